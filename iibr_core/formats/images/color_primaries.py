"""Colour spaces by their primaries: chromaticities, or the numbers of ITU-T H.273."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import DISPLAY_P3, SRGB, ColorSpace

MAX_XYZ_DIFFERENCE = 2e-3
"""Largest difference between two programs' values of the same primaries, in XYZ."""
MIN_DETERMINANT = 1e-4
"""Smallest determinant of a matrix of primaries; below it they lie on a line."""
BRADFORD = np.array([[0.8951, 0.2664, -0.1614], [-0.7502, 1.7135, 0.0367], [0.0389, -0.0685, 1.0296]])
"""Cones from XYZ (ICC.1:2022, annex E.3)."""
D50 = np.array([0.9642, 1.0, 0.8249])
UNNAMED = "its own"
"""Name of a colour space that a file describes and does not name."""
D65_XY = (0.3127, 0.3290)
C_XY = (0.310, 0.316)
PRIMARIES = {
    1: ("sRGB", (0.640, 0.330, 0.300, 0.600, 0.150, 0.060, *D65_XY)),
    4: ("BT.470 M", (0.670, 0.330, 0.210, 0.710, 0.140, 0.080, *C_XY)),
    5: ("BT.601 (625 lines)", (0.640, 0.330, 0.290, 0.600, 0.150, 0.060, *D65_XY)),
    6: ("BT.601 (525 lines)", (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, *D65_XY)),
    7: ("SMPTE 240M", (0.630, 0.340, 0.310, 0.595, 0.155, 0.070, *D65_XY)),
    8: ("film", (0.681, 0.319, 0.243, 0.692, 0.145, 0.049, *C_XY)),
    9: ("BT.2020", (0.708, 0.292, 0.170, 0.797, 0.131, 0.046, *D65_XY)),
    11: ("DCI-P3", (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, 0.314, 0.351)),
    12: ("Display P3", (0.680, 0.320, 0.265, 0.690, 0.150, 0.060, *D65_XY)),
    22: ("EBU 3213", (0.630, 0.340, 0.295, 0.605, 0.155, 0.077, *D65_XY)),
}
"""Name, then x and y of red, green, blue and white, by their number (ITU-T H.273, table 2)."""


@cache
def space_of_number(number: int) -> ColorSpace | None:
    """Return the colour space of a number of ITU-T H.273; None where that has no such primaries."""
    if number not in PRIMARIES:
        return None
    name, xy = PRIMARIES[number]
    return space_of_chromaticities(xy, name)


def space_of_chromaticities(xy: Any, name: str = UNNAMED) -> ColorSpace:
    """Return the colour space of these primaries, adapted to D50 (Bradford).

    xy: x and y of red, green, blue and white, 8 numbers; what cannot be primaries gives sRGB. name: of the space, where
    it is neither sRGB nor Display P3.
    """
    if not isinstance(xy, tuple) or len(xy) != 8:
        return SRGB
    points = np.array(xy, np.float64).reshape(4, 2)
    if not (np.abs(points).max() < 10 and points[:, 1].all()):
        return SRGB
    x, y = points.T
    xyz = np.stack([x / y, np.ones(4), (1 - x - y) / y])
    cones = BRADFORD @ np.stack([D50, xyz[:, 3]], axis=1)
    if abs(np.linalg.det(xyz[:, :3])) < MIN_DETERMINANT or not (cones > 0).all():
        return SRGB
    adapted = np.linalg.solve(BRADFORD, (cones[:, :1] / cones[:, 1:]) * BRADFORD)
    return space_of_matrix(adapted @ (xyz[:, :3] * np.linalg.solve(xyz[:, :3], xyz[:, 3])), name)


def space_of_matrix(matrix: NDArray[np.float64], name: str = UNNAMED) -> ColorSpace:
    """Return the colour space of a matrix (3, 3) to XYZ under D50: sRGB or Display P3 where it hardly differs."""
    for known in (SRGB, DISPLAY_P3):
        if np.abs(matrix - np.array(known.xyz_from_linear)).max() < MAX_XYZ_DIFFERENCE:
            return known
    red, green, blue = ((float(x), float(y), float(z)) for x, y, z in matrix)
    return ColorSpace(name, (red, green, blue))
