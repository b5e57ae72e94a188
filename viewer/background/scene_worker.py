"""The worker thread: reads a scene, plans it and makes its views, and hands each result over as soon as it is there.

A frozen `SceneRequest` carries all the inputs, so there is nothing to lock. The newest request wins: the job before it
stops at its next row band, and whatever it still had to say is dropped. The core's heavy imports happen in this
thread, so the window comes first.
"""

from __future__ import annotations

import itertools
import queue
import threading
import time
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from iibr_core.color import stored_from_encoded
from iibr_core.generation.plan import ScenePlan
from iibr_core.types import FloatImage, InputError, Photo, ViewOffset, ViewUpdate
from viewer.background.loaded_photo import LoadedPhoto, apply_depth_settings, load_photo, make_plan, prepare_brush
from viewer.model.state.app_state import CENTRE, Progress, Scene, Source
from viewer.model.state.depth_editing import DepthSettings

QUEUED_RESULTS = 8
"""Results that may wait for the window: enough to keep the worker busy, few enough to cost no memory."""

UNKNOWN_DISPARITY_RANGE_PX = (-4.0, 4.0)
"""Where to look for the focus in a light field that says nothing about disparity."""

POST_RETRY_S = 0.02


@dataclass(frozen=True, eq=False)
class SceneRequest:
    """One job with all its inputs. depth_settings: what is made of the photo's depth, None for what the source says."""

    generation: int
    source: Source
    depth_strength: float = 1.0
    loaded: LoadedPhoto | None = None
    depth_settings: DepthSettings | None = None


@dataclass(frozen=True, eq=False)
class SceneReady:
    """The scene is read and planned. centre: its centre view, there before any other is made."""

    generation: int
    scene: Scene
    loaded: LoadedPhoto | None
    centre: ViewUpdate


@dataclass(frozen=True, eq=False)
class ViewReady:
    """One more view, and how far the job is with it."""

    generation: int
    view: ViewUpdate
    progress: Progress


@dataclass(frozen=True, eq=False)
class ProgressReport:
    """What the job is busy with before there is a scene."""

    generation: int
    progress: Progress


@dataclass(frozen=True, eq=False)
class Failed:
    """The job ended early; the message is one line for people."""

    generation: int
    message: str


SceneResult = SceneReady | ViewReady | ProgressReport | Failed
Work = Callable[[SceneRequest, Callable[[], bool], Callable[[], ViewOffset]], Iterator[SceneReady | ViewReady]]
"""What a job does: (request, should_stop, where the user looks) -> its results, in order. See `results_of`."""


class SceneWorker:
    """One thread that carries out the newest request.

    wake is called (in that thread) when a result was posted. work is what a job does, `results_of` by default.
    """

    def __init__(self, wake: Callable[[], None], work: Work | None = None) -> None:
        self.eye = CENTRE
        """Where the user looks now; views near it are made first. Set by the window, read by the job."""
        self.is_lost = False
        """Whether the thread ended unasked. The next request starts another one."""
        self._wake = wake
        self._work = work or self._results_of
        self._results: queue.Queue[SceneResult] = queue.Queue(QUEUED_RESULTS)
        self._changed = threading.Condition()
        self._wanted: SceneRequest | None = None
        self._is_closed = False
        self._thread = self._started_thread()

    def submit(self, request: SceneRequest) -> None:
        """Start this job; the one before it is cancelled. A lost thread is replaced."""
        with self._changed:
            self._wanted = request
            self._changed.notify()
        if self.is_lost:
            self._thread.join()
            self.is_lost = False
            self._thread = self._started_thread()

    def cancel(self) -> None:
        """Stop the present job; nothing more is heard of it."""
        with self._changed:
            self._wanted = None
            self._changed.notify()

    def next_result(self) -> SceneResult | None:
        """The next result of the newest request, or None. Results of earlier requests are dropped here."""
        while True:
            try:
                result = self._results.get_nowait()
            except queue.Empty:
                return None
            if self._wanted is not None and result.generation == self._wanted.generation:
                return result

    def close(self) -> None:
        """Cancel, and wait for the thread to end."""
        with self._changed:
            self._is_closed = True
            self._changed.notify()
        self._thread.join()

    def _started_thread(self) -> threading.Thread:
        thread = threading.Thread(target=self._run_and_wake, name="iibr-worker", daemon=True)
        thread.start()
        return thread

    def _run_and_wake(self) -> None:
        try:
            self._run()
        except BaseException:  # the window says so and goes on; the trace is for whoever mends it
            traceback.print_exc()
            self.is_lost = True
            self._wake()

    def _run(self) -> None:
        request: SceneRequest | None = None
        while True:
            with self._changed:
                while self._wanted is request and not self._is_closed:
                    self._changed.wait()
                request = self._wanted
            if self._is_closed:
                return
            if request is not None:
                self._carry_out(request)

    def _carry_out(self, request: SceneRequest) -> None:
        def should_stop() -> bool:
            return self._is_closed or self._wanted is not request

        try:
            for result in self._work(request, should_stop, lambda: self.eye):
                if should_stop():
                    return
                self._post(result, should_stop)
        except Exception as error:  # the one place where a job's error can still be shown to the user
            self._post(Failed(request.generation, message_of(error)), should_stop)

    def _results_of(
        self, request: SceneRequest, should_stop: Callable[[], bool], nearest_to: Callable[[], ViewOffset]
    ) -> Iterator[SceneReady | ViewReady]:
        """`results_of`, what it is busy with posted as it goes."""

        def report_progress(progress: Progress) -> None:
            self._post(ProgressReport(request.generation, progress), should_stop)

        return results_of(request, should_stop, nearest_to, report_progress)

    def _post(self, result: SceneResult, should_stop: Callable[[], bool]) -> None:
        while not should_stop():
            try:
                self._results.put(result, timeout=POST_RETRY_S)
            except queue.Full:
                continue
            self._wake()
            return


