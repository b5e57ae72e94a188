"""Opening of a scene: read the file, plan, make the views; each result is yielded at once."""

import itertools
import time
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

import numpy as np

from iibr_core.color import stored_from_encoded
from iibr_core.depth.editing.edits import UNEDITED
from iibr_core.depth.subject import subject_disparity
from iibr_core.formats.cameras import infinity_of
from iibr_core.formats.images.photo import focal_px_from_fov
from iibr_core.formats.light_fields.light_field_formats import is_light_field
from iibr_core.method.disparity_range import measure_disparity_range
from iibr_core.method.plan import ScenePlan
from iibr_core.runtime.compiling import working_clock
from iibr_core.runtime.machine import give_back_memory
from iibr_core.runtime.time_left import TimeLeft
from iibr_core.runtime.work import is_stopped
from iibr_core.scenes.outer_views import OuterViews
from iibr_core.scenes.photo import apply_depth_settings, load_photo, make_plan, sketch_photo, views_of_photo
from iibr_core.scenes.scene import (
    READING,
    DepthSettings,
    LoadedPhoto,
    Progress,
    Scene,
    SceneReady,
    SceneRequest,
    Source,
    ViewReady,
    WantedPhoto,
)
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import CENTRE, InputError, ViewOffset, ViewUpdate, Wanted


def results_of(
    request: SceneRequest, nearest_to: Callable[[], ViewOffset], wanted: Wanted = lambda: None
) -> Generator[SceneReady | ViewReady]:
    """Yield all results of opening a scene: the scene, then each of its views; a light field perhaps more than once.

    nearest_to: returns the viewpoint near which views are made first. wanted: called after the scene was taken.
    """
    try:
        if is_light_field(Path(request.source.path)):
            yield from _with_hidden(_results_of_light_field(request, wanted))
        else:
            yield from _with_hidden(_results_of_photo(request, nearest_to, wanted))
    finally:
        give_back_memory()


def sketch_of(photo: WantedPhoto) -> SceneReady | None:
    """Return a photo at a small size, as generation 0; None if that saves no time, or it cannot be read like that."""
    source = photo.source
    with suppress(InputError):
        loaded = None if is_light_field(Path(source.path)) else sketch_photo(source)
        if loaded is not None:
            plan = make_plan(source, loaded, photo.depth_strength)
            scene = scene_of_photo(source, loaded, plan)
            scene = replace(scene, notes=(), depth_origin=None, depth_source="being looked for", is_sketch=True)
            return SceneReady(0, scene, None, _centre_view(loaded, plan))
    return None


def scene_of_photo(source: Source, loaded: LoadedPhoto, plan: ScenePlan) -> Scene:
    """Return the scene of a photo and its plan."""
    (height, width), focal_px = loaded.photo.size, loaded.photo.focal_px
    values = loaded.disparity.values
    infinity = infinity_of(float(values.min()), float(values.max()), loaded.disparity.inverse_metres)
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
        focal_px=None if focal_px == focal_px_from_fov(width) else focal_px,
        subject_disparity_px=subject_disparity(plan.field_disparity(loaded.disparity).values),
        settings=loaded.settings,
        depth_origin=loaded.origin,
        levels=loaded.levels,
        depth_model=loaded.model,
        inverse_metres=loaded.disparity.inverse_metres if loaded.depth_settings.edits == UNEDITED else None,
        color_space=loaded.photo.color_space,
        own_size=ScreenSize(loaded.own_size.width, loaded.own_size.height),
        infinity_px=(infinity - plan.disparity_zero) * plan.disparity_scale,
        found_span_px=_found_span_px(loaded, plan),
    )


def _found_span_px(loaded: LoadedPhoto, plan: ScenePlan) -> float:
    """Return the range of the field disparity before edits, which make_plan keeps at its scale."""
    if loaded.depth_settings.edits == UNEDITED:
        far, near = plan.disparity_range_px
        return near - far
    found = loaded.refined.values
    span = float(np.ptp(found)) if plan.given_range is None else measure_disparity_range(found).range
    return span * abs(plan.disparity_scale)


def _centre_view(loaded: LoadedPhoto, plan: ScenePlan) -> ViewUpdate:
    colors = stored_from_encoded(loaded.photo.pixels, loaded.photo.is_hdr)
    return ViewUpdate(*plan.grid.centre, colors, plan.field_disparity(loaded.disparity).values)


def _results_of_photo(
    request: SceneRequest, nearest_to: Callable[[], ViewOffset], wanted: Wanted
) -> Iterator[SceneReady | ViewReady]:
    source = request.source
    depth_settings = request.depth_settings or DepthSettings(source.depth.refine)
    if request.loaded is None:
        loaded = load_photo(source, depth_settings, request.asks_model)
    else:
        loaded = apply_depth_settings(request.loaded, depth_settings)
    plan = request.plan or make_plan(source, loaded, request.depth_strength)
    scene = scene_of_photo(source, loaded, plan)
    yield SceneReady(request.generation, scene, loaded, _centre_view(loaded, plan))
    views = views_of_photo(source, loaded, plan, nearest_to, False, wanted)
    yield from _count_views(request.generation, views, scene, wanted)


def _results_of_light_field(request: SceneRequest, wanted: Wanted) -> Iterator[SceneReady | ViewReady]:
    from iibr_core.scenes.light_fields import load_light_field  # photos start without its modules

    for field in load_light_field(request.source, request.takes_drafts, wanted=wanted):
        is_partial = field.scene.has_view_disparity and not field.scene.missing_views
        centre = next(field.views)
        yield SceneReady(request.generation, field.scene, None, centre)
        rest = itertools.takewhile(lambda _: not is_stopped(), itertools.chain((centre,), field.views))
        yield from _count_views(request.generation, rest, field.scene, wanted if is_partial else lambda: None)
        if is_stopped():
            return


def _with_hidden(results: Iterator[SceneReady | ViewReady]) -> Iterator[SceneReady | ViewReady]:
    """Yield results, with the surface behind the centre view's once the outer views of a scene are there."""
    centre: ViewUpdate | None = None
    for result in results:
        if isinstance(result, SceneReady):
            centre, outer = result.centre, OuterViews(result.scene)
        elif centre is not None and outer.take(result.view):
            result = replace(result, hidden=outer.hidden_behind(centre))
        yield result


def _count_views(
    generation: int, views: Iterator[ViewUpdate], scene: Scene, wanted: Wanted = lambda: None
) -> Iterator[ViewReady]:
    """Yield the views with the progress of making them."""
    time_left, begun_s = TimeLeft(working_clock), time.perf_counter()
    for there, view in enumerate(views, 1):
        chosen = wanted()
        total = scene.view_count if chosen is None else len({*chosen, CENTRE})
        left_s, seconds = time_left.update(there, total), time.perf_counter() - begun_s
        if view.is_final:
            progress = Progress(there, total, seconds, share=there / total, left_s=left_s)
        else:
            progress = Progress(0, total, seconds, READING, there / total)
        yield ViewReady(generation, view, progress)
