"""A light field of a square before a wall whose rows stand 0.4 times as far apart as columns."""

from functools import cache
from pathlib import Path

import numpy as np

from iibr_core.color import bytes_from_encoded
from iibr_core.formats.images.write import write_image
from tests.iibr_core.scenes import bilinear

ROW_STEP, SIDE, SIZE = 0.4, 5, 96
WALL_PX, SQUARE_PX = -1.0, 3.0


def seen(t: float | np.ndarray, s: float | np.ndarray, focus: float = 0.0) -> np.ndarray:
    """Return a square before a wall, (H, W, 3), seen from (t, s) in distances between columns, sheared to a focus."""
    y, x = np.mgrid[:SIZE, :SIZE].astype(np.float32)
    y, x = y - focus * t, x - focus * s
    is_square = (abs(y + SQUARE_PX * t - 48) < 20) & (abs(x + SQUARE_PX * s - 48) < 20)
    wall, square = (
        bilinear(_texture(seed), y + disparity * t + 48, x + disparity * s + 48)
        for seed, disparity in ((0, WALL_PX), (1, SQUARE_PX))
    )
    return np.where(is_square[..., None], square * np.float32([1.0, 0.8, 0.5]), wall * np.float32([0.5, 0.8, 1.0]))


@cache
def _texture(seed: int) -> np.ndarray:
    """Return noise with details of about three pixels, so that a shift of half a pixel is seen."""
    noise = np.random.default_rng(seed).random((2 * SIZE, 2 * SIZE, 3))
    for axis in (0, 1, 0, 1):
        noise = (np.roll(noise, 1, axis) + 2 * noise + np.roll(noise, -1, axis)) / 4
    return np.clip(2 * noise - 0.5, 0, 1).astype(np.float32)


def write_unequal_rows(folder: Path) -> Path:
    """Write views whose names state their positions."""
    folder.mkdir()
    for row, column in np.ndindex(SIDE, SIDE):
        t, s = ROW_STEP * (row - SIDE // 2), column - SIDE // 2
        path = folder / f"out_{row:02d}_{column:02d}_{10 * t:.1f}_{10 * s:.1f}.png"
        write_image(path, bytes_from_encoded(seen(t, s)))
    return folder
