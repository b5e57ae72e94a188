"""Colours of surfaces, and holes in planes, as functions of a point in the primitive's frame: the same in every view.

`pixel` is the size of a pixel on the surface at that point. Finer detail is left out, because it would alias.
"""

from __future__ import annotations

from math import floor, pi, sin, sqrt

import numpy as np

from iibr_core.runtime.kernels import kernel
from iibr_core.training.scenes.primitives import DISC, LACE, MESH

OCTAVES = 5
OCTAVE_RATIO = 2.17
LACE_LEVEL = 0.75


@kernel
def albedo_at(p, x, y, z, pixel):
    """Return the colour (linear light) of a primitive: stripes and noise blend the two colours of its palette."""
    share = _rough_noise(x, y, z, p.wavelength, p.gain, pixel, p.seed)
    share += p.stripes * (_stripes(0.9 * x + 0.3 * y + 0.3 * z, p.period, pixel) - share)
    return (
        _mix(p.palette[0, 0], p.palette[1, 0], share),
        _mix(p.palette[0, 1], p.palette[1, 1], share),
        _mix(p.palette[0, 2], p.palette[1, 2], share),
    )


@kernel
def is_cut(p, x, y):
    """Return whether a plane has a hole at (x, y)."""
    if p.cut == DISC:
        return (x / p.half[0]) ** 2 + (y / p.half[1]) ** 2 > 1
    u, v = x / p.cut_period, y / p.cut_period
    if p.cut == MESH:
        width = p.cut_width / p.cut_period
        return u - floor(u) > width and v - floor(v) > width
    return p.cut == LACE and noise(u, v, 0.5, p.seed) + 0.5 * noise(2.3 * u, 2.3 * v, 0.5, p.seed + 1) < LACE_LEVEL


@kernel
def noise(x, y, z, seed):
    """Return value noise in [0, 1): random at integer points, smooth between them."""
    i, j, k = floor(x), floor(y), floor(z)
    fx, fy, fz = _smooth(x - i), _smooth(y - j), _smooth(z - k)
    near = _mix(
        _mix(_random_at(i, j, k, seed), _random_at(i + 1, j, k, seed), fx),
        _mix(_random_at(i, j + 1, k, seed), _random_at(i + 1, j + 1, k, seed), fx),
        fy,
    )
    far = _mix(
        _mix(_random_at(i, j, k + 1, seed), _random_at(i + 1, j, k + 1, seed), fx),
        _mix(_random_at(i, j + 1, k + 1, seed), _random_at(i + 1, j + 1, k + 1, seed), fx),
        fy,
    )
    return _mix(near, far, fz)


@kernel
def _random_at(x, y, z, seed):
    """Return a number in [0, 1) that looks random and depends on four integers."""
    # Odd constants spread the integers over all bits; shifts and products mix high bits into low ones.
    h = np.uint64(x) * np.uint64(0x9E3779B97F4A7C15) + np.uint64(y) * np.uint64(0xC2B2AE3D27D4EB4F)
    h += np.uint64(z) * np.uint64(0x165667B19E3779F9) + np.uint64(seed) * np.uint64(0xD6E8FEB86659FD93)
    h = (h ^ (h >> np.uint64(32))) * np.uint64(0xD6E8FEB86659FD93)
    h = (h ^ (h >> np.uint64(29))) * np.uint64(0xBF58476D1CE4E5B9)
    return np.int64(h >> np.uint64(32)) * 2.0**-32


@kernel
def _rough_noise(x, y, z, wavelength, gain, pixel, seed):
    """Return the sum of octaves of noise from `wavelength` down to the pixel, in 0 .. 1."""
    total, power, strength = 0.0, 0.0, 1.0
    for octave in range(OCTAVES):
        total += strength * _visible(wavelength / pixel) * (_noise_of(x, y, z, wavelength, seed + octave) - 0.5)
        # Octaves that are too fine count here, or the others would get stronger.
        power += strength * strength
        strength *= gain
        wavelength /= OCTAVE_RATIO
    return min(max(0.5 + 1.25 * total / sqrt(power), 0.0), 1.0)


@kernel
def _noise_of(x, y, z, wavelength, seed):
    return noise(x / wavelength, y / wavelength, z / wavelength, seed)


@kernel
def _stripes(position, period, pixel):
    """Return 0 and 1 in turn along a line, with ramps about a pixel wide; half where the period is too fine."""
    # A sine is amplified until its flanks are a pixel wide, and clipped.
    sharpness = max(period / (pi * pixel), 1.0)
    wave = 0.5 + 0.5 * min(max(sharpness * sin(2 * pi * position / period), -1.0), 1.0)
    return _mix(0.5, wave, _visible(0.5 * period / pixel))


@kernel
def _visible(length_px):
    """Return the share of a detail that is shown: 0 below 0.8 pixels, 1 above 1.6."""
    return _smooth(min(max(length_px / 0.8 - 1.0, 0.0), 1.0))


@kernel
def _mix(a, b, share):
    return a + (b - a) * share


@kernel
def _smooth(t):
    """Return the smoothstep of t in 0 .. 1."""
    return t * t * (3 - 2 * t)
