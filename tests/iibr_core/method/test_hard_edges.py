from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates, zoom

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.depth.edges.refine import refine
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.evaluation.warp import reference_warp
from iibr_core.method.light_field import ViewMaker
from iibr_core.stages import Stages
from iibr_core.types import FloatImage, GridShape, ViewOffset
from tests.iibr_core.scenes import smooth_texture

HEIGHT, WIDTH, FOREGROUND = 96, 128, 2.0
SLANT = 0.004
"""Of the wall: its disparity rises by so much a pixel, and is 0 in the middle."""
SAMPLES = 4
"""A pixel of the truth is the mean of SAMPLES x SAMPLES points, in linear light."""
GRID = GridShape(5, 5)
CORNERS = [ViewOffset(t, s) for t in (-2.0, 2.0) for s in (-2.0, 2.0)]
MARGIN = 16

Places = np.ndarray


def stripes(period: float, width: float, along: Places) -> np.ndarray:
    return np.abs((along + period / 2) % period - period / 2) < width / 2


def hair(y: Places, x: Places) -> np.ndarray:
    return np.any([np.abs(x - 20 - 11 * k - 4 * np.sin(y / (9 + k)) - 0.1 * (y - 48)) < 0.6 for k in range(9)], axis=0)


OUTLINES: dict[str, Callable[[Places, Places], np.ndarray]] = {
    "disc": lambda y, x: np.hypot(y - 48, x - 64) < 26,
    "ridge of one pixel": lambda y, x: np.abs(x - 64 - 0.2 * (y - 48)) < 0.5,
    "mesh": lambda y, x: (stripes(9, 2, x + 0.3 * y) | stripes(9, 2, y - 0.3 * x)) & (np.hypot(y - 48, x - 64) < 40),
    "hair": hair,
    "slats": lambda y, x: stripes(10, 6, y + 0.08 * x) & (abs(x - 64) < 40),
    "glass": lambda y, x: 0.35 * (np.hypot(y - 48, x - 64) < 26),
}
"""How much of the light at y and x, in pixels of the photo, is the foreground's."""

MAPS: dict[str, Callable[[FloatImage], FloatImage]] = {
    "exact": lambda exact: exact,
    "noise": lambda exact: exact + np.random.default_rng(5).normal(0, 0.03, exact.shape),
    "60 levels": lambda exact: np.round(exact * 26.5) / 26.5,
    "blurred": lambda exact: gaussian_filter(exact, 1.5),
    "half": lambda exact: zoom(
        exact.reshape(HEIGHT // 2, 2, WIDTH // 2, 2).mean(axis=(1, 3)), 2, order=1, grid_mode=True, mode="nearest"
    ),
}

CASES = [
    ("disc", "exact", 42.1),
    ("ridge of one pixel", "exact", 46.7),
    ("mesh", "60 levels", 33.3),
    ("hair", "noise", 35.9),
    ("hair", "blurred", 20.7),
    ("slats", "half", 25.2),
    ("glass", "exact", 32.7),
]
"""Outline, map, and half a decibel below what the views reach. A plain warp sees 25.1 (hair) to 44.9 dB of what is
visible with exact maps, 19.1 (mesh) to 32.7 with blurred ones.
"""


def texture(y: Places, x: Places, seed: int) -> np.ndarray:
    values = smooth_texture(HEIGHT + 2 * MARGIN, WIDTH + 2 * MARGIN, seed)
    at = np.stack([y, x]) + MARGIN
    return np.stack([map_coordinates(values[..., c], at, order=1, mode="nearest") for c in range(3)], axis=-1)


@cache
def view_of(outline: str, offset: ViewOffset) -> FloatImage:
    """(H, W, 3), sRGB-encoded."""
    y, x = ((np.arange(n * SAMPLES) + 0.5) / SAMPLES - 0.5 for n in (HEIGHT, WIDTH))
    v, u = np.meshgrid(y, x, indexing="ij")
    # On the wall x + d(x) s is solved for x.
    on_wall = WIDTH / 2 + (u - WIDTH / 2) / (1 - SLANT * offset.s)
    wall = texture(v + SLANT * (on_wall - WIDTH / 2) * offset.t, on_wall, 0) * np.float32([0.5, 0.8, 1.0])
    v, u = v + FOREGROUND * offset.t, u + FOREGROUND * offset.s
    share, front = OUTLINES[outline](v, u)[..., None], texture(v, u, 1) * np.float32([1.0, 0.5, 0.3])
    light = linear_from_srgb(wall) * (1 - share) + linear_from_srgb(front) * share
    pixels = light.reshape(HEIGHT, SAMPLES, WIDTH, SAMPLES, 3).mean(axis=(1, 3))
    return np.asarray(srgb_from_linear(pixels.astype(np.float32)), np.float32)


@pytest.mark.parametrize(("outline", "given", "least"), CASES)
def test_views_of_hard_edges_stay_within_bounds(outline, given, least) -> None:
    photo, (y, x) = view_of(outline, ViewOffset(0.0, 0.0)), np.indices((HEIGHT, WIDTH))
    exact = np.where(OUTLINES[outline](y, x) > 0, FOREGROUND, SLANT * (x - WIDTH / 2))
    disparity = np.asarray(MAPS[given](exact), np.float32)
    field = [GRID.offset(row, column) for row, column in np.ndindex(*GRID)]
    whole, visible, plain = [], [], []
    views = ViewMaker(photo, refine(photo, disparity), field, stages=Stages(ray_transformer=False))
    for offset in CORNERS:
        made, truth = views.view(offset).colors, view_of(outline, offset)
        warped = reference_warp(photo, disparity, offset)
        whole.append(bounded_psnr(made, truth))
        visible.append(bounded_psnr(made, truth, warped.visible))
        plain.append(bounded_psnr(warped.colors, truth, warped.visible))
    assert np.mean(whole) > least
    # Nowhere worse than the photo's pixels moved plainly.
    assert np.mean(visible) > np.mean(plain) - 0.1
