"""Scenes: a photo with its disparity, or a light field from disk, and the light fields that are made of them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal, TypedDict, Unpack, get_args

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import encoded_from_stored, photo_in_srgb
from iibr_core.depth.choice import DepthChoice, DepthStart
from iibr_core.depth.estimates import MetricDepth, values_of
from iibr_core.depth.estimators.catalog import model_to_use
from iibr_core.depth.estimators.estimate_depth import estimate_with
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS, read_photo
from iibr_core.formats.light_fields.light_field_formats import is_light_field, open_light_field
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.light_fields.views import grid_of, read_stored_view, read_views
from iibr_core.formats.maps.disparity_file import map_at_size
from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.interface.encoded_pictures import photo_of
from iibr_core.interface.fields import LightField, MakeView, View, gather
from iibr_core.method.farthest_views import outer_views_of_grid
from iibr_core.method.photo_views import PhotoViews
from iibr_core.method.plan import ScenePlan
from iibr_core.runtime.work import (
    ReportProgress,
    ShouldStop,
    ignore_progress,
    never,
    raise_if_stopped,
    stoppable,
    watched,
)
from iibr_core.scenes.dense import read_dense
from iibr_core.scenes.photo import load_photo, make_plan, photo_of_arrays, views_of_photo
from iibr_core.scenes.scene import LoadedPhoto, Source
from iibr_core.types import (
    Disparity,
    FloatImage,
    GridShape,
    InputError,
    ViewOffset,
)

Parallax = Literal["viewing", "literal"]
"""How far views move: as the window shows a scene, whatever the units of its disparity, or by the disparity as it was
given, in px from view to view.
"""
Grid = int | tuple[int, int] | None
"""Views across and down: 9 is 9 x 9, (5, 9) five rows of nine."""


class ViewOptions(TypedDict, total=False):
    """Options of making views; options that are left out have their usual values.

    parallax: see `Parallax`; "viewing" if left out. depth_strength: times the viewing parallax. inpaint: way of filling
    holes, as `iibr generate --inpaint` takes it.
    """

    parallax: Parallax
    depth_strength: float
    inpaint: str


class Scene(ABC):
    """A photo with its depth, or a light field from disk.

    name: of it. photo: it, or the middle view, (H, W, 3) float32, 1 = white. focal_px: focal length in px of a view.
    depth_source: where its depth came from, in words. notes: what reading it changed, one sentence each.
    """

    name: str
    photo: FloatImage
    focal_px: float
    depth_source: str
    notes: tuple[str, ...]

    def light_field(
        self,
        grid: Grid = None,
        should_stop: ShouldStop = never,
        report_progress: ReportProgress = ignore_progress,
        **options: Unpack[ViewOptions],
    ) -> LightField:
        """All views, in memory.

        grid: None for the plan's; of a light field from disk its own. options: see `ViewOptions`; a light field
        from disk takes inpaint, for views between its own. report_progress: gets the share that is
        done. Raises InputError where an option means nothing or memory does not suffice, Cancelled once should_stop is
        true.
        """
        with stoppable(should_stop), watched(report_progress):
            made = self._make(grid, options)
        views = _told(made, should_stop, report_progress)
        return gather(views, made.grid, self.focal_px, self.name, made.view_between)

    def views(
        self,
        grid: Grid = None,
        should_stop: ShouldStop = never,
        report_progress: ReportProgress = ignore_progress,
        **options: Unpack[ViewOptions],
    ) -> Iterator[View]:
        """Yield every view once, the middle one first; none is kept. Arguments of `light_field`."""
        with stoppable(should_stop), watched(report_progress):
            made = self._make(grid, options)
        return _told(made, should_stop, report_progress)

    @abstractmethod
    def _make(self, grid: Grid, options: ViewOptions) -> _Making:
        """Begin to make views. Raises InputError."""


@dataclass(frozen=True, eq=False)
class _Making:
    """The views of a grid, as they come. view_between: makes those between; None: nothing does. doing: in words."""

    grid: GridShape
    views: Iterator[View]
    view_between: MakeView | None
    doing: str


def _told(made: _Making, should_stop: ShouldStop, report_progress: ReportProgress) -> Iterator[View]:
    """Yield the views and report progress. Raises Cancelled once should_stop is true."""
    done, total = 0, made.grid.rows * made.grid.columns
    while True:
        with stoppable(should_stop), watched(report_progress):
            view = next(made.views, None)
            raise_if_stopped()
        if view is None:
            return
        done += 1
        report_progress(done, total, made.doing)
        yield view


class PhotoScene(Scene):
    """A photo and its disparity."""

    def __init__(self, loaded: LoadedPhoto, source: Source) -> None:
        """source: what it was opened by; the options of each light field change what they name."""
        self._loaded, self._source = loaded, source
        photo = loaded.photo
        self.name, self.photo, self.focal_px = photo.name, photo_in_srgb(photo).pixels, photo.focal_px
        self.depth_source, self.notes = loaded.origin.words, photo.notes + loaded.disparity.notes

    @property
    def disparity(self) -> FloatImage:
        """Disparity as given or found, (H, W) float32, larger is closer."""
        return self._loaded.disparity.values

    def plan(self, grid: Grid = None, **options: Unpack[ViewOptions]) -> ScenePlan:
        """Return the plan of the views, with their cost. Arguments of `light_field`. Raises InputError."""
        return make_plan(self._source_for(grid, options), self._loaded, options.get("depth_strength", 1.0))

    def _source_for(self, grid: Grid, options: ViewOptions) -> Source:
        """Raises InputError for options that mean nothing."""
        _require_known(options, ViewOptions.__annotations__)
        shape, parallax = _grid_shape(grid), options.get("parallax", "viewing")
        if parallax not in get_args(Parallax):
            raise InputError(f"parallax {parallax!r}: give 'viewing' or 'literal'")
        if parallax == "literal" and (shape is None or options.get("depth_strength", 1) != 1):
            raise InputError("parallax 'literal' takes disparity as it is: give a grid, and no depth_strength")
        inpaint, is_literal = _inpainting(options), parallax == "literal"
        return replace(self._source, grid=shape, inpaint=inpaint, is_literal=is_literal)

    def _make(self, grid: Grid, options: ViewOptions) -> _Making:
        plan = self.plan(grid, **options)
        views = views_of_photo(self._source_for(grid, options), self._loaded, plan)
        values = plan.field_disparity(self._loaded.disparity).values
        return _Making(plan.grid, views, _ViewsBetween(self.photo, values, plan), "making views")


class FieldScene(Scene):
    """A light field on disk. Views between its own are made from all of them; their disparity is found if need be."""

    def __init__(self, found: MultiView) -> None:
        self._field, self._grid = found, grid_of(found)
        self.photo = encoded_from_stored(read_stored_view(found, *self._grid.centre))
        self.name, self.notes, self.focal_px = found.name, found.notes, found.focal_px or float(self.photo.shape[1])
        self.depth_source = "the light field" if found.disparity else "none"

    def _make(self, grid: Grid, options: ViewOptions) -> _Making:
        _require_known(options, ("inpaint",))
        wanted = _grid_shape(grid) or self._grid
        if wanted == self._grid:
            return _Making(wanted, read_views(self._field)[1], None, "reading views")
        dense = read_dense(self._field, wanted, _inpainting(options))
        return _Making(wanted, dense.views, None, "making views")


def open(
    path: str | Path,
    depth: DepthStart | str | Path = "auto",
    refine: float = 1.0,
    max_pixels: int = DEFAULT_MAX_PIXELS,
    should_stop: ShouldStop = never,
    report_progress: ReportProgress = ignore_progress,
) -> Scene:
    """Open a photo, or a light field: a folder of views, a quilt, a lenslet image.

    depth: of a photo, where it comes from: "auto" (a map beside it, the photo's own, a model that is here, a guess),
    "embedded", "model", "rough", "flat", or the path of a map. refine: how far its edges are drawn to the photo's, 0 to
    1. Raises InputError for what cannot be read, Cancelled once should_stop is true.
    """
    path = Path(path)
    if is_light_field(path):
        return FieldScene(open_light_field(path))
    source = Source(str(path), _choice_of(depth, refine), max_pixels=max_pixels)
    with stoppable(should_stop), watched(report_progress):
        return PhotoScene(load_photo(source), source)


def from_arrays(
    photo: NDArray[Any], disparity: NDArray[Any], focal_px: float | None = None, name: str = "photo"
) -> PhotoScene:
    """A scene of a photo (H, W, 3), uint8 or float with 1 = white, and its disparity (H, W), larger is closer.

    focal_px: focal length in px, None for that of a usual lens. The disparity counts as it is: nothing is refined, and
    its unit matters for parallax "literal" alone. Raises InputError for other shapes and values that are not finite.
    """
    given, disparity = photo_of(photo, focal_px, name), np.asarray(disparity)
    if disparity.shape != given.size:
        raise InputError(
            f"a disparity of shape {disparity.shape} for a photo of {tuple(given.size)}: give the same (H, W)"
        )
    with np.errstate(over="ignore"):
        values = disparity.astype(np.float32)
    if not np.isfinite(values).all():
        raise InputError("the given array: holds disparities that are NaN, infinite or too large; fill or scale them")
    return PhotoScene(photo_of_arrays(given, Disparity(values, "the given array")), Source(""))


def estimate_depth(
    photo: NDArray[Any] | str | Path,
    model: str | Path | None = None,
    should_stop: ShouldStop = never,
    report_progress: ReportProgress = ignore_progress,
) -> FloatImage:
    """Inverse depth (H, W) float32 of a photo, larger is closer, in no unit: by a model that is on this machine.

    photo: (H, W, 3), or a file. model: a name that `iibr models` lists, an ONNX file, a model's folder, or "guess", for
    height in the picture and contours alone; None: the recommended one. Raises InputError where it is not here or gives
    nothing of use, Cancelled once should_stop is true.
    """
    given = read_photo(Path(photo)) if isinstance(photo, str | Path) else photo_of(photo)
    if model == "guess":
        from iibr_core.depth.pictorial_cues import estimate_from_cues

        with stoppable(should_stop):
            return estimate_from_cues(given).values
    local = model_to_use(DepthChoice("model", model=None if model is None else str(model)))
    assert local is not None, "what was asked for is there, or was refused"
    with stoppable(should_stop), watched(report_progress):
        estimate = estimate_with(local, given)
    values = values_of(estimate)
    return map_at_size(np.reciprocal(values) if isinstance(estimate, MetricDepth) else values, given.size)


class _ViewsBetween:
    """Makes views anywhere between those of a plan, from a ray set that the first of them makes and all share."""

    def __init__(self, photo: FloatImage, disparity: FloatImage, plan: ScenePlan) -> None:
        self._photo, self._disparity, self._plan = photo, disparity, plan

    def __call__(self, offset: ViewOffset) -> FloatImage:
        return self._views.view(offset).colors

    @cached_property
    def _views(self) -> PhotoViews:
        return PhotoViews(self._photo, self._disparity, outer_views_of_grid(self._plan.grid))


def _grid_shape(grid: Grid) -> GridShape | None:
    """Raises InputError for no views."""
    if grid is None:
        return None
    shape = GridShape(grid, grid) if isinstance(grid, int) else GridShape(*grid)
    if not all(isinstance(side, int | np.integer) and side >= 1 for side in shape):
        raise InputError(f"grid {grid}: give whole numbers, 1 or more")
    return shape


def _require_known(options: ViewOptions, known: Iterable[str]) -> None:
    unknown = [name for name in options if name not in known]
    if unknown:
        raise InputError(f"{', '.join(unknown)}: unknown option; give {', '.join(known)}")


def _inpainting(options: ViewOptions) -> str:
    return options.get("inpaint", DEFAULT_INPAINTER)


def _choice_of(depth: DepthStart | str | Path, refine: float) -> DepthChoice:
    match depth:
        case "auto" | "embedded" | "model" | "rough" | "flat":
            return DepthChoice(depth, refine=refine)
    return DepthChoice(file=str(depth), refine=refine)
