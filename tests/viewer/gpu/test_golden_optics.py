"""Every part of the lens and of inspection on hard fields, against golden pictures: sheets of them, one for each field.

Rows of views stand closer together than columns, their number is even, the disc lies beside the middle, and lamps clip.
"""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from iibr_core.beyond.hidden_surfaces import SeenBehind, hidden_surface
from iibr_core.beyond.optics import ApertureMask, ApertureShape, Optics
from iibr_core.color import encoded_from_stored, stored_from_encoded
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.gloss.geometry import SceneGeometry
from iibr_core.gloss.settings import Gloss, GlossLight, GlossStroke, GlossSurface
from iibr_core.gloss.shading import make_gloss_maps
from iibr_core.method.farthest_views import outer_views_of_grid
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import DISPLAY_P3, GridShape, ViewOffset
from tests.image_compare import DEPTH_EDGES, assert_golden
from tests.viewer.gpu.scenes import TwoPlanes, open_field
from viewer.gpu.inspection_passes import InspectionPasses, Line, OverlayStyle
from viewer.model.colormap import VIRIDIS
from viewer.model.layout import PixelRect

GOLDEN = Path(__file__).parents[2] / "golden" / "optics"
GRID, ROW_STEP = GridShape(4, 5), 0.6
CENTRE, BESIDE = ViewOffset(0.0, 0.0), ViewOffset(0.6, -1.3)
COLUMNS = 4
"""Number of pictures in a row of a sheet."""


@dataclass(frozen=True)
class Lamps(TwoPlanes):
    """Two planes with a lamp on each, as bright as `lamp`."""

    lamp: float = 1.0

    def seen(self, x, y, t, s):
        colors, disparity = super().seen(x, y, t, s)
        for plane, left, top in ((self.background, 0.8, 0.25), (self.foreground, 0.38, 0.62)):
            away = np.hypot(x + plane * s - left * self.width, y + plane * t - top * self.height)
            colors = np.where(((away < 3) & (disparity == np.float32(plane)))[..., None], self.lamp, colors)
        return colors, disparity

    def stored(self, offset):
        """Colours as they are stored, and disparity, of the view at an offset in view steps."""
        y, x = np.indices((self.height, self.width)).astype(float)
        colors, disparity = self.seen(x, y, ROW_STEP * offset.t, offset.s)
        return stored_from_encoded(colors.astype(np.float32), self.lamp > 1), disparity


SCENE = Lamps(80, 54, background=-2.0, foreground=3.0, radius_px=14.0, across=0.4, down=0.55)
BRIGHT = replace(SCENE, lamp=2.5)
SIZE = ScreenSize(SCENE.width, SCENE.height)
STROKES = GlossStroke(((0.3, 0.5), (0.5, 0.6)), 0.12), GlossStroke(((0.35, 0.5),), 0.05, erases=True)
SURFACE = GlossSurface(nearest=0.3, strokes=STROKES)
GLOSS = Gloss(SURFACE, roughness=0.45, reflectance=0.3, light=GlossLight((0.5, -0.4, -1), (0.6, 0.4, 0.3)))
MIRROR = replace(GLOSS, roughness=0.15, light=GlossLight((-0.3, 0.1, -1), (0.2, 0.3, 0.3), radius_deg=12.0))


def open_hard_field(renderer, scene=SCENE, grid=GRID, views=None, is_warped=True):
    """Let a renderer draw the scene. views: of those that are there, None for all."""
    open_field(renderer, grid, scene.width, scene.height, scene.lamp > 1, is_warped, ROW_STEP)
    for at in np.ndindex(*grid) if views is None else views:
        colors, disparity = scene.stored(grid.offset(*at))
        renderer.field.upload(*at, colors, disparity if is_warped else None)
    if is_warped and views is None:
        outer = outer_views_of_grid(GRID)
        seen = [SeenBehind(ViewOffset(ROW_STEP * at.t, at.s), *scene.stored(at), None) for at in outer]
        colors, disparity = scene.stored(CENTRE)
        renderer.field.set_hidden(hidden_surface(encoded_from_stored(colors), disparity, max(GRID), seen))


def open_bright(renderer):
    open_hard_field(renderer, BRIGHT)
    renderer.field.color_space = DISPLAY_P3


def open_glossy(renderer):
    open_hard_field(renderer)
    colors, disparity = SCENE.stored(CENTRE)
    maps = make_gloss_maps(SURFACE, encoded_from_stored(colors), disparity, SceneGeometry(90.0, -4.0))
    renderer.field.set_gloss(maps)


