"""The views of the open scene on the graphics card, and the last picture of them, in the window and off screen.

Views wait here until there is time to upload them. Everything is called from the thread of the GL context.
"""

from __future__ import annotations

import math
import time
from collections import deque
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from iibr_core.beyond.optics import Optics
from iibr_core.gloss.settings import Gloss
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.scene import LoadedPhoto, Scene, SceneReady
from iibr_core.scenes.scene_gloss import GlossRequest, gloss_request
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import CENTRE, FloatImage, ViewOffset, ViewUpdate
from viewer.display.picking import is_kept_for_picking, pick_disparity
from viewer.display.snapshot import SceneSnapshot, field_of
from viewer.gpu.context import GLContext
from viewer.gpu.light_field_texture import LightFieldTexture, box_around
from viewer.gpu.refocus.picture_renderer import Renderer
from viewer.gpu.refocus.view_sampling import views_seen
from viewer.model.app_state import AppState
from viewer.model.window import DrawReport

if TYPE_CHECKING:
    from iibr_core.beyond.hidden_surfaces import HiddenSurface
    from iibr_core.gloss.shading import GlossMaps

VIEW_REFRESH_S = 0.25
"""Seconds between pictures that only new views change: a picture for each view would delay the hand."""

STILL_BUDGET_S = 0.08
"""Time for a step of a picture that is fine already, in seconds: no hand waits for it."""
FINE_PASSES = 4
"""Number of passes of a picture while views that it will show are missing; the other passes follow."""
MORE_VIEWS = 2.0
"""Ratio of the final views that a picture will show to those that it shows, from which on it is drawn again while views
are made: a few more views change the noise, not the picture.
"""
WAITING_VIEWS = 4
"""Number of waiting views at which the worker pauses."""


@dataclass(frozen=True)
class Picture:
    """Everything that the picture depends on.

    generation: of the scene. views_uploaded, previews: numbers of views, and of previews of edited depth and gloss, so
    far. samples: drawn so far. part: the part of the picture that is drawn, as a share of it.
    """

    generation: int
    views_uploaded: int
    optics: Optics
    size_px: ScreenSize
    samples: int = 0
    previews: int = 0
    part: Rect = WHOLE


