"""The state machine: clamps, worker messages by generation, and what each edit costs."""

import math
from dataclasses import replace

import pytest
from hypothesis import strategies as st

from iibr_core.beyond.optics import Optics
from iibr_core.depth.choice import DepthOrigin
from iibr_core.formats.images.picture import CUT_OFF
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.lens_limits import aperture_limit
from iibr_core.scenes.scene import Progress, Scene, Source
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import reduce
from viewer.model import history, lens, messages, opening, saving
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.messages import MAX_NOTICES, Notice
from viewer.model.remedies import DEPTH_COMMANDS
from viewer.model.saving import JobProgress, SavedSettings
from viewer.model.tasks import PlainTask, ask, forget_tasks

SOURCE = Source("photo.png")
floats = st.floats(allow_nan=True, allow_infinity=True)
grids = st.builds(GridShape, st.integers(1, 17), st.integers(1, 17))


def plan_of(grid, scale=1.0, zero=0.0):
    return ScenePlan(grid, scale, zero, (-2.0, 3.0), 0.1, True, 0, 0, ())


def scene_of(grid=GridShape(9, 9), source=SOURCE, **changes):  # noqa: B008
    scene = Scene(source, "photo", 60, 40, grid, (-2.0, 3.0), "photo.pfm")
    return replace(scene, **changes)


def state_with(scene):
    return AppState(source=scene.source if scene else None, scene=scene, generation=1)


def test_quitting_asks_while_jobs_are_under_way_and_can_wait_for_them():
    job = JobProgress(1, "export", "a.gif")
    busy = saving.set_jobs(state_with(scene_of()), (job,))
    asked = saving.quit_window(busy)
    assert (asked.prompt, asked.should_quit) == ("quit", False)
    assert saving.quit_window(asked, is_sure=True).should_quit
    waiting = saving.quit_when_done(asked)
    assert (waiting.prompt, waiting.should_quit, waiting.quits_when_done) == (None, False, True)
    assert not saving.set_jobs(waiting, (replace(job, done=0.5),)).should_quit
    assert saving.set_jobs(waiting, ()).should_quit
    failed = messages.notify(waiting, Notice("a.gif: the disk is full", is_error=True))
    assert not saving.set_jobs(failed, ()).should_quit, "what went wrong is to be seen"
    assert saving.quit_when_done(saving.set_jobs(asked, ())).should_quit, "they ended while that was asked"


def test_what_became_of_a_job_is_still_told_when_another_photo_opens():
    stays, goes = Notice("Exported a.gif", is_result=True), Notice("This photo has no depth.")
    told = messages.notify(messages.notify(state_with(scene_of()), goes), stays)
    asked = opening.open_source(told, Source("other.png"))
    opened = opening.show_scene(asked, asked.generation, scene_of(source=asked.source))
    assert opened.notices == (stays,)


def test_settings_of_another_picture_are_made_to_fit_and_can_be_taken_back():
    state = state_with(scene_of(GridShape(5, 5)))
    optics = Optics(eye=ViewOffset(9, 9), aperture_diameter=1e6, focus_disparity=1)
    saved = SavedSettings(optics, 1.0, Source(""), (10, 10))
    offered = messages.notify(state, Notice("It has settings.", offer=saved))
    after = opening.take_settings(offered, saved)
    assert after.optics == Optics(
        eye=ViewOffset(2, 2), aperture_diameter=aperture_limit(state.scene), focus_disparity=1
    )
    assert after.notices == ()
    assert history.undo(after).optics == state.optics
    wider = replace(saved, view_width=2 * state.scene.width)
    assert opening.take_settings(offered, wider).optics == replace(after.optics, focus_disparity=0.5)
    broken = replace(saved, optics=replace(optics, dolly=math.nan))
    assert opening.take_settings(state, broken).optics == state.optics


def test_stopping_keeps_what_is_there_and_late_progress_does_not_bring_it_back():
    state = opening.set_progress(state_with(scene_of()), 1, Progress(3, 81, 0.1), (0, 0))
    state = opening.stop(state)
    assert state.stopped == state.generation == 1
    assert "3 of 81" in state.progress.doing
    finished = opening.set_progress(state_with(scene_of()), 1, Progress(81, 81, 0.1), (0, 0))
    assert opening.stop(finished) == finished
    late = opening.set_progress(state, 1, Progress(4, 81, 0.2), (0, 1))
    assert late.progress == state.progress
    assert late.views_there == {(0, 0), (0, 1)}


