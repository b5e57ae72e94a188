"""The source of an export: an open scene, pictures drawn of it, and its views.

A kind of export is a function that writes one file or folder from an `ExportSource`, in any thread; the source draws
pictures wherever the graphics card may be used.
"""

from collections.abc import Callable, Collection, Generator, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from numpy.typing import NDArray

from iibr_core.beyond.optics import Optics
from iibr_core.exports.kinds import ExportKind, ExportOptions, optics_of, with_defaults
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.formats.images.picture_kinds import AS_USUAL, PictureFormat
from iibr_core.formats.images.write import write_picture
from iibr_core.formats.light_fields.light_field_formats import is_light_field, open_light_field
from iibr_core.method.plan import ScenePlan
from iibr_core.runtime.work import raise_if_stopped, report_progress
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.scene import MAKING, LoadedPhoto, Scene, SceneReady, SceneRequest, Source
from iibr_core.scenes.scene_gloss import add_gloss
from iibr_core.types import CENTRE, SRGB, ColorSpace, FloatImage, GridShape, InputError, ViewOffset, ViewUpdate

if TYPE_CHECKING:
    from iibr_core.formats.images.metadata import PictureMetadata

Item = TypeVar("Item")
Draw = Callable[[RenderSettings], NDArray[Any]]
"""Function that draws a picture. Raises Cancelled once the export should stop, InputError if there is no memory."""
OpticsOf = Callable[[Scene, Optics], Iterable[Optics]]
"""Function from a scene and the optics it is shown with to the optics of the pictures that are drawn of it."""


@dataclass(frozen=True, eq=False)
class ExportSource:
    """An open scene to be exported.

    loaded: its photo, None for a light field from disk. optics: the optics that the window shows. centre: the centre
    view that is shown, None if it is not known.
    """

    scene: Scene
    loaded: LoadedPhoto | None
    optics: Optics
    draw: Draw
    centre: ViewUpdate | None = None

    @property
    def color_space(self) -> ColorSpace:
        """Colour space in which pictures of this scene are saved."""
        return AS_USUAL.space_for(self.scene.color_space)

    @property
    def focal_px(self) -> float | None:
        """Focal length of a view in pixels, None if it is not known."""
        return self.scene.focal_px if self.loaded is None else self.loaded.photo.focal_px

    def watched(self, items: Iterable[Item], total: int, doing: str) -> Iterator[Item]:
        """Yield the items and report progress."""
        for done, item in enumerate(items):
            raise_if_stopped()
            report_progress(done, total, doing)
            yield item
        report_progress(total, total, doing)

    def views(
        self,
        static_disparity: float | None = None,
        with_disparity: bool = False,
        wanted: Collection[ViewOffset] | None = None,
        in_srgb: bool = True,
    ) -> Generator[ViewUpdate]:
        """Yield every view of the scene's grid once, the centre first; none is kept.

        static_disparity: the disparity (as given) that does not move, if it is not the plan's; for photos only.
        with_disparity: whether light fields from disk yield the disparity of each view, as far as it can be found.
        wanted: the views of a photo to make beside the centre, None for all. in_srgb: whether colours are converted to
        sRGB; otherwise they stay in the scene's colour space.
        """
        if self.loaded is None:
            views = self._views_of_folder(with_disparity)
        else:
            from iibr_core.scenes.photo import views_of_photo

            plan = self.plan(static_disparity)
            views = views_of_photo(self.scene.source, self.loaded, plan, in_srgb=in_srgb, wanted=lambda: wanted)
        scene = self.scene
        if static_disparity is not None:
            moved = (self.plan().disparity_zero - static_disparity) * self.plan().disparity_scale
            scene = replace(scene, infinity_px=(scene.infinity_px or 0.0) + moved)
        total = scene.view_count if wanted is None else len({*wanted, CENTRE})
        for done, view in enumerate(add_gloss(views, self.optics.gloss, scene), 1):
            raise_if_stopped()
            report_progress(done, total, MAKING)
            yield view
        raise_if_stopped()

    def with_grid(self, grid: GridShape) -> "ExportSource":
        """Return a photo's scene with another number of views, whose outermost ones stay where they are."""
        if self.loaded is None or grid == self.scene.grid:
            return self
        from iibr_core.scenes.opening import scene_of_photo

        plan, source = self.plan(), replace(self.scene.source, grid=grid)
        finer = max(max(plan.grid) - 1, 1) / max(max(grid) - 1, 1)
        low, high = (value * finer for value in plan.disparity_range_px)
        plan = replace(plan, grid=grid, disparity_scale=plan.disparity_scale * finer, disparity_range_px=(low, high))
        return replace(self, scene=scene_of_photo(source, self.loaded, plan), centre=None)

    def _views_of_folder(self, with_disparity: bool) -> Iterator[ViewUpdate]:
        """Return the views from disk, with found disparity if the scene has it."""
        from iibr_core.formats.light_fields.views import read_views
        from iibr_core.scenes.light_fields import load_light_field, open_field

        is_as_read = self.scene.plan is None and self.scene.depth_source in ("none", "light field")
        if is_as_read and not with_disparity:
            return read_views(open_field(self.field_source))[1]
        centre = self._final_centre
        known = None if centre is None else centre.disparity
        return next(load_light_field(self.field_source, takes_drafts=False, known=known)).views

    @property
    def field_source(self) -> Source:
        """The source of a light field from disk, with the order of its views as it was found."""
        return replace(self.scene.source, arrangement=self.scene.arrangement)

    @property
    def _final_centre(self) -> ViewUpdate | None:
        """The centre view of a light field from disk, if its disparity is known and final."""
        centre = self.centre if self.loaded is None else None
        return centre if centre is not None and centre.is_final and centre.disparity is not None else None

    def plan(self, static_disparity: float | None = None) -> ScenePlan:
        """Return the plan of a photo's views, with another disparity that does not move if one is given."""
        plan = self.scene.plan
        assert plan is not None, "a light field from disk has no plan"
        if static_disparity is None:
            return plan
        shift = (plan.disparity_zero - static_disparity) * plan.disparity_scale
        low, high = (value + shift for value in plan.disparity_range_px)
        return replace(plan, disparity_zero=static_disparity, disparity_range_px=(low, high))

    def centre_view(self) -> ViewUpdate:
        """Return the centre view with its disparity in pixels per view step."""
        if self._final_centre is not None:
            return self._final_centre
        views = self.views()
        try:
            return next(views)
        finally:
            views.close()

    def depth_view(self) -> tuple[ViewUpdate, FloatImage]:
        """Return the centre view, and its disparity (H, W). Raises InputError without one."""
        view = self.centre_view()
        if view.disparity is None:
            raise InputError(f"{self.scene.name}: has no depth; open it with a disparity map")
        return view, view.disparity

    def write_picture(
        self, path: Path, pixels: NDArray[Any], form: PictureFormat = AS_USUAL, color_space: ColorSpace = SRGB
    ) -> None:
        """Write a picture (H, W, 3) of this colour space with the Exif and XMP of the photo."""
        write_picture(path, pixels, form, self.metadata, color_space)

    @property
    def metadata(self) -> "PictureMetadata":
        """Exif and XMP of the photo; none of a light field."""
        from iibr_core.formats.images.metadata import PictureMetadata
        from iibr_core.formats.images.open_picture import read_metadata

        return PictureMetadata() if self.loaded is None else read_metadata(Path(self.scene.source.path))


