"""Pictures woven for lenticular displays: against a slow twin, and seen through a simulated sheet of lenses."""

import json
from functools import cache

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from iibr_core.beyond.optics import Optics
from iibr_core.evaluation.metrics import psnr
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.formats.lenticular import parse_calibration
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ImageSize
from viewer.gpu.programs import ProgramCache
from viewer.gpu.weaving import Weaver
from viewer.model.stereo import Weave

PORTRAIT = {
    "configVersion": "1.0", "serial": "LKG-PORT-00000", "pitch": {"value": 52.5927}, "slope": {"value": -7.0835},
    "center": {"value": 0.8168}, "DPI": {"value": 324.0}, "screenW": {"value": 192.0}, "screenH": {"value": 256.0},
    "viewCone": {"value": 40.0}, "invView": {"value": 1.0}, "flipImageX": {"value": 0.0},
    "flipImageY": {"value": 0.0}, "flipSubp": {"value": 0.0},
}  # fmt: skip
"""Numbers of a real display; screens here are an eighth as wide and high."""
CELL_KEYS = "ROffsetX", "ROffsetY", "GOffsetX", "GOffsetY", "BOffsetX", "BOffsetY"
CELLS = {
    "landscape": [(-0.31, 0.25, 0.28, 0.25, 0.0, -0.25), (-0.31, -0.25, 0.28, -0.25, 0.0, 0.25)],
    "portrait": [(-0.25, -0.31, -0.25, 0.28, 0.25, 0.0), (0.25, -0.31, 0.25, 0.28, -0.25, 0.0)],
}
DISPLAYS = {
    "portrait": {},
    "landscape": {"pitch": 50.0693, "slope": -7.522, "center": 0.0764, "DPI": 283, "screenW": 320, "screenH": 180},
    "leaning right": {"pitch": 49.8, "slope": 5.48, "center": 0, "DPI": 338, "screenW": 256, "screenH": 160},
    "go": {"pitch": 80.7, "slope": -6.3, "center": -0.3, "DPI": 491, "screenW": 180, "screenH": 320},
    "inverted": {"invView": 0},
    "blue first": {"flipSubp": 1},
    "seen mirrored": {"flipImageX": 1},
    "upside down": {"flipImageY": 1},
    "cells in columns": {
        "pitch": 44.7506, "slope": -6.8746, "center": 0.1694, "DPI": 283, "screenW": 320, "screenH": 180,
        "CellPatternMode": 2, "subpixelCells": "landscape",
    },
    "cells in rows": {"pitch": 44.72, "slope": -7.45, "DPI": 283, "CellPatternMode": 4, "subpixelCells": "portrait"},
    "cells in fours": {"CellPatternMode": 3, "subpixelCells": "portrait"},
}  # fmt: skip
CHECKERBOARD = {"cells in a checkerboard": {"CellPatternMode": 1, "subpixelCells": "landscape"}}
"""An order without a display: these subpixels would leave some sides dark."""
VIEWS, TILE = 48, ImageSize(80, 60)
BLUR_PX = 5.0
"""A view has a subpixel of a colour in 48 pixels; what is smaller than about two of these distances is lost."""
PARALLAX = 0.004
"""Motion of the nearest surface from view to view, as a share of the width."""


def stated(name):
    cells = {key: [dict(zip(CELL_KEYS, cell)) for cell in value] for key, value in CELLS.items()}
    return PORTRAIT | {key: cells.get(value, {"value": value}) if isinstance(value, str) else {"value": value}
                       for key, value in (DISPLAYS | CHECKERBOARD)[name].items()}  # fmt: skip


def views():
    """Views (V, H, W, 3) of two crossing patterns, one that stays and one that moves to the left."""
    y, x = ((np.arange(side) + 0.5) / side for side in TILE)
    s = np.arange(VIEWS)[:, None, None]
    moving = x + PARALLAX * (s - VIEWS / 2)
    waves = [np.sin(38 * moving + 9 * y[:, None] + hue) + np.sin(17 * y[:, None] - 8 * x + 2 * hue) for hue in range(3)]
    return np.rint(127.5 + 55 * np.stack(waves, -1)).astype(np.uint8)


def display_of(name):
    return parse_calibration(json.dumps(stated(name)), "a display")


def woven(gl, name):
    """The views woven for a display."""
    programs, display = ProgramCache(gl.ctx), display_of(name)
    weaver, tile = Weaver(gl.ctx, programs), ScreenSize(TILE.width, TILE.height)
    eyes = (RenderSettings(Optics(), tile),) * VIEWS
    weave = Weave(eyes, display, ScreenSize(display.screen.width, display.screen.height), tile)
    try:
        weaver.prepare(weave)
        for i, view in enumerate(views()):
            sheet = weaver.tile(i, tile)
            texels = np.dstack([view[::-1], np.full(TILE, 255, np.uint8)])
            sheet.color_attachments[0].write(texels.tobytes(), sheet.viewport)
        weaver.weave(weave, tile)
        return weaver.screen.read()
    finally:
        weaver.release()
        programs.release()