def test_stopping_while_another_file_is_read_returns_to_the_scene_that_is_open():
    before = state_with(scene_of())
    state = opening.stop(opening.open_source(before, Source("other.png")))
    assert state.source is before.source
    assert state.generation == before.generation + 2
    assert state.stopped is None
    first = opening.stop(opening.open_source(AppState(), SOURCE))
    assert (first.source, first.stopped, first.progress) == (None, 1, Progress())


def test_a_sketch_opens_the_photo_and_the_whole_photo_goes_on_with_it():
    sketch = scene_of(source=SOURCE, is_sketch=True)
    state = opening.show_scene(state_with(None), 1, sketch)
    assert state.progress.doing.startswith("reading")
    state = lens.focus_on(replace(state, source=SOURCE), (0.0, 0.0), 1.0)
    whole = opening.show_scene(
        state, 1, scene_of(source=SOURCE, notes=("A map is damaged.",), problems=("A map is damaged.",))
    )
    assert whole.notices == (*state.notices, Notice("A map is damaged."))
    assert whole.history.past == state.history.past != ()
    assert whole.chosen_focus is not None
    stopped = opening.stop(state)
    assert stopped.stopped == 1
    assert stopped.scene is sketch


def test_recent_files_of_one_name_are_told_apart_by_their_folders():
    paths = ("/a/x/boxes", "C:\\photos\\tree.jpg", "/a/y/boxes/views", "/boxes", "/b/field/views")
    assert opening.names_of(paths) == ["boxes (x)", "tree.jpg", "boxes (y)", "boxes", "field"]


def test_a_new_scene_starts_with_fresh_optics_and_names_only_what_failed():
    state = opening.open_source(lens.set_aperture(state_with(scene_of()), 2), Source("other.png"))
    notes = ("Made smaller.", CUT_OFF, "A map is damaged.")
    origin = DepthOrigin("rough", "rough, guessed without a model")
    scene = scene_of(source=state.source, notes=notes, problems=notes[2:], depth_origin=origin)
    state = opening.show_scene(state, state.generation, scene)
    assert state.optics == Optics()
    assert state.notices == (Notice(CUT_OFF), Notice("A map is damaged.", commands=DEPTH_COMMANDS))


@pytest.mark.parametrize(
    "late",
    [
        do(opening.show_scene, 0, scene_of(GridShape(3, 3))),
        do(opening.set_progress, 0, Progress(1, 9)),
        do(opening.report_failure, 0, "no such file"),
    ],
)
def test_late_words_of_an_earlier_generation_change_nothing(late):
    state = state_with(scene_of())
    assert reduce(state, late) is state


def test_a_failure_is_said_and_the_scene_before_is_taken_up_again():
    before = state_with(scene_of())
    state = opening.open_source(before, Source("broken.png"))
    state = opening.report_failure(state, state.generation, "broken.png: truncated")
    assert state.notices == (Notice("broken.png: truncated", is_error=True),)
    assert state.source is SOURCE
    assert state.generation == before.generation + 2
    again = opening.report_failure(before, 1, "no memory")
    assert (again.generation, again.progress) == (before.generation, Progress()), "it is not started again"


def test_notices_are_kept_once_bounded_and_dismissable():
    state = AppState()
    for i in (*range(MAX_NOTICES + 3), MAX_NOTICES + 2):
        state = messages.notify(state, Notice(str(i)))
    assert [notice.text for notice in state.notices] == [str(i) for i in range(3, MAX_NOTICES + 3)]
    detailed = messages.show_details(messages.notify(state, Notice("a", details="b")), Notice("a", details="b"))
    assert detailed.notices[-1] == Notice("a b")
    state = messages.dismiss(state, Notice("5"))
    assert [notice.text for notice in state.notices] == ["3", "4", "6", "7"]


def test_a_task_that_comes_while_others_are_taken_up_stays():
    state = ask(ask(AppState(), PlainTask("copy")), PlainTask("paste"))
    assert forget_tasks(state, 1).tasks == (PlainTask("paste"),)
