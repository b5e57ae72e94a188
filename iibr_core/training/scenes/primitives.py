"""Shapes that scenes are made of, their intersections with rays in a frame of each shape, and their colours."""

from __future__ import annotations

from math import inf, sqrt

import numpy as np

from iibr_core.runtime.kernels import kernel
from iibr_core.training.scenes.textures import noise, pattern, rough_noise

PLANE, BOX, BALL, WIRE = range(4)
"""A rectangle, a box, an ellipsoid, the side of a cylinder along its third axis."""

PRIMITIVE = np.dtype(
    [
        ("shape", "i8"),
        ("centre", "f8", 3),
        ("axes", "f8", (3, 3)),  # rows: the primitive's own axes in the world, orthonormal
        ("half", "f8", 3),  # half extents along them
        ("nearest_z", "f8"),
        ("cut", "i8"),  # of planes: textures.WHOLE, ...
        ("cut_period", "f8"),
        ("cut_width", "f8"),
        ("pattern", "i8"),
        ("period", "f8"),
        ("roughness", "f8"),  # share of rough noise against the pattern
        ("wavelength", "f8"),  # of the coarsest rough noise
        ("gain", "f8"),  # strength of each octave of rough noise against the coarser
        ("tint", "f8"),  # share of the third colour
        ("phase", "f8", 3),
        ("palette", "f8", (3, 3)),  # three colours in linear light, 0 .. 1
        ("seed", "i8"),
    ],
    align=True,
)


@kernel
def distance_along(shape, origin, direction, half):
    """Return the distance along a ray to a primitive, in the frame of the primitive, or infinity."""
    (ox, oy, oz), (ex, ey, ez), (hx, hy, hz) = origin, direction, half
    if shape == PLANE:
        # The plane z = 0 of its own frame, within its rectangle.
        z = -oz / ez if ez != 0.0 else inf
        return z if abs(ox + z * ex) <= hx and abs(oy + z * ey) <= hy else inf
    if shape == BOX:
        # Slab test: inside between the last of the near faces and the first of the far ones. Along a face the quotients
        # are infinite, which compares as it should.
        ax, bx = (-hx - ox) / ex, (hx - ox) / ex
        ay, by = (-hy - oy) / ey, (hy - oy) / ey
        az, bz = (-hz - oz) / ez, (hz - oz) / ez
        enter = max(min(ax, bx), min(ay, by), min(az, bz))
        leave = min(max(ax, bx), max(ay, by), max(az, bz))
        return enter if enter <= leave else inf
    if shape == BALL:
        # Scaled to the unit ball: a t^2 + 2 b t + c = 0.
        ox, oy, oz, ex, ey, ez = ox / hx, oy / hy, oz / hz, ex / hx, ey / hy, ez / hz
        a, b, c = ex * ex + ey * ey + ez * ez, ox * ex + oy * ey + oz * ez, ox * ox + oy * oy + oz * oz - 1
    else:
        # The cylinder about the third axis: the same without z.
        a, b, c = ex * ex + ey * ey, ox * ex + oy * ey, ox * ox + oy * oy - hx * hx
    # Missed, or moving away from its middle.
    inside = b * b - a * c
    if not inside > 0.0 or b >= 0.0:
        return inf
    # The nearer root, in the form that does not cancel digits.
    z = c / (sqrt(inside) - b)
    return z if shape == BALL or abs(oz + z * ez) <= hz else inf


@kernel
def normal_at(shape, x, y, z, hx, hy, hz):
    """The unit normal at a point of a primitive, in its own frame."""
    if shape == PLANE:
        return 0.0, 0.0, 1.0
    if shape == BOX:
        # The face that the point lies on: its largest coordinate, relative to the box.
        ax, ay, az = abs(x) / hx, abs(y) / hy, abs(z) / hz
        if ax >= ay and ax >= az:
            return 1.0 if x > 0 else -1.0, 0.0, 0.0
        return (0.0, 1.0 if y > 0 else -1.0, 0.0) if ay >= az else (0.0, 0.0, 1.0 if z > 0 else -1.0)
    # Along the gradient of (x / hx)^2 + (y / hy)^2 + (z / hz)^2; that of a cylinder has no z.
    nx, ny, nz = x / (hx * hx), y / (hy * hy), z / (hz * hz) if shape == BALL else 0.0
    length = max(sqrt(nx * nx + ny * ny + nz * nz), 1e-300)
    return nx / length, ny / length, nz / length


@kernel
def albedo_at(p, x, y, z, pixel):
    """Colour of a primitive at a point of its own frame, linear light; see textures for `pixel`."""
    x, y, z = x + p.phase[0], y + p.phase[1], z + p.phase[2]
    # Mix of pattern and rough noise between two colours of the palette; coarse noise tints it with the third.
    rough = rough_noise(x, y, z, p.wavelength, p.gain, pixel, p.seed)
    share = pattern(p.pattern, x, y, z, p.period, pixel, p.seed + 11)
    share += (rough - share) * p.roughness
    coarse = 1.7 * p.wavelength
    tint = p.tint * noise(x / coarse, y / coarse, z / coarse, p.seed + 12)
    r = p.palette[0, 0] + (p.palette[1, 0] - p.palette[0, 0]) * share
    g = p.palette[0, 1] + (p.palette[1, 1] - p.palette[0, 1]) * share
    b = p.palette[0, 2] + (p.palette[1, 2] - p.palette[0, 2]) * share
    return (
        r + (p.palette[2, 0] - r) * tint,
        g + (p.palette[2, 1] - g) * tint,
        b + (p.palette[2, 2] - b) * tint,
    )
