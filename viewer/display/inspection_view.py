"""Images that inspection shows beside and over the picture, drawn again when their record changed.

Called from the thread of the window only.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.exports.render_settings import RenderSettings
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.scene import LoadedPhoto, Scene
from iibr_core.types import ViewUpdate
from viewer.background.entropy import Entropy, EntropyRequest
from viewer.background.newest import Failed
from viewer.background.surface import Surface, SurfaceRequest
from viewer.display.scene_view import SceneView
from viewer.gpu.context import GLContext
from viewer.gpu.inspection_passes import InspectionPasses, Line, OverlayStyle
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.refocus.picture_drawing import PictureDrawing
from viewer.gpu.refocus.view_sampling import nearest_present
from viewer.model import inspection, messages, selection
from viewer.model.action import Action, do
from viewer.model.colormap import VIRIDIS
from viewer.model.inspection import NO_INSPECTION_TEXTURES, InspectionTextures, sheet_cells, view_near
from viewer.model.layout import Layout, whole_pixels
from viewer.model.state.app_state import AppState, Hover
from viewer.model.state.inspection import Origin, OverlayKind, Probe, ViewIndex
from viewer.model.state.notices import Notice

MASK_COLORS = {"inpainted": (255, 184, 60), "surface": (80, 240, 220)}
"""Colours (sRGB bytes) of overlays that are masks."""
SURFACE_OPACITY = 0.6
MAX_BRUSH_OPACITY = 0.5
"""Largest opacity of overlays while a brush is in hand."""
SNAPSHOT_BUDGET_S = 0.025
"""Seconds per turn for drawing the snapshot's picture."""


