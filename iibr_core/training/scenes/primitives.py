"""Shapes that scenes are made of, and their intersections with rays, in the frame of each shape."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np

from iibr_core.runtime.kernels import kernel

PLANE, ELLIPSOID, WIRE = range(3)
"""A rectangle, an ellipsoid, and the side of a cylinder along its third axis."""
WHOLE, DISC, MESH, LACE = range(4)
"""Cuts of a plane: none, an ellipse, wires in both directions, ragged noise."""

PRIMITIVE = np.dtype(
    [
        ("shape", "i8"),
        ("centre", "f8", 3),
        ("axes", "f8", (3, 3)),  # rows: orthonormal axes of the primitive's frame
        ("half", "f8", 3),  # half extents along the axes
        ("cut", "i8"),
        ("cut_period", "f8"),  # distance of the holes
        ("cut_width", "f8"),  # width of a mesh's wires
        ("wavelength", "f8"),  # of the coarsest noise
        ("gain", "f8"),  # strength of each octave of noise against the coarser one
        ("stripes", "f8"),  # share of stripes against noise
        ("period", "f8"),  # of the stripes
        ("palette", "f8", (2, 3)),  # two colours in linear light
        ("seed", "i8"),
        ("origin", "f8", 3),  # the camera of the current view, in the primitive's frame
        ("bounds", "f8", 4),  # first and last x, first and last y in the current view, in pixels
    ],
    align=True,
)


@kernel
def to_own_frame(p, x, y, z):
    """Return a direction of the world in the frame of a primitive."""
    return (
        p.axes[0, 0] * x + p.axes[0, 1] * y + p.axes[0, 2] * z,
        p.axes[1, 0] * x + p.axes[1, 1] * y + p.axes[1, 2] * z,
        p.axes[2, 0] * x + p.axes[2, 1] * y + p.axes[2, 2] * z,
    )


@kernel
def distance_along(p, ex, ey, ez):
    """Return the distance to a hit, in lengths of the ray's direction e in the primitive's frame, or infinity."""
    ox, oy, oz = p.origin[0], p.origin[1], p.origin[2]
    hx, hy, hz = p.half[0], p.half[1], p.half[2]
    if p.shape == PLANE:
        distance = -oz / ez
        return distance if abs(ox + distance * ex) <= hx and abs(oy + distance * ey) <= hy else inf
    # Scaled to the unit sphere, or to the cylinder of radius 1: a t^2 + 2 b t + c = 0.
    ux, uy, vx, vy = ox / hx, oy / hy, ex / hx, ey / hy
    a, b, c = vx * vx + vy * vy, ux * vx + uy * vy, ux * ux + uy * uy - 1
    if p.shape == ELLIPSOID:
        a, b, c = a + (ez / hz) ** 2, b + oz * ez / (hz * hz), c + (oz / hz) ** 2
    root = b * b - a * c
    if not root > 0.0 or b >= 0.0:
        return inf
    # The nearer root, in the form that does not cancel digits.
    distance = c / (sqrt(root) - b)
    return distance if p.shape == ELLIPSOID or abs(oz + distance * ez) <= hz else inf


@kernel
def normal_at(p, x, y, z):
    """Return the unit normal at a point of a primitive, in its frame."""
    if p.shape == PLANE:
        return 0.0, 0.0, 1.0
    # The gradient of (x / hx)^2 + (y / hy)^2 + (z / hz)^2; a cylinder has no part along z.
    nx, ny, nz = x / p.half[0] ** 2, y / p.half[1] ** 2, z / p.half[2] ** 2 if p.shape == ELLIPSOID else 0.0
    length = sqrt(nx * nx + ny * ny + nz * nz)
    return nx / length, ny / length, nz / length
