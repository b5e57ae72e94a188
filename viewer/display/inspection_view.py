"""Images that inspection shows beside and over the picture, drawn again when their record changed.

Called from the thread of the window only.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.exports.render_settings import RenderSettings
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset, ViewUpdate
from viewer.background.maps import Entropy, EntropyRequest, Surface, SurfaceRequest
from viewer.display.scene_view import SceneView
from viewer.gpu.context import GLContext
from viewer.gpu.inspection_passes import InspectionPasses, Line, OverlayStyle
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.refocus.picture_drawing import PictureDrawing
from viewer.gpu.refocus.view_sampling import nearest_present
from viewer.model import selection
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.colormap import VIRIDIS
from viewer.model.inspection import (
    NO_INSPECTION_TEXTURES,
    Hover,
    InspectionTextures,
    Origin,
    OverlayKind,
    Probe,
    ViewIndex,
    sheet_cells,
    view_near,
)
from viewer.model.layout import Layout, whole_pixels

MASK_COLORS = {"inpainted": (255, 184, 60), "surface": (80, 240, 220)}
"""Colours (sRGB bytes) of overlays that are masks."""
SURFACE_OPACITY = 0.9
MAX_BRUSH_OPACITY = 0.5
"""Largest opacity of overlays while a brush is in hand."""
SNAPSHOT_BUDGET_S = 0.025
"""Seconds per turn for drawing the snapshot's picture."""


class _Frame(NamedTuple):
    """Everything that the images of a frame are drawn from. views: record of the stored views."""

    state: AppState
    scene: Scene
    field: LightFieldTexture
    layout: Layout
    size_px: ScreenSize
    exposure: float
    generation: int
    views: tuple[int, ...]


class _OverlayValues(NamedTuple):
    """A map over the picture. values: (H, W) in `view`, 255 = 1; None: its disparity."""

    kind: OverlayKind | Literal["surface"]
    view: ViewIndex
    values: NDArray[np.uint8] | None