@dataclass(frozen=True)
class _ViewImage:
    """Everything that an image of views depends on. views: number of uploads. exposure: factor of brightness. previews:
    number of previews of edited depth.
    """

    generation: int
    views: int
    exposure: float
    previews: int


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
        self._drawn: dict[str, tuple[object, int]] = {}
        self._on_sheet: frozenset[tuple[ViewIndex, int]] = frozenset()
        self._inpainted: dict[ViewIndex, NDArray[np.uint8]] = {}
        self._entropy: Entropy | None = None
        self._entropy_asked: tuple[int, ViewIndex] | None = None
        self._surface: Surface | None = None
        self._surface_asked: tuple[object, LoadedPhoto] | None = None
        self._snapshot: tuple[object, PictureDrawing] | None = None
        self._probed: tuple[object, Probe | None] = (None, None)

    def open(self) -> None:
        """Forget the scene before."""
        self._inpainted.clear()
        self._drawn.clear()
        self._entropy = self._entropy_asked = None
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
        scene, field = state.scene, self._scene_view.renderer.field
        if scene is None or field is None or layout.frame_px is None or not field.present.any():
            return NO_INSPECTION_TEXTURES
        view = self._scene_view
        base = _ViewImage(view.generation, view.views_uploaded, 2.0**state.optics.exposure_stops, view.previews)
        names = {"overlay": self._overlay(state, scene, field, layout, base)}
        names["minimap"] = self._minimap(field, layout, base)
        if field.grid == scene.grid:  # else: only the photo is there, or a preview of its depth
            names |= self._strips(state, scene, field, layout, base)
            names["sheet"] = self._sheet(field, layout, base) if state.inspection.shows_views else None
            names["compared"] = self._compared(state, scene, field, layout, base)
        return self._textures(names)

    def probe(self, state: AppState) -> Probe | None:
        """Return the values under the pointer; None where they are not asked for."""
        scene, hover, field = state.scene, state.hover, self._scene_view.renderer.field
        if scene is None or hover is None or field is None or not state.inspection.shows_values:
            return None
        view = self._scene_view
        asked = hover, state.optics, view.generation, view.views_uploaded, view.renderer.samples
        if self._probed[0] != asked:
            self._probed = asked, self._probe_at(hover, state, scene, field)
        return self._probed[1]

    def entropy_request(self, state: AppState) -> EntropyRequest | None:
        """Return the entropy map to be computed now; None where none is wanted, or it was asked for before."""
        scene, view = state.scene, self._scene_view
        if scene is None or scene.plan is None or view.loaded is None or state.inspection.overlay != "entropy":
            return None
        asked = view.generation, view_near(state.optics.eye, scene.grid)
        if asked == self._entropy_asked or view.generation != state.generation:
            return None
        self._entropy_asked = asked
        return EntropyRequest(*asked, view.loaded, scene.plan, scene.source.inpaint)

    def take_entropy(self, result: Entropy | Failed[EntropyRequest]) -> list[Action]:
        """Show an entropy map; a failure takes the overlay away."""
        if isinstance(result, Failed):
            self._entropy_asked = None
            return [do(messages.notify, Notice(result.message, is_error=True)), do(inspection.set_overlay, None)]
        self._entropy = result
        return []

    def surface_request(self, state: AppState) -> SurfaceRequest | None:
        """Return the surface to be found now; None where none is selected, or it was asked for before."""
        scene, loaded = state.scene, self._scene_view.loaded
        if state.selection is None or scene is None or scene.plan is None or loaded is None:
            self._surface = self._surface_asked = None
            return None
        asked = state.selection.place, state.brush.tolerance
        if self._surface_asked is not None and self._surface_asked[0] == asked and self._surface_asked[1] is loaded:
            return None
        self._surface_asked = asked, loaded
        return SurfaceRequest(*asked, loaded, scene.plan)

    def take_surface(self, result: Surface | Failed[SurfaceRequest]) -> list[Action]:
        """Show the selected surface."""
        if isinstance(result, Failed):
            return [do(messages.notify, Notice(result.message, is_error=True)), do(selection.deselect)]
        self._surface = result
        return [do(selection.set_range, result.range_px)]

    def release(self) -> None:
        """Free the GL objects."""
        self._stop_snapshot()
        self._passes.release()

    def _textures(self, names: dict[str, int | None]) -> InspectionTextures:
        return InspectionTextures(**names, shown=tuple(self._drawn[name][0] for name in names if names[name]))

    def _minimap(self, field: LightFieldTexture, layout: Layout, base: _ViewImage) -> int | None:
        """Return the photo at a small size."""
        row, column = field.grid.centre
        if layout.minimap is None or not field.present[row, column]:
            return None
        size_px = layout.in_pixels(layout.minimap).size
        draw = partial(self._passes.draw_view, field, row, column, "minimap", base.exposure, size_px)
        return self._once("minimap", (base.generation, base.exposure, size_px), draw)

    def _once(self, name: str, record: object, draw: Callable[[], int]) -> int:
        """Return the image of this name, drawn again only if its record changed."""
        if name not in self._drawn or self._drawn[name][0] != record:
            self._drawn[name] = record, draw()
        return self._drawn[name][1]

    def _strips(
        self, state: AppState, scene: Scene, field: LightFieldTexture, layout: Layout, base: _ViewImage
    ) -> dict[str, int | None]:
        names: dict[str, int | None] = {"strip_across": None, "strip_down": None}
        x, y = state.inspection.place or ((scene.width - 1) / 2, (scene.height - 1) / 2)
        row, column = view_near(state.optics.eye, scene.grid)
        part = layout.part
        across = Line(row, (y + 0.5) / scene.height, span=(part.x, part.width))
        down = Line(column, (x + 0.5) / scene.width, is_upright=True, span=(part.y, part.height))
        lines = (("strip_across", layout.strip_across, across), ("strip_down", layout.strip_down, down))
        for name, rect, line in lines:
            if rect is not None:
                size_px = layout.in_pixels(rect).size
                draw = partial(self._passes.draw_epi, field, line, size_px, base.exposure, state.optics.gloss)
                names[name] = self._once(name, (base, line, size_px, state.optics.gloss), draw)
        return names

    def _sheet(self, field: LightFieldTexture, layout: Layout, base: _ViewImage) -> int:
        """Return the sheet of all views; only views that are new are drawn."""
        assert layout.frame_px is not None
        size_px = layout.frame_px.size
        record = base.generation, base.exposure, size_px
        there = frozenset((view, int(uploads)) for view, uploads in np.ndenumerate(field.uploads) if uploads)
        old = self._drawn.get("sheet")
        is_new = old is None or old[0] != (record, self._on_sheet)
        name = self._passes.start_sheet(size_px) if is_new or old is None else old[1]
        cells = sheet_cells(Rect(0, 0, *size_px), field.grid, layout.ui_scale * layout.pixel_ratio)
        for i, cell in enumerate(cells):
            view = divmod(i, field.grid.columns)
            upload = view, int(field.uploads[view])
            if is_new or (upload in there and upload not in self._on_sheet):
                self._passes.draw_on_sheet(field, *view, whole_pixels(cell), base.exposure)
        self._on_sheet = there
        self._drawn["sheet"] = (record, there), name
        return name

    def _overlay(
        self, state: AppState, scene: Scene, field: LightFieldTexture, layout: Layout, base: _ViewImage
    ) -> int | None:
        """Return the map over the picture: of the selected surface, or the overlay that was chosen."""
        found = self._overlay_values(state, scene, field)
        if found is None or layout.frame_px is None or not field.has_disparity[found.view]:
            return None
        optics, size_px, part = state.optics, layout.frame_px.size, layout.part
        opacity = state.inspection.opacity
        if state.brush.is_on:  # the photo must be seen
            opacity = SURFACE_OPACITY if found.kind == "surface" else min(opacity, MAX_BRUSH_OPACITY)
        ends = scene.disparity_range_px if found.kind == "disparity" else (0.0, 1.0)
        ends = ends if ends[1] > ends[0] else (ends[0] - 0.5, ends[0] + 0.5)
        color = MASK_COLORS.get(found.kind)
        style = OverlayStyle((color,) * len(VIRIDIS) if color else VIRIDIS, ends, opacity, is_mask=color is not None)
        record = (
            base,
            found.kind,
            found.view,
            self._entropy,
            self._surface,
            optics.eye,
            optics.dolly,
            size_px,
            part,
            style,
        )
        draw = partial(self._passes.draw_overlay, field, optics, found.view, size_px, style, found.values, part)
        return self._once("overlay", record, draw)

    def _overlay_values(self, state: AppState, scene: Scene, field: LightFieldTexture) -> _OverlayValues | None:
        """Return the map to be shown; None if there is none, or not yet."""
        kind = state.inspection.overlay
        if state.selection is not None and self._surface is not None:
            return _OverlayValues("surface", field.grid.centre, self._surface.mask)
        if kind is None or (kind != "disparity" and field.grid != scene.grid):
            return None
        if kind == "entropy":
            entropy = self._entropy
            is_known = entropy is not None and entropy.generation == self._scene_view.generation
            return _OverlayValues("entropy", entropy.view, entropy.values) if entropy is not None and is_known else None
        view: ViewIndex = tuple(nearest_present(field.present)[view_near(state.optics.eye, field.grid)].tolist())
        return _OverlayValues(kind, view, self._mask_of(view, field) if kind == "inpainted" else None)

    def _mask_of(self, view: ViewIndex, field: LightFieldTexture) -> NDArray[np.uint8]:
        packed = self._inpainted.get(view)
        if packed is None:
            return np.zeros((field.height, field.width), np.uint8)
        return np.unpackbits(packed, axis=1, count=field.width) * np.uint8(255)

    def _compared(
        self, state: AppState, scene: Scene, field: LightFieldTexture, layout: Layout, base: _ViewImage
    ) -> int | None:
        """Return the left image of the comparison: the photo, or the picture of the snapshot once it is drawn."""
        kind, optics = state.inspection.comparison, state.inspection.snapshot
        if kind == "photo":
            draw = partial(self._passes.draw_view, field, *scene.grid.centre, "photo", base.exposure)
            return self._once("compared", (base.generation, base.exposure), draw)
        if kind is None or optics is None or layout.frame_px is None:
            if self.is_drawing:
                self._stop_snapshot()
            return None
        record = base.generation, base.views, base.previews, optics, layout.frame_px.size, layout.part
        pixels = self._draw_snapshot(record, RenderSettings(optics, layout.frame_px.size, layout.part))
        if pixels is None:
            return None
        return self._once("compared", record, lambda: self._passes.show("snapshot", pixels))

    def _draw_snapshot(self, record: object, settings: RenderSettings) -> NDArray[Any] | None:
        """Draw the snapshot's picture for about SNAPSHOT_BUDGET_S; None until it is finished."""
        if self._snapshot is None or self._snapshot[0] != record:
            self._stop_snapshot()
            self._snapshot = record, self._scene_view.renderer.start_picture(settings)
        drawing = self._snapshot[1]
        if not drawing.is_done:
            drawing.advance(SNAPSHOT_BUDGET_S)
            if drawing.is_done:
                drawing.stop()
        return drawing.image if drawing.is_done else None

    def _stop_snapshot(self) -> None:
        if self._snapshot is not None:
            self._snapshot[1].stop()
            self._snapshot = None

    def _probe_at(self, hover: Hover, state: AppState, scene: Scene, field: LightFieldTexture) -> Probe:
        at = (hover.x_px + 0.5) / scene.width, (hover.y_px + 0.5) / scene.height
        drawn = self._scene_view.picture_drawn
        part = drawn.part if drawn is not None else WHOLE
        rgb = self._scene_view.renderer.read_pixel((at[0] - part.x) / part.width, (at[1] - part.y) / part.height)
        return Probe(rgb, self._origin(hover, state, scene, field))

    def _origin(self, hover: Hover, state: AppState, scene: Scene, field: LightFieldTexture) -> Origin:
        """Return the origin of the surface under the pointer, by the view nearest to the eye."""
        if scene.plan is None:
            return "from disk"
        eye = state.optics.eye
        view: ViewIndex = tuple(nearest_present(field.present)[view_near(eye, field.grid)].tolist())
        packed = self._inpainted.get(view)
        if packed is not None and hover.disparity is not None:
            t, s = scene.grid.offset(*view)
            x = round(hover.x_px - hover.disparity * (s - eye.s))
            y = round(hover.y_px - hover.disparity * (t - eye.t))
            if 0 <= x < scene.width and 0 <= y < scene.height and packed[y, x // 8] >> (7 - x % 8) & 1:
                return "inpainted"
        return "photo" if eye == scene.grid.offset(*scene.grid.centre) else "generated"
