"""The state machine: clamps, worker messages by generation, and what each edit costs."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.beyond.optics import (
    APERTURE_KINDS,
    EXPOSURE_LIMIT_STOPS,
    ApertureMask,
    ApertureShape,
    Optics,
)
from iibr_core.depth.choice import DepthOrigin
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.lens_limits import (
    STEEPEST_TILT,
    aperture_limit,
    dolly_limit,
    focus_limits,
    focus_span,
    is_finite,
)
from iibr_core.scenes.scene import Progress, Scene, Source
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import reduce
from viewer.model import history, inspection, lens, messages, opening, preferences, saving
from viewer.model.action import Action, do
from viewer.model.carried_optics import carry_optics
from viewer.model.messages import MAX_NOTICES
from viewer.model.remedies import DEPTH_COMMANDS
from viewer.model.state.app_state import AppState, Hover, Picture
from viewer.model.state.jobs import JobProgress
from viewer.model.state.lens import PRESETS
from viewer.model.state.notices import Notice
from viewer.model.state.saving import SavedSettings
from viewer.model.window_limits import DEPTH_STRENGTH_LIMIT

SOURCE = Source("photo.png")
floats = st.floats(allow_nan=True, allow_infinity=True)
grids = st.builds(GridShape, st.integers(1, 17), st.integers(1, 17))


def plan_of(grid: GridShape, scale: float = 1.0, zero: float = 0.0) -> ScenePlan:
    return ScenePlan(grid, scale, zero, (-2.0, 3.0), 0.1, True, 0, 0, ())


def scene_of(grid: GridShape = GridShape(9, 9), source: Source = SOURCE, **changes: object) -> Scene:  # noqa: B008
    scene = Scene(source, "photo", 60, 40, grid, (-2.0, 3.0), "photo.pfm")
    return replace(scene, **changes)  # type: ignore[arg-type]


def state_with(scene: Scene | None) -> AppState:
    return AppState(source=scene.source if scene else None, scene=scene, generation=1)


@given(grids, floats, floats)
def test_the_eye_stays_within_the_grid_and_a_margin(grid: GridShape, t: float, s: float) -> None:
    before = state_with(scene_of(grid))
    eye = reduce(before, do(lens.move_eye, ViewOffset(t, s))).optics.eye
    if not (math.isfinite(t) and math.isfinite(s)):
        assert eye == before.optics.eye
        return
    for value, wanted, views in zip(eye, (t, s), grid):
        margin = 0.5 if views == 1 else 0.0
        low, high = -(views // 2) - margin, views - 1 - views // 2 + margin
        assert low <= value <= high
        assert value == wanted or value in (low, high)


@given(grids, floats)
def test_the_aperture_lies_between_pinhole_and_grid(grid: GridShape, diameter: float) -> None:
    widest = max(grid) if max(grid) > 1 else 0
    result = reduce(state_with(scene_of(grid)), do(lens.set_aperture, diameter)).optics.aperture_diameter
    assert 0 <= result <= widest
    if 0 <= diameter <= widest:
        assert result == diameter


@given(floats)
def test_focus_exposure_and_depth_stay_finite_and_in_range(value: float) -> None:
    scene = scene_of()
    state = state_with(scene)
    for action in (
        do(lens.set_focus, value),
        do(lens.set_exposure, value),
        do(lens.set_depth_strength, value, is_finished=False),
    ):
        state = reduce(state, action)
    low, high = focus_limits(scene)
    assert low <= state.optics.focus_disparity <= high
    assert abs(state.optics.exposure_stops) <= EXPOSURE_LIMIT_STOPS
    assert 0 <= state.depth_strength <= DEPTH_STRENGTH_LIMIT


shapes = st.builds(
    ApertureShape, st.sampled_from(APERTURE_KINDS), st.integers(-5, 50), floats, floats, floats, st.none()
)


@given(grids, floats, floats, st.tuples(floats, floats), shapes, floats)
def test_every_optic_stays_finite_and_within_its_limits(
    grid: GridShape, dolly: float, spread: float, tilt: tuple[float, float], shape: ApertureShape, highlights: float
) -> None:
    scene = scene_of(grid)
    state = state_with(scene)
    edits = (
        do(lens.set_dolly, dolly),
        do(lens.set_focus_range, spread),
        do(lens.set_focus_tilt, tilt),
        do(lens.set_aperture_shape, shape),
    )
    for action in (*edits, do(lens.set_highlights, highlights)):
        state = reduce(state, action)
    optics, span = state.optics, focus_span(scene)
    assert is_finite(optics)
    assert abs(optics.dolly) <= dolly_limit(grid) == (grid.columns - 1) / 2
    assert 0 <= optics.focus_range <= span
    assert max(map(abs, optics.focus_tilt)) <= STEEPEST_TILT * span
    assert 0 <= optics.highlight_recovery <= 1
    shape_now = optics.aperture_shape
    assert 3 <= shape_now.blades <= 11
    assert 0 <= shape_now.rotation_deg < 360
    assert 0 <= shape_now.ring_inner < 1
    assert 0 <= shape_now.cat_eye <= 1
    assert shape_now.kind != "mask", "there is no mask"


def test_a_mask_is_kept_while_another_shape_is_tried() -> None:
    mask = ApertureMask("star.png", 2, 2, bytes([255, 0, 0, 255]))
    state = reduce(state_with(scene_of()), do(lens.set_aperture_shape, ApertureShape("mask", mask=mask)))
    assert state.optics.aperture_shape.kind == "mask"
    state = reduce(state, do(lens.set_aperture_shape, replace(state.optics.aperture_shape, kind="ring")))
    assert state.optics.aperture_shape.mask == mask


@pytest.mark.parametrize("name", PRESETS)
def test_presets_keep_viewpoint_and_light_and_can_be_taken_back(name: str) -> None:
    before = state_with(scene_of(subject_disparity_px=1.5))
    for action in (
        do(lens.move_eye, ViewOffset(1, 2)),
        do(lens.set_dolly, 1),
        do(lens.set_exposure, 1),
        do(lens.set_focus_tilt, (1, 1)),
        do(lens.set_aperture, 2),
    ):
        before = reduce(before, action)
    after = reduce(before, do(lens.apply_preset, name))  # type: ignore[arg-type]
    kept = [(o.eye, o.dolly, o.exposure_stops) for o in (before.optics, after.optics)]
    assert kept[0] == kept[1]
    assert after.optics.focus_tilt == (0, 0)
    assert reduce(after, do(history.undo)).optics == before.optics


def test_what_the_presets_are_for() -> None:
    state = state_with(scene_of(subject_disparity_px=1.5))
    portrait, macro, sharp = (reduce(state, do(lens.apply_preset, name)).optics for name in PRESETS)
    assert portrait.focus_disparity == 1.5
    assert portrait.focus_range > 0
    assert macro.focus_disparity == 3.0, "the nearest"
    assert macro.aperture_diameter == aperture_limit(GridShape(9, 9)) > portrait.aperture_diameter > 0
    assert sharp.aperture_diameter == 0


def test_a_portrait_keeps_what_the_user_made_sharp_and_lets_the_light_be() -> None:
    state = reduce(state_with(scene_of(subject_disparity_px=1.5)), do(lens.set_highlights, 0.2))
    chosen = reduce(reduce(state, do(lens.focus_on, (0.1, -0.2), 2.5)), do(lens.apply_preset, "portrait")).optics
    assert chosen.focus_disparity == 2.5
    assert chosen.highlight_recovery == 0.2
    reset = reduce(reduce(state, do(lens.focus_on, (0.1, -0.2), 2.5)), do(lens.reset))
    assert reduce(reset, do(lens.apply_preset, "portrait")).optics.focus_disparity == 1.5


@pytest.mark.parametrize("action", [do(lens.focus_on, (0.0, 0.0), 1.0), do(lens.set_focus, 1.0)])
def test_the_first_focusing_opens_the_aperture(action: Action) -> None:
    """Through a pinhole everything is sharp: a click would seem to do nothing."""
    first = reduce(state_with(scene_of()), action)
    assert 0 < first.optics.aperture_diameter < aperture_limit(GridShape(9, 9))
    assert reduce(first, do(history.undo)).optics == Optics()


def test_focusing_leaves_an_aperture_alone_that_the_user_chose() -> None:
    for chosen in (do(lens.set_aperture, 0), do(lens.set_aperture, 2), do(lens.apply_preset, "everything sharp")):
        before = reduce(state_with(scene_of()), chosen)
        assert reduce(before, do(lens.set_focus, 1.0)).optics.aperture_diameter == before.optics.aperture_diameter
    one_view = reduce(state_with(scene_of(GridShape(1, 1))), do(lens.set_focus, 1.0))
    assert (one_view.optics.aperture_diameter, one_view.notices) == (0, ())


def test_quitting_asks_while_jobs_are_under_way_and_can_wait_for_them() -> None:
    job = JobProgress(1, "export", "a.gif")
    busy = reduce(state_with(scene_of()), do(saving.set_jobs, (job,)))
    asked = reduce(busy, do(saving.quit_window))
    assert (asked.prompt, asked.should_quit) == ("quit", False)
    assert reduce(asked, do(saving.quit_window, is_sure=True)).should_quit
    waiting = reduce(asked, do(saving.quit_when_done))
    assert (waiting.prompt, waiting.should_quit, waiting.quits_when_done) == (None, False, True)
    assert not reduce(waiting, do(saving.set_jobs, (replace(job, done=0.5),))).should_quit
    assert reduce(waiting, do(saving.set_jobs, ())).should_quit
    failed = reduce(waiting, do(messages.notify, Notice("a.gif: the disk is full", is_error=True)))
    assert not reduce(failed, do(saving.set_jobs, ())).should_quit, "what went wrong is to be seen"
    assert reduce(reduce(asked, do(saving.set_jobs, ())), do(saving.quit_when_done)).should_quit, (
        "they ended while that was asked"
    )


def test_what_became_of_a_job_is_still_told_when_another_photo_opens() -> None:
    stays, goes = Notice("Exported a.gif", stays=True), Notice("This photo has no depth.")
    told = reduce(reduce(state_with(scene_of()), do(messages.notify, goes)), do(messages.notify, stays))
    asked = reduce(told, do(opening.open_source, Source("other.png")))
    opened = reduce(asked, do(opening.show_scene, asked.generation, scene_of(source=asked.source)))
    assert opened.notices == (stays,)


def test_what_is_opened_closes_the_help() -> None:
    assert reduce(replace(AppState(), prompt="help"), do(opening.open_source, Source("photo.png"))).prompt is None


def test_settings_of_another_picture_are_made_to_fit_and_can_be_taken_back() -> None:
    state = state_with(scene_of(GridShape(5, 5)))
    optics = Optics(eye=ViewOffset(9, 9), aperture_diameter=20, focus_disparity=1)
    saved = SavedSettings(optics, 1.0, Source(""), (10, 10))
    offered = reduce(state, do(messages.notify, Notice("It has settings.", offer=saved)))
    after = reduce(offered, do(opening.take_settings, saved))
    assert after.optics == Optics(eye=ViewOffset(2, 2), aperture_diameter=5, focus_disparity=1)
    assert after.notices == ()
    assert reduce(after, do(history.undo)).optics == state.optics
    wider = replace(saved, view_width=2 * state.scene.width)
    assert reduce(offered, do(opening.take_settings, wider)).optics == replace(after.optics, focus_disparity=0.5)
    broken = replace(saved, optics=replace(optics, dolly=math.nan))
    assert reduce(state, do(opening.take_settings, broken)).optics == state.optics


def test_stopping_keeps_what_is_there_and_late_progress_does_not_bring_it_back() -> None:
    state = reduce(state_with(scene_of()), do(opening.set_progress, 1, Progress(3, 81, 0.1), (0, 0)))
    state = reduce(state, do(opening.stop))
    assert state.stopped == state.generation == 1
    assert "3 of 81" in state.progress.doing
    late = reduce(state, do(opening.set_progress, 1, Progress(4, 81, 0.2), (0, 1)))
    assert late.progress == state.progress
    assert late.views_there == {(0, 0), (0, 1)}


def test_stopping_while_another_file_is_read_returns_to_the_scene_that_is_open() -> None:
    before = state_with(scene_of())
    state = reduce(reduce(before, do(opening.open_source, Source("other.png"))), do(opening.stop))
    assert state.source is before.source
    assert state.generation == before.generation + 2
    assert state.stopped is None
    first = reduce(reduce(AppState(), do(opening.open_source, SOURCE)), do(opening.stop))
    assert (first.source, first.stopped, first.progress) == (None, 1, Progress())


def test_a_finished_field_cannot_be_stopped() -> None:
    state = reduce(state_with(scene_of()), do(opening.set_progress, 1, Progress(81, 81, 0.1), (0, 0)))
    assert reduce(state, do(opening.stop)) == state


def test_views_that_came_are_known_until_another_field_is_made() -> None:
    state = reduce(state_with(None), do(opening.show_scene, 1, scene_of(GridShape(3, 3))))
    assert state.views_there == {(1, 1)}
    state = reduce(state, do(opening.set_progress, 1, Progress(2, 9, 0.1), (0, 2)))
    assert state.views_there == {(1, 1), (0, 2)}
    state = reduce(state, do(opening.show_scene, 1, scene_of(GridShape(5, 5))))
    assert state.views_there == {(2, 2)}


def test_a_sketch_opens_the_photo_and_the_whole_photo_goes_on_with_it() -> None:
    sketch = scene_of(source=SOURCE, is_sketch=True)
    state = reduce(state_with(None), do(opening.show_scene, 1, sketch))
    assert state.progress.doing.startswith("reading")
    state = reduce(replace(state, source=SOURCE), do(lens.focus_on, (0.0, 0.0), 1.0))
    whole = reduce(
        state,
        do(
            opening.show_scene,
            1,
            scene_of(source=SOURCE, notes=("A map is damaged.",), problems=("A map is damaged.",)),
        ),
    )
    assert whole.notices == (*state.notices, Notice("A map is damaged."))
    assert whole.history.past == state.history.past != ()
    assert whole.chosen_focus is not None
    stopped = reduce(state, do(opening.stop))
    assert stopped.stopped == 1
    assert stopped.scene is sketch


def test_recent_files_are_listed_once_the_latest_first() -> None:
    state = state_with(None)
    for name in ("a.png", "b.png", "a.png"):
        state = reduce(state, do(opening.show_scene, 1, scene_of(source=Source(name))))
    assert state.recent == ("a.png", "b.png")


def test_focus_can_be_set_in_a_flat_scene() -> None:
    low, high = focus_limits(scene_of(disparity_range_px=(0.0, 0.0)))
    assert low < 0 < high


@pytest.mark.parametrize(
    "action",
    [
        do(lens.move_eye, ViewOffset(1, 1)),
        do(lens.set_focus, 1),
        do(lens.set_aperture, 1),
        do(lens.set_dolly, 1),
        do(lens.set_focus_tilt, (1, 1)),
        do(lens.focus_on, (0, 0), 1),
        do(lens.apply_preset, "macro"),
        do(lens.reset),
        do(opening.stop),
        do(history.undo),
    ],
)
def test_optics_do_not_change_before_a_scene_is_open(action: object) -> None:
    assert reduce(AppState(), action) == AppState()  # type: ignore[arg-type]


def test_reset_brings_the_first_optics_back() -> None:
    state = state_with(scene_of())
    for action in (
        do(lens.move_eye, ViewOffset(1, 2)),
        do(lens.set_focus, 1),
        do(lens.set_aperture, 3),
        do(lens.set_exposure, 1),
    ):
        state = reduce(state, action)
    assert state.optics == Optics(eye=ViewOffset(1, 2), focus_disparity=1, aperture_diameter=3, exposure_stops=1)
    assert reduce(state, do(lens.reset)).optics == Optics()


@pytest.mark.parametrize(
    ("action", "draws", "restarts"),
    [
        (do(lens.move_eye, ViewOffset(0.0, 1.0)), True, False),
        (do(lens.set_focus, 1.0), True, False),
        (do(lens.set_aperture, 2.0), True, False),
        (do(lens.set_exposure, 1.0), True, False),
        (do(lens.set_dolly, 1.0), True, False),
        (do(lens.set_focus_range, 0.5), True, False),
        (do(lens.set_focus_tilt, (0.5, 0.0)), True, False),
        (do(lens.set_aperture_shape, ApertureShape("polygon")), True, False),
        (do(lens.set_highlights, 0.5), True, False),
        (do(lens.focus_on, (0.0, 0.0), 1.0), True, False),
        (do(lens.apply_preset, "macro"), True, False),
        (do(inspection.set_hover, Hover(3.0, 4.0, 1.0)), False, False),
        (do(preferences.set_theme, "light"), False, False),
        (do(opening.stop), False, False),
        (do(history.undo), False, False),
        (do(lens.set_focus_tilt, (math.inf, 0.0)), False, False),
        (do(lens.set_focus, 0.0), False, False),
        (do(lens.move_eye, ViewOffset(math.nan, 0.0)), False, False),
        (do(lens.set_depth_strength, 2.0, is_finished=False), False, False),
        (do(lens.set_depth_strength, 2.0, is_finished=True), False, True),
        (do(opening.open_source, Source("other.png")), False, True),
        (do(opening.set_progress, 1, Progress(3, 81, 0.1)), False, False),
        (do(messages.notify, Notice("hello")), False, False),
        (do(saving.quit_window), False, False),
    ],
)
def test_what_an_edit_costs(action: object, draws: bool, restarts: bool) -> None:
    """The picture is drawn again only if its record differs, the worker restarts only if the generation does."""
    before = replace(state_with(scene_of()), has_chosen_aperture=True)
    after = reduce(before, action)  # type: ignore[arg-type]
    picture = [Picture(1, 5, state.optics, (60, 40)) for state in (before, after)]
    assert (picture[0] != picture[1]) == draws
    assert (before.generation != after.generation) == restarts


def test_opening_shows_what_is_read_and_keeps_the_old_scene_until_then() -> None:
    before = state_with(scene_of())
    after = reduce(before, do(opening.open_source, Source("other.png")))
    assert after.scene is before.scene
    assert "other.png" in after.progress.doing


def test_a_new_scene_starts_with_fresh_optics_and_names_only_what_failed() -> None:
    state = reduce(
        reduce(state_with(scene_of()), do(lens.set_aperture, 2)), do(opening.open_source, Source("other.png"))
    )
    notes = ("Made smaller.", "A map is damaged.")
    origin = DepthOrigin("rough", "rough, guessed without a model")
    scene = scene_of(source=state.source, notes=notes, problems=notes[1:], depth_origin=origin)
    state = reduce(state, do(opening.show_scene, state.generation, scene))
    assert state.optics == Optics()
    assert state.notices == (Notice("A map is damaged.", commands=DEPTH_COMMANDS),)


def test_the_same_file_opened_again_is_a_new_scene() -> None:
    state = reduce(reduce(state_with(scene_of()), do(lens.set_aperture, 2)), do(opening.open_source, replace(SOURCE)))
    state = reduce(state, do(opening.show_scene, state.generation, scene_of(source=state.source)))
    assert state.optics == Optics()


def test_another_depth_strength_keeps_the_surface_in_focus_and_the_place_in_the_grid() -> None:
    old = plan_of(GridShape(5, 5), scale=0.5, zero=10.0)
    new = plan_of(GridShape(9, 9), scale=0.25, zero=12.0)
    state = state_with(scene_of(GridShape(5, 5), plan=old))
    given = 13.0  # the surface in focus, in the disparity file's units
    for action in (
        do(lens.move_eye, ViewOffset(1, -2)),
        do(lens.set_focus, (given - 10.0) * 0.5),
        do(lens.set_aperture, 2.0),
        do(lens.set_exposure, 1.0),
    ):
        state = reduce(state, action)
    state = reduce(state, do(lens.set_depth_strength, 1.5, is_finished=True))
    optics = reduce(state, do(opening.show_scene, state.generation, scene_of(GridShape(9, 9), plan=new))).optics
    assert optics.focus_disparity == pytest.approx((given - 12.0) * 0.25)
    assert optics.eye == ViewOffset(2, -4)
    assert optics.aperture_diameter == 4.0
    assert optics.exposure_stops == 1.0


@pytest.mark.parametrize(("views", "eye"), [(2, -2.0), (3, -1.0), (1, -2.0)])
def test_a_step_between_two_views_is_the_whole_grid_and_of_one_view_it_is_one(views: int, eye: float) -> None:
    old, new = (scene_of(GridShape(1, n), plan=plan_of(GridShape(1, n), scale=0.5)) for n in (views, 5))
    assert carry_optics(Optics(eye=ViewOffset(0.0, -0.5)), old, replace(new, source=old.source)).eye.s == eye


def test_depth_strength_of_zero_and_back_gives_finite_optics() -> None:
    flat, deep = plan_of(GridShape(1, 1), scale=0.0), plan_of(GridShape(9, 9), scale=0.5)
    state = state_with(scene_of(GridShape(9, 9), plan=deep))
    for action in (do(lens.move_eye, ViewOffset(4, 4)), do(lens.set_focus, 1), do(lens.set_aperture, 9)):
        state = reduce(state, action)
    for plan in (flat, deep):
        state = reduce(state, do(opening.show_scene, 1, scene_of(plan.grid, plan=plan)))
        assert all(map(math.isfinite, (*state.optics.eye, state.optics.focus_disparity)))
        assert 0 <= state.optics.aperture_diameter <= max(plan.grid)


@pytest.mark.parametrize(
    "late",
    [
        do(opening.show_scene, 0, scene_of(GridShape(3, 3))),
        do(opening.set_progress, 0, Progress(1, 9)),
        do(opening.report_failure, 0, "no such file"),
    ],
)
def test_late_words_of_an_earlier_generation_change_nothing(late: object) -> None:
    state = state_with(scene_of())
    assert reduce(state, late) is state  # type: ignore[arg-type]


def test_a_failure_is_said_and_the_scene_before_is_taken_up_again() -> None:
    before = state_with(scene_of())
    state = reduce(before, do(opening.open_source, Source("broken.png")))
    state = reduce(state, do(opening.report_failure, state.generation, "broken.png: truncated"))
    assert state.notices == (Notice("broken.png: truncated", is_error=True),)
    assert state.source is SOURCE
    assert state.generation == before.generation + 2


def test_a_failure_of_the_open_scene_itself_does_not_start_it_again() -> None:
    before = state_with(scene_of())
    state = reduce(before, do(opening.report_failure, 1, "no memory"))
    assert (state.generation, state.progress) == (before.generation, Progress())


def test_notices_are_kept_once_bounded_and_dismissable() -> None:
    state = AppState()
    for i in (*range(MAX_NOTICES + 3), MAX_NOTICES + 2):
        state = reduce(state, do(messages.notify, Notice(str(i))))
    assert [notice.text for notice in state.notices] == [str(i) for i in range(3, MAX_NOTICES + 3)]
    state = reduce(state, do(messages.dismiss, Notice("5")))
    assert [notice.text for notice in state.notices] == ["3", "4", "6", "7"]