def message_of(error: Exception) -> str:
    """One line for people: an input error speaks for itself, any other says what kind it is."""
    text = " ".join(str(error).split())
    return text if isinstance(error, InputError) else f"{type(error).__name__}: {text or 'no message'}"


def results_of(
    request: SceneRequest,
    should_stop: Callable[[], bool],
    nearest_to: Callable[[], ViewOffset],
    report_progress: Callable[[Progress], None] = lambda progress: None,
) -> Iterator[SceneReady | ViewReady]:
    """Everything a job has to say, in order: the scene, then each of its views. tell: what it does until then.

    Raises InputError for a file that cannot be opened, Cancelled where should_stop says so while it is read.
    """
    from iibr_core.formats.light_fields.hci import is_light_field_folder

    if is_light_field_folder(Path(request.source.path)):
        yield from _results_of_folder(request, should_stop)
    else:
        yield from _results_of_photo(request, should_stop, nearest_to, report_progress)


def scene_of_photo(source: Source, loaded: LoadedPhoto, plan: ScenePlan) -> Scene:
    """What the viewer says about a photo and its plan."""
    height, width = loaded.photo.size
    return Scene(
        source=source,
        name=loaded.photo.name,
        width=width,
        height=height,
        grid=plan.grid,
        disparity_range_px=plan.disparity_range_px,
        depth_source=loaded.disparity.source,
        is_hdr=loaded.photo.is_hdr,
        plan=plan,
        notes=loaded.photo.notes + loaded.disparity.notes,
        focal_px=_known_focal_px(loaded.photo),
        subject_disparity_px=_centre_first(plan.field_disparity(loaded.disparity).values),
        settings=loaded.settings,
        depth_origin=loaded.origin,
        levels=loaded.levels,
        depth_models=loaded.models,
    )


def _known_focal_px(photo: Photo) -> float | None:
    """None where the photo did not tell, and a usual field of view stands in."""
    from iibr_core.formats.images.photo import focal_px_from_fov

    return None if photo.focal_px == focal_px_from_fov(photo.size[1]) else photo.focal_px


def _centre_first(disparity: FloatImage) -> float:
    """The median of the middle ninth of the picture."""
    height, width = disparity.shape
    part = disparity[height // 3 : height - height // 3, width // 3 : width - width // 3]
    return float(np.median(part))


def _results_of_photo(
    request: SceneRequest,
    should_stop: Callable[[], bool],
    nearest_to: Callable[[], ViewOffset],
    report_progress: Callable[[Progress], None],
) -> Iterator[SceneReady | ViewReady]:
    source = request.source
    depth_settings = request.depth_settings or DepthSettings(source.refine)
    loaded = (
        load_photo(source, should_stop, report_progress, depth_settings)
        if request.loaded is None
        else apply_depth_settings(request.loaded, depth_settings, should_stop)
    )
    plan = make_plan(source, loaded, request.depth_strength)
    disparity = plan.field_disparity(loaded.disparity)
    colors = stored_from_encoded(loaded.photo.pixels, loaded.photo.is_hdr)
    centre = ViewUpdate(*plan.grid.centre, colors, disparity.values)
    yield SceneReady(request.generation, scene_of_photo(source, loaded, plan), loaded, centre)

    from iibr_core.generation.light_field import generate

    views = generate(loaded.photo, disparity, plan, should_stop, nearest_to, source.quality, source.inpaint)
    yield from _count_views(request.generation, views, plan.grid.rows * plan.grid.columns)
    if not should_stop():
        prepare_brush()


def _results_of_folder(request: SceneRequest, should_stop: Callable[[], bool]) -> Iterator[SceneReady | ViewReady]:
    """The light field of a folder. Its first two views tell whether each brings its disparity."""
    from iibr_core.formats.light_fields.hci import read_light_field

    header, views = read_light_field(Path(request.source.path))
    first = list(itertools.islice(views, 2))
    scene = Scene(
        source=request.source,
        name=header.name,
        width=header.width,
        height=header.height,
        grid=header.grid,
        disparity_range_px=header.disparity_range_px or _range_of(first[0].disparity),
        depth_source="light field" if first[0].disparity is not None else "none",
        is_hdr=header.is_hdr,
        has_view_disparity=all(view.disparity is not None for view in first),
        subject_disparity_px=_centre_first(first[0].disparity) if first[0].disparity is not None else 0.0,
    )
    yield SceneReady(request.generation, scene, None, first[0])
    rest = itertools.takewhile(lambda _: not should_stop(), itertools.chain(first, views))
    yield from _count_views(request.generation, rest, header.grid.rows * header.grid.columns)


def _range_of(disparity: FloatImage | None) -> tuple[float, float]:
    if disparity is None:
        return UNKNOWN_DISPARITY_RANGE_PX
    return float(disparity.min()), float(disparity.max())


def _count_views(generation: int, views: Iterator[ViewUpdate], total: int) -> Iterator[ViewReady]:
    start = time.perf_counter()
    for done, view in enumerate(views, 1):
        yield ViewReady(generation, view, Progress(done, total, time.perf_counter() - start))
