"""How the core's hot loops are compiled, and the scalar pieces several of them share.

A kernel that calls another with arrays pays for counting references, per call: inner loops pass scalars only, or are
written out.
"""

from __future__ import annotations

from math import floor

import numba
import numpy as np

# Reassociation and contraction only: NaN and infinity keep their meaning.
kernel = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "arcp", "nsz"})
"""Threads run these at the same time, and each is compiled once per machine."""


KNOTS = 4096
_AT = np.arange(KNOTS + 2) / KNOTS
LINEAR_TABLE = (((_AT + 0.055) / 1.055) ** 2.4).astype(np.float32)
SRGB_TABLE = (1.055 * _AT ** (2 / 2.4) - 0.055).astype(np.float32)
"""Over the root of linear light: so even that the knots need not lie closer in the dark."""


@kernel
def linear_scalar(encoded):  # type: ignore[no-untyped-def]
    """`color.linear_from_srgb` of one value, up to white from a table: powers took a fifth of the time of rays that
    surfaces share.
    """
    x = max(encoded, 0.0)
    if x <= 0.04045:
        return x / 12.92
    if not x < 1.0:
        return ((x + 0.055) / 1.055) ** 2.4
    at = x * KNOTS
    k = np.uint64(at)
    return LINEAR_TABLE[k] + (at - k) * (LINEAR_TABLE[k + np.uint64(1)] - LINEAR_TABLE[k])


@kernel
def srgb_scalar(linear):  # type: ignore[no-untyped-def]
    """`color.srgb_from_linear` of one value, up to white from a table."""
    x = max(linear, 0.0)
    if x <= 0.0031308:
        return x * 12.92
    if not x < 1.0:
        return 1.055 * x ** (1 / 2.4) - 0.055
    at = np.sqrt(x) * KNOTS
    k = np.uint64(at)
    return SRGB_TABLE[k] + (at - k) * (SRGB_TABLE[k + np.uint64(1)] - SRGB_TABLE[k])


@kernel
def nearest_pixel(position):  # type: ignore[no-untyped-def]
    """Index of the pixel whose area holds a position."""
    return floor(position + 0.5)