MASK = ApertureMask("corner", 2, 3, bytes([255, 0, 128, 0, 255, 0]))
LENS = Optics(BESIDE, focus_disparity=-1.0, aperture_diameter=3.0)
LENSES = [
    Optics(BESIDE),
    Optics(ViewOffset(-2.0, 2.0)),
    Optics(ViewOffset(-2.6, 3.1), dolly=1.0),
    Optics(BESIDE, dolly=-2.0, focus_disparity=1.0, aperture_diameter=2.0),
    LENS,
    replace(LENS, focus_disparity=3.0, focus_tilt=(2.0, -1.5), focus_range=0.5),
    replace(LENS, aperture_shape=ApertureShape("polygon", blades=5, rotation_deg=20.0, roundness=0.3)),
    replace(LENS, aperture_shape=ApertureShape("ring", ring_inner=0.7), highlight_recovery=0.7, exposure_stops=-1.0),
    replace(LENS, aperture_shape=ApertureShape("cat_eye", cat_eye=0.9), highlight_recovery=0.3),
    replace(LENS, aperture_shape=ApertureShape("mask", mask=MASK, rotation_deg=30.0), highlight_recovery=1.0),
    replace(LENS, eye=CENTRE, aperture_diameter=9.0, focus_range=0.4),
    replace(LENS, eye=ViewOffset(1.0, 2.0), focus_disparity=2.5, aperture_diameter=0.4, highlight_recovery=1.0),
]
"""Through the whole field, of which each part of the lens is seen."""
FIELDS = {
    "all": (open_hard_field, LENSES),
    "bright": (open_bright, [LENSES[0], LENSES[5], LENSES[7], LENSES[10]]),
    "glossy": (
        open_glossy,
        [
            Optics(gloss=GLOSS), Optics(BESIDE, gloss=MIRROR), Optics(ViewOffset(0.4, 0.7), dolly=2.5, gloss=GLOSS),
            replace(LENS, gloss=GLOSS, dolly=1.0, focus_disparity=3.0),
        ],
    ),
    "some": (
        lambda renderer: open_hard_field(renderer, views=[(2, 2), (0, 0), (3, 1), (1, 4)]),
        [LENSES[0], LENSES[2], LENSES[3], LENSES[10]],
    ),
    "flat": (
        lambda renderer: open_hard_field(renderer, is_warped=False),
        [replace(LENS, aperture_diameter=0.0), LENS, LENSES[3], LENSES[9]],
    ),
    "one": (lambda renderer: open_hard_field(renderer, grid=GridShape(1, 1)), [LENSES[0], LENSES[2], LENS, LENSES[10]]),
}  # fmt: skip


def check(name, pictures, folder, regenerates):
    """Compare pictures of one size with those of a golden sheet, each by itself."""
    rows = [np.concatenate(pictures[i : i + COLUMNS], axis=1) for i in range(0, len(pictures), COLUMNS)]
    tile = pictures[0].shape[:2]
    assert_golden(np.concatenate(rows), f"optics/{name}", DEPTH_EDGES, folder, regenerates, tile)


@pytest.mark.parametrize("name", FIELDS)
def test_pictures_through_lenses_are_the_golden_ones(renderer, name, tmp_path, regenerate_golden):
    require_llvmpipe(renderer)
    check(name, drawn(renderer, name), tmp_path, regenerate_golden)


def drawn(renderer, name):
    """Return the pictures of a field."""
    open_it, lenses = FIELDS[name]
    open_it(renderer)
    return [renderer.converged_picture(RenderSettings(optics, SIZE)) for optics in lenses]


def require_llvmpipe(renderer):
    if "llvmpipe" not in renderer.gl.renderer:
        pytest.skip(f"golden images belong to llvmpipe, this is {renderer.gl.renderer}")


PART = Rect(0.3, 0.2, 0.5, 0.6)
SOME = [(0, 0), (2, 2), (2, 0), (2, 3), (0, 3), (3, 3)]
"""Views of which one row and one column have several, and lack others."""
STYLE = OverlayStyle(VIRIDIS, (-2.5, 3.5), opacity=0.6)


def inspected(passes, field, values):
    """Yield the images (H, W, 3) of every pass of inspection, all of one size; overlays on white, by their opacity."""
    for line, exposure, gloss in (
        (Line(2, 0.55), 1.0, None),
        (Line(3, 0.4, is_upright=True, span=(0.2, 0.7)), 0.5, None),
        (Line(2, 0.6, span=(0.1, 0.6)), 1.0, GLOSS),
        (Line(3, 0.4, is_upright=True), 2.0, MIRROR),
        (Line(0, 0.9), 1.0, MIRROR),
    ):
        passes.draw_epi(field, line, SIZE, exposure, gloss)
        yield passes.read("upright" if line.is_upright else "across")[..., :3]
    for view, exposure in (((0, 0), 2.0), ((1, 1), 1.0)):
        passes.draw_view(field, *view, "view", exposure, SIZE)
        yield passes.read("view")[..., :3]
    passes.start_sheet(SIZE)
    for view, cell in (((2, 3), PixelRect(2, 3, 26, 18)), ((1, 1), PixelRect(30, 5, 40, 28))):
        passes.draw_on_sheet(field, *view, cell, 1.0)
    yield passes.read("sheet")[..., :3]
    for optics, part, style, shown in (
        (Optics(BESIDE, dolly=1.5), WHOLE, STYLE, None),
        (Optics(BESIDE), PART, STYLE, values),
        (Optics(ViewOffset(0.2, 1.7), dolly=-2.0), PART, STYLE._replace(opacity=1.0), None),
        (Optics(ViewOffset(-1.0, 1.4)), WHOLE, STYLE._replace(is_mask=True, map_ends=(0.0, 1.0)), values),
    ):
        passes.draw_overlay(field, optics, GRID.centre, SIZE, style, shown, part)
        overlay = passes.read("overlay")
        share = overlay[..., 3:] / 255
        yield np.rint(share * overlay[..., :3] + 255 * (1 - share)).astype(np.uint8)


def test_images_of_inspection_are_the_golden_ones(gl, renderer, tmp_path, regenerate_golden):
    """EPIs across and down with gloss, views that are there and not, made smaller, overlays, of a Display P3 photo."""
    require_llvmpipe(renderer)
    open_hard_field(renderer, views=SOME)
    renderer.field.color_space = DISPLAY_P3
    colors, disparity = SCENE.stored(CENTRE)
    renderer.field.set_gloss(
        make_gloss_maps(SURFACE, encoded_from_stored(colors), disparity, SceneGeometry(90.0, -4.0))
    )
    values = np.rint(np.clip(colors[..., 0] * 1.3, 0, 255)).astype(np.uint8)
    passes = InspectionPasses(gl.ctx, renderer.programs)
    check("inspection", list(inspected(passes, renderer.field, values)), tmp_path, regenerate_golden)
    passes.release()
