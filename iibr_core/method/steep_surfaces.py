"""Neighbouring rays of the photo that one steep surface joins, however far apart they land.

No fixed gap separates a steep surface from a depth edge, but its steps do: those of a surface are about as large as the
steps beside them, while the step of a depth edge stands alone.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.surfaces import SLOPE_SHARE
from iibr_core.types import FloatImage, image_size

RIGHT, BELOW = 1, 2
"""Bits: this ray and the next one to the right, or below, lie on one steep surface."""
STEEP_SHARE = 0.5
"""Share of the step between surfaces above which the steps of a surface count as steep."""
MIN_RUN = 3
"""Number of steps on one side that must follow the step between two rays, each about as large as the last."""


def join_steep_rays(disparity: FloatImage, surface_step: float) -> NDArray[np.uint8]:
    """Return the bits RIGHT and BELOW of each ray (H, W), for steps larger than STEEP_SHARE of surface_step."""
    joined = np.zeros(disparity.shape, np.uint8)

    def band(first: int, last: int) -> None:
        _join(disparity, STEEP_SHARE * surface_step, first, last, joined)

    in_bands(band, image_size(disparity))
    return joined


def is_joined(joined: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """Return which rays (H, W) are joined to a neighbour on any of their four sides."""
    either = joined != 0
    either[:, 1:] |= (joined[:, :-1] & RIGHT) != 0
    either[1:] |= (joined[:-1] & BELOW) != 0
    return np.asarray(either)


@kernel
def slope_at(disparity, joined, bit, y, x):
    """Return the change of disparity a pixel, right or below, at a ray joined to a neighbour there; else 0."""
    down, right = (1, 0) if bit == BELOW else (0, 1)
    here, rise, sides = disparity[y, x], 0.0, 0
    if y >= down and x >= right and joined[y - down, x - right] & bit:
        rise, sides = here - disparity[y - down, x - right], 1
    if joined[y, x] & bit:
        rise, sides = rise + disparity[y + down, x + right] - here, sides + 1
    return rise / max(sides, 1)


@kernel
def _belongs_to_surface(disparity, least_step, y, x, down, right):
    """Return whether the step from this ray to the next one, down or right, is that of a steep surface."""
    height, width = disparity.shape
    if y + down >= height or x + right >= width:
        return False
    step = disparity[y + down, x + right] - disparity[y, x]
    if not abs(step) > least_step:
        return False
    # One side is enough: a surface is one up to its end.
    for side in (-1, 1):
        near, alike = step, 0
        for i in range(1, MIN_RUN + 1):
            v, u = y + side * i * down, x + side * i * right
            if v < 0 or u < 0 or v + down >= height or u + right >= width:
                break
            far = disparity[v + down, u + right] - disparity[v, u]
            # NaN, no surface, fails the comparison.
            if not abs(far - near) <= SLOPE_SHARE * max(abs(far), abs(near)):
                break
            near, alike = far, alike + 1
        if alike == MIN_RUN:
            return True
    return False


@kernel
def _join(disparity, least_step, first, last, joined):
    height, width = disparity.shape
    for y in range(first, last):
        for x in range(width):
            # Most steps are small: a test of both is cheaper than two calls.
            right = abs(disparity[y, min(x + 1, width - 1)] - disparity[y, x])
            below = abs(disparity[min(y + 1, height - 1), x] - disparity[y, x])
            if not (right > least_step or below > least_step):
                continue
            if _belongs_to_surface(disparity, least_step, y, x, 0, 1):
                joined[y, x] |= RIGHT
            if _belongs_to_surface(disparity, least_step, y, x, 1, 0):
                joined[y, x] |= BELOW
