"""A small scene that is hard all at once: nothing of it lies in the middle, along an axis, or on a multiple of four.

A slanted wall of stripes and noise, a board that turns away to the right border, a disc, a thin wire, a box that
the frame cuts off at the lower left, and a lamp brighter than white.
"""

from functools import cache
from pathlib import Path

import numpy as np

import iibr_core as iibr
from iibr_core.color import bytes_from_encoded, encoded_from_stored, linear_from_srgb, srgb_from_linear
from iibr_core.interface.fields import LightField
from iibr_core.types import GridShape
from tests.iibr_core.scenes import bilinear
from tests.image_compare import OTHER_PROCESSOR, assert_golden

GOLDEN = Path(__file__).parents[1] / "golden" / "core"

HEIGHT, WIDTH = 61, 83
SAMPLES = 4
"""A pixel of the photo is the mean of SAMPLES x SAMPLES points, in linear light."""
GRID = GridShape(4, 5)
"""Two rows of views lie above the middle one, and one below."""
NEAREST, FARTHEST = 8.0, -1.5
"""Limits of the scene's disparities, px per view step."""


def layers(y: np.ndarray, x: np.ndarray) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Return mask, colour and disparity at places, the farthest surface first."""
    noise = np.random.default_rng(4).random((HEIGHT + 2, WIDTH + 2, 3))
    grain = bilinear(noise, y + 0.5, x + 0.5) - 0.5
    stripes = np.sin(0.7 * x + 0.35 * y)[..., None] * np.array([0.12, 0.05, -0.1])
    lines = 0.2 * (np.sin(1.1 * y - 0.2 * x) > 0)[..., None]
    everywhere = np.ones(y.shape, np.bool_)
    return [
        (everywhere, [0.3, 0.45, 0.6] + stripes + 0.15 * grain, 0.2 + 0.012 * (x - 41) - 0.018 * (y - 25)),
        ((x > 62.3) & (abs(y - 27) < 14.4), [0.7, 0.6, 0.3] + lines * [0.5, -1.0, 0.3], 1.5 + 0.3 * (x - 62)),
        (np.hypot(y - 50.2, x - 52.6) < 3.8, np.full((*y.shape, 3), 1.0), 2.0 + 0 * x),
        (np.hypot(y - 21.3, x - 37.6) < 10.7, [0.8, 0.25, 0.2] + 0.3 * grain, 3.0 + 0.01 * y),
        (abs(x - 57.3 + 0.22 * y) < 0.7, [0.05, 0.08, 0.04] + 0 * grain, 4.5 + 0 * x),
        ((y > 43.6 + 0.3 * x) & (x < 24.4), [0.25, 0.5, 0.2] + 1.0 * lines, 5.0 - 0.02 * x),
    ]


@cache
def hard_scene(is_hdr: bool = False, size: tuple[int, int] = (HEIGHT, WIDTH)) -> tuple[np.ndarray, np.ndarray]:
    """Return photo (H, W, 3) and disparity (H, W), px per view step.

    is_hdr: the lamp is four times as bright as white. size: height and width in pixels.
    """
    fine, coarse = (
        np.meshgrid(*((np.arange(n * k) + 0.5) / (n * k) * whole - 0.5 for n, whole in zip(size, (HEIGHT, WIDTH))),
                    indexing="ij")
        for k in (SAMPLES, 1)
    )  # fmt: skip
    light, disparity = np.zeros((*fine[0].shape, 3)), np.zeros(size)
    for mask, color, _ in layers(*fine):
        light[mask] = (linear_from_srgb(np.clip(color, 0, 1)) * (4 if is_hdr and np.min(color) == 1 else 1))[mask]
    for mask, _, values in layers(*coarse):
        disparity[mask] = values[mask] * size[1] / WIDTH
    photo = srgb_from_linear(light.reshape(size[0], SAMPLES, size[1], SAMPLES, 3).mean(axis=(1, 3)))
    return photo, disparity.astype(np.float32)


@cache
def hard_field(is_hdr: bool = False) -> LightField:
    """Return the scene's light field of GRID, whose rows are even in number."""
    return iibr.from_arrays(*hard_scene(is_hdr)).light_field(tuple(GRID), parallax="literal")


def grey(values: np.ndarray, low: float = FARTHEST, high: float = NEAREST) -> np.ndarray:
    """Return a map (H, W) as a picture."""
    return np.repeat(((values - low) / (high - low))[..., None], 3, axis=2)


def with_maps(colors: np.ndarray, disparity: np.ndarray, inpainted: np.ndarray) -> np.ndarray:
    """Return the colours of a view, half as bright if HDR, beside its disparity, reddish where it was inpainted."""
    maps = grey(disparity)
    maps[inpainted, 1:] *= 0.6
    shown = encoded_from_stored(colors)
    return np.concatenate([shown / (2 if shown.max() > 1.5 else 1), maps], axis=1)


def assert_golden_pictures(pictures: list[np.ndarray], name: str, folder: Path, regenerates: bool) -> None:
    """Compare pictures (H, W, 3), 1 = white, one above the other, with those of tests/golden/core."""
    width = max(picture.shape[1] for picture in pictures)
    padded = [np.pad(picture, ((0, 0), (0, width - picture.shape[1]), (0, 0))) for picture in pictures]
    assert np.isfinite(np.concatenate(padded)).all()
    image = bytes_from_encoded(np.concatenate(padded))
    assert_golden(image, f"core/{name}", OTHER_PROCESSOR, folder, regenerates)
