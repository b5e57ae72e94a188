"""Disparity from views that are too large for the memory or the time: found from smaller copies of them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import encoded_from_stored, stored_from_encoded
from iibr_core.depth.edges.refine import refine
from iibr_core.depth.guess import resize_picture
from iibr_core.depth.multi_view.estimate import SMALL_SIDE_PX, estimate_with_doubt, sweep_bytes
from iibr_core.formats.images.photo import size_within
from iibr_core.formats.maps.resample import resample_map
from iibr_core.method.memory import budget_bytes
from iibr_core.types import FloatImage, ImageSize, StoredColors, ViewOffset, image_size

MIN_NOTED_DOUBT = 0.05
"""Smallest share of the picture that is noted."""
Range = tuple[float, float]


def estimate_within_memory(
    views: Sequence[StoredColors],
    offsets: Sequence[ViewOffset],
    reference: int,
    range_px: Range,
    max_pixels: int | None = None,
) -> tuple[FloatImage, tuple[str, ...]]:
    """Return the disparity (H, W) of the reference view in px per view step, and notes: on smaller copies, on doubt.

    Arguments are those of `estimate_disparity`. max_pixels: largest number of pixels of a view that is matched.
    """
    size = image_size(views[reference])
    small = _matched_size(size, range_px, offsets, reference, max_pixels or math.prod(size))
    if small == size:
        values, is_doubtful = estimate_with_doubt(views, offsets, reference, range_px)
        return values, _doubt(is_doubtful)
    copies = [_resized(view, small) for view in views]
    values, is_doubtful = estimate_with_doubt(copies, offsets, reference, _scaled(range_px, size, small))
    whole = resample_map(values, size) * np.float32(size.width / small.width)
    refined = refine(encoded_from_stored(views[reference]), whole, is_enlarged=True)
    note = f"Found from views reduced to {small}, then enlarged to {size} along the edges of the picture."
    return refined, (note, *_doubt(is_doubtful))


def _doubt(is_doubtful: NDArray[np.bool_]) -> tuple[str, ...]:
    """Return a sentence about the share of the picture whose disparity is in doubt."""
    share = float(is_doubtful.mean())
    if share < MIN_NOTED_DOUBT:
        return ()
    return (f"{share:.0%} of the picture is plain or repeats itself: its depth is that of the surfaces around it.",)


def _matched_size(
    size: ImageSize, range_px: Range, offsets: Sequence[ViewOffset], reference: int, max_pixels: int
) -> ImageSize:
    """Return the size that views are matched at."""
    at = offsets[reference]
    reach = max(max(abs(offset.t - at.t), abs(offset.s - at.s)) for offset in offsets)
    while True:
        small = size_within(size, max_pixels)
        needed = sweep_bytes(small, _scaled(range_px, size, small), reach)
        if needed <= budget_bytes() or max(small) <= SMALL_SIDE_PX:
            return small
        max_pixels = math.prod(small) * 3 // 4


def _scaled(range_px: Range, size: ImageSize, small: ImageSize) -> Range:
    low, high = (end * small.width / size.width for end in range_px)
    return low, high


def _resized(view: StoredColors, size: ImageSize) -> StoredColors:
    """Return a view (H, W, 3) at a smaller size."""
    return stored_from_encoded(resize_picture(encoded_from_stored(view), size), is_hdr=view.dtype != np.uint8)
