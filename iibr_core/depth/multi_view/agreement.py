"""The disparity maps of all views of a light field, held against each other.

A map is least sure where few other views see a place: there it mostly continues what stands in front. What no other map
confirms, or more of them look through than confirm, is filled by what looks like it around.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import encoded_from_stored
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.runtime.work import raise_if_stopped, report_progress
from iibr_core.types import FloatImage, StoredColors, ViewOffset

AGREE_PX = 1.0
"""Two maps that place a point within so many pixels, seen from each other's view, agree."""


def reconcile(
    views: Sequence[StoredColors],
    maps: Sequence[FloatImage],
    offsets: Sequence[ViewOffset],
) -> list[FloatImage]:
    """The maps, (H, W) each, with what the others do not bear out filled by what looks like it around; a map that
    nothing bears out stays as it is. views: (H, W, 3) each.
    """
    reconciled = []
    for index, (colors, values) in enumerate(zip(views, maps)):
        is_confirmed = find_confirmed(maps, offsets, index)
        if is_confirmed.any() and not is_confirmed.all():
            known = np.where(is_confirmed, values, np.float32(np.nan))
            values = fill_disparity_by_color(encoded_from_stored(colors), known)
        reconciled.append(values)
        report_progress(len(reconciled), len(maps), "finding disparity")
    return reconciled


def find_confirmed(maps: Sequence[FloatImage], offsets: Sequence[ViewOffset], index: int) -> NDArray[np.bool_]:
    """Where one of the maps (H, W) is borne out: another one has the same point, and no more look through it, to what
    lies behind, than have it. What stands before it there says nothing.
    """
    values = maps[index]
    rows, columns = np.indices(values.shape, np.float32)
    having, through = np.zeros(values.shape, np.int32), np.zeros(values.shape, np.int32)
    for other, (there, at) in enumerate(zip(maps, offsets)):
        t, s = at.t - offsets[index].t, at.s - offsets[index].s
        if other == index or t == s == 0:
            continue
        raise_if_stopped()
        nearer = _sample(there, rows - values * np.float32(t), columns - values * np.float32(s)) - values
        most = np.float32(AGREE_PX / max(abs(t), abs(s)))
        having += np.abs(nearer) <= most
        through += nearer < -most
    confirmed: NDArray[np.bool_] = (having > 0) & (having >= through)
    return confirmed


def _sample(image: FloatImage, row: FloatImage, column: FloatImage) -> FloatImage:
    """The nearest pixels of an image (H, W) at these positions, NaN beyond it."""
    height, width = image.shape
    y, x = np.rint(row), np.rint(column)
    is_inside = (y >= 0) & (y < height) & (x >= 0) & (x < width)
    y, x = (np.where(is_inside, at, 0).astype(np.int64) for at in (y, x))
    sampled: FloatImage = np.where(is_inside, image[y, x], np.float32(np.nan))
    return sampled
