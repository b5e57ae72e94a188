"""The photo continued beyond its frame, once, so that all views show the same there.

The surface nearest on the frame continues, and lines continue straight (coherence transport, Bornemann & Maerz, 2007).
All other colours are averaged along the frame, wider the farther out, because the details that continue are unknown.
They get the fine texture of the pixel as far inside the frame.
"""

from __future__ import annotations

from math import hypot, log2, sqrt

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.nearest_known import number_pixels
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import nearest_pixel
from iibr_core.runtime.tiling import in_bands
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import FloatImage, ImageSize, Margins, image_size

BINOMIAL = np.array([1, 4, 6, 4, 1], np.float32) / 16
"""Weights, in each direction, of the mean from which texture differs."""
SPREAD = 1.6
"""Binary logarithm of the standard deviation, in units of 0.41 px, of the mean that is taken 1 px from the frame."""
TEXTURE_SHARE, TEXTURE_PX = 0.6, 16.0
"""Share of the photo's texture far beyond its frame, and the distance in pixels at which it is half of that.

The place of the texture is a guess, and close to the frame it is not missed.
"""
LINE_REACH_PX = 5
"""Radius of the squares in which lines are found: 11 x 11 pixels."""
STRENGTH_POWER, ANGLE_POWER = 2, 16
"""Exponents of a line's strength and of the cosine of the angle to it, in its weight."""
LINE_NOISE = 0.01
"""Standard deviation of steps between neighbouring pixels that are no line."""
SLANT, PLACES = 2.0, 12
"""Range along the frame of the lines that are followed, as a multiple of the distance from the frame; number of places
in each direction within that range.
"""


def outpaint(
    colors: FloatImage,
    disparity: FloatImage,
    margins: Margins,
    stages: Stages = ALL_STAGES,
) -> tuple[FloatImage, FloatImage]:
    """Return the photo's colors (H, W, 3) and disparity (H, W), continued beyond the frame.

    margins: number of new pixels on each side. stages: the ones that are on.
    """
    size = image_size(disparity)
    if not any(margins):
        return colors, disparity
    larger = margins.around(size)
    grown, surfaces = np.empty((*larger, 3), np.float32), np.empty(larger, np.float32)
    frame, number = _frame_pixels(size), np.empty(size, np.int32)
    number_pixels(frame, number)
    means = _means_along_frame(colors.reshape(-1, 3)[frame], max(margins))
    lines = np.empty((len(frame), 2), np.float32)
    _find_lines(colors, frame, lines)

    def band(first: int, last: int) -> None:
        frame_of = number, frame, means, lines
        _extend_rows(colors, disparity, frame_of, stages.outpainted_lines, margins, (first, last), grown, surfaces)

    in_bands(band, larger)
    return grown, surfaces


def _frame_pixels(size: ImageSize) -> NDArray[np.int64]:
    """Return the flat indices (N,) of the frame's pixels, clockwise from the upper left."""
    height, width = size
    right, left = np.arange(1, height), np.arange(1, height - 1)[::-1]
    top, bottom = np.arange(width), np.arange(width - 1)[::-1]
    return np.concatenate([top, right * width + width - 1, (height - 1) * width + bottom, left * width])


def _means_along_frame(frame: FloatImage, farthest: int) -> FloatImage:
    """Return the colours of the frame's N pixels, and wider and wider means of them (K, N, 3).

    The standard deviation of mean k is 0.41 sqrt(4**k - 1) px (weights 1 2 1; each step doubles the distances).
    """
    mean = frame.astype(np.float64)
    means = [mean]
    for k in range(_level(hypot(farthest, farthest)).__ceil__()):
        mean = 0.5 * mean + 0.25 * (np.roll(mean, 2**k, axis=0) + np.roll(mean, -(2**k), axis=0))
        means.append(mean)
    return np.stack(means).astype(np.float32)


@kernel
def _level(distance):
    """Return the index of the mean of `_means_along_frame` for a distance from the frame; fractions blend two."""
    return max(SPREAD + log2(distance), 0.0)


@kernel
def _texture(colors, y, x, c):
    """Return the difference of a pixel from the mean around it; the border is repeated."""
    height, width, _ = colors.shape
    mean = np.float32(0.0)
    for j in range(-2, 3):
        v = min(max(y + j, 0), height - 1)
        for i in range(-2, 3):
            mean += BINOMIAL[j + 2] * BINOMIAL[i + 2] * colors[v, min(max(x + i, 0), width - 1), c]
    return colors[y, x, c] - mean


