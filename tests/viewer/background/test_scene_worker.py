"""The worker thread: newest request wins, late results are dropped, the queue is bounded, errors do not end it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from iibr_core.beyond.optics import CENTRE
from iibr_core.depth.editing.edits import DepthEdits, Stroke
from iibr_core.method import ray_transformer
from iibr_core.runtime import compiling
from iibr_core.runtime.work import is_stopped
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.scene import DepthSettings, Progress, SceneReady, SceneRequest, Source, ViewReady
from iibr_core.types import GridShape, InputError, ViewUpdate
from tests.iibr_core.scenes.test_light_fields import write_two_planes
from tests.viewer.conftest import reduce
from viewer.background.job_threads import QUEUED_RESULTS, Failed, ProgressReport
from viewer.background.scene_worker import PhotosFound, SceneResult, SceneWork, SceneWorker
from viewer.model import lens, opening
from viewer.model.action import do
from viewer.model.state.app_state import AppState
from viewer.model.units import equivalent_f_number

DEADLINE_S = 120.0
VIEW = ViewUpdate(0, 0, np.zeros((1, 1, 3), np.uint8), None)


class Desk:
    """A worker, and the window's end of it: waits for wake-ups instead of polling."""

    def __init__(self, work: SceneWork | None = None) -> None:
        self._woken = threading.Semaphore(0)
        self.worker = SceneWorker(self._woken.release, work)

    def woken(self) -> bool:
        """Wait to be woken."""
        return self._woken.acquire(timeout=DEADLINE_S)

    def next(self, with_progress: bool = False) -> SceneResult:
        """The next result that is not late, waiting for it; reports of progress are left out, unless asked for."""
        while True:
            if (result := self.worker.next_result()) is not None:
                if with_progress or not isinstance(result, ProgressReport):
                    return result
                continue
            assert self._woken.acquire(timeout=DEADLINE_S), "the worker went silent"


@pytest.fixture
def desk_for() -> Iterator[Callable[..., Desk]]:
    desks: list[Desk] = []

    def make(work: SceneWork | None = None) -> Desk:
        desks.append(Desk(work))
        return desks[-1]

    yield make
    for desk in desks:
        desk.worker.close()


def request(generation: int, path: str = "p") -> SceneRequest:
    return SceneRequest(generation, Source(path))


def view(generation: int, done: int = 1) -> ViewReady:
    return ViewReady(generation, VIEW, Progress(done, 99, 0.0))


def test_a_photo_comes_with_its_first_view_at_once_and_then_all_of_them(photo_path: Path) -> None:
    desk = Desk()
    desk.worker.submit(SceneRequest(7, Source(str(photo_path), grid=GridShape(3, 3))))
    ready = desk.next()
    assert isinstance(ready, SceneReady)
    assert (ready.generation, ready.scene.grid, ready.scene.name) == (7, (3, 3), "scene")
    assert ready.loaded is not None
    np.testing.assert_array_equal(ready.centre.colors, np.round(ready.loaded.photo.pixels * 255))
    views = [desk.next() for _ in range(9)]
    desk.worker.close()
    indices = {(v.view.row, v.view.column) for v in views if isinstance(v, ViewReady)}
    assert indices == {(row, column) for row in range(3) for column in range(3)}
    assert [v.progress.done for v in views if isinstance(v, ViewReady)] == list(range(1, 10))


def test_depth_painted_beyond_its_range_is_no_other_lens(photo_path: Path) -> None:
    """The views are others, the aperture is carried over to them: its f-number stays."""
    source, loaded, stops, state = Source(str(photo_path)), None, [], AppState()
    state = reduce(state, do(opening.open_source, source))
    for count in (0, 1, 4):
        strokes = tuple(Stroke("nearer", ((0.5, 0.5), (0.6, 0.5)), 0.1, 1.0) for _ in range(count))
        state = replace(state, generation=count + 1, depth=DepthSettings(1.0, DepthEdits(strokes=strokes)))
        request = SceneRequest(count + 1, source, loaded=loaded, depth_settings=state.depth)
        ready = next(results_of(request, lambda: CENTRE))
        assert isinstance(ready, SceneReady)
        state, loaded = (
            reduce(state, do(opening.show_scene, count + 1, replace(ready.scene, source=source))),
            ready.loaded,
        )
        state = state if count else reduce(state, do(lens.set_aperture, 1.0))
        stops.append(equivalent_f_number(ready.scene, state.optics.aperture_diameter))
    assert ready.scene.found_span_px < 0.5 * np.ptp(ready.scene.disparity_range_px)
    assert stops == pytest.approx([stops[0]] * 3)


def test_a_new_request_cancels_the_one_before(desk_for: Callable[..., Desk]) -> None:
    cancelled = threading.Event()
    started = threading.Event()

    def work(job: SceneRequest, _: object) -> Iterator[ViewReady]:
        if job.generation == 1:
            started.set()
            while not is_stopped():
                threading.Event().wait(0.001)
            cancelled.set()
        yield view(job.generation)

    desk = desk_for(work)
    desk.worker.submit(request(1))
    assert started.wait(DEADLINE_S)
    desk.worker.submit(request(2))
    assert desk.next().generation == 2
    assert cancelled.is_set()
    assert desk.worker.next_result() is None


def test_results_already_queued_for_an_earlier_request_are_dropped(desk_for: Callable[..., Desk]) -> None:
    posted = threading.Event()

    def work(job: SceneRequest, _: object) -> Iterator[ViewReady]:
        yield view(job.generation)
        yield view(job.generation)
        if job.generation == 1:
            posted.set()

    desk = desk_for(work)
    desk.worker.submit(request(1))
    assert posted.wait(DEADLINE_S)
    desk.worker.submit(request(2))
    assert [desk.next().generation for _ in range(2)] == [2, 2]
    assert desk.worker.next_result() is None


