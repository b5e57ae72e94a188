"""Opening of a scene: read the file, plan, make the views; each result is yielded at once."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iibr_core.color import stored_from_encoded
from iibr_core.depth.editing.edits import UNEDITED
from iibr_core.depth.subject import subject_disparity
from iibr_core.formats.cameras import infinity_of
from iibr_core.formats.light_fields.light_field_formats import is_light_field
from iibr_core.generation.disparity_range import measure_disparity_range
from iibr_core.generation.outer_views import ALL_VIEWS, WantedViews
from iibr_core.generation.plan import ScenePlan
from iibr_core.runtime.machine import give_back_memory
from iibr_core.runtime.work import is_stopped
from iibr_core.scenes.light_fields import showings_of_light_field
from iibr_core.scenes.loaded_photo import LoadedPhoto, apply_depth_settings, load_photo, sketch_photo
from iibr_core.scenes.making import make_plan, views_of_photo
from iibr_core.scenes.opening_work import MeasureViews, ViewsWork
from iibr_core.scenes.scene import DepthSettings, FilledField, Progress, Scene, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import Disparity, InputError, Photo, ViewOffset, ViewUpdate


@dataclass(frozen=True, eq=False)
class SceneRequest:
    """One job with all its inputs. depth_settings: refinement and edits of depth, None for those of the source.

    plan: of what is loaded, where it is made already. takes_drafts: views may come twice, so that there is something
    to look at soon; else each comes once, final. filled: the same light field, where all its views are made already.
    asks_model: else depth is guessed where a model would be asked.
    """

    generation: int
    source: Source
    depth_strength: float = 1.0
    loaded: LoadedPhoto | None = None
    depth_settings: DepthSettings | None = None
    takes_drafts: bool = True
    plan: ScenePlan | None = None
    filled: FilledField | None = None
    asks_model: bool = True


@dataclass(frozen=True, eq=False)
class SceneReady:
    """The scene is read and planned. centre: its centre view, there before any other is made."""

    generation: int
    scene: Scene
    loaded: LoadedPhoto | None
    centre: ViewUpdate


@dataclass(frozen=True, eq=False)
class ViewReady:
    """One more view, or one that is there as it will stay; and how far the job is with it."""

    generation: int
    view: ViewUpdate
    progress: Progress


def results_of(
    request: SceneRequest,
    nearest_to: Callable[[], ViewOffset],
    report_progress: Callable[[Progress], None] = lambda progress: None,
    wanted: Callable[[], WantedViews] = lambda: ALL_VIEWS,
) -> Generator[SceneReady | ViewReady]:
    """Yield all results of a job in order: the scene, then each of its views; a light field perhaps more than once.

    report_progress: gets what it does while there is nothing new to show. wanted: asked once the scene is there,
    which views of a photo's grid are to be made beside its own. Raises InputError for a file that cannot
    be opened while it is read.
    """
    try:
        if request.filled is not None:
            yield from _results_of_filled(request, request.filled)
        elif is_light_field(Path(request.source.path)):
            yield from _results_of_light_field(request, nearest_to, report_progress)
        else:
            yield from _results_of_photo(request, nearest_to, report_progress, wanted)
    finally:
        give_back_memory()


def sketch_of(wanted: WantedPhoto) -> SceneReady | None:
    """Return a large photo at a small size, as generation 0; None where it cannot be read so."""
    source = wanted.source
    with suppress(InputError):
        loaded = None if is_light_field(Path(source.path)) else sketch_photo(source)
        if loaded is not None:
            plan = make_plan(source, loaded, wanted.depth_strength)
            scene = scene_of_photo(source, loaded, plan)
            scene = replace(scene, notes=(), depth_origin=None, depth_source="being looked for", is_sketch=True)
            return SceneReady(0, scene, None, _centre_view(loaded, plan))
    return None


def scene_of_photo(source: Source, loaded: LoadedPhoto, plan: ScenePlan) -> Scene:
    """Return the scene of a photo and its plan."""
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
        notes=loaded.photo.notes + loaded.disparity.notes + plan.notes,
        problems=loaded.origin.failures,
        focal_px=_known_focal_px(loaded.photo),
        subject_disparity_px=subject_disparity(plan.field_disparity(loaded.disparity).values),
        settings=loaded.settings,
        depth_origin=loaded.origin,
        levels=loaded.levels,
        depth_model=loaded.model,
        inverse_metres=loaded.disparity.inverse_metres if loaded.depth_settings.edits == UNEDITED else None,
        color_space=loaded.photo.color_space,
        own_size=ScreenSize(loaded.own_size.width, loaded.own_size.height),
        infinity_px=(_given_infinity(loaded.disparity) - plan.disparity_zero) * plan.disparity_scale,
        found_span_px=_found_span_px(loaded, plan),
    )


def _given_infinity(disparity: Disparity) -> float:
    """Return the disparity, as given, of infinitely far points."""
    return infinity_of(float(disparity.values.min()), float(disparity.values.max()), disparity.inverse_metres)


def _found_span_px(loaded: LoadedPhoto, plan: ScenePlan) -> float:
    """Return the range of the field disparity before edits, which make_plan keeps at its scale."""
    if loaded.depth_settings.edits == UNEDITED:
        far, near = plan.disparity_range_px
        return near - far
    found = loaded.refined.values
    span = float(np.ptp(found)) if plan.given_range is None else measure_disparity_range(found).range
    return span * abs(plan.disparity_scale)


def _known_focal_px(photo: Photo) -> float | None:
    """Return the focal length; None if the photo has none and a usual field of view is assumed."""
    from iibr_core.formats.images.photo import focal_px_from_fov

    return None if photo.focal_px == focal_px_from_fov(photo.size.width) else photo.focal_px


def _results_of_photo(
    request: SceneRequest,
    nearest_to: Callable[[], ViewOffset],
    report_progress: Callable[[Progress], None],
    wanted: Callable[[], WantedViews],
) -> Iterator[SceneReady | ViewReady]:
    source = request.source
    depth_settings = request.depth_settings or DepthSettings(source.depth.refine)

    def tell(done: float, total: float, doing: str) -> None:
        report_progress(Progress(doing=f"{doing}, {done / total:.0%}" if done and total else doing))

    loaded = (
        load_photo(source, tell, depth_settings, asks_model=request.asks_model)
        if request.loaded is None
        else apply_depth_settings(request.loaded, depth_settings)
    )
    plan = request.plan or make_plan(source, loaded, request.depth_strength)
    yield SceneReady(request.generation, scene_of_photo(source, loaded, plan), loaded, _centre_view(loaded, plan))

    draft_bytes = plan.draft_bytes if request.takes_drafts else None
    views = views_of_photo(source, loaded, plan, tell, nearest_to, draft_bytes, False, wanted)
    work = ViewsWork(plan.grid.rows * plan.grid.columns)
    yield from _count_views(
        request.generation, views, lambda there, drafts, share: work.advance((share, 1.0), there, drafts)
    )


def _centre_view(loaded: LoadedPhoto, plan: ScenePlan) -> ViewUpdate:
    colors = stored_from_encoded(loaded.photo.pixels, loaded.photo.is_hdr)
    return ViewUpdate(*plan.grid.centre, colors, plan.field_disparity(loaded.disparity).values)


def _results_of_filled(request: SceneRequest, filled: FilledField) -> Iterator[SceneReady | ViewReady]:
    yield SceneReady(request.generation, replace(filled.scene, source=request.source), None, filled.views[0])
    total = len(filled.views)
    work = ViewsWork(total)
    yield from _count_views(
        request.generation, iter(filled.views), lambda there, drafts, share: work.advance((there, total), there, drafts)
    )


def _results_of_light_field(
    request: SceneRequest,
    nearest_to: Callable[[], ViewOffset],
    report_progress: Callable[[Progress], None],
) -> Iterator[SceneReady | ViewReady]:
    """The light field of a folder or file, once more each time that more is known of it."""
    for showing in showings_of_light_field(
        request.source, report_progress, request.takes_drafts, nearest_to=nearest_to
    ):
        scene, centre = showing.scene, next(showing.views)
        yield SceneReady(request.generation, scene, None, centre)
        rest = itertools.takewhile(lambda _: not is_stopped(), itertools.chain((centre,), showing.views))
        yield from _count_views(request.generation, rest, showing.measure)
        if is_stopped():
            return


def _count_views(generation: int, views: Iterator[ViewUpdate], measure: MeasureViews) -> Iterator[ViewReady]:
    is_final = {}
    for view in views:
        is_final[view.row, view.column] = view.is_final
        drafts = list(is_final.values()).count(False)
        yield ViewReady(generation, view, measure(len(is_final), drafts, view.share))


class WantedPhoto(NamedTuple):
    """A photo, its views planned with this depth strength."""

    source: Source
    depth_strength: float