OpenDrawn = Callable[[Source, float, LensChoice, Callable[[Scene], None], OpticsOf | None], ExportSource]
"""Function (source, depth_strength, lens, on_ready, optics_of) that opens a scene whose pictures can be drawn.

It makes the views that the pictures with these optics show; all views for None. on_ready is called with the scene
before any view is made; its exceptions end the opening. Raises InputError.
"""


def open_for_export(
    kind: ExportKind,
    options: ExportOptions,
    source: Source,
    depth_strength: float,
    lens: LensChoice,
    on_ready: Callable[[Scene], None],
    open_drawn: OpenDrawn | None,
) -> ExportSource:
    """Open a scene for an export of this kind, by `open_drawn` if the kind is drawn."""
    if kind.is_drawn:
        assert open_drawn is not None
        return open_drawn(source, depth_strength, lens, on_ready, partial(optics_of, kind, options))
    from iibr_core.scenes.light_fields import is_order_known
    from iibr_core.scenes.opening import results_of

    # A light field from disk is copied without waiting for its disparity, unless that shows the order of its views.
    path = Path(source.path)
    is_copied = kind.is_light_field and (not is_light_field(path) or is_order_known(open_light_field(path), source))
    request = SceneRequest(0, source, depth_strength, takes_drafts=is_copied)
    ready = next(results_of(request, lambda: CENTRE))
    assert isinstance(ready, SceneReady)
    on_ready(ready.scene)
    optics = lens.optics_on(ready.scene, ready.centre.disparity)
    return ExportSource(ready.scene, ready.loaded, optics, _draw_nothing, ready.centre)


def write_export(kind: ExportKind, path: Path, source: ExportSource, options: ExportOptions) -> str | None:
    """Write an export of this kind; return a sentence about it for the user, or None."""
    filled = with_defaults(kind, options, source.scene, source.optics)
    if "grid" in kind.supports and filled.grid is not None:
        source = source.with_grid(filled.grid)
    message: str | None = kind.function(kind.write)(path, source, filled)
    if filled.rate < options.rate:
        return (
            f"browsers slow down animations of {options.rate:g} frames a second; "
            f"the same {filled.frames / filled.rate:.3g} s have {filled.frames} frames instead"
        )
    return message


def _draw_nothing(settings: RenderSettings) -> NDArray[Any]:
    raise AssertionError("this kind of export draws nothing")
