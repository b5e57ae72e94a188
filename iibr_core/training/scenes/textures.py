"""Looks of surfaces of procedural scenes: solid patterns, and holes cut into planes. Scalars only.

Patterns are continuous functions of a point in the surface's own frame, the same from every view. `pixel` is the size
of a pixel of the centre view on the surface there: detail finer than it is left out, as it could only alias.
"""

from __future__ import annotations

from math import cos, floor, pi, sin, sqrt

import numpy as np

from iibr_core.runtime.kernels import kernel

NOISE, WAVES, STRIPES, CHECKS, SPOTS = range(5)
PATTERNS = (NOISE, WAVES, STRIPES, CHECKS, SPOTS)
WHOLE, DISC, FRAME, MESH, LEAVES, LACE = range(6)
"""How a plane is cut: not, an ellipse, a window frame, wires in both directions, leaves, ragged noise."""

OCTAVES = 5
OCTAVE_RATIO = 2.17
FINEST_NOISE_PX = (0.8, 1.6)
"""Noise whose lattice is this many pixels wide is left out altogether, or just not at all."""
FINEST_PERIOD_PX = (1.5, 3.0)


@kernel
def hash_lattice(x, y, z, seed):
    """A number in [0, 1) that depends on four integers and looks random."""
    # Odd constants spread the four numbers over all bits; shifts and products mix high bits into low ones. Overflow
    # wraps.
    h = np.uint64(x) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(y) * np.uint64(0xC2B2AE3D27D4EB4F)
    h += np.uint64(z) * np.uint64(0x165667B19E3779F9) + np.uint64(seed) * np.uint64(0xD6E8FEB86659FD93)
    h = (h ^ (h >> np.uint64(32))) * np.uint64(0xD6E8FEB86659FD93)
    h = (h ^ (h >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
    # The upper 32 bits.
    return np.int64(h >> np.uint64(32)) * 2.0**-32


@kernel
def _mix(a, b, share):
    return a + (b - a) * share


@kernel
def _ramp(value, low, high):
    """0 up to low, 1 from high, a smooth step between."""
    # Smoothstep: 3 t^2 - 2 t^3.
    t = min(max((value - low) / (high - low), 0.0), 1.0)
    return t * t * (3 - 2 * t)


@kernel
def noise(x, y, z, seed):
    """Value noise in [0, 1): random at integer points, smooth between."""
    # Lattice cell and smoothstep weights within it, then trilinear between its corners.
    i, j, k = floor(x), floor(y), floor(z)
    fx, fy, fz = x - i, y - j, z - k
    fx, fy, fz = fx * fx * (3 - 2 * fx), fy * fy * (3 - 2 * fy), fz * fz * (3 - 2 * fz)
    near = _mix(
        _mix(hash_lattice(i, j, k, seed), hash_lattice(i + 1, j, k, seed), fx),
        _mix(hash_lattice(i, j + 1, k, seed), hash_lattice(i + 1, j + 1, k, seed), fx),
        fy,
    )
    far = _mix(
        _mix(hash_lattice(i, j, k + 1, seed), hash_lattice(i + 1, j, k + 1, seed), fx),
        _mix(hash_lattice(i, j + 1, k + 1, seed), hash_lattice(i + 1, j + 1, k + 1, seed), fx),
        fy,
    )
    return _mix(near, far, fz)


@kernel
def rough_noise(x, y, z, wavelength, gain, pixel, seed):
    """Octaves of noise from `wavelength` down to the pixel, each `gain` times as strong as the coarser; in 0 .. 1."""
    total, power, strength = 0.0, 0.0, 1.0
    # Fractal noise. Octaves near the pixel fade out but count in the power, lest the others grow stronger.
    for octave in range(OCTAVES):
        kept = _ramp(wavelength / pixel, FINEST_NOISE_PX[0], FINEST_NOISE_PX[1])
        power += strength * strength
        if kept > 0:
            total += strength * kept * (noise(x / wavelength, y / wavelength, z / wavelength, seed + octave) - 0.5)
        strength *= gain
        wavelength /= OCTAVE_RATIO
    # Normalised by the root of the summed squares, as independent octaves add up.
    return min(max(0.5 + 1.25 * total / sqrt(power), 0.0), 1.0)


@kernel
def _square_wave(position, period, soft):
    """0 and 1 in turn along a line, with ramps `soft` wide between."""
    # A sine, amplified until its flanks are `soft` wide, and clipped.
    sharpness = max(period / (pi * soft), 1.0)
    return 0.5 + 0.5 * min(max(sharpness * sin(2 * pi * position / period), -1.0), 1.0)


@kernel
def _spots(x, y, z, period, soft, seed):
    """1 within a ball in each cell of a grid, 0 outside."""
    # One ball a cell, its radius and place random, so that it stays inside.
    i, j, k = floor(x / period), floor(y / period), floor(z / period)
    radius = 0.2 + 0.28 * hash_lattice(i, j, k, seed)
    room = 1 - 2 * radius
    dx = x / period - i - radius - room * hash_lattice(i, j, k, seed + 1)
    dy = y / period - j - radius - room * hash_lattice(i, j, k, seed + 2)
    # Twice as long in z, about the middle of the cell.
    dz = (z / period - k - 0.5) * 0.5
    distance = (sqrt(dx * dx + dy * dy + dz * dz) - radius) * period
    return 1 - _ramp(distance, -0.5 * soft, 0.5 * soft)


@kernel
def pattern(kind, x, y, z, period, pixel, seed):
    """The named pattern at a point, in 0 .. 1; half where its period is too fine to be seen."""
    soft = 1.2 * pixel
    if kind == WAVES:
        a, b = 2 * pi / period, 2 * pi / (period * 1.37)
        value = 0.5 + 0.25 * (sin(a * (0.8 * x + 0.6 * y) + b * 0.5 * z) + cos(b * (x - 0.9 * y) + a * z))
    elif kind == STRIPES:
        value = _square_wave(0.9 * x + 0.3 * y + 0.31 * z, period, soft)
    elif kind == CHECKS:
        a = 2 * _square_wave(x, period, soft) - 1
        b = 2 * _square_wave(y, period, soft) - 1
        c = 2 * _square_wave(z, period, soft) - 1
        value = 0.5 + 0.5 * a * b * c
    elif kind == SPOTS:
        value = _spots(x, y, z, period, soft, seed)
    else:
        value = noise(x / period, y / period, z / period, seed)
    # Fade to grey where the period comes near the pixel: it would alias.
    return _mix(0.5, value, _ramp(period / pixel, FINEST_PERIOD_PX[0], FINEST_PERIOD_PX[1]))


@kernel
def _leaf(x, y, angle, seed):
    """Whether a point lies on the one leaf of its cell of a turned unit grid."""
    # The turned grid; then place, direction and length of the leaf in its cell.
    u, v = cos(angle) * x - sin(angle) * y, sin(angle) * x + cos(angle) * y
    i, j = floor(u), floor(v)
    turn = 2 * pi * hash_lattice(i, j, 0, seed)
    du = u - i - 0.35 - 0.3 * hash_lattice(i, j, 1, seed)
    dv = v - j - 0.35 - 0.3 * hash_lattice(i, j, 2, seed)
    along, across = cos(turn) * du + sin(turn) * dv, cos(turn) * dv - sin(turn) * du
    length = 0.3 + 0.3 * hash_lattice(i, j, 3, seed)
    # Two parabolas that meet at its tips.
    tip = 1 - (along / length) ** 2
    return tip > 0 and abs(across) < 0.35 * length * tip


@kernel
def is_cut(kind, x, y, half_x, half_y, period, width, seed):
    """Whether a plane has a hole at (x, y) of its own frame. period and width are those of the holes, world units."""
    if kind == DISC:
        return (x / half_x) ** 2 + (y / half_y) ** 2 > 1
    if kind == FRAME:
        return abs(x) < half_x - width and abs(y) < half_y - width
    if kind == MESH:
        # A wire at the left and upper side of every cell.
        u, v = (x + half_x) / period, (y + half_y) / period
        return (u - floor(u)) * period > width and (v - floor(v)) * period > width
    if kind == LEAVES:
        x, y = x / period, y / period
        # Three layers of leaves, turned and scaled against each other: they overlap irregularly.
        return not (_leaf(x, y, 0.3, seed) or _leaf(1.3 * x, 1.3 * y, 1.1, seed + 1) or _leaf(x, y, 2.0, seed + 2))
    if kind == LACE:
        x, y = x / period, y / period
        return noise(x, y, 0.5, seed) + 0.5 * noise(2.3 * x, 2.3 * y, 0.5, seed + 1) < 0.75
    return False
