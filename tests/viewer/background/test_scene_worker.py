"""Opening a scene in its thread: results in order, failures by name, and progress that a person can follow."""

import threading
from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from iibr_core.depth.editing.edits import DepthEdits, Stroke
from iibr_core.runtime import compiling
from iibr_core.scenes.f_numbers import equivalent_f_number
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.scene import DepthSettings, Progress, SceneReady, SceneRequest, Source, ViewReady
from iibr_core.types import CENTRE, ViewOffset, ViewUpdate
from tests.iibr_core.scenes.test_light_fields import write_two_planes
from tests.viewer.conftest import reduce
from viewer.background.newest import Failed, Newest
from viewer.background.scene_worker import PhotosFound, SceneWork, WorkReport
from viewer.model import lens, opening
from viewer.model.action import do
from viewer.model.app_state import AppState

DEADLINE_S = 120.0
VIEW = ViewUpdate(0, 0, np.zeros((1, 1, 3), np.uint8), None)


class Desk:
    """A scene thread, and the window's end of it."""

    def __init__(self):
        self._woken, self.work = threading.Semaphore(0), SceneWork()
        self.thread = Newest("test", self.work, self._woken.release)

    def next(self, with_progress=False):
        """Wait for the next result; reports of progress are left out, unless asked for."""
        while True:
            if (result := self.thread.next_result()) is not None:
                if with_progress or not isinstance(result, WorkReport):
                    return result
                continue
            assert self._woken.acquire(timeout=DEADLINE_S), "no result"


@pytest.fixture
def desk():
    made = Desk()
    yield made
    made.thread.close()


def test_a_folder_of_photos_names_its_first(desk, photo_path):
    desk.thread.submit(SceneRequest(1, Source(str(photo_path.parent))))
    assert desk.next() == PhotosFound(1, str(photo_path))
    desk.thread.submit(SceneRequest(2, Source("gone.png")))
    failure = desk.next()
    assert "gone.png" in failure.message


def test_depth_painted_beyond_its_range_is_no_other_lens(photo_path):
    """The views are others, the aperture is carried over to them: its f-number stays."""
    source, loaded, stops, state = Source(str(photo_path)), None, [], AppState()
    state = reduce(state, do(opening.open_source, source))
    for count in (0, 1, 4):
        strokes = tuple(Stroke("nearer", ((0.5, 0.5), (0.6, 0.5)), 0.1, 1.0) for _ in range(count))
        state = replace(state, generation=count + 1, depth=DepthSettings(1.0, DepthEdits(strokes=strokes)))
        request = SceneRequest(count + 1, source, loaded=loaded, depth_settings=state.depth)
        ready = next(results_of(request, lambda: CENTRE))
        state, loaded = (
            reduce(state, do(opening.show_scene, count + 1, replace(ready.scene, source=source))),
            ready.loaded,
        )
        state = state if count else reduce(state, do(lens.set_aperture, 1.0))
        stops.append(equivalent_f_number(ready.scene, state.optics.aperture_diameter))
    assert ready.scene.found_span_px < 0.5 * np.ptp(ready.scene.disparity_range_px)
    assert stops == pytest.approx([stops[0]] * 3)


def test_compiling_is_reported_beside_the_count_of_the_views(desk, monkeypatch):
    def results(request, nearest_to):
        assert nearest_to() == ViewOffset(1, 2), "the place where the user looks"
        compiling.report_compiling()
        yield ViewReady(1, VIEW, Progress(3, 9, left_s=7.0))
        compiling.report_compiling()

    monkeypatch.setattr("iibr_core.scenes.opening.results_of", results)
    monkeypatch.setattr("viewer.background.scene_worker.REPORT_INTERVAL_S", 0.0)
    monkeypatch.setattr(compiling.compiled, "count", 3)
    monkeypatch.setattr(compiling.compiled, "expected", 12)
    desk.work.eye = ViewOffset(1, 2)
    desk.thread.submit(SceneRequest(1, Source("p")))
    reports = [result.progress for _ in range(3) if isinstance(result := desk.next(with_progress=True), WorkReport)]
    assert [(progress.done, progress.total) for progress in reports] == [(0, 0), (3, 9)]
    assert all(progress.doing.startswith(compiling.COMPILING) for progress in reports)
    assert all(progress.share == 0.25 for progress in reports), "of the kernels, not of the views"
    assert all(progress.left_s is None for progress in reports), "of two times left, one is wrong"


def test_the_bar_of_each_work_grows_and_the_last_view_completes_it(desk, tmp_path):
    """Through all showings of a light field, as the window's state has it."""
    source = Source(str(write_two_planes(tmp_path / "field")))
    state = reduce(AppState(), do(opening.open_source, source))
    desk.thread.submit(SceneRequest(1, source))
    shown = [state.progress]
    while not state.progress.is_complete:
        result = desk.next(with_progress=True)
        assert not isinstance(result, Failed | PhotosFound)
        if isinstance(result, SceneReady):
            state = reduce(state, do(opening.show_scene, 1, result.scene))
        else:
            view = (result.view.row, result.view.column) if isinstance(result, ViewReady) else None
            state = reduce(state, do(opening.set_progress, 1, result.progress, view))
        shown.append(state.progress)
    for before, now in pairwise(shown):
        same_work = before.doing.partition(",")[0] == now.doing.partition(",")[0]
        assert 0 <= (before.share if same_work else 0) <= now.share <= 1
    assert shown[-1].share == pytest.approx(1.0)
    assert desk.thread.next_result() is None