@kernel
def _extend_rows(colors, disparity, frame_of, follows_lines, margins, rows, grown, surfaces):
    """Fill rows [first, last) of the larger image. frame_of: number of each pixel of the frame, the pixels, their means
    and lines.
    """
    (height, width), (top, _, left, _), (number, frame, means, lines) = disparity.shape, margins, frame_of
    for row in range(*rows):
        for column in range(grown.shape[1]):
            y, x = min(max(row - top, 0), height - 1), min(max(column - left, 0), width - 1)
            away = hypot(row - top - y, column - left - x)
            if away == 0.0:
                surfaces[row, column] = disparity[y, x]
                for c in range(3):
                    grown[row, column, c] = colors[y, x, c]
                continue
            place, level = number[y, x], _level(away)
            surfaces[row, column] = disparity[y, x]
            k = min(int(level), len(means) - 2)
            part = np.float32(level - k)
            # The pixel as far inside, on the other side of that place, gives the texture.
            share = np.float32(TEXTURE_SHARE * away / (away + TEXTURE_PX))
            v = min(max(2 * y - row + top, 0), height - 1)
            u = min(max(2 * x - column + left, 0), width - 1)
            for c in range(3):
                mean = means[k, place, c] + part * (means[k + 1, place, c] - means[k, place, c])
                grown[row, column, c] = max(mean + share * _texture(colors, v, u, c), 0.0)
            if follows_lines:
                _blend_lines(frame, means, lines, place, away, (row - top, column - left, width), grown[row, column])


@kernel
def _find_lines(colors, pixels, lines):
    """Write the lines (N, 2) through pixels (N,), flat indices: strength times (cos 2a, sin 2a).

    a is the angle at which colours change least. The strength is 1 if they change across the line only, and 0 if they
    change alike in all directions.
    """
    height, width, _ = colors.shape
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        # The structure tensor, summed over channels, along the diagonals of 2 x 2 pixels: these have the same middle,
        # unlike steps to the right and down.
        falls = both = rises = 0.0
        for v in range(max(y - LINE_REACH_PX, 0), min(y + LINE_REACH_PX + 1, height - 1)):
            for u in range(max(x - LINE_REACH_PX, 0), min(x + LINE_REACH_PX + 1, width - 1)):
                for c in range(3):
                    falling = np.float64(colors[v + 1, u + 1, c] - colors[v, u, c])
                    rising = np.float64(colors[v, u + 1, c] - colors[v + 1, u, c])
                    falls += falling * falling
                    both += falling * rising
                    rises += rising * rising
        # Turned by 45 degrees, xx + yy = (falls + rises) / 2, yy - xx = -both, 4 xy = falls - rises. The eigenvalues
        # differ by sqrt((xx - yy)^2 + 4 xy^2); the line runs across the larger one's direction.
        total = 0.5 * (falls + rises) + 3 * (2 * LINE_REACH_PX + 1) ** 2 * LINE_NOISE**2
        lines[i, 0], lines[i, 1] = -both / total, 0.5 * (rises - falls) / total


@kernel
def _line_weight(line_cos, line_sin, down, across):
    """Return the weight 0..1 of a line in the direction (down, across)."""
    strength = sqrt(line_cos * line_cos + line_sin * line_sin)
    if strength == 0.0:
        return 0.0
    # Cosine of twice the angle between the line and the direction.
    squared = float(down * down + across * across)
    double = (line_cos * (across * across - down * down) + line_sin * 2.0 * across * down) / (strength * squared)
    return strength**STRENGTH_POWER * max(0.5 + 0.5 * double, 0.0) ** (ANGLE_POWER // 2)


@kernel
def _blend_lines(frame, means, lines, place, away, pixel, color):
    """Blend the lines of the frame into the colour (3) of a pixel beyond it, more where they lead there straighter."""
    row, column, width = pixel
    step = SLANT * away / PLACES
    # A mean as wide as the distance between two places.
    level = _level(step)
    k = min(int(level), len(means) - 2)
    part = np.float32(level - k)
    total = red = green = blue = 0.0
    for j in range(-PLACES, PLACES + 1):
        n = nearest_pixel(place + j * step) % len(frame)
        down, across = row - frame[n] // width, column - frame[n] % width
        weight = _line_weight(lines[n, 0], lines[n, 1], down, across) * away / hypot(down, across)
        total += weight
        red += weight * (means[k, n, 0] + part * (means[k + 1, n, 0] - means[k, n, 0]))
        green += weight * (means[k, n, 1] + part * (means[k + 1, n, 1] - means[k, n, 1]))
        blue += weight * (means[k, n, 2] + part * (means[k + 1, n, 2] - means[k, n, 2]))
    # The other colours have a weight of 1.
    rest = 1.0 / (1.0 + total)
    color[0], color[1], color[2] = rest * (color[0] + red), rest * (color[1] + green), rest * (color[2] + blue)
