"""What inspection shows beside and over the picture, drawn from the stage's light field when its record changed.

Everything is called from the one GL thread.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.exports.render_settings import RenderSettings
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewUpdate
from viewer.background.comparison import ComparisonInputs, EntropyReady, PairReady, PairScored
from viewer.background.comparison_worker import ComparisonResult
from viewer.background.job_threads import Failed
from viewer.display.scene_view import SceneView
from viewer.gpu.context import GLContext
from viewer.gpu.inspection_passes import InspectionPasses, Line, OverlayStyle
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.refocus.picture_drawing import PictureDrawing
from viewer.gpu.refocus.view_sampling import nearest_present
from viewer.model import messages
from viewer.model.action import do
from viewer.model.actions import Action
from viewer.model.colormap import VIRIDIS
from viewer.model.inspection_request import (
    DIFFERENCE_GAIN,
    NO_INSPECTION_TEXTURES,
    InspectionRequest,
    InspectionTextures,
    sheet_cells,
    view_near,
)
from viewer.model.layout import Layout, whole_pixels
from viewer.model.state.app_state import AppState, Hover
from viewer.model.state.inspection import Compare, Comparison, Origin, Pair, PairCompared, Probe, SetOverlay, ViewIndex
from viewer.model.state.notices import Notice

INPAINTED_RGB = (255, 184, 60)
SNAPSHOT_BUDGET_S = 0.025
"""Time a turn for drawing the snapshot's picture."""
ROUNDING = 1
"""Of 255: by so much one picture differs that was summed up in other steps."""


@dataclass(frozen=True)
class _ViewImage:
    """What images depend on: the field, how many views were uploaded to it, brightness as a factor, how often edited
    depth was shown in its place.
    """

    generation: int
    views: int
    exposure: float
    previews: int


