"""How the core's hot loops are compiled, and the scalar pieces several of them share.

A kernel that calls another with arrays pays for counting references, per call: inner loops pass scalars only, or are
written out.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from math import floor
from typing import Any

import numpy as np

from iibr_core.runtime.kernel_cache import KernelCache, numba

# Reassociation and contraction only: NaN and infinity keep their meaning.
_compile = numba.njit(nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "arcp", "nsz"})


def kernel(function: Callable[..., Any]) -> Any:
    """The function, compiled at its first call; threads run it at the same time. The only decorator for hot loops.

    It is compiled once per machine and source (`runtime/kernel_cache.py`); in every process where nothing can be kept.
    """
    compiled = _compile(function)
    if not numba.config.DISABLE_JIT:
        with suppress(Exception):  # folders, disks, Numba's settings: none of it is worth a kernel
            compiled._cache = KernelCache(function)
    return compiled


KNOTS = 4096
_AT = np.arange(KNOTS + 2) / KNOTS
LINEAR_TABLE = (((_AT + 0.055) / 1.055) ** 2.4).astype(np.float32)
SRGB_TABLE = (1.055 * _AT ** (2 / 2.4) - 0.055).astype(np.float32)
"""Over the square root of linear light: so evenly curved that the knots need not lie closer in the dark."""


@kernel
def linear_scalar(encoded):
    """`color.linear_from_srgb` of one value, up to white from a table: powers took a fifth of the time of rays that
    surfaces share.
    """
    x = max(encoded, 0.0)
    # IEC 61966-2-1: a straight line near black, exact; above it a power, linear between the knots of a table.
    if x <= 0.04045:
        return x / 12.92
    # HDR: above white the curve goes on, and the table ends. Nothing but numbers below 1 may become an index.
    if not x < 1.0:
        return ((x + 0.055) / 1.055) ** 2.4
    at = x * KNOTS
    # Unsigned indices need no test for counting from the end.
    k = np.uint64(at)
    return LINEAR_TABLE[k] + (at - k) * (LINEAR_TABLE[k + np.uint64(1)] - LINEAR_TABLE[k])


@kernel
def srgb_scalar(linear):
    """`color.srgb_from_linear` of one value, up to white from a table."""
    x = max(linear, 0.0)
    # The inverse; its table runs over the root, see SRGB_TABLE.
    if x <= 0.0031308:
        return x * 12.92
    if not x < 1.0:
        return 1.055 * x ** (1 / 2.4) - 0.055
    at = np.sqrt(x) * KNOTS
    k = np.uint64(at)
    return SRGB_TABLE[k] + (at - k) * (SRGB_TABLE[k + np.uint64(1)] - SRGB_TABLE[k])


@kernel
def nearest_pixel(position):
    """Index of the pixel whose area holds a position."""
    # Halves go up, also below 0: int() would round towards 0 there.
    return floor(position + 0.5)