class SceneView:
    """Holds the renderer and the views of the open scene.

    field: the stored views, None before the first. generation: number of the worker's job that made the views.
    previews: number of changes by edited depth, gloss and free cameras. views_uploaded: number of uploads.
    pictures_drawn: number of pictures. picture_drawn: record of the last picture, None before the first. centre: the
    centre view, None before anything is open.
    """

    def __init__(self, gl: GLContext) -> None:
        self._gl = gl
        self.renderer = Renderer(gl)
        self.field: LightFieldTexture | None = None
        self.generation = self.views_uploaded = self.pictures_drawn = self.previews = 0
        self.loaded: LoadedPhoto | None = None
        self.centre: ViewUpdate | None = None
        self.picture_drawn: Picture | None = None
        self._scene: Scene | None = None
        self._fallback_view: ViewUpdate | None = None
        self._fallback: LightFieldTexture | None = None
        self._gloss: GlossMaps | None = None
        self._is_preview = self._is_edited = self._holds_picture = self._is_settled = False
        self._seen: frozenset[tuple[int, int]] | None = None
        self._final_seen = 0
        self._hidden: HiddenSurface | None = None
        self._waiting: deque[ViewUpdate] = deque()
        self._is_final: dict[tuple[int, int], bool] = {}
        self._disparities: dict[ViewOffset, FloatImage] = {}
        self._drawn_at = 0.0

    def open(self, ready: SceneReady) -> None:
        """Show this scene from now on. Raises InputError if it does not fit the graphics card; the old scene stays.

        The first view has a field of its own until the second comes, because allocating a whole field takes a while.
        The picture of the same photo stays until the new one has its first pass.
        """
        scene, centre, before = ready.scene, ready.centre, self._scene
        self.show_fallback(None)
        self._hidden = None
        self._show_alone(scene, centre, centre.disparity, None)
        self.generation, self.loaded, self._scene, self.centre = ready.generation, ready.loaded, scene, centre
        self._gloss, self._is_edited = None, False
        self._holds_picture = before is not None and before.source is scene.source
        self._disparities.clear()
        self._keep_for_picking(scene, centre)

    def show_disparity(self, disparity: FloatImage) -> None:
        """Show the photo warped by this field disparity (H, W) in place of its views, until views of a new plan come.

        Raises InputError if the graphics card has no room.
        """
        scene, centre, field = self._scene, self.centre, self._stored
        assert scene is not None
        assert centre is not None
        shown = self._disparities.get(CENTRE) if self._is_preview else None
        differs = None if shown is None else shown != disparity
        self._is_edited = True
        if differs is None or field.is_shared or _is_beyond(disparity[differs], field.range_px):
            self._show_alone(scene, replace(centre, is_final=True), disparity, self._gloss)
        elif differs.any():
            field.change_disparity(*scene.grid.centre, disparity, box_around(differs))
        self._disparities = {CENTRE: disparity}
        self._draw_again()

    def show_fallback(self, view: ViewUpdate | None) -> None:
        """Show this view, which has a disparity, in place of the scene's views; None shows these again."""
        if view is not None or self._fallback_view is not None:
            if self._fallback is not None:
                self._fallback.release()
            self._fallback_view, self._fallback = view, None
            if view is not None:
                field = self._stored
                size = field.width, field.height, field.hdr
                self._fallback = LightFieldTexture(self._gl.ctx, field.grid, *size, with_disparity=True, is_single=True)
                self._fallback.upload(*field.grid.centre, view.colors, view.disparity)
            self._draw_again()

    def gloss_request(self, gloss: Gloss | None) -> GlossRequest | None:
        """Return the request for the maps that this gloss needs, None if they are known."""
        if self._scene is None or self.centre is None:
            return None
        return gloss_request(gloss, self._scene, self.centre, self._gloss)

    def take_gloss(self, maps: GlossMaps) -> None:
        """Show gloss with these maps from now on, unless they are of another scene."""
        if self.centre is not None and maps.disparity is self.centre.disparity:
            self._gloss = maps
            self._stored.set_gloss(maps)
            self._draw_again()

    def take_hidden(self, surface: HiddenSurface | None) -> None:
        """Show this surface behind the photo's through an open lens from now on; None changes nothing."""
        if surface is not None:
            self._hidden = surface
            self._stored.set_hidden(surface)
            self._draw_again()
            self._holds_picture = True  # until the first pass with the surface

    def add(self, view: ViewUpdate) -> None:
        """Take a view of the open scene, to be uploaded later. Raises InputError if there is no room for all views."""
        scene, centre = self._scene, self.centre
        assert scene is not None
        assert centre is not None
        if (view.row, view.column) == scene.grid.centre:
            self._is_final[scene.grid.centre] = view.is_final
            return  # uploaded when the scene was opened
        if self._is_preview:
            self._open_field(scene, self._gloss)
            self._stored.upload(*scene.grid.centre, centre.colors, centre.disparity)
            self._is_preview, self._final_seen = False, 0  # what was drawn of the picture went with its field
        self._waiting.append(view)
        self._keep_for_picking(scene, view)

    @property
    def has_room(self) -> bool:
        """Whether more views may come; otherwise the worker pauses."""
        return len(self._waiting) < WAITING_VIEWS

    def upload(self, budget_s: float) -> bool:
        """Upload waiting views until the time is spent; return whether some still wait.

        A present view is not replaced while another holder draws a picture of the views.
        """
        end = time.perf_counter() + budget_s
        while self._waiting and time.perf_counter() < end:
            view = self._waiting[0]
            if (view.row, view.column) in self._is_final and self._stored.is_shared:
                break
            self._waiting.popleft()
            self._stored.upload(view.row, view.column, view.colors, view.disparity)
            self.views_uploaded += 1
            at = view.row, view.column
            self._is_final[at] = view.is_final
            self._is_settled &= self._seen is not None and (at not in self._seen or len(self._seen) == 1)
        return bool(self._waiting)

    def upload_all(self) -> None:
        """Upload every waiting view."""
        self.upload(math.inf)

    def pick(self, eye: ViewOffset, x_px: float, y_px: float) -> float | None:
        """Return the disparity seen at a pixel of the picture, None if the scene has none."""
        if self._fallback_view is not None and self._fallback_view.disparity is not None:
            return pick_disparity({CENTRE: self._fallback_view.disparity}, eye, x_px, y_px)
        return pick_disparity(self._disparities, self._scene.in_columns(eye) if self._scene else eye, x_px, y_px)

    def draw(self, state: AppState, size_px: ScreenSize, part: Rect = WHOLE) -> Picture | None:
        """Draw the picture of this state, or a part of it, stretched to size_px, if it has changed, or refine it.

        Returns its record, None without views.
        """
        if self.views_uploaded == 0:
            return None
        optics, drawn, budget_s = state.shown_optics, self.picture_drawn, self._gl.frame_budget_s
        picture = Picture(self.generation, self.views_uploaded, optics, size_px, previews=self.previews, part=part)
        if drawn is not None and drawn == replace(picture, views_uploaded=drawn.views_uploaded, samples=drawn.samples):
            is_making, is_soft = state.is_making_views, self._is_soft
            is_soon = time.perf_counter() - self._drawn_at < VIEW_REFRESH_S
            if is_soon and is_making and not is_soft:
                return drawn  # the processor is needed for views
            if self._refines(is_making):
                self.renderer.refine(STILL_BUDGET_S if is_making and not is_soft else budget_s)
                self._drawn_at = time.perf_counter()
                self.picture_drawn = replace(drawn, samples=drawn.samples + 1)
                return self.picture_drawn
            if is_soon or not self._renews(is_making):
                return drawn
            self.renderer.renew(optics, size_px, part)
        elif self._holds_picture and drawn is not None and (drawn.size_px, drawn.part) == (size_px, part):
            self.renderer.renew(optics, size_px, part, is_coarse=True)
        else:
            self.renderer.render_in_time(optics, size_px, budget_s, part)
        self._drawn_at, self._holds_picture = time.perf_counter(), False
        self.pictures_drawn += 1
        self._note_views(optics)
        self.picture_drawn = replace(picture, samples=self.renderer.samples)
        return self.picture_drawn

    @property
    def report(self) -> DrawReport:
        """The report on the last picture."""
        renderer, drawn = self.renderer, self.picture_drawn
        is_sketch = self._scene is not None and self._scene.is_sketch
        is_lens_coarse = drawn is not None and drawn.optics.aperture_diameter > 0 and self._is_soft
        is_draft = is_sketch or is_lens_coarse or not renderer.passes_shown
        return DrawReport(renderer.samples, renderer.samples_converged, 1e3 * renderer.draw_s, is_draft)

    @property
    def _is_soft(self) -> bool:
        """Whether the picture on the screen can still become visibly finer."""
        renderer = self.renderer
        return renderer.passes_shown < FINE_PASSES and not (renderer.is_renewing or renderer.is_converged)

    def converge(self, state: AppState, size_px: ScreenSize, part: Rect = WHOLE) -> Picture | None:
        """Draw the picture with all its samples, however long that takes; return its record as `draw` does."""
        if self.draw(state, size_px, part) is not None:
            self.renderer.refine()
        return self.picture_drawn

    @property
    def is_whole(self) -> bool:
        """Whether every view is present and final, and no edit of the depth is previewed."""
        return self._scene is not None and not self._scene.is_sketch and not self._is_edited and self._has_all_views

    def snapshot(self) -> SceneSnapshot | None:
        """Return a snapshot of the shown views, to be released; None before anything is open."""
        if self._scene is None or self.centre is None:
            return None
        is_free, field = self._fallback_view is not None, self.renderer.drawn_field.share()
        return SceneSnapshot(self._scene, self.loaded, self.centre, field, self._gloss, is_free)

    def shows_all_views(self) -> bool:
        """Return whether the last picture shows every uploaded view, or would not change by those missing."""
        drawn = self.picture_drawn
        return drawn is None or self._is_settled or drawn.views_uploaded == self.views_uploaded

    def release(self) -> None:
        """Free the GL objects."""
        self.renderer.release()
        for field in (self.field, self._fallback):
            if field is not None:
                field.release()

    @property
    def _stored(self) -> LightFieldTexture:
        assert self.field is not None, "open first"
        return self.field

    def _draw_again(self) -> None:
        """Draw the picture again because its field has changed otherwise than by more views."""
        self.renderer.show(self._fallback or self._stored)
        self.previews += 1

    def _show_alone(
        self, scene: Scene, centre: ViewUpdate, disparity: FloatImage | None, gloss: GlossMaps | None
    ) -> None:
        """Show the centre view in a field of one view."""
        self._open_field(scene, gloss, is_single=True)
        self._stored.upload(*scene.grid.centre, centre.colors, disparity)
        self.views_uploaded, self._is_final = 1, {scene.grid.centre: centre.is_final}
        self._is_preview = True
        self._waiting.clear()

    def _open_field(self, scene: Scene, gloss: GlossMaps | None, is_single: bool = False) -> None:
        field, before = field_of(self._gl, scene, is_single), self.field
        field.set_gloss(gloss)
        field.set_hidden(self._hidden)
        self.field = field
        self.renderer.show(self._fallback or field)
        if before is not None:
            before.release()

    def _keep_for_picking(self, scene: Scene, view: ViewUpdate) -> None:
        if view.disparity is not None and is_kept_for_picking(scene.grid, view.row, view.column):
            self._disparities[scene.viewpoint(view.row, view.column)] = view.disparity

    @property
    def _has_all_views(self) -> bool:
        return self._scene is not None and sum(self._is_final.values()) == self._scene.view_count

    def _note_views(self, optics: Optics) -> None:
        """Keep which views the picture that is begun will show, and whether all of them are there and final."""
        assert self._scene is not None
        grid, (row, column) = self._scene.grid, self._scene.grid.centre
        seen = set() if self._fallback_view is not None else views_seen(optics, grid, self._scene.has_view_disparity)
        self._seen = None if seen is None else frozenset((row + round(at.t), column + round(at.s)) for at in seen)
        self._final_seen = self._count_final_seen()
        self._is_settled = self._final_seen == self._seen_count

    @property
    def _seen_count(self) -> int:
        assert self._scene is not None
        return math.prod(self._scene.grid) if self._seen is None else len(self._seen)

    def _count_final_seen(self) -> int:
        return sum(final for at, final in self._is_final.items() if self._seen is None or at in self._seen)

    def _refines(self, is_making: bool) -> bool:
        """Return whether more samples would make the picture better that is begun, or that is shown."""
        is_passing = is_making and not self._is_settled
        is_fine = self.renderer.passes_shown >= FINE_PASSES and not self.renderer.is_renewing
        return not (self.renderer.is_converged or (is_passing and is_fine))

    def _renews(self, is_making: bool) -> bool:
        """Return whether the picture is to be drawn again for the views that came since it was begun."""
        if self.shows_all_views():
            return False
        final = self._count_final_seen()
        return not is_making or final == self._seen_count or final >= MORE_VIEWS * self._final_seen


def _is_beyond(values: FloatImage, range_px: tuple[float, float]) -> bool:
    far, near = range_px
    return bool(values.size and (values.min() < far or values.max() > near))
