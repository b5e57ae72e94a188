"""The colour map of overlays and their legends: viridis, perceptually uniform, in ten evenly spaced colours.

The overlay's shader and the legends blend these ten alike. A package that holds the map would cost more to import than
the rest of this room together, and its 256 colours differ from the blended ones by up to 15 of 255.
"""

from __future__ import annotations

VIRIDIS: tuple[tuple[float, float, float], ...] = tuple(
    (code >> 16 & 255, code >> 8 & 255, code & 255)
    for code in (
        0x440154, 0x482878, 0x3E4989, 0x31688E, 0x26828E, 0x1F9E89, 0x35B779, 0x6ECE58, 0xB5DE2B, 0xFDE725,
    )
)  # fmt: skip
"""By S. van der Walt and N. Smith (CC0), sRGB bytes."""


def map_color(share: float) -> tuple[float, float, float]:
    """Return the colour (sRGB, 0..1) at a share of the map, 0 dark, 1 light; beyond the ends the nearest."""
    place = min(max(share, 0.0), 1.0) * (len(VIRIDIS) - 1)
    first = min(int(place), len(VIRIDIS) - 2)
    low, high = VIRIDIS[first], VIRIDIS[first + 1]
    red, green, blue = ((a + (b - a) * (place - first)) / 255 for a, b in zip(low, high))
    return red, green, blue
