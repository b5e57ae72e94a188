"""The worker thread: newest request wins, late results are dropped, the queue is bounded, errors do not end it."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.depth.editing.edits import DepthEdits, Stroke
from iibr_core.runtime import compiling
from iibr_core.runtime.tiling import Cancelled
from iibr_core.types import GridShape, InputError, ViewUpdate
from tests.iibr_core.known_scenes import write_grid, write_llff_row, write_stanford, write_stereo_pair
from tests.viewer.background.test_light_field_job import showings
from viewer.background.jobs import QUEUED_RESULTS, Failed
from viewer.background.light_field_job import UNKNOWN_DISPARITY_RANGE_PX
from viewer.background.loaded_photo import load_photo, sketch_photo, without_history
from viewer.background.read_ahead import WantedPhoto
from viewer.background.scene_worker import (
    SceneReady,
    SceneRequest,
    SceneResult,
    SceneWork,
    SceneWorker,
    ViewReady,
    _telling_compiling,
    results_of,
    sketch_of,
)
from viewer.model.actions import OpenPath, SceneOpened
from viewer.model.lens.photographic_units import equivalent_f_number
from viewer.model.reducers.root import reduce
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_editing import DepthSettings
from viewer.model.state.optics import CENTRE, SetAperture
from viewer.model.state.scene import Progress, Source

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

    def next(self) -> SceneResult:
        """The next result that is not late, waiting for it."""
        while True:
            if (result := self.worker.next_result()) is not None:
                return result
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


def write_large_photo(folder: Path, name: str = "large", ending: str = "jpg") -> Path:
    """A photo that takes a while to read."""
    rows, columns = np.mgrid[:1200, :1600]
    pixels = np.stack([rows % 256, columns % 256, (rows // 100 + columns // 100) % 2 * 200], axis=2)
    path = folder / f"{name}.{ending}"
    Image.fromarray(pixels.astype(np.uint8)).save(path)
    return path


@pytest.mark.parametrize("ending", ["jpg", "png", "webp"])
def test_a_large_photo_has_a_sketch(tmp_path: Path, ending: str) -> None:
    source = Source(str(write_large_photo(tmp_path, ending=ending)), grid=GridShape(3, 3))
    sketch = sketch_of(WantedPhoto(source, 1.0))
    whole = next(results_of(SceneRequest(1, source), lambda: False, lambda: CENTRE))
    assert isinstance(whole, SceneReady)
    assert sketch is not None
    assert (sketch.scene.size, sketch.scene.own_size) == ((480, 360), (1600, 1200))
    assert sketch.scene.is_sketch
    assert sketch.loaded is None
    assert sketch.centre.colors.shape == (360, 480, 3)
    assert sketch.scene.name == whole.scene.name
    assert (whole.scene.size, whole.scene.is_sketch) == ((1600, 1200), False)
    assert whole.loaded is not None


@pytest.mark.parametrize("changes", [{"max_pixels": 10_000}, {"is_literal": True}], ids=str)
def test_what_is_read_in_no_time_or_taken_literally_has_no_sketch(tmp_path: Path, changes: dict[str, object]) -> None:
    source = replace(Source(str(write_large_photo(tmp_path)), grid=GridShape(3, 3)), **changes)  # type: ignore[arg-type]
    assert sketch_photo(source) is None


def test_a_cut_jpeg_has_no_sketch_and_fails_as_it_did_without(tmp_path: Path) -> None:
    path = write_large_photo(tmp_path)
    path.write_bytes(path.read_bytes()[:20_000])
    assert sketch_of(WantedPhoto(Source(str(path)), 1.0)) is None
    with pytest.raises(InputError, match=r"large\.jpg"):
        list(results_of(SceneRequest(1, Source(str(path))), lambda: False, lambda: CENTRE))


@pytest.mark.parametrize("takes_drafts", [True, False])
def test_views_come_twice_where_they_may_and_progress_counts_them_once(photo_path: Path, takes_drafts: bool) -> None:
    source = Source(str(photo_path), grid=GridShape(3, 3))
    request = SceneRequest(1, source, takes_drafts=takes_drafts)
    ready, *results = results_of(request, lambda: False, lambda: CENTRE)
    views = [result for result in results if isinstance(result, ViewReady)]
    assert isinstance(ready, SceneReady)
    assert [view.view.is_final for view in views] == [True] + [False] * 8 * takes_drafts + [True] * 8
    expected = [(done, max(done - 1, 0) if takes_drafts else 0) for done in range(1, 10)]
    expected += [(9, drafts) for drafts in range(7, -1, -1)] if takes_drafts else []
    assert [(view.progress.done, view.progress.drafts) for view in views] == expected
    assert [view.progress.is_complete for view in views] == [False] * (len(views) - 1) + [True]


def test_a_lost_worker_says_so_and_the_next_request_starts_another(
    desk_for: Callable[..., Desk], capfd: pytest.CaptureFixture[str]
) -> None:
    def work(asked: SceneRequest, *_: object) -> Iterator[ViewReady]:
        if asked.generation == 1:
            raise SystemExit("a library tried to end the program")
        yield view(asked.generation)

    desk = desk_for(work)
    desk.worker.submit(request(1))
    assert desk.woken()
    assert desk.worker.is_lost
    desk.worker.submit(request(2))
    result = desk.next()
    assert result.generation == 2
    assert not desk.worker.is_lost
    assert "a library tried" in capfd.readouterr().err


def test_a_photo_tells_its_focal_length_only_where_it_knows_it(photo_path: Path, tmp_path: Path) -> None:
    from iibr_core.formats.images.photo import read_photo, write_image

    known = tmp_path / "known.png"
    write_image(known, np.zeros((20, 30, 3), np.uint8), {"Exif:FocalLengthIn35mmFilm": 50})
    for path, expected in ((photo_path, None), (known, read_photo(known).focal_px)):
        ready = next(results_of(SceneRequest(1, Source(str(path))), lambda: False, lambda: CENTRE))
        assert isinstance(ready, SceneReady)
        assert ready.scene.focal_px == expected
    assert read_photo(known).focal_px == pytest.approx(50 / np.hypot(36, 24) * np.hypot(20, 30))


def test_the_subject_is_what_fills_the_middle(photo_path: Path) -> None:
    ready = next(results_of(SceneRequest(1, Source(str(photo_path))), lambda: False, lambda: CENTRE))
    assert isinstance(ready, SceneReady)
    assert ready.scene.subject_disparity_px == ready.scene.disparity_range_px[1], "the near square"


def test_depth_painted_beyond_its_range_is_no_other_lens(photo_path: Path) -> None:
    """The views are others, the aperture is carried over to them: its f-number stays."""
    source, loaded, stops, state = Source(str(photo_path)), None, [], AppState()
    state = reduce(state, OpenPath(source))
    for count in (0, 1, 4):
        strokes = tuple(Stroke("nearer", ((0.5, 0.5), (0.6, 0.5)), 0.1, 1.0) for _ in range(count))
        state = replace(state, generation=count + 1, depth=DepthSettings(1.0, DepthEdits(strokes=strokes)))
        request = SceneRequest(count + 1, source, loaded=loaded, depth_settings=state.depth)
        ready = next(results_of(request, lambda: False, lambda: CENTRE))
        assert isinstance(ready, SceneReady)
        state, loaded = reduce(state, SceneOpened(count + 1, replace(ready.scene, source=source))), ready.loaded
        state = state if count else reduce(state, SetAperture(1.0))
        stops.append(equivalent_f_number(ready.scene, state.optics.aperture_diameter))
    assert ready.scene.found_span_px < 0.5 * np.ptp(ready.scene.disparity_range_px)
    assert stops == pytest.approx([stops[0]] * 3)


def test_a_loaded_photo_is_not_read_again(photo_path: Path) -> None:
    source = Source(str(photo_path), grid=GridShape(1, 1))
    first = next(results_of(SceneRequest(1, source), lambda: False, lambda: CENTRE))
    assert isinstance(first, SceneReady)
    photo_path.unlink()
    again = next(results_of(SceneRequest(2, source, 2.0, first.loaded), lambda: False, lambda: CENTRE))
    assert isinstance(again, SceneReady)
    assert again.loaded is first.loaded
    assert again.scene.plan is not None
    assert first.scene.plan is not None
    assert again.scene.plan.disparity_scale == pytest.approx(2 * first.scene.plan.disparity_scale)


@pytest.mark.parametrize("with_disparity", [True, False])
def test_a_light_field_folder_goes_the_same_way(tmp_path: Path, photo_path: Path, with_disparity: bool) -> None:
    from iibr_core.formats.light_fields.hci import HciWriter

    request = SceneRequest(1, Source(str(photo_path), grid=GridShape(3, 3)), takes_drafts=False)
    made = list(results_of(request, lambda: False, lambda: CENTRE))
    folder = tmp_path / "field"
    with HciWriter(folder, GridShape(3, 3), 100.0, "field", with_disparity) as writer:
        for result in made:
            if isinstance(result, ViewReady):
                writer.add(result.view)
    results = results_of(SceneRequest(2, Source(str(folder))), lambda: False, lambda: CENTRE)
    ready, views = next(showings(results))
    assert (ready.scene.grid, ready.scene.plan, ready.loaded) == ((3, 3), None, None)
    assert ready.scene.has_view_disparity == with_disparity
    assert ready.scene.disparity_range_px[0] < ready.scene.disparity_range_px[1]
    assert len(views) == 9


@pytest.mark.parametrize(
    ("write", "grid", "range_px", "depth_source"),
    [
        (lambda to: write_stanford(to, 2, 3), (2, 3), UNKNOWN_DISPARITY_RANGE_PX, "none"),
        (write_stereo_pair, (1, 2), (7.5, 7.5), "none"),  # the map is the left view's, the middle is the right one
        (write_grid, (3, 3), (0.5, 2.0), "light field"),
    ],
)
def test_what_evaluation_reads_opens_here(
    tmp_path: Path,
    write: Callable[[Path], Path],
    grid: tuple[int, int],
    range_px: tuple[float, float],
    depth_source: str,
) -> None:
    source = Source(str(write(tmp_path / "field")))
    ready, views = next(showings(results_of(SceneRequest(1, source), lambda: False, lambda: CENTRE)))
    scene = ready.scene
    assert (scene.name, scene.grid, scene.disparity_range_px) == ("field", grid, range_px)
    assert (scene.depth_source, scene.has_view_disparity) == (depth_source, False)
    assert len(views) == grid[0] * grid[1]


def test_views_that_stand_on_no_grid_are_refused_in_one_line(tmp_path: Path) -> None:
    source = Source(str(write_llff_row(tmp_path / "fern")))
    with pytest.raises(InputError, match=r"fern.*no regular grid.*`iibr evaluate` reads them"):
        next(results_of(SceneRequest(1, source), lambda: False, lambda: CENTRE))


def test_a_folder_without_views_is_told_what_would_be_some(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="holds no light field; laid out as HCI, Stanford"):
        next(results_of(SceneRequest(1, Source(str(tmp_path))), lambda: False, lambda: CENTRE))


def test_generating_stops_between_row_bands(photo_path: Path) -> None:
    """Asked to stop once the scene is there, it ends without another view."""
    kinds: list[type] = []
    asked = []

    def should_stop() -> bool:
        asked.append(len(kinds))
        return bool(kinds)

    for result in results_of(
        SceneRequest(1, Source(str(photo_path), grid=GridShape(3, 3))), should_stop, lambda: CENTRE
    ):
        kinds.append(type(result))
    assert asked[-1] > 0
    assert kinds[0] is SceneReady
    assert kinds.count(ViewReady) <= 1  # the photo's own view costs nothing


def test_reading_stops_too(photo_path: Path) -> None:
    """Asked to stop while it refines depth."""
    request = SceneRequest(1, Source(str(photo_path), grid=GridShape(3, 3)))
    with pytest.raises(Cancelled):
        next(results_of(request, lambda: True, lambda: CENTRE))


def test_a_new_request_cancels_the_one_before(desk_for: Callable[..., Desk]) -> None:
    cancelled = threading.Event()
    started = threading.Event()

    def work(job: SceneRequest, should_stop: Callable[[], bool], _: object) -> Iterator[ViewReady]:
        if job.generation == 1:
            started.set()
            while not should_stop():
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

    def work(job: SceneRequest, should_stop: object, _: object) -> Iterator[ViewReady]:
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

    def work(job: SceneRequest, should_stop: object, _: object) -> Iterator[ViewReady]:
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
    def work(job: SceneRequest, should_stop: object, _: object) -> Iterator[ViewReady]:
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

    def work(job: SceneRequest, should_stop: Callable[[], bool], _: object) -> Iterator[ViewReady]:
        yield view(job.generation)
        if job.generation == 1:
            while not should_stop():
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


def test_weights_that_are_missing_are_a_failure_and_fast_still_works(
    monkeypatch: pytest.MonkeyPatch, desk_for: Callable[..., Desk], photo_path: Path, tmp_path: Path
) -> None:
    monkeypatch.setattr("iibr_core.generation.light_field.resource_folder", lambda name: tmp_path / name)
    desk = desk_for()
    source = Source(str(photo_path), grid=GridShape(3, 3), quality="balanced")
    desk.worker.submit(SceneRequest(1, source))
    assert [type(desk.next()) for _ in range(2)] == [SceneReady, ViewReady]
    failure = desk.next()
    assert isinstance(failure, Failed)
    assert failure.message.startswith(
        f"{tmp_path / 'assets' / 'weights' / 'ray_transformer.safetensors'}: no such file"
    )
    desk.worker.submit(SceneRequest(2, replace(source, quality="fast")))
    assert [type(desk.next()) for _ in range(10)] == [SceneReady, *[ViewReady] * 9]


def test_where_the_user_looks_reaches_the_job(desk_for: Callable[..., Desk]) -> None:
    from iibr_core.types import ViewOffset

    seen = []

    def work(job: SceneRequest, should_stop: object, nearest_to: Callable[[], ViewOffset]) -> Iterator[ViewReady]:
        seen.append(nearest_to())
        yield view(job.generation)

    desk = desk_for(work)
    desk.worker.eye = ViewOffset(1, 2)
    desk.worker.submit(request(1))
    desk.next()
    assert seen == [ViewOffset(1, 2)]


def test_an_avif_photo_opens(tmp_path: Path) -> None:
    """It is read by another library than the settings in saved pictures."""
    from PIL import Image

    from viewer.background.loaded_photo import load_photo

    Image.new("RGB", (48, 32), (200, 80, 60)).save(tmp_path / "a.avif")
    loaded = load_photo(Source(str(tmp_path / "a.avif")))
    assert (loaded.photo.size, loaded.settings) == ((32, 48), "")


def test_a_photo_that_is_left_keeps_its_map_and_nothing_of_its_strokes(photo_path: Path) -> None:
    loaded = load_photo(Source(str(photo_path)))
    edits = DepthEdits(strokes=(Stroke("nearer", ((0.5, 0.5),), 0.1, 0.5),))
    painted = loaded.canvas.apply(edits)
    left = without_history(loaded)
    assert left.canvas is not loaded.canvas
    np.testing.assert_array_equal(left.disparity.values, loaded.disparity.values)
    np.testing.assert_array_equal(left.canvas.apply(edits), painted)


def test_kernels_that_are_compiled_are_told_beside_the_views_that_are_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """So that the views go on being counted, and can be stopped."""
    monkeypatch.setattr(compiling, "_first_run", compiling._FirstRun())
    told: list[Progress] = []

    def results() -> Iterator[ViewReady]:
        compiling.note_kernel(came_along=False)
        yield ViewReady(0, VIEW, Progress(3, 9))
        compiling.note_kernel(came_along=False)

    assert len(list(_telling_compiling(results(), told.append))) == 1
    assert [(progress.done, progress.total) for progress in told] == [(0, 0), (3, 9)]
    assert all(progress.doing.startswith(compiling.COMPILING) for progress in told)
