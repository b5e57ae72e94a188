"""Inspection as pure functions: what each action changes, which view and which work follow from the state."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import GridShape, ViewOffset
from viewer.model.actions import Action, EndGesture, SceneOpened, SetHover
from viewer.model.colormap import VIRIDIS, map_color
from viewer.model.commands import BY_NAME, OVERLAY_WORDS
from viewer.model.inspection_request import (
    beside_of,
    make_inspection_request,
    sheet_cells,
    view_at,
    view_label,
    view_near,
    view_to_compare,
)
from viewer.model.layout import Beside, layout_of
from viewer.model.reducers.inspection_reducer import KEPT
from viewer.model.reducers.root import reduce
from viewer.model.state.app_state import AppState, Hover
from viewer.model.state.inspection import (
    OVERLAYS,
    Compare,
    GroundTruth,
    Inspection,
    KeepState,
    MoveDivider,
    OverlayKind,
    Pair,
    PairCompared,
    Probe,
    SetInspection,
    SetOverlay,
    TruthRead,
)
from viewer.model.state.optics_actions import MoveEye
from viewer.model.state.preferences import SetPreference
from viewer.model.state.tasks import ChooseTask
from viewer.ui.overlays.inspection_overlay import legend_words, status_text
from viewer.ui.overlays.reticle import hover_text
from viewer.ui.sections.inspect import pair_text, score_text

GRID = GridShape(5, 7)
PLAN = ScenePlan(GRID, 1.0, 0.0, (-1.0, 2.0), 0.1, True, 0, 0, ())
SCENE = Scene(Source("a.png"), "a", 60, 40, GRID, (-1.0, 2.0), "a.pfm", plan=PLAN)
FOLDER = replace(SCENE, plan=None)
OPEN = AppState(source=SCENE.source, scene=SCENE, generation=3)
TRUTH = GroundTruth("truth", "truth", GridShape(9, 9), 60, 40)


def after(state: AppState, *actions: Action) -> AppState:
    for action in actions:
        state = reduce(state, action)
    return state


def test_looking_changes_neither_optics_nor_history_nor_the_work() -> None:
    actions = (
        SetInspection("shows_epis", True),
        SetInspection("shows_grid", True),
        SetInspection("shows_values", True),
        SetOverlay("disparity"),
        Compare("photo"),
    )
    state = after(OPEN, *actions)
    assert replace(state, inspection=OPEN.inspection) == OPEN
    assert state.inspection == Inspection(shows_epis=True, shows_grid=True, shows_values=True, comparison="photo")


def test_an_overlay_and_a_comparison_take_turns() -> None:
    state = after(OPEN, Compare("photo"), SetOverlay("entropy"))
    assert (state.inspection.overlay, state.inspection.comparison) == ("entropy", None)
    state = after(state, Compare("photo"))
    assert (state.inspection.overlay, state.inspection.comparison) == (None, "photo")


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_what_is_not_finite_changes_nothing(value: float) -> None:
    state = after(OPEN, Compare("photo"))
    assert after(state, SetInspection("opacity", value), MoveDivider(value)) == state


def test_opacity_and_divider_are_held_within_the_picture() -> None:
    inspection = after(OPEN, SetInspection("opacity", 3.0), MoveDivider(-5)).inspection
    assert inspection.opacity == 1
    assert 0 < inspection.divider < 0.1
    assert 0.9 < after(OPEN, MoveDivider(5)).inspection.divider < 1


def test_the_divider_is_held_until_the_pointer_goes_up() -> None:
    state = after(OPEN, Compare("photo"), MoveDivider(0.3))
    assert state.inspection.divider_taken
    assert not after(state, EndGesture()).inspection.divider_taken


@pytest.mark.parametrize("kind", ["entropy", "inpainted"])
def test_views_from_disk_say_nothing_of_how_they_were_made(kind: OverlayKind) -> None:
    state = replace(OPEN, scene=FOLDER)
    refused = after(state, SetOverlay(kind))
    assert refused.inspection == state.inspection
    assert len(refused.notices) == 1
    assert after(state, SetOverlay("disparity")).inspection.overlay == "disparity"
    flat = replace(OPEN, scene=replace(FOLDER, has_view_disparity=False))
    assert after(flat, SetOverlay("disparity")).inspection.overlay is None


def test_ground_truth_is_asked_for_where_there_is_none() -> None:
    state = after(OPEN, Compare("truth"))
    assert state.tasks == (ChooseTask("truth"),)
    assert state.inspection == OPEN.inspection
    state = after(OPEN, TruthRead(TRUTH))
    assert (state.inspection.truth, state.inspection.comparison) == (TRUTH, "truth")
    assert after(state, Compare(None), Compare("truth")).inspection.comparison == "truth"


@pytest.mark.parametrize(
    ("scene", "truth", "words"),
    [
        (SCENE, replace(TRUTH, width=61), "61x40"),
        (SCENE, replace(TRUTH, height=4), "60x4"),
        (FOLDER, TRUTH, "9x9"),
    ],
)
def test_ground_truth_that_does_not_fit_is_a_notice(scene: Scene, truth: GroundTruth, words: str) -> None:
    state = replace(OPEN, scene=scene)
    refused = after(state, TruthRead(truth))
    assert replace(refused, notices=()) == state
    assert words in refused.notices[0].text
    assert refused.notices[0].is_error


def test_a_light_field_from_disk_takes_ground_truth_of_its_own_grid() -> None:
    state = after(replace(OPEN, scene=FOLDER), TruthRead(replace(TRUTH, grid=GRID)))
    assert state.inspection.comparison == "truth"


def test_another_scene_takes_ground_truth_and_findings_away_and_leaves_what_is_looked_at() -> None:
    state = after(OPEN, SetInspection("shows_epis", True), TruthRead(TRUTH), SetHover(Hover(3, 4, 0.5)))
    opened = after(state, SceneOpened(3, replace(SCENE, source=Source("b.png"))))
    assert opened.inspection == Inspection(shows_epis=True)
    replanned = after(state, SceneOpened(3, SCENE))
    assert replanned.inspection.truth == TRUTH


def test_scores_of_another_comparison_or_scene_are_not_heard() -> None:
    state = after(OPEN, TruthRead(TRUTH))
    pair = Pair(3, "truth", (1, 1), 40.0, 0.01)
    assert after(state, PairCompared(pair)).inspection.pair == pair
    assert after(state, PairCompared(replace(pair, generation=2))) == state
    assert after(OPEN, PairCompared(pair)) == OPEN
    assert after(state, PairCompared(pair), Compare("photo")).inspection.pair is None


def test_the_place_pointed_at_last_stays_and_what_was_found_there_goes() -> None:
    probe = Probe((1, 2, 3), 4, 5, "photo")
    state = after(OPEN, SetHover(Hover(3, 4, 0.5)), SetInspection("probe", probe))
    assert after(state, SetHover(Hover(5, 6, 0.5))).inspection.probe == probe, "until more is known"
    left = after(state, SetHover(None)).inspection
    assert (left.place, left.probe) == ((3, 4), None)


def test_every_kind_has_a_command_that_also_takes_it_away() -> None:
    for name in (*(f"Overlay: {OVERLAY_WORDS[kind]}" for kind in OVERLAYS), "Compare photo and picture"):
        state = after(OPEN, BY_NAME[name].action(OPEN))
        assert state.inspection != OPEN.inspection
        assert after(state, BY_NAME[name].action(state)).inspection == OPEN.inspection


@pytest.mark.parametrize(
    ("eye", "view"), [((0, 0), (2, 3)), ((-9, 9), (0, 6)), ((0.6, -1.4), (3, 2)), ((1e30, -1e30), (4, 0))]
)
def test_the_view_near_the_eye(eye: tuple[float, float], view: tuple[int, int]) -> None:
    assert view_near(ViewOffset(*eye), GRID) == view


def test_ground_truth_of_another_grid_is_crossed_in_proportion() -> None:
    def view(t: float, s: float) -> tuple[int, int]:
        return view_to_compare(SCENE, ViewOffset(t, s), "truth", TRUTH)

    assert view(0, 0) == (4, 4)
    assert view(-2, 3) == (0, 8)
    assert view(1, -3) == (6, 0)
    assert view_to_compare(SCENE, ViewOffset(2, 2), "photo", TRUTH) == GRID.centre
    single = replace(SCENE, grid=GridShape(1, 1))
    assert view_to_compare(single, ViewOffset(0.4, 0.4), "truth", TRUTH) == (4, 4)


def test_ground_truth_follows_the_hand_and_is_scored_when_all_is_still() -> None:
    state = after(OPEN, TruthRead(TRUTH))
    still = make_inspection_request(state, is_moving=False, before=None)
    assert still is not None
    assert still.is_scored
    assert make_inspection_request(state, is_moving=True, before=still) == still, "what is known stays"
    moved = make_inspection_request(after(state, MoveEye(ViewOffset(1, 1))), is_moving=True, before=still)
    assert moved is not None
    assert (moved.view, moved.is_scored) == ((6, 5), False)


def test_without_a_second_image_there_is_no_work() -> None:
    for action in (
        Compare("photo"),
        SetOverlay("disparity"),
        SetOverlay("inpainted"),
        SetInspection("shows_epis", True),
    ):
        assert make_inspection_request(after(OPEN, action), is_moving=False, before=None) is None
    assert make_inspection_request(AppState(), is_moving=False, before=None) is None


def test_strips_take_their_room_beside_the_picture_and_line_up_with_it() -> None:
    plain = layout_of((900, 700), (60, 40))
    layout = layout_of((900, 700), (60, 40), 2.0, 1.0, Beside((5, 9), has_status=True))
    picture, across, down, status = layout.picture, layout.strip_across, layout.strip_down, layout.status
    assert plain.strip_across is plain.strip_down is plain.status is None
    assert picture is not None
    assert across is not None
    assert down is not None
    assert status is not None
    assert picture.width / picture.height == pytest.approx(1.5)
    assert (across.x, across.width) == (picture.x, picture.width)
    assert (down.y, down.height) == (picture.y, picture.height)
    assert across.height / 9 >= 6, "every view several pixels"
    assert down.width / 5 >= 6
    assert picture.y + picture.height < across.y
    assert across.y + across.height <= status.y
    assert status.y + status.height < 700
    assert down.x + down.width < layout.panel.x
    assert layout.in_pixels(across)[2] == layout.in_pixels(picture)[2]


def test_a_window_too_small_for_strips_has_no_picture_and_no_strips() -> None:
    layout = layout_of((360, 100), (60, 40), beside=Beside((9, 9), has_status=True))
    assert layout.picture is layout.strip_across is layout.status is None


def test_a_single_view_has_no_epis() -> None:
    state = after(replace(OPEN, scene=replace(SCENE, grid=GridShape(1, 1))), SetInspection("shows_epis", True))
    assert beside_of(state).epi_views is None
    assert beside_of(after(OPEN, SetInspection("shows_epis", True))).epi_views == (5, 7)


@pytest.mark.parametrize("grid", [GridShape(1, 1), GridShape(3, 9), GridShape(17, 17)])
def test_a_click_on_the_sheet_finds_the_view_drawn_there(grid: GridShape) -> None:
    picture = Rect(12, 30, 600, 400)
    cells = sheet_cells(picture, grid)
    for i, cell in enumerate(cells):
        assert cell.width / cell.height == pytest.approx(1.5)
        assert view_at(picture, grid, 1.0, cell.x + cell.width / 2, cell.y + 1) == divmod(i, grid.columns)
        assert picture.contains(cell.x, cell.y)
        assert picture.contains(cell.x + cell.width, cell.y + cell.height)
    assert view_at(picture, grid, 1.0, picture.x, picture.y) is None


def test_words() -> None:
    assert view_label((2, 3), GRID) == "middle view"
    assert view_label((0, 4), GRID) == "view 1 → 2 ↑"
    assert view_label((3, 3), GRID) == "view 1 ↓"
    assert score_text(41.234, 0.03125) == "41.23 dB PSNR, 0.0312 FLIP"
    assert score_text(41.234, None) == "41.23 dB PSNR"
    assert score_text(math.inf, 0.0) == "identical"
    assert "still" in score_text(None, None)
    hover = Hover(12.3, 4.0, -0.5)
    plain, numbers = after(OPEN), after(OPEN, SetPreference("units", "light field"))
    assert status_text(plain, SCENE, hover, None) == ["12, 4", hover_text(plain.optics, SCENE, hover)]
    assert "px" not in hover_text(plain.optics, SCENE, hover)
    words = status_text(numbers, SCENE, hover, Probe((1, 20, 255), 7, 35, "inpainted"))
    assert words == ["12, 4", "−0.50 px", "0.50 behind", "inpainted", "RGB 1 20 255", "seen in 7 of 35 views"]
    flat = status_text(plain, SCENE, replace(hover, disparity=None), Probe((0, 0, 0), None, 35, "from disk"))
    assert flat == ["12, 4", "from disk", "RGB 0 0 0", "35 views"]


def test_the_legend_speaks_the_units_of_the_panel() -> None:
    shown, ends = after(OPEN, SetOverlay("disparity")), (-1.5, 2.0)
    assert legend_words(shown, SCENE, ends) == ("distance", ["far", "near"])
    assert legend_words(reduce(shown, SetPreference("units", "light field")), SCENE, ends) == (
        "px per step",
        ["−1.50", "2.00"],
    )
    in_metres = replace(SCENE, inverse_metres=(0.1, 0.2))
    assert legend_words(shown, in_metres, ends) == ("distance", ["20 m", "2.50 m"])
    assert legend_words(reduce(shown, SetOverlay("entropy")), SCENE, (0.0, 1.0)) == ("entropy", ["0.00", "1.00"])


def test_comparing_with_the_kept_state_closes_the_notice_that_advised_it() -> None:
    kept = after(OPEN, KeepState())
    assert [notice.text for notice in kept.notices] == [KEPT]
    assert reduce(kept, Compare("kept")).notices == ()
    assert reduce(kept, Compare("photo")).notices == ()


def test_scores_are_shown_only_with_the_view_they_belong_to() -> None:
    state = after(OPEN, TruthRead(replace(TRUTH, grid=GRID)), PairCompared(Pair(3, "truth", (2, 3), 40.0, 0.01)))
    assert pair_text(state, SCENE, "truth") == "Middle view: 40.00 dB PSNR, 0.0100 FLIP"
    moved = after(state, MoveEye(ViewOffset(0, 2)))
    assert pair_text(moved, SCENE, "truth") == "Making the view 2 →…"


def test_the_colour_map_grows_steadily_lighter() -> None:
    colors = np.array([map_color(share) for share in np.linspace(0, 1, 100)])
    lightness = colors @ [0.2126, 0.7152, 0.0722]
    assert (np.diff(lightness) > 0).all()
    for i, color in enumerate(VIRIDIS):
        assert map_color(i / (len(VIRIDIS) - 1)) == pytest.approx([value / 255 for value in color], abs=1e-6)
    assert map_color(-1) == map_color(0)
    assert map_color(2) == map_color(1)