class InspectionView:
    """Draws the images that a state asks for, and keeps which pixels of the views were inpainted."""

    def __init__(self, gl: GLContext, scene_view: SceneView) -> None:
        self._scene_view = scene_view
        self._passes = InspectionPasses(gl.ctx, scene_view.renderer.programs)
        self._drawn: dict[str, tuple[Any, int]] = {}
        self._on_sheet = np.zeros((0, 0), int)
        self._inpainted: dict[ViewIndex, NDArray[np.uint8]] = {}
        self._entropy: Entropy | None = None
        self._surface: Surface | None = None
        self._snapshot: tuple[object, PictureDrawing] | None = None
        self._probed: tuple[object, Probe | None] = (None, None)

    def open(self) -> None:
        """Forget the scene before."""
        self._inpainted.clear()
        self._drawn.clear()
        self._entropy = None
        self._stop_snapshot()

    @property
    def is_drawing(self) -> bool:
        """Whether the picture of the snapshot is being drawn."""
        return self._snapshot is not None and not self._snapshot[1].is_done

    def add(self, view: ViewUpdate) -> None:
        """Keep the mask of inpainted pixels of a view, eight pixels a byte."""
        if view.inpainted is not None:
            self._inpainted[view.row, view.column] = np.packbits(view.inpainted, axis=1)

    def draw(self, state: AppState, layout: Layout) -> InspectionTextures:
        """Draw the images that changed and return the names of all."""
        view, scene, field = self._scene_view, state.scene, self._scene_view.field
        if scene is None or field is None or layout.frame_px is None or not field.present.any():
            return NO_INSPECTION_TEXTURES
        views, exposure = (view.generation, view.views_uploaded, view.previews), 2.0**state.optics.exposure_stops
        frame = _Frame(state, scene, field, layout, layout.frame_px.size, exposure, view.generation, views)
        names = {"overlay": self._overlay(frame), "minimap": self._minimap(frame)}
        if not field.is_single:  # else: only the photo is there, or a preview of its depth
            names |= self._strips(frame)
            names["sheet"] = self._sheet(frame) if state.inspection.shows_views else None
            names["compared"] = self._compared(frame)
        return InspectionTextures(**names, shown=tuple(self._drawn[name][0] for name in names if names[name]))

    def probe(self, state: AppState) -> Probe | None:
        """Return the values under the pointer; None where they are not asked for."""
        scene, hover, field = state.scene, state.hover, self._scene_view.field
        if scene is None or hover is None or field is None or not state.inspection.shows_values:
            return None
        view = self._scene_view
        asked = hover, state.optics, view.generation, view.views_uploaded, view.renderer.samples
        if self._probed[0] != asked:
            part = view.picture_drawn.part if view.picture_drawn is not None else WHOLE
            at = (hover.x_px + 0.5) / scene.width, (hover.y_px + 0.5) / scene.height
            rgb = view.renderer.read_pixel((at[0] - part.x) / part.width, (at[1] - part.y) / part.height)
            self._probed = asked, Probe(rgb, self._origin(hover, state.optics.eye, scene, field))
        return self._probed[1]

    def entropy_request(self, state: AppState) -> EntropyRequest | None:
        """Return the entropy map to be computed; None if none is wanted, or it is known."""
        scene, view = state.scene, self._scene_view
        if scene is None or scene.plan is None or view.loaded is None or state.inspection.overlay != "entropy":
            return None
        wanted = view.generation, view_near(state.optics.eye, scene.grid)
        is_known = self._entropy is not None and (self._entropy.generation, self._entropy.view) == wanted
        if is_known or view.generation != state.generation:
            return None
        return EntropyRequest(*wanted, view.loaded, scene.plan, scene.source.inpaint)

    def take_entropy(self, entropy: Entropy) -> None:
        """Show an entropy map."""
        self._entropy = entropy

    def surface_request(self, state: AppState) -> SurfaceRequest | None:
        """Return the surface to be found; None if none is selected."""
        scene, loaded = state.scene, self._scene_view.loaded
        if state.selection is None or scene is None or scene.plan is None or loaded is None:
            self._surface = None
            return None
        return SurfaceRequest(selection.surface_stroke("forward", state.selection, state.brush), loaded, scene.plan)

    def take_surface(self, surface: Surface) -> list[Action]:
        """Show the selected surface."""
        self._surface = surface
        return [do(selection.set_range, surface.range_px)]

    def release(self) -> None:
        """Free the GL objects."""
        self._stop_snapshot()
        self._passes.release()

    def _once(self, name: str, record: object, draw: Callable[[], int]) -> int:
        """Return the image of this name, drawn again only if its record changed."""
        if name not in self._drawn or self._drawn[name][0] != record:
            self._drawn[name] = record, draw()
        return self._drawn[name][1]

    def _minimap(self, frame: _Frame) -> int | None:
        """Return the photo at a small size."""
        field, centre, rect = frame.field, frame.field.grid.centre, frame.layout.minimap
        if rect is None or not field.present[centre]:
            return None
        size_px = frame.layout.in_pixels(rect).size
        draw = partial(self._passes.draw_view, field, *centre, "minimap", frame.exposure, size_px)
        return self._once("minimap", (frame.generation, frame.exposure, size_px), draw)

    def _strips(self, frame: _Frame) -> dict[str, int | None]:
        state, scene, layout, part = frame.state, frame.scene, frame.layout, frame.layout.part
        x, y = state.inspection.place or ((scene.width - 1) / 2, (scene.height - 1) / 2)
        row, column = view_near(state.optics.eye, scene.grid)
        across = Line(row, (y + 0.5) / scene.height, span=(part.x, part.width))
        down = Line(column, (x + 0.5) / scene.width, is_upright=True, span=(part.y, part.height))
        names: dict[str, int | None] = {}
        for name, rect, line in (
            ("strip_across", layout.strip_across, across),
            ("strip_down", layout.strip_down, down),
        ):
            if rect is not None:
                drawn = line, layout.in_pixels(rect).size, frame.exposure, state.optics.gloss
                draw = partial(self._passes.draw_epi, frame.field, *drawn)
                names[name] = self._once(name, (frame.views, drawn), draw)
        return names

    def _sheet(self, frame: _Frame) -> int:
        """Return the sheet of all views; only views that are new are drawn."""
        field, layout, uploads = frame.field, frame.layout, frame.field.uploads.copy()
        record = frame.generation, frame.exposure, frame.size_px
        is_new = "sheet" not in self._drawn or self._drawn["sheet"][0][0] != record
        name = self._passes.start_sheet(frame.size_px) if is_new else self._drawn["sheet"][1]
        cells = sheet_cells(Rect(0, 0, *frame.size_px), field.grid, layout.ui_scale * layout.pixel_ratio)
        for (row, column), cell in zip(np.ndindex(*field.grid), cells):
            if is_new or uploads[row, column] != self._on_sheet[row, column]:
                self._passes.draw_on_sheet(field, row, column, whole_pixels(cell), frame.exposure)
        self._on_sheet = uploads
        self._drawn["sheet"] = (record, uploads.tobytes()), name
        return name

    def _overlay(self, frame: _Frame) -> int | None:
        """Return the map over the picture: of the selected surface, or the overlay that was chosen."""
        found = self._overlay_values(frame)
        if found is None or not frame.field.has_disparity[found.view]:
            return None
        state, part = frame.state, frame.layout.part
        opacity = state.inspection.opacity
        if state.brush.is_on:  # the photo must be seen
            opacity = SURFACE_OPACITY if found.kind == "surface" else min(opacity, MAX_BRUSH_OPACITY)
        ends = frame.scene.disparity_range_px if found.kind == "disparity" else (0.0, 1.0)
        ends = ends if ends[1] > ends[0] else (ends[0] - 0.5, ends[0] + 0.5)
        color = MASK_COLORS.get(found.kind)
        style = OverlayStyle((color,) * len(VIRIDIS) if color else VIRIDIS, ends, opacity, is_mask=color is not None)
        lens, maps = (state.optics.eye, state.optics.dolly), (found.kind, found.view, self._entropy, self._surface)
        arguments = state.optics, found.view, frame.size_px, style, found.values, part
        draw = partial(self._passes.draw_overlay, frame.field, *arguments)
        return self._once("overlay", (frame.views, lens, maps, frame.size_px, part, style), draw)

    def _overlay_values(self, frame: _Frame) -> _OverlayValues | None:
        """Return the map to be shown; None if there is none, or not yet."""
        kind, field, entropy = frame.state.inspection.overlay, frame.field, self._entropy
        if frame.state.selection is not None and self._surface is not None:
            return _OverlayValues("surface", field.grid.centre, self._surface.outline)
        if kind is None or (kind != "disparity" and field.is_single):
            return None
        if kind == "entropy":
            if entropy is None or entropy.generation != frame.generation:
                return None
            return _OverlayValues("entropy", entropy.view, entropy.values)
        view = _nearest_view(field, frame.state.optics.eye)
        if kind == "disparity":
            return _OverlayValues(kind, view, None)
        if view not in self._inpainted:
            return _OverlayValues(kind, view, np.zeros((field.height, field.width), np.uint8))
        mask = np.unpackbits(self._inpainted[view], axis=1, count=field.width)
        return _OverlayValues(kind, view, mask * np.uint8(255))

    def _compared(self, frame: _Frame) -> int | None:
        """Return the left image of the comparison: the photo, or the picture of the snapshot once it is drawn."""
        kind, optics = frame.state.inspection.comparison, frame.state.inspection.snapshot
        if kind == "photo":
            draw = partial(self._passes.draw_view, frame.field, *frame.scene.grid.centre, "photo", frame.exposure)
            return self._once("compared", (frame.generation, frame.exposure), draw)
        if kind is None or optics is None:
            if self.is_drawing:
                self._stop_snapshot()
            return None
        settings = RenderSettings(optics, frame.size_px, frame.layout.part)
        drawing = self._draw_snapshot((frame.views, settings), settings)
        if not drawing.is_done:
            return None
        return self._once("compared", (frame.views, settings), lambda: self._passes.show("snapshot", drawing.image))

    def _draw_snapshot(self, record: object, settings: RenderSettings) -> PictureDrawing:
        """Draw the snapshot's picture for about SNAPSHOT_BUDGET_S."""
        if self._snapshot is None or self._snapshot[0] != record:
            self._stop_snapshot()
            self._snapshot = record, self._scene_view.renderer.start_picture(settings)
        drawing = self._snapshot[1]
        if not drawing.is_done:
            drawing.advance(SNAPSHOT_BUDGET_S)
            if drawing.is_done:
                drawing.stop()
        return drawing

    def _stop_snapshot(self) -> None:
        if self._snapshot is not None:
            self._snapshot[1].stop()
            self._snapshot = None

    def _origin(self, hover: Hover, eye: ViewOffset, scene: Scene, field: LightFieldTexture) -> Origin:
        """Return the origin of the surface under the pointer, by the view nearest to the eye."""
        if scene.plan is None:
            return "from disk"
        view = _nearest_view(field, eye)
        packed = self._inpainted.get(view)
        if packed is not None and hover.disparity is not None:
            t, s = scene.grid.offset(*view)
            x, y = round(hover.x_px - hover.disparity * (s - eye.s)), round(hover.y_px - hover.disparity * (t - eye.t))
            if 0 <= x < scene.width and 0 <= y < scene.height and packed[y, x // 8] >> (7 - x % 8) & 1:
                return "inpainted"
        return "photo" if eye == scene.grid.offset(*scene.grid.centre) else "generated"


def _nearest_view(field: LightFieldTexture, eye: ViewOffset) -> ViewIndex:
    """Return the present view nearest to the eye."""
    row, column = nearest_present(field.present)[view_near(eye, field.grid)].tolist()
    return row, column
