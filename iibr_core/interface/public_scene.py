"""Scenes: a photo with its disparity, or a light field from disk, and the light fields that are made of them."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypedDict, Unpack, get_args

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import encoded_from_stored, photo_in_srgb
from iibr_core.depth.choice import DepthChoice, DepthStart
from iibr_core.depth.guess import guess_depth
from iibr_core.depth.models.catalog import model_to_use
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS, focal_px_from_fov, read_photo
from iibr_core.formats.light_fields.light_field_formats import is_light_field
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.light_fields.order import grid_of
from iibr_core.formats.light_fields.views import read_stored_view, read_views, row_step_of
from iibr_core.formats.maps.disparity_file import map_at_size
from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.interface.fields import LensViews, LightField, MakeView, View, gather
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
from iibr_core.scenes.light_fields import open_settled, read_dense
from iibr_core.scenes.opening import scene_of_photo
from iibr_core.scenes.photo import lens_views_of, load_photo, make_plan, photo_of_arrays, view_maker_of
from iibr_core.scenes.scene import MAKING, READING, LoadedPhoto, Source
from iibr_core.types import Disparity, FloatImage, GridShape, InputError, Photo

Parallax = Literal["viewing", "literal"]
"""Distance by which views move: "viewing" as the window shows a scene, whatever the unit of its disparity; "literal" by
the disparity as it was given, in px from view to view.
"""
Grid = int | tuple[int, int] | None
"""Rows and columns of views: 9 is 9 x 9, (5, 9) five rows of nine, None the grid of the plan or of the files."""


class ViewOptions(TypedDict, total=False):
    """Options of `Scene.light_field`: "viewing" parallax, depth strength 1 and the background inpainter by default."""

    parallax: Parallax
    depth_strength: float
    inpaint: str


class _Making(NamedTuple):
    """The views of a grid, as they come.

    view_between: makes views between them, None if nothing does; lens: those inside a lens. row_step: see `LightField`.
    """

    grid: GridShape
    views: Iterator[View]
    view_between: MakeView | None = None
    lens: LensViews | None = None
    doing: str = MAKING
    row_step: float = 1.0

    def watched(self, should_stop: ShouldStop, report_progress: ReportProgress) -> Iterator[View]:
        """Yield the views and report progress. Raises Cancelled once should_stop is true."""
        for done in count(1):
            with stoppable(should_stop), watched(report_progress):
                view = next(self.views, None)
                raise_if_stopped()
            if view is None:
                return
            report_progress(done, self.grid.rows * self.grid.columns, self.doing)
            yield view


class Scene(ABC):
    """A photo with its depth, or a light field from disk.

    photo: the photo, or the middle view, (H, W, 3) float32, 1 = white. focal_px: focal length in px of a view.
    depth_source: origin of the depth, in words. notes: changes that reading made, one sentence each.
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
        """Return all views, in memory.

        grid, parallax: see `Grid` and `Parallax`. depth_strength: factor of the viewing parallax. inpaint: way of
        filling holes, as `iibr generate --inpaint` takes it. A light field from disk takes grid and inpaint only, for
        views between its own. Raises InputError for other options and if memory does not suffice, Cancelled once
        should_stop is true.
        """
        with stoppable(should_stop), watched(report_progress):
            making = self._make(_grid_shape(grid), **options)
        views = making.watched(should_stop, report_progress)
        field = gather(views, making.grid, self.focal_px, self.name, making.row_step)
        return replace(field, _view_between=making.view_between, _lens=making.lens)

    def views(
        self,
        grid: Grid = None,
        should_stop: ShouldStop = never,
        report_progress: ReportProgress = ignore_progress,
        **options: Unpack[ViewOptions],
    ) -> Iterator[View]:
        """Yield every view once, the middle one first; none is kept. Arguments of `light_field`."""
        with stoppable(should_stop), watched(report_progress):
            making = self._make(_grid_shape(grid), **options)
        return making.watched(should_stop, report_progress)

    @abstractmethod
    def _make(self, grid: GridShape | None, **options: Unpack[ViewOptions]) -> _Making:
        """Begin to make views. Raises InputError."""


class PhotoScene(Scene):
    """A photo and its disparity."""

    def __init__(self, loaded: LoadedPhoto, source: Source) -> None:
        """Keep the photo and the source it was opened by; the options of a light field replace those of the source."""
        self._loaded, self._source = loaded, source
        photo = loaded.photo
        self.name, self.photo, self.focal_px = photo.name, photo_in_srgb(photo).pixels, photo.focal_px
        self.depth_source, self.notes = loaded.origin.words, photo.notes + loaded.disparity.notes

    @property
    def disparity(self) -> FloatImage:
        """Disparity as given or found, (H, W) float32, larger is closer."""
        return self._loaded.disparity.values

    def plan(self, grid: Grid = None, parallax: Parallax = "viewing", depth_strength: float = 1.0) -> ScenePlan:
        """Return the plan of the views, with their cost. Arguments of `light_field`. Raises InputError."""
        return self._planned(_grid_shape(grid), parallax, depth_strength)[1]

    def _planned(
        self, grid: GridShape | None, parallax: Parallax, depth_strength: float, inpaint: str = DEFAULT_INPAINTER
    ) -> tuple[Source, ScenePlan]:
        """Return the source with these options, and the plan of its views."""
        if parallax not in get_args(Parallax):
            raise InputError(f"parallax {parallax!r}: give 'viewing' or 'literal'")
        is_literal = parallax == "literal"
        if is_literal and (grid is None or depth_strength != 1):
            raise InputError("parallax 'literal' takes the disparity as given: give a grid, and no depth_strength")
        source = replace(self._source, grid=grid, inpaint=inpaint, is_literal=is_literal)
        return source, make_plan(source, self._loaded, depth_strength)

    def _make(
        self,
        grid: GridShape | None,
        parallax: Parallax = "viewing",
        depth_strength: float = 1.0,
        inpaint: str = DEFAULT_INPAINTER,
    ) -> _Making:
        source, plan = self._planned(grid, parallax, depth_strength, inpaint)
        maker = view_maker_of(source, self._loaded, plan)
        views = maker.generate(plan.grid, self._loaded.photo.is_hdr)
        lens = LensViews(scene_of_photo(source, self._loaded, plan), partial(lens_views_of, source, self._loaded, plan))
        return _Making(plan.grid, views, lambda offset: maker.view(offset).colors, lens)