@pytest.mark.parametrize("name", DISPLAYS)
def test_each_side_sees_its_view(gl, name):
    numbers, screen = plain(stated(name)), woven(gl, name)
    right = side_of_light(numbers)
    for view in (0, 1, 24, 47):
        picture = gathered(screen, right, view)
        picture = picture[:: -1 if numbers["flipImageY"] else 1, :: -1 if numbers["flipImageX"] else 1]
        scores = [psnr(picture, each) for each in softened(*picture.shape[:2])]
        assert int(np.argmax(scores)) == view
        assert scores[view] >= 30, f"view {view}: {scores[view]:.1f} dB"


@pytest.mark.parametrize("name", [*DISPLAYS, *CHECKERBOARD])
def test_the_shader_does_as_its_slow_twin(gl, name):
    drawn, expected = woven(gl, name).astype(float), twin(display_of(name))
    differs = np.abs(drawn - expected) > 2
    assert differs.mean() < 2e-3, "rounding may end a lens one subpixel earlier"


def plain(calibration):
    """The numbers of a calibration without what they are wrapped in."""
    return {key: value["value"] if isinstance(value, dict) else value for key, value in calibration.items()}


def side_of_light(numbers):
    """How far to the right the light of each subpixel leaves, from 0 to 1, (H, W, 3).

    Lenses are long cylinders; light leaves to the side that lies across the axis of its lens. Lengths in inches.
    """
    height, width = int(numbers["screenH"]), int(numbers["screenW"])
    row, column = np.indices((height, width))
    row = height - 1 - row
    cells = np.array([[cell[key] for key in CELL_KEYS] for cell in numbers.get("subpixelCells", [])]).reshape(-1, 3, 2)
    if len(cells):
        orders = [0 * row, (row + column) % 2, column % 2, (row + column % 2 * 2) % 4, row % 2]
        offsets = cells[orders[int(numbers["CellPatternMode"])] % len(cells)]
    else:
        thirds = np.array([0, 1, 2])[:: -1 if numbers["flipSubp"] else 1] / 3
        offsets = np.broadcast_to(np.stack([thirds, 0 * thirds], -1), (height, width, 3, 2))
    x = (column[..., None] + 0.5 + offsets[..., 0]) / numbers["DPI"]
    y = (row[..., None] + 0.5 + offsets[..., 1]) / numbers["DPI"]
    slope = numbers["slope"]
    if numbers["flipImageX"]:  # in a mirror the lenses lean to the other side
        x, slope = width / numbers["DPI"] - x, -slope
    leaning = np.arctan2(1, slope) if slope > 0 else np.arctan2(-1, -slope)
    lenses = (x * np.cos(leaning) + y * np.sin(leaning)) * numbers["pitch"] - numbers["center"]
    from_left_edge = lenses - np.floor(lenses)
    return 1 - from_left_edge if numbers["invView"] else from_left_edge


def gathered(screen, right, view):
    """What an eye sees that stands where a view belongs: the subpixels that shine there, with their gaps filled."""
    weights = np.clip(1 - np.abs(right * VIEWS - 0.5 - view), 0, None)
    light, shares = (gaussian_filter(each, (BLUR_PX, BLUR_PX, 0)) for each in (screen * weights, weights))
    return light / np.maximum(shares, 1e-9) / 255


@cache
def enlarged(height, width):
    """The views (V, H, W, 3) as large as a screen."""
    rows, columns = (interpolation(*sides) for sides in zip((height, width), TILE))
    wide = np.einsum("xt,vrtc->vrxc", columns, views() / np.float32(255), optimize=True)
    return np.einsum("yr,vrxc->vyxc", rows, wide, optimize=True)


def interpolation(size, texels):
    """The weights (size, texels) of linear interpolation between the middles of texels."""
    at = np.clip((np.arange(size)[:, None] + 0.5) * texels / size - 0.5, 0, texels - 1)
    return np.clip(1 - np.abs(at - np.arange(texels)), 0, None).astype(np.float32)


@cache
def softened(height, width):
    """The views as large as a screen, and no sharper than what can be gathered."""
    return gaussian_filter(enlarged(height, width), (0, BLUR_PX, BLUR_PX, 0))


def twin(display):
    """The woven picture, one colour after the other."""
    (height, width), large = display.screen, enlarged(*display.screen)
    large = large[:, :: -1 if display.is_mirrored[1] else 1, :: -1 if display.is_mirrored[0] else 1]
    row, column = np.indices((height, width))
    up = height - 1 - row
    orders = [0 * up, up % 2 != column % 2, column % 2, (up + column % 2 * 2) % 4, up % 2]
    offsets = np.array(display.cells)[orders[display.pattern].astype(int) % len(display.cells)]
    woven = np.empty((height, width, 3))
    for c in range(3):
        x, y = column + 0.5 + offsets[..., c, 0], up + 0.5 + offsets[..., c, 1]
        x = width - x if display.is_mirrored[0] else x
        across, upwards = display.lenses_per_px
        phase = np.mod(x * across + y * upwards - display.center, 1)
        view = np.clip((1 - phase if display.is_inverted else phase) * len(large) - 0.5, 0, len(large) - 1)
        left = view.astype(int)
        near, next_one = (large[each, row, column, c] for each in (left, np.minimum(left + 1, len(large) - 1)))
        woven[..., c] = near + (next_one - near) * (view - left)
    return woven * 255
