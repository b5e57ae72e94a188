"""Neighbouring rays of the photo that one steep surface joins, however far apart they land.

A fixed gap cannot tell a steep surface from a depth edge. Its steps can: those of a surface are about as large as the
steps beside them, while a depth edge's step stands alone.
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
"""Where steps are larger than this share of what parts surfaces, a surface is steep. From SMOOTH_SHARE on only, a plane
of slope 0.3 would be 0.03 px off.
"""
MINIMUM_RUN = 3
"""So many steps beyond it, on one side, must follow the step between two rays, each about as large as the last."""


def connect_rays(disparity: FloatImage, surface_step: float) -> NDArray[np.uint8]:
    """(H, W): bits RIGHT and BELOW, of steps larger than STEEP_SHARE of surface_step only: others need no proof."""
    connected = np.zeros(disparity.shape, np.uint8)
    in_bands(
        lambda first, last: _connect(disparity, STEEP_SHARE * surface_step, first, last, connected),
        image_size(disparity),
    )
    return connected


def connected_either_way(connected: NDArray[np.uint8]) -> NDArray[np.bool_]:
    """(H, W): whether each ray is connected to a neighbour on any of its four sides."""
    either = connected != 0
    either[:, 1:] |= (connected[:, :-1] & RIGHT) != 0
    either[1:] |= (connected[:-1] & BELOW) != 0
    return np.asarray(either)


@kernel
def _is_connected(disparity, least_step, y, x, down, right):
    """Whether the step from this ray to the next one down or right is a surface's."""
    height, width = disparity.shape
    if y + down >= height or x + right >= width:
        return False
    own = disparity[y + down, x + right] - disparity[y, x]
    if not abs(own) > least_step:
        return False
    # One side is enough: a surface is one up to where it ends.
    for side in (-1, 1):
        near, alike = own, 0
        for i in range(1, MINIMUM_RUN + 1):
            v, u = y + side * i * down, x + side * i * right
            if v < 0 or u < 0 or v + down >= height or u + right >= width:
                break
            far = disparity[v + down, u + right] - disparity[v, u]
            # NaN, no surface, fails the comparison.
            if not abs(far - near) <= SLOPE_SHARE * max(abs(far), abs(near)):
                break
            near, alike = far, alike + 1
        if alike == MINIMUM_RUN:
            return True
    return False


@kernel
def _connect(disparity, least_step, first, last, connected):
    height, width = disparity.shape
    for y in range(first, last):
        for x in range(width):
            # Most steps are small: a test of both is cheaper than two calls.
            right = abs(disparity[y, min(x + 1, width - 1)] - disparity[y, x])
            below = abs(disparity[min(y + 1, height - 1), x] - disparity[y, x])
            if not (right > least_step or below > least_step):
                continue
            if _is_connected(disparity, least_step, y, x, 0, 1):
                connected[y, x] |= RIGHT
            if _is_connected(disparity, least_step, y, x, 1, 0):
                connected[y, x] |= BELOW
