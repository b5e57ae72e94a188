"""What an export is made of: the scene as it is open, pictures that are drawn of it, views that are made of it again.

A kind of export is a function that writes one file or folder of this, in whatever thread; drawing is handed over.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, TypeVar

from numpy.typing import NDArray

from iibr_core.exports.render_settings import RenderSettings
from iibr_core.generation.outer_views import WantedViews
from iibr_core.generation.plan import ScenePlan
from iibr_core.rendering.optics import CENTRE, Optics
from iibr_core.runtime.tiling import ShouldStop, raise_if_stopped
from iibr_core.scenes.loaded_photo import LoadedPhoto
from iibr_core.scenes.making import views_of_photo
from iibr_core.scenes.scene import Progress, Scene
from iibr_core.scenes.scene_gloss import add_gloss
from iibr_core.types import FloatImage, ReportProgress, ViewOffset, ViewUpdate

Item = TypeVar("Item")


Draw = Callable[[RenderSettings], NDArray[Any]]
"""Draws a picture. Raises Cancelled once the export should stop, InputError where there is no room."""


def undrawn(settings: RenderSettings) -> NDArray[Any]:
    """For kinds that draw nothing."""
    raise AssertionError("this kind of export is said to draw nothing")


@dataclass(frozen=True, eq=False)
class ExportSource:
    """scene: that is open; loaded: its photo, None for a light field from disk. optics: as the window shows it.

    report_progress: heard in whatever thread exports. should_stop: asked often. centre: the centre view as it is shown,
    None where that is not known.
    """

    scene: Scene
    loaded: LoadedPhoto | None
    optics: Optics
    draw: Draw
    report_progress: ReportProgress
    should_stop: ShouldStop
    centre: ViewUpdate | None = None

    def watched(self, items: Iterable[Item], total: int, doing: str) -> Iterator[Item]:
        """The items, telling how many were taken. Raises Cancelled once the export should stop."""
        for done, item in enumerate(items):
            raise_if_stopped(self.should_stop)
            self.report_progress(done, total, doing)
            yield item
        self.report_progress(total, total, doing)

    def views(
        self,
        zero: float | None = None,
        with_disparity: bool = False,
        wanted: Collection[ViewOffset] | None = None,
        in_srgb: bool = True,
    ) -> Generator[ViewUpdate]:
        """Every view of the scene's grid once, the centre first, none of them kept.

        zero: the disparity (as given) that stays still, where it is to be another than the plan's; for photos only.
        with_disparity: of light fields from disk too, each view of its own, as far as it can be found.
        wanted: of a photo, only these and the centre; None: all. in_srgb: else in the scene's colour space. Raises
        Cancelled once the export should stop.
        """
        if self.loaded is None:
            made = self._views_of_folder(with_disparity)
        else:
            made = views_of_photo(
                self.scene.source,
                self.loaded,
                self.plan(zero),
                self.should_stop,
                self.report_progress,
                in_srgb=in_srgb,
                wanted=lambda: WantedViews(wanted),
            )
        scene = self.scene if zero is None else replace(self.scene, infinity_px=self._infinity_px(zero))
        made = add_gloss(made, self.optics.gloss, scene, self.should_stop)
        for view in made:
            raise_if_stopped(self.should_stop)
            self.report_progress(view.share, 1.0, "making views")
            yield view
        raise_if_stopped(self.should_stop)

    def _infinity_px(self, zero: float) -> float:
        """Of the scene's views where another disparity stays still."""
        before, after = self.plan(), self.plan(zero)
        return self.scene.infinity_px + (before.disparity_zero - after.disparity_zero) * after.disparity_scale

    def _views_of_folder(self, with_disparity: bool) -> Iterator[ViewUpdate]:
        """As read; with disparity that was found, and with views between them, where the scene has such."""
        from iibr_core.formats.light_fields.light_field_formats import open_light_field
        from iibr_core.formats.light_fields.views import read_views
        from iibr_core.scenes.light_fields import showings_of_light_field

        is_as_read = self.scene.grid == self.scene.given_grid and self.scene.depth_source in ("none", "light field")
        if is_as_read and not with_disparity:
            return read_views(open_light_field(Path(self.scene.source.path)))[1]
        known = self._found_centre.disparity if self._found_centre is not None else None
        showings = showings_of_light_field(
            self.scene.source, self.should_stop, self._tell, takes_drafts=False, known=known
        )
        return next(showings).views

    @property
    def _found_centre(self) -> ViewUpdate | None:
        """The centre view of a light field from disk, whose disparity is known already and will stay."""
        is_known = self.loaded is None and self.centre is not None and self.centre.is_final
        return self.centre if is_known and self.centre is not None and self.centre.disparity is not None else None

    def _tell(self, progress: Progress) -> None:
        self.report_progress(progress.share, 1.0, progress.doing)

    def plan(self, zero: float | None = None) -> ScenePlan:
        """Of a photo's views; see `views`."""
        plan = self.scene.plan
        assert plan is not None, "a light field from disk has no plan"
        if zero is None:
            return plan
        low, high = (value + (plan.disparity_zero - zero) * plan.disparity_scale for value in plan.disparity_range_px)
        return replace(plan, disparity_zero=zero, disparity_range_px=(low, high))

    def centre_view(self) -> ViewUpdate:
        """The centre view with its disparity, px per view step."""
        if self._found_centre is not None:
            return self._found_centre
        views = self.views()
        try:
            return next(views)
        finally:
            views.close()

    def disparity_seen(self) -> FloatImage | None:
        """Disparity (H, W) of the centre view where that is the viewpoint; else None, as where there is none."""
        return self.centre_view().disparity if self.optics.eye == CENTRE else None
