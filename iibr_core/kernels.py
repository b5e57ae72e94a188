"""How the core's hot loops are compiled, and the scalar pieces several of them share.

A kernel that calls another with arrays pays for counting references, per call: inner loops pass scalars only, or are
written out.
"""

from __future__ import annotations

from math import floor

import numba

# Reassociation and contraction only: NaN and infinity keep their meaning.
kernel = numba.njit(cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "arcp", "nsz"})
"""Threads run these at the same time, and each is compiled once per machine."""


@kernel
def linear_scalar(encoded):  # type: ignore[no-untyped-def]
    """`color.linear_from_srgb` of one value."""
    x = max(encoded, 0.0)
    return x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4


@kernel
def srgb_scalar(linear):  # type: ignore[no-untyped-def]
    """`color.srgb_from_linear` of one value."""
    x = max(linear, 0.0)
    return x * 12.92 if x <= 0.0031308 else 1.055 * x ** (1 / 2.4) - 0.055


@kernel
def nearest_pixel(position):  # type: ignore[no-untyped-def]
    """Index of the pixel whose area holds a position."""
    return floor(position + 0.5)
