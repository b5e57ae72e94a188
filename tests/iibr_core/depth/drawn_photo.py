"""A drawn photo whose depth is known, and what is found for it in numbers and words.

The scene: a wall that is far at its top, a disc before it on the left, a box on the right between both.
"""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
from PIL import Image
from scipy import ndimage

from iibr_core.depth.search import PhotoWithDepth
from iibr_core.remedies import remedy_of
from iibr_core.types import TOTAL_PARALLAX, FloatImage, GridShape
from tests.golden_text import assert_same_text

HEIGHT, WIDTH = 160, 240
PLACES = {"disc": (80, 68), "box": (110, 170), "wall": (120, 20), "top": (8, 60)}
USUAL_GRID = GridShape(9, 9)
LOSSY = 0.04
"""Largest error in px away from edges: 1.2 px lie between near and far, maps are JPEGs and of half the size."""


@cache
def drawn(has_sky: bool = False) -> tuple[np.ndarray, FloatImage]:
    """Return a photo's bytes, and its inverse distance, 0 (in the sky) to 0.95."""
    y, x = np.mgrid[:HEIGHT, :WIDTH] / np.array([HEIGHT, WIDTH])[:, None, None]
    noise = np.random.default_rng(0).normal(0, 14, (HEIGHT, WIDTH))
    colors = np.stack([100 + noise, 120 + noise, 90 + noise], -1)
    near = 0.1 + 0.15 * y
    if has_sky:
        colors[y < 0.4], near[y < 0.4] = (140, 180, 230), 0
    box = (abs(x - 0.72) < 0.12) & (abs(y - 0.68) < 0.22)
    disc = np.hypot((x - 0.28) * WIDTH / HEIGHT, y - 0.5) < 0.22
    colors[box] = (np.array([50, 80, 190]) + noise[..., None])[box]
    colors[disc] = (np.array([230, 130, 90]) + noise[..., None])[disc]
    near[box], near[disc] = 0.5, 0.95
    return np.clip(colors, 0, 255).astype(np.uint8), near.astype(np.float32)


@cache
def slope() -> tuple[np.ndarray, FloatImage]:
    """Return a textured surface whose photo does not show which end is near: the left is."""
    colors = np.random.default_rng(1).normal(120, 14, (HEIGHT, WIDTH, 3))
    near = np.tile(np.linspace(1, 1 / 6, WIDTH), (HEIGHT, 1))
    return np.clip(colors, 0, 255).astype(np.uint8), near.astype(np.float32)


def unit(values: FloatImage) -> FloatImage:
    return np.asarray((values - values.min()) / np.ptp(values))


def as_bytes(shares: FloatImage) -> np.ndarray:
    return np.rint(255 * shares).astype(np.uint8)


def stored_as(upright: np.ndarray, orientation: int) -> np.ndarray:
    """Return a picture as a camera stores it that states this orientation (Exif 2.3, 4.6.4)."""
    turned = {
        2: upright[:, ::-1], 3: upright[::-1, ::-1], 4: upright[::-1], 5: upright.swapaxes(0, 1),
        6: np.rot90(upright), 7: np.rot90(upright, 2).swapaxes(0, 1), 8: np.rot90(upright, -1),
    }  # fmt: skip
    return np.ascontiguousarray(turned.get(orientation, upright))


def save(path: Path, pixels: np.ndarray, orientation: int = 1, **options: object) -> Path:
    path.parent.mkdir(exist_ok=True)
    exif = Image.Exif()
    exif[0x0112] = orientation
    Image.fromarray(pixels).save(path, exif=exif, **({"quality": 95, "subsampling": 0} | options))
    return path


def usual_disparity(near: FloatImage, grid: GridShape = USUAL_GRID) -> FloatImage:
    """Return the disparity of inverse distances without a scale: slow twin of `disparity_from`."""
    low, high = np.percentile(near, (1, 99))
    px = TOTAL_PARALLAX * near.shape[1] / max(max(grid) - 1, 1) / (high - low)
    return np.asarray((np.clip(near, 3 * low - 2 * high, 3 * high - 2 * low) - np.median(near)) * px)


def assert_disparity(found: PhotoWithDepth, expected: FloatImage, atol: float = LOSSY) -> None:
    """Compare everywhere but beside edges, where maps of other sizes are blurred, and in what was unknown."""
    values, unknown = found.disparity.values, found.disparity.unknown
    assert values.shape == found.photo.size == expected.shape
    assert values.dtype == np.float32
    assert np.isfinite(values).all()
    known = ndimage.maximum_filter(expected, 9) - ndimage.minimum_filter(expected, 9) < 0.1 * np.ptp(expected)
    known &= np.True_ if unknown is None else ~unknown
    assert known.any()
    error = np.abs(values - expected)[known].max()
    assert error < atol, f"off by {error:.3f} px"


def assert_metres(found: PhotoWithDepth, near: FloatImage, rtol: float = 0.02) -> None:
    """Compare inverse distances, 1 / m, at all places."""
    assert found.disparity.inverse_metres is not None
    factor, offset = found.disparity.inverse_metres
    for place in PLACES.values():
        assert abs(factor * found.disparity.values[place] + offset - near[place]) < rtol * near.max()


def lines_of(found: PhotoWithDepth, folder: Path) -> Iterator[str]:
    """Yield what is found: its origin, the photo's size, focal length and notes, the map's numbers and notes."""
    photo, disparity, origin = found.photo, found.disparity, found.origin
    yield f"{origin.kind}: {origin.line} Near: {origin.near or '-'}. Model: {origin.model or '-'}."
    yield f"{photo.size}, {photo.focal_px:.1f} px, {photo.color_space.name}"
    height, width = photo.size
    at = {name: (y * height // HEIGHT, x * width // WIDTH) for name, (y, x) in PLACES.items()}
    yield ", ".join(f"{name} {disparity.values[place]:.3f}" for name, place in at.items())
    unknown = 0.0 if disparity.unknown is None else disparity.unknown.mean()
    words = "" if disparity.inverse_metres is None else "1/m = {:.3f} d + {:.3f}, ".format(*disparity.inverse_metres)
    yield f"{words}unknown {unknown:.3f}" + (", enlarged" if disparity.is_enlarged else "")
    for note in (*photo.notes, *disparity.notes, *(f"failed: {words}" for words in origin.failures)):
        remedy = remedy_of(note.removeprefix("failed: ")) if note.startswith("failed: ") else remedy_of(note)
        yield note.replace(str(folder), "") + (f" [{remedy.name}]" if remedy else "")


def assert_as_kept(found: PhotoWithDepth, folder: Path, name: str, row: str, regenerate: bool) -> None:
    assert_same_text([*lines_of(found, folder)], f"depth/{name}", row, regenerate)
