"""Photos that look like tiles of one scene: quilts and mosaics of views without a tag in their names."""

import numpy as np

from iibr_core.types import FloatImage

LONGEST_PX = 512
"""Longer side of the copy that is looked at, about."""
MAX_TILES = 20
"""Largest number of tiles along an axis."""
MIN_ALIKE, MIN_JUMP = 1.4, 1.5
"""Factors by which pixels half a tile apart differ more than those a whole tile apart, and neighbours across borders of
tiles more than other neighbours.
"""
MIN_STRIP, MIN_TILE_PX = 4, 8
"""Fewest tiles of a single row or column, and the smallest side of a tile in the copy."""


def tile_note(pixels: FloatImage) -> tuple[str, ...]:
    """Return a sentence if a photo (H, W, 3) looks like tiles of one scene, none otherwise."""
    step = max(max(pixels.shape[:2]) // LONGEST_PX, 1)
    luma = np.nan_to_num(pixels[::step, ::step].mean(axis=2))
    across, down = _tiles_along(luma.T), _tiles_along(luma)
    if max(across, down) < MIN_STRIP and min(across, down) < 2:
        return ()
    return (
        f"Looks like {across}x{down} pictures of one scene: if it is a quilt or a mosaic of views, let its name end in"
        f" _qs{across}x{down}.",
    )


def _tiles_along(luma: FloatImage) -> int:
    """Return the number of tiles along the first axis of a luma (H, W), 1 if there are none."""
    length = len(luma)
    if length < 2 * MIN_TILE_PX:
        return 1
    steps = np.abs(np.diff(luma, axis=0)).mean(axis=1)
    mean_step = float(np.median(steps))

    def difference(shift: float) -> float:
        rows = np.rint(np.arange(int(length - shift)) + shift).astype(int).clip(0, length - 1)
        return float(np.abs(luma[rows] - luma[: len(rows)]).mean())

    for count in range(min(MAX_TILES, length // MIN_TILE_PX), 1, -1):
        tile = length / count
        borders = np.rint(np.arange(1, count) * tile).astype(int) - 1
        jumps = np.maximum.reduce([steps[(borders + k).clip(0, length - 2)] for k in (-1, 0, 1)])
        is_cut = np.median(jumps) > MIN_JUMP * mean_step > 0
        if is_cut and difference(tile / 2) > MIN_ALIKE * difference(tile):
            return count
    return 1
