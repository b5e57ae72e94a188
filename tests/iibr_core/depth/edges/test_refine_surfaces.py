"""Surfaces that rise like blurred steps: slopes, hills, cushions, folds. They come back as they were, bit for bit."""

from __future__ import annotations

import numpy as np
import pytest

from iibr_core.depth.edges.refine import refine
from iibr_core.training.degradation import blur, coarsen, quantise
from tests.iibr_core.scenes import smooth_texture

HEIGHT, WIDTH = 120, 160


def places(height: int = HEIGHT, width: int = WIDTH) -> tuple[np.ndarray, np.ndarray]:
    y, x = np.mgrid[:height, :width].astype(float)
    return x, y


def patches(height: int = HEIGHT, width: int = WIDTH) -> np.ndarray:
    """A photo of strong edges that belong to no depth: cells of random colours about random points."""
    rng = np.random.default_rng(11)
    points, colors = rng.random((60, 2)) * [height, width], rng.random((60, 3))
    x, y = places(height, width)
    nearest = ((y[..., None] - points[:, 0]) ** 2 + (x[..., None] - points[:, 1]) ** 2).argmin(-1)
    return colors[nearest].astype(np.float32)


def grain(height: int = HEIGHT, width: int = WIDTH) -> np.ndarray:
    noise = np.random.default_rng(12).random((3, height, width), np.float32)
    return np.stack([np.clip(0.5 + 3 * (blur(channel, 1.2) - 0.5), 0, 1) for channel in noise], -1)


PHOTOS = {"smooth": smooth_texture(HEIGHT, WIDTH), "patches": patches(), "grain": grain()}


def relief(period: float, slope: float) -> np.ndarray:
    x, _ = places()
    return slope * period / (2 * np.pi) * np.cos(2 * np.pi * x / period)


def oblique_relief(period: float) -> np.ndarray:
    x, y = places()
    return 0.3 * period / 6 * np.cos(2 * np.pi * (x + 0.6 * y) / period)


def bump(radius: float) -> np.ndarray:
    x, y = places()
    return 3 * np.exp(-((x - 80) ** 2 + (y - 60) ** 2) / (2 * radius**2))


def cushion(size: float) -> np.ndarray:
    x, y = places()
    across, down = np.clip(np.abs(x - 80) / size, 0, 1), np.clip(np.abs(y - 60) / size, 0, 1)
    return 4 * (1 - across**4) * (1 - down**4)


def face() -> np.ndarray:
    x, y = places()
    head = 2 * np.exp(-(((x - 80) / 40) ** 4) - ((y - 60) / 50) ** 4)
    nose = 1.2 * np.exp(-(((x - 80) / 6) ** 2) - ((y - 65) / 14) ** 2)
    eyes = sum(np.exp(-(((x - at) / 9) ** 2) - ((y - 45) / 6) ** 2) for at in (62, 98))
    return head + nose - 0.5 * eyes


def hills(seed: int, width: float) -> np.ndarray:
    made = blur(np.random.default_rng(seed).random((HEIGHT, WIDTH), np.float32), width)
    return 2 * (made - made.mean()) / made.std()


def rounded_step(length: float) -> np.ndarray:
    """As flat on both sides as a blurred step: only the photo tells."""
    x, y = places()
    return 3 * np.tanh((x - 80 + 0.3 * (y - 60)) / length)


SURFACES = {
    **{f"plane {slope}": slope * (places()[0] - 80) for slope in (-0.9, -0.4, 0.05, 0.3, 0.6)},
    **{f"relief {p} {slope}": relief(p, slope) for p in (12, 64) for slope in (0.05, 0.2, 0.5)},
    **{f"oblique {p}": oblique_relief(p) for p in (12, 24, 48)},
    **{f"bump {r}": bump(r) for r in (8, 15, 25)},
    **{f"cushion {size}": cushion(size) for size in (22, 38, 60)},
    **{f"hills {w}": hills(w, w) for w in (6, 12, 18)},
    **{f"rounded step {length}": rounded_step(length) for length in (4, 8, 16)},
    "face": face(),
}


@pytest.mark.parametrize("photo", PHOTOS)
@pytest.mark.parametrize("surface", SURFACES)
def test_smooth_surfaces_stay_as_they_are(surface: str, photo: str) -> None:
    disparity = SURFACES[surface].astype(np.float32)
    np.testing.assert_array_equal(refine(PHOTOS[photo], disparity), disparity)


@pytest.mark.parametrize("surface", ["plane 0.3", "relief 64 0.2", "bump 25", "hills 12", "face"])
@pytest.mark.parametrize("levels", [255, 60, 24])
@pytest.mark.parametrize("factor", [1, 2])
def test_coarse_levels_make_no_stairs_of_slopes(surface: str, levels: int, factor: int) -> None:
    smooth = SURFACES[surface].astype(np.float32)
    disparity = coarsen(quantise(smooth, float(np.ptp(smooth)) / levels), factor)
    for photo in PHOTOS.values():
        np.testing.assert_array_equal(refine(photo, disparity), disparity)


@pytest.mark.parametrize("period", [16, 24, 40, 64])
@pytest.mark.parametrize("sigma", [1.0, 2.0, 4.0])
def test_a_relief_beside_blurred_edges_stays_as_it_is(period: int, sigma: float) -> None:
    x, y = places(160, 260)
    disc = np.hypot(x - 200, y - 80) < 35
    surface = 0.3 * period / 6 * np.cos(2 * np.pi * x / period)
    exact = np.where(disc, 5 + 0.05 * period, surface).astype(np.float32)
    photo = np.where(disc[..., None], patches(160, 260) * 0.3 + [0.6, 0.2, 0.0], patches(160, 260) * 0.7)
    soft = blur(exact, sigma)
    soft[:, :130] = surface[:, :130]
    refined = refine(photo.astype(np.float32), soft)
    np.testing.assert_array_equal(refined[:, :120], soft[:, :120])
    if period < 40:
        return  # The disc's own surroundings are no flat shoulders.
    band = np.abs(np.hypot(x - 200, y - 80) - 35) < 2 * sigma
    assert np.abs(refined - exact)[band].mean() < 0.75 * np.abs(soft - exact)[band].mean()


@pytest.mark.parametrize("sigma", [1.0, 2.0, 4.0])
def test_only_the_soft_side_of_a_map_is_refined(sigma: float) -> None:
    """Discs from left to right: the left ones exact, the right ones blurred."""
    x, y = places(200, 400)
    rng, photo, exact = np.random.default_rng(3), grain(200, 400), np.zeros((200, 400), np.float32)
    for at in np.arange(20, 400, 40):
        disc = np.hypot(x - at, y - rng.uniform(40, 160)) < rng.uniform(12, 30)
        exact[disc], photo[disc] = rng.uniform(1, 4), 0.4 * photo[disc] + 0.6 * rng.random(3)
    share = np.clip((np.arange(400) - 190) / 20, 0, 1)
    given = ((1 - share) * exact + share * blur(exact, sigma)).astype(np.float32)
    refined = refine(photo.astype(np.float32), given)
    np.testing.assert_array_equal(refined[:, :184], given[:, :184])
    soft = (slice(None), slice(216, None))
    assert np.abs(refined - exact)[soft].mean() < 0.5 * np.abs(given - exact)[soft].mean()
