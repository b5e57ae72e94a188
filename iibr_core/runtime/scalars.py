"""Scalar pieces that several hot loops share: the curve of sRGB by tables, and pixel indices."""

from __future__ import annotations

from math import floor

import numpy as np

from iibr_core.runtime.kernels import kernel

KNOTS = 4096
_AT = np.arange(KNOTS + 2) / KNOTS
LINEAR_TABLE = (((_AT + 0.055) / 1.055) ** 2.4).astype(np.float32)
SRGB_TABLE = (1.055 * _AT ** (2 / 2.4) - 0.055).astype(np.float32)
"""Over the square root of linear light: its curve is so even that no closer knots are needed in the dark."""


@kernel
def linear_scalar(encoded):
    """Return `color.linear_from_srgb` of one value, up to white from a table: powers took a fifth of the time of rays
    that surfaces share.
    """
    x = max(encoded, 0.0)
    # IEC 61966-2-1: a straight line near black, exact; above it a power, linear between the knots of a table.
    if x <= 0.04045:
        return x / 12.92
    # HDR: above white the curve continues, and the table ends. Nothing but numbers below 1 may become an index.
    if not x < 1.0:
        return ((x + 0.055) / 1.055) ** 2.4
    at = x * KNOTS
    # Unsigned indices need no test for counting from the end.
    k = np.uint64(at)
    return LINEAR_TABLE[k] + (at - k) * (LINEAR_TABLE[k + np.uint64(1)] - LINEAR_TABLE[k])


@kernel
def srgb_scalar(linear):
    """Return `color.srgb_from_linear` of one value, up to white from a table."""
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
    """Return the index of the pixel whose area holds a position."""
    # Halves go up, also below 0: int() would round towards 0 there.
    return floor(position + 0.5)