class FieldScene(Scene):
    """A light field on disk. Views between its own are made from all of them; their disparity is found if need be."""

    def __init__(self, field: MultiView) -> None:
        self._field, self._grid, self._row_step = field, grid_of(field), row_step_of(field)
        self.photo = encoded_from_stored(read_stored_view(field, *self._grid.centre))
        self.name, self.notes, self.focal_px = field.name, field.notes, field.focal_px or float(self.photo.shape[1])
        self.depth_source = "the light field" if field.disparity else "none"

    def _make(self, grid: GridShape | None, **options: Unpack[ViewOptions]) -> _Making:
        if options.get("parallax", "viewing") != "viewing" or options.get("depth_strength", 1) != 1:
            raise InputError(f"{self.name}: parallax and depth_strength are for photos; leave them out")
        if grid is None or grid == self._grid:
            return _Making(self._grid, read_views(self._field)[1], doing=READING, row_step=self._row_step)
        views = read_dense(self._field, grid, options.get("inpaint", DEFAULT_INPAINTER))[2]
        return _Making(grid, views, row_step=self._row_step)


def open(
    path: str | Path,
    depth: DepthStart | str | Path = "auto",
    refine: bool = True,
    max_pixels: int = DEFAULT_MAX_PIXELS,
    should_stop: ShouldStop = never,
    report_progress: ReportProgress = ignore_progress,
) -> Scene:
    """Open a photo, or a light field: a folder of views, a quilt, a lenslet image.

    depth: source of a photo's depth: "auto" (a map beside it, the photo's own, a model that is here, a guess),
    "embedded", "model", "rough", "flat", or the path of a map. refine: whether its edges are drawn to the photo's.
    Raises InputError for files that cannot be read, Cancelled once should_stop is true.
    """
    path = Path(path)
    if is_light_field(path):
        return FieldScene(open_settled(Source(str(path)))[0])
    source = Source(str(path), _choice_of(depth, refine), max_pixels=max_pixels)
    with stoppable(should_stop), watched(report_progress):
        return PhotoScene(load_photo(source), source)


def from_arrays(
    photo: NDArray[Any], disparity: NDArray[Any], focal_px: float | None = None, name: str = "photo"
) -> PhotoScene:
    """Return a scene of a photo (H, W, 3), uint8 or float with 1 = white, and its disparity (H, W), larger is closer.

    focal_px: focal length in px, None for that of a usual lens. The disparity is not refined, and its unit matters for
    parallax "literal" alone. Raises InputError for other shapes and values that are not finite.
    """
    given, disparity = _photo_of(photo, focal_px, name), np.asarray(disparity)
    if disparity.shape != given.size:
        raise InputError(f"a disparity of shape {disparity.shape} for a photo of {tuple(given.size)}: give one (H, W)")
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
    """Return the inverse depth (H, W) float32 of a photo by a model on this machine: larger is closer, NaN unknown.

    photo: (H, W, 3), or a file. model: a name that `iibr models` lists, an ONNX file, a model's folder, or "guess", for
    height in the picture and contours alone; None: the recommended one. Raises InputError if the model is not here or
    gives nothing of use, Cancelled once should_stop is true.
    """
    given = read_photo(Path(photo)) if isinstance(photo, str | Path) else _photo_of(photo)
    with stoppable(should_stop), watched(report_progress):
        if model == "guess":
            return guess_depth(given).values
        local = model_to_use(DepthChoice("model", model=None if model is None else str(model)))
        assert local is not None, "what was asked for is there, or was refused"
        estimate = local.estimate(given)
    return map_at_size(estimate.nearness.astype(np.float32), given.size)


def _photo_of(pixels: NDArray[Any], focal_px: float | None = None, name: str = "photo") -> Photo:
    """Return the photo of an array. Raises InputError unless it is (H, W, 3) and finite."""
    pixels = np.asarray(pixels)
    if pixels.ndim != 3 or pixels.shape[2] != 3 or not pixels.size:
        raise InputError(f"a photo of shape {pixels.shape}: give (H, W, 3)")
    with np.errstate(over="ignore"):
        given = np.maximum(encoded_from_stored(pixels), 0)
    if not np.isfinite(given).all():
        raise InputError(f"{name}: holds colours that are NaN or infinite; give finite ones")
    return Photo(given, focal_px or focal_px_from_fov(pixels.shape[1]), name, is_hdr=bool(given.max() > 1))


def _grid_shape(grid: Grid) -> GridShape | None:
    """Return rows and columns. Raises InputError for anything but whole numbers from 1."""
    if grid is None:
        return None
    shape = GridShape(grid, grid) if isinstance(grid, int) else GridShape(*grid)
    if not all(isinstance(side, int | np.integer) and side >= 1 for side in shape):
        raise InputError(f"grid {grid}: give whole numbers, 1 or more")
    return shape


def _choice_of(depth: DepthStart | str | Path, refine: bool) -> DepthChoice:
    match depth:
        case "auto" | "embedded" | "model" | "rough" | "flat":
            return DepthChoice(depth, refine=refine)
    return DepthChoice(file=str(depth), refine=refine)