class InspectionView:
    """Draws what the state asks for, and keeps what views say beside their colours."""

    def __init__(self, gl: GLContext, scene_view: SceneView) -> None:
        self._scene_view = scene_view
        self._passes = InspectionPasses(gl.ctx, scene_view.renderer.programs)
        self._drawn: dict[str, tuple[object, int]] = {}
        self._on_sheet: frozenset[tuple[ViewIndex, int]] = frozenset()
        self._inpainted: dict[ViewIndex, NDArray[np.uint8]] = {}
        self._entropy: EntropyReady | None = None
        self._pair: PairReady | None = None
        self._kept: tuple[object, PictureDrawing] | None = None
        self._probed: tuple[object, Probe | None] = (None, None)

    def open(self) -> None:
        """Another scene is on the screen."""
        self._inpainted.clear()
        self._drawn.clear()
        self._entropy = self._pair = None
        self._stop_snapshot()

    @property
    def is_drawing(self) -> bool:
        """Whether the picture of the snapshot is being drawn."""
        return self._kept is not None and not self._kept[1].is_done

    def add(self, view: ViewUpdate) -> None:
        """Keep what of a view was inpainted, eight pixels a byte."""
        if view.inpainted is not None:
            self._inpainted[view.row, view.column] = np.packbits(view.inpainted, axis=1)

    def draw(self, state: AppState, layout: Layout) -> InspectionTextures:
        """Draw what changed and say where it is."""
        scene, field = state.scene, self._scene_view.renderer.field
        if scene is None or field is None or layout.frame_px is None or not field.present.any():
            return NO_INSPECTION_TEXTURES
        view = self._scene_view
        base = _ViewImage(view.generation, view.views_uploaded, 2.0**state.optics.exposure_stops, view.previews)
        names = {"overlay": self._overlay(state, scene, field, layout, base)}
        names["minimap"] = self._minimap(field, layout, base)
        if field.grid == scene.grid:  # else: only the photo's own view is there, or what is being done to its depth
            names |= self._strips(state, scene, field, layout, base)
            names["sheet"] = self._sheet(field, layout, base) if state.inspection.shows_grid else None
            names |= self._comparison_images(state, scene, field, base)
            names |= self._kept_images(state, layout.frame_px.size, layout.part, base)
        return self._textures(names)

    def probe(self, state: AppState) -> Probe | None:
        """What is known of the picture under the pointer, where that is asked for."""
        scene, hover, field = state.scene, state.hover, self._scene_view.renderer.field
        if scene is None or hover is None or field is None or not state.inspection.shows_values:
            return None
        view = self._scene_view
        asked = hover, state.optics, view.generation, view.views_uploaded, view.renderer.report
        if self._probed[0] != asked:
            self._probed = asked, self._probe_at(hover, state, scene, field)
        return self._probed[1]

    def inputs(self, request: InspectionRequest | None, state: AppState) -> ComparisonInputs | None:
        """What this request is made from; None while that is not there."""
        scene, view = state.scene, self._scene_view
        field = view.renderer.field
        if request is None or scene is None or field is None or view.generation != request.generation:
            return None
        if view.loaded is not None and scene.plan is not None:
            return ComparisonInputs(view.loaded, scene.plan, inpaint=scene.source.inpaint)
        if field.grid != scene.grid:
            return None
        stored = self._passes.read_view(field, *request.view)
        return None if stored is None else ComparisonInputs(stored=stored)

    def take(self, result: ComparisonResult) -> list[Action]:
        """Show what was found; what is to be known of it comes back as actions."""
        match result:
            case PairReady(request):
                self._pair = result
                return [PairCompared(Pair(request.generation, _comparison_of(request), request.view))]
            case PairScored(request, psnr_db, flip):
                return [PairCompared(Pair(request.generation, _comparison_of(request), request.view, psnr_db, flip))]
            case EntropyReady():
                self._entropy = result
                return []
            case Failed(id=request, message=message):
                is_overlay = request is not None and request.kind == "entropy"
                off = SetOverlay(None) if is_overlay else Compare(None)
                return [do(messages.notify, Notice(message, is_error=True)), off]

    def release(self) -> None:
        """Free the GL objects."""
        self._stop_snapshot()
        self._passes.release()

    def _textures(self, names: dict[str, int | None]) -> InspectionTextures:
        return InspectionTextures(**names, shown=tuple(self._drawn[name][0] for name in names if names[name]))

    def _minimap(self, field: LightFieldTexture, layout: Layout, base: _ViewImage) -> int | None:
        """The photo, very small."""
        row, column = field.grid.centre
        if layout.minimap is None or not field.present[row, column]:
            return None
        size_px = layout.in_pixels(layout.minimap).size
        draw = partial(self._passes.draw_view, field, row, column, "minimap", base.exposure, size_px)
        return self._once("minimap", (base.generation, base.exposure, size_px), draw)

    def _once(self, name: str, record: object, draw: Callable[[], int]) -> int:
        """The image of this name, drawn again only if its record changed."""
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
        """All views; those that came since the last time, or came again, are drawn."""
        assert layout.frame_px is not None
        size_px = layout.frame_px.size
        record = base.generation, base.exposure, size_px, field.stride
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
        assert layout.frame_px is not None
        size_px, part = layout.frame_px.size, layout.part
        kind, optics = state.inspection.overlay, state.optics
        view: ViewIndex = tuple(nearest_present(field.present)[view_near(optics.eye, field.grid)].tolist())
        if kind is None or not field.has_disparity[view] or (kind != "disparity" and field.grid != scene.grid):
            return None
        values, looked_up = None, None
        if kind == "inpainted":
            values = self._mask_of(view, field)
        elif kind == "entropy":
            if self._entropy is None or self._entropy.request.generation != base.generation:
                return None
            looked_up, values = self._entropy.request, self._entropy.entropy
            view = looked_up.view
        colors = (INPAINTED_RGB,) * len(VIRIDIS) if kind == "inpainted" else VIRIDIS
        ends = scene.disparity_range_px if kind == "disparity" else (0.0, 1.0)
        ends = ends if ends[1] > ends[0] else (ends[0] - 0.5, ends[0] + 0.5)
        record = base, kind, view, optics.eye, optics.dolly, size_px, part, state.inspection.opacity, looked_up
        if not field.present[view]:
            return None

        def draw() -> int:
            style = OverlayStyle(colors, ends, state.inspection.opacity, is_mask=kind == "inpainted")
            return self._passes.draw_overlay(field, optics, view, size_px, style, values, part)

        return self._once("overlay", record, draw)

    def _mask_of(self, view: ViewIndex, field: LightFieldTexture) -> NDArray[np.uint8]:
        packed = self._inpainted.get(view)
        if packed is None:
            return np.zeros((field.height, field.width), np.uint8)
        return np.unpackbits(packed, axis=1, count=field.width) * np.uint8(255)

    def _comparison_images(
        self, state: AppState, scene: Scene, field: LightFieldTexture, base: _ViewImage
    ) -> dict[str, int | None]:
        kind, pair = state.inspection.comparison, self._pair
        if kind in ("kept", "difference"):
            return {}
        if kind == "photo":
            draw = partial(self._passes.draw_view, field, *scene.grid.centre, "photo", base.exposure)
            return {"left": self._once("left", (base.generation, base.exposure), draw), "right": None}
        if kind is None or pair is None or (pair.request.generation, pair.request.kind) != (base.generation, kind):
            return {"left": None, "right": None}
        left = self._once("left", (pair.request, "left"), lambda: self._passes.show("left", pair.left))
        right = self._once("right", (pair.request, "right"), lambda: self._passes.show("right", pair.right))
        return {"left": left, "right": right}

    def _kept_images(self, state: AppState, size_px: ScreenSize, part: Rect, base: _ViewImage) -> dict[str, int | None]:
        """The picture of the snapshot, or its difference from the present one once that is finished."""
        kind, optics = state.inspection.comparison, state.inspection.kept
        if optics is None or kind not in ("kept", "difference"):
            if self.is_drawing:
                self._stop_snapshot()
            return {}
        record = base.generation, base.views, base.previews, optics, size_px, part
        kept = self._snapshot(record, RenderSettings(optics, size_px, part))
        if kept is None:
            return {"left": None, "right": None}
        if kind == "kept":
            return {"left": self._once("left", record, lambda: self._passes.show("left", kept)), "right": None}
        renderer, drawn = self._scene_view.renderer, self._scene_view.picture_drawn
        if not (renderer.is_converged and self._scene_view.shows_all_views()):
            before = self._drawn.get("difference")
            return {"difference": before[1] if before else None}
        return {"difference": self._once("difference", (record, drawn), lambda: self._show_difference(kept))}

    def _snapshot(self, record: object, settings: RenderSettings) -> NDArray[Any] | None:
        """Draw the snapshot's picture for about SNAPSHOT_BUDGET_S; None until it is finished."""
        if self._kept is None or self._kept[0] != record:
            self._stop_snapshot()
            self._kept = record, self._scene_view.renderer.start_picture(settings)
        drawing = self._kept[1]
        if not drawing.is_done:
            drawing.advance(SNAPSHOT_BUDGET_S)
            if drawing.is_done:
                drawing.stop()
        return drawing.image if drawing.is_done else None

    def _stop_snapshot(self) -> None:
        if self._kept is not None:
            self._kept[1].stop()
            self._kept = None

    def _show_difference(self, kept: NDArray[Any]) -> int:
        """Black where nothing differs but by rounding; amplified, for what differs little is what one looks for."""
        difference = np.abs(self._scene_view.renderer.read_image().astype(np.int16) - kept)
        difference[difference <= ROUNDING] = 0
        return self._passes.show("difference", np.minimum(difference * DIFFERENCE_GAIN, 255).astype(np.uint8))

    def _probe_at(self, hover: Hover, state: AppState, scene: Scene, field: LightFieldTexture) -> Probe:
        seen = None
        if hover.disparity is not None and field.has_disparity.any():
            shows = self._passes.seen_in(field, state.optics.eye, hover.x_px, hover.y_px, hover.disparity)
            seen = int(shows.sum())
        at = (hover.x_px + 0.5) / scene.width, (hover.y_px + 0.5) / scene.height
        drawn = self._scene_view.picture_drawn
        part = drawn.part if drawn is not None else WHOLE
        rgb = self._scene_view.renderer.read_pixel((at[0] - part.x) / part.width, (at[1] - part.y) / part.height)
        return Probe(rgb, seen, int(field.present.sum()), self._origin(hover, state, scene, field))

    def _origin(self, hover: Hover, state: AppState, scene: Scene, field: LightFieldTexture) -> Origin:
        """By what the view nearest to the eye says of the surface under the pointer."""
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


def _comparison_of(request: InspectionRequest) -> Comparison:
    assert request.kind != "entropy"  # the kept state is compared without a request
    return request.kind