def test_the_queue_is_bounded_and_a_full_one_can_be_cancelled(desk_for: Callable[..., Desk]) -> None:
    made: list[int] = []
    is_full = threading.Event()

    def work(job: SceneRequest, _: object) -> Iterator[ViewReady]:
        if job.generation == 2:
            yield view(2)
            return
        for done in range(1000):
            made.append(done)
            if done == QUEUED_RESULTS:
                is_full.set()
            yield view(1, done)

    desk = desk_for(work)
    desk.worker.submit(request(1))
    assert is_full.wait(DEADLINE_S)
    desk.worker.submit(request(2))
    assert desk.next().generation == 2
    assert len(made) <= QUEUED_RESULTS + 2  # one at the queue's door, and one that took the place just read


@pytest.mark.parametrize(
    ("error", "message"),
    [
        (InputError("x.png: no such file"), "x.png: no such file"),
        (ZeroDivisionError("division\nby zero"), "ZeroDivisionError: division by zero"),
        (RuntimeError(), "RuntimeError: no message"),
    ],
)
def test_an_exception_is_posted_and_the_worker_lives_on(
    desk_for: Callable[..., Desk], error: Exception, message: str
) -> None:
    def work(job: SceneRequest, _: object) -> Iterator[ViewReady]:
        yield view(job.generation)
        if job.generation == 1:
            raise error

    desk = desk_for(work)
    desk.worker.submit(request(1))
    assert isinstance(desk.next(), ViewReady)
    failure = desk.next()
    assert isinstance(failure, Failed)
    assert failure.message == message
    desk.worker.submit(request(2))
    assert isinstance(desk.next(), ViewReady)


def test_after_cancel_nothing_is_heard_and_the_next_request_works(desk_for: Callable[..., Desk]) -> None:
    ended = threading.Event()

    def work(job: SceneRequest, _: object) -> Iterator[ViewReady]:
        yield view(job.generation)
        if job.generation == 1:
            while not is_stopped():
                threading.Event().wait(0.001)
            ended.set()

    desk = desk_for(work)
    desk.worker.submit(request(1))
    desk.next()
    desk.worker.cancel()
    assert ended.wait(DEADLINE_S)
    assert desk.worker.next_result() is None
    desk.worker.submit(request(2))
    assert desk.next().generation == 2


def test_a_missing_file_is_a_failure_with_its_name(desk_for: Callable[..., Desk]) -> None:
    desk = desk_for()
    desk.worker.submit(request(1, "gone.png"))
    failure = desk.next()
    assert isinstance(failure, Failed)
    assert "gone.png" in failure.message


def test_where_the_user_looks_reaches_the_job(desk_for: Callable[..., Desk]) -> None:
    from iibr_core.types import ViewOffset

    seen = []

    def work(job: SceneRequest, nearest_to: Callable[[], ViewOffset]) -> Iterator[ViewReady]:
        seen.append(nearest_to())
        yield view(job.generation)

    desk = desk_for(work)
    desk.worker.eye = ViewOffset(1, 2)
    desk.worker.submit(request(1))
    desk.next()
    assert seen == [ViewOffset(1, 2)]


def test_weights_that_are_missing_are_a_failure(
    monkeypatch: pytest.MonkeyPatch, desk_for: Callable[..., Desk], photo_path: Path, tmp_path: Path
) -> None:
    monkeypatch.setattr(ray_transformer, "resource_folder", lambda name: tmp_path / name)
    ray_transformer.shipped_transformer.cache_clear()
    desk = desk_for()
    desk.worker.submit(SceneRequest(1, Source(str(photo_path), grid=GridShape(3, 3))))
    assert [type(desk.next()) for _ in range(2)] == [SceneReady, ViewReady]
    failure = desk.next()
    assert isinstance(failure, Failed)
    weights = tmp_path / "assets" / "weights" / "ray_transformer.safetensors"
    assert failure.message.startswith(f"{weights}: no such file")


def test_kernels_that_are_compiled_are_told_beside_the_views_that_are_there(
    monkeypatch: pytest.MonkeyPatch, desk_for: Callable[..., Desk]
) -> None:
    """So that the views go on being counted, and can be stopped."""

    def results_of(*_: object) -> Iterator[ViewReady]:
        compiling.report_compiling()
        yield ViewReady(1, VIEW, Progress(3, 9, left_s=7.0))
        compiling.report_compiling()

    monkeypatch.setattr("iibr_core.scenes.opening.results_of", results_of)
    monkeypatch.setattr("viewer.background.scene_worker.REPORT_EVERY_S", 0.0)
    desk = desk_for()
    desk.worker.submit(request(1))
    results = [desk.next(with_progress=True) for _ in range(3)]
    told = [result.progress for result in results if isinstance(result, ProgressReport)]
    assert [(progress.done, progress.total) for progress in told] == [(0, 0), (3, 9)]
    assert all(progress.doing.startswith(compiling.COMPILING) for progress in told)
    assert all(progress.left_s is None for progress in told), "of two times left, one is wrong"


def test_the_bar_of_each_work_grows_and_the_last_view_completes_it(
    desk_for: Callable[..., Desk], tmp_path: Path
) -> None:
    """Through all showings of a light field, as the window's state has it."""
    source = Source(str(write_two_planes(tmp_path / "field")))
    desk, state = desk_for(), reduce(AppState(), do(opening.open_source, source))
    desk.worker.submit(SceneRequest(1, source))
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
    assert desk.worker.next_result() is None
