"""Surfaces that rise like blurred steps: slopes, hills, folds. They come back as they were, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest

from iibr_core.depth.edges.refine import refine
from iibr_core.training.degradation import blur, coarsen, quantise
from tests.iibr_core.scenes import smooth_texture

HEIGHT, WIDTH = 96, 128
Y, X = np.mgrid[:HEIGHT, :WIDTH] - np.array([HEIGHT / 2, WIDTH / 2])[:, None, None]


def patches() -> np.ndarray:
    """A photo of strong edges that belong to no depth: cells of random colours about random points."""
    rng = np.random.default_rng(11)
    points, colors = (rng.random((40, 2)) - 0.5) * [HEIGHT, WIDTH], rng.random((40, 3))
    nearest = ((Y[..., None] - points[:, 0]) ** 2 + (X[..., None] - points[:, 1]) ** 2).argmin(-1)
    return colors[nearest].astype(np.float32)


def hills(width: float) -> np.ndarray:
    values = blur(np.random.default_rng(3).random((HEIGHT, WIDTH), np.float32), width)
    return 2 * (values - values.mean()) / values.std()


PHOTOS = smooth_texture(HEIGHT, WIDTH), patches()
SURFACES = {
    "steep plane": -0.9 * X,
    "plane": 0.3 * X + 0.05 * Y,
    "fine relief": 0.2 * 12 / 6 * np.cos(2 * np.pi * (X + 0.6 * Y) / 12),
    "wide relief": 0.5 * 64 / 6 * np.cos(2 * np.pi * X / 64),
    "bump": 3 * np.exp(-(X**2 + Y**2) / (2 * 15**2)),
    "cushion": 4 * (1 - np.clip(np.abs(X) / 38, 0, 1) ** 4) * (1 - np.clip(np.abs(Y) / 38, 0, 1) ** 4),
    "hills": hills(12),
    "rounded step": 3 * np.tanh((X + 0.3 * Y) / 8),  # as flat on both sides as a blurred step: only the photo tells
}


@pytest.mark.parametrize("surface", SURFACES)
def test_smooth_surfaces_stay_as_they_are_and_coarse_levels_make_no_stairs_of_them(surface: str) -> None:
    smooth = SURFACES[surface].astype(np.float32)
    levels = [quantise(smooth, float(np.ptp(smooth)) / count) for count in (255, 24)]
    for photo in PHOTOS:
        for disparity in (smooth, *(() if surface == "rounded step" else (*levels, coarsen(levels[0], 2)))):
            np.testing.assert_array_equal(refine(photo, disparity), disparity)


@pytest.mark.parametrize("sigma", [1.0, 4.0])
def test_only_the_soft_side_of_a_map_is_refined(sigma: float) -> None:
    """Discs from left to right: the left ones exact, the right ones blurred."""
    y, x = np.mgrid[:200, :400]
    rng, exact = np.random.default_rng(3), np.zeros((200, 400), np.float32)
    photo = 0.4 * np.tile(smooth_texture(200, 100), (1, 4, 1))
    for at in np.arange(20, 400, 40):
        disc = np.hypot(x - at, y - rng.uniform(40, 160)) < rng.uniform(12, 30)
        exact[disc], photo[disc] = rng.uniform(1, 4), 0.3 * photo[disc] + 0.6 * rng.random(3)
    share = np.clip((np.arange(400) - 190) / 20, 0, 1)
    given = ((1 - share) * exact + share * blur(exact, sigma)).astype(np.float32)
    refined = refine(photo.astype(np.float32), given)
    np.testing.assert_array_equal(refined[:, :184], given[:, :184])
    soft = (slice(None), slice(216, None))
    assert np.abs(refined - exact)[soft].mean() < 0.5 * np.abs(given - exact)[soft].mean()
