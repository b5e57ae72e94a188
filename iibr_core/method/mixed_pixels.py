"""Pixels at depth edges show two surfaces at once. Left whole, they trail an edge band of foreground colour into the
background.

A pixel on the far side of a depth edge is split: the background keeps its own colour, and the foreground gets a fringe
ray there that covers the pixel's share alpha. Both together are the pixel again. Share and colours are the most likely
ones by how both surfaces' colours are spread around it (Bayesian matting: Chuang et al., CVPR 2001); where colours
are alike, the outline gives the share.
"""

from __future__ import annotations

import numpy as np

from iibr_core.inpainting.disparity_by_color import nearness
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import linear_scalar, srgb_scalar
from iibr_core.runtime.tiling import in_bands
from iibr_core.surfaces import SLOPE_SHARE, is_in_front, same_surface
from iibr_core.types import FloatImage, image_size

MIN_MATTE = 0.02
"""Share of foreground below which it is noise."""
MATTING_PX = 5
"""Distance within which the colours of both surfaces are taken, in pixels."""
MATTING_NEARNESS = nearness(MATTING_PX, 2.5)
"""Weights (2 MATTING_PX + 1, 2 MATTING_PX + 1) of the pixels there."""
EDGE_BAND_WEIGHT = 0.001
"""Weight of pixels beside a depth edge, which may be mixed themselves; they count where there are no others."""
COLOR_VARIANCE = 2e-5
"""Variance that is added to that of colours in linear light, for rounding, as a share of 1 plus theirs."""
OUTLINE_SHARE = 0.08
"""Share of a pixel that its outline alone gives to the foreground, for each of eight neighbours in the foreground."""
SHARE_DEVIATION = 0.2
"""Standard deviation of true shares from it: supersampled layers had 0.1; edges of maps are not as exact."""
MATTING_ROUNDS = 2
STRAIGHT = np.array([(-1, 0), (0, -1), (0, 1), (1, 0)])


def split_mixed_pixels(
    colors: FloatImage, disparity: FloatImage, edge_step: float
) -> tuple[FloatImage, FloatImage, FloatImage, FloatImage]:
    """Split the mixed pixels of a photo (H, W, 3) with disparity (H, W). edge_step: the least step of a depth edge.

    Returns background colours (H, W, 3), fringe colours (H, W, 3), fringe disparity (H, W) and fringe coverage (H, W);
    without a fringe coverage is 0 and disparity NaN.
    """
    own, fringe = np.empty_like(colors, order="C"), np.empty_like(colors, order="C")
    fringe_disparity, coverage = np.empty_like(disparity, order="C"), np.empty_like(disparity, order="C")
    is_edge_band, size = np.empty(disparity.shape, np.bool_), image_size(disparity)

    def band(first: int, last: int) -> None:
        own[first:last] = fringe[first:last] = colors[first:last]
        fringe_disparity[first:last], coverage[first:last] = np.nan, 0.0
        split = own, fringe, fringe_disparity, coverage
        _split_rows(colors, disparity, is_edge_band, edge_step, (first, last), split)

    in_bands(lambda first, last: _mark_edge_bands(disparity, edge_step, first, last, is_edge_band), size)
    in_bands(band, size)
    return own, fringe, fringe_disparity, coverage


def move_with_foreground(disparity: FloatImage, steps: tuple[float, float]) -> FloatImage:
    """Return disparity (H, W) that is the foreground's at pixels just behind a step from steps[0] to steps[1].

    Such pixels show both surfaces, too. Moved with the foreground, their light stays the same beside it; surfaces that
    small steps separate are hardly moved against each other.
    """
    moved = np.empty_like(disparity, order="C")
    in_bands(lambda first, last: _move(disparity, *steps, first, last, moved), image_size(disparity))
    return moved


@kernel
def _move(disparity, least_step, most_step, first, last, moved):
    """Write rows [first, last) of `move_with_foreground`."""
    height, width = disparity.shape
    for y in range(first, last):
        for x in range(width):
            here = foreground = background = beyond = disparity[y, x]
            for k in range(4):
                down, right = STRAIGHT[k]
                v, u = min(max(y + down, 0), height - 1), min(max(x + right, 0), width - 1)
                background = min(background, disparity[v, u])
                if disparity[v, u] > foreground:
                    foreground = disparity[v, u]
                    beyond = disparity[min(max(v + down, 0), height - 1), min(max(u + right, 0), width - 1)]
            # On a slope, disparity changes on either side of the step, too.
            step = foreground - here
            goes_on = max(here - background, beyond - foreground) > SLOPE_SHARE * step
            moved[y, x] = foreground if least_step < step <= most_step and not goes_on else here


@kernel
def _mark_edge_bands(disparity, edge_step, first, last, is_edge_band):
    """Write rows [first, last): which pixels have a neighbour on the other side of a depth edge."""
    height, width = disparity.shape
    for y in range(first, last):
        for x in range(width):
            own, nearest, farthest = disparity[y, x], disparity[y, x], disparity[y, x]
            for v in range(max(y - 1, 0), min(y + 2, height)):
                for u in range(max(x - 1, 0), min(x + 2, width)):
                    nearest, farthest = max(nearest, disparity[v, u]), min(farthest, disparity[v, u])
            is_edge_band[y, x] = nearest - own > edge_step or own - farthest > edge_step


@kernel
def _foreground_beside(disparity, y, x, edge_step):
    """Return the front-most disparity beside a pixel, and the share of the pixel that the outline gives to it; the
    pixel's disparity and 0 on a slope, which falls away on the other side, too.
    """
    height, width = disparity.shape
    here, share = disparity[y, x], 0.0
    foreground = background = here
    for v in range(max(y - 1, 0), min(y + 2, height)):
        for u in range(max(x - 1, 0), min(x + 2, width)):
            foreground, background = max(foreground, disparity[v, u]), min(background, disparity[v, u])
    if here - background > SLOPE_SHARE * (foreground - here):
        return here, share
    for v in range(max(y - 1, 0), min(y + 2, height)):
        for u in range(max(x - 1, 0), min(x + 2, width)):
            if same_surface(disparity[v, u], foreground, edge_step):
                share += OUTLINE_SHARE
    return foreground, share


@kernel
def _color_statistics(colors, disparity, is_edge_band, pixel, foreground, edge_step, statistics):
    """Write mean (2, 3) and covariance (2, 3, 3) of linear colours of the pixel's surface and the one in front;
    extend darkest and brightest (3) by the pixel's surface. Return whether there are pixels of both.
    """
    (height, width), (y, x) = disparity.shape, pixel
    mean, spread, darkest, brightest = statistics
    weights, color = np.zeros(2), np.empty_like(darkest)
    mean[:], spread[:] = 0.0, 0.0
    for v in range(max(y - MATTING_PX, 0), min(y + MATTING_PX + 1, height)):
        for u in range(max(x - MATTING_PX, 0), min(x + MATTING_PX + 1, width)):
            to_own, to_foreground = abs(disparity[v, u] - disparity[y, x]), abs(disparity[v, u] - foreground)
            # A third surface, or none; or the pixel itself.
            if not min(to_own, to_foreground) <= edge_step or (v == y and u == x):
                continue
            surface = 1 if to_foreground < to_own else 0
            weight = MATTING_NEARNESS[v - y + MATTING_PX, u - x + MATTING_PX] * (
                EDGE_BAND_WEIGHT if is_edge_band[v, u] else 1.0
            )
            weights[surface] += weight
            for c in range(3):
                color[c] = linear_scalar(colors[v, u, c])
                if surface == 0:
                    darkest[c], brightest[c] = min(darkest[c], color[c]), max(brightest[c], color[c])
                mean[surface, c] += weight * color[c]
                for e in range(c + 1):
                    spread[surface, c, e] += weight * color[c] * color[e]
    for surface in range(2):
        mean[surface] /= max(weights[surface], 1e-9)
        spread[surface] /= max(weights[surface], 1e-9)
        for c in range(3):
            for e in range(c + 1):
                spread[surface, c, e] -= mean[surface, c] * mean[surface, e]
                spread[surface, e, c] = spread[surface, c, e]
        noise = COLOR_VARIANCE * (1.0 + spread[surface, 0, 0] + spread[surface, 1, 1] + spread[surface, 2, 2])
        for c in range(3):
            spread[surface, c, c] += noise
    return weights.min() > 0


@kernel
def _mixture_precision(spread, share, precision):
    """Write the inverse (3, 3) of the covariance of a mixture's colours, by cofactors. spread (2, 3, 3): covariances of
    background and foreground.
    """
    mixed = (1.0 - share) ** 2 * spread[0] + share**2 * spread[1]
    for c in range(3):
        for e in range(3):
            i, j, k, m = (c + 1) % 3, (c + 2) % 3, (e + 1) % 3, (e + 2) % 3
            precision[c, e] = mixed[i, k] * mixed[j, m] - mixed[i, m] * mixed[j, k]
    precision /= mixed[0, 0] * precision[0, 0] + mixed[0, 1] * precision[0, 1] + mixed[0, 2] * precision[0, 2]


@kernel
def _split_rows(colors, disparity, is_edge_band, edge_step, rows, split):
    """Write rows [first, last) of the result of `split_mixed_pixels`, which hold the photo's colours before."""
    own, fringe, fringe_disparity, coverage = split
    mean, spread, precision = np.empty((2, 3)), np.empty((2, 3, 3)), np.empty((3, 3))
    here, darkest, brightest = np.empty(3), np.empty(3), np.empty(3)
    statistics = mean, spread, darkest, brightest
    for y in range(*rows):
        for x in range(disparity.shape[1]):
            if not is_edge_band[y, x]:
                continue
            foreground, outline = _foreground_beside(disparity, y, x, edge_step)
            for c in range(3):
                here[c] = darkest[c] = brightest[c] = linear_scalar(colors[y, x, c])
            # A pixel just behind an edge, and colours of both sides.
            if not (
                is_in_front(foreground, disparity[y, x], edge_step)
                and _color_statistics(colors, disparity, is_edge_band, (y, x), foreground, edge_step, statistics)
            ):
                continue
            # Colours of a mixture spread with both surfaces'. The share that fits best, by colours and outline, follows
            # from that spread, and the spread from the share.
            share, contrast = outline, mean[1] - mean[0]
            _mixture_precision(spread, share, precision)
            for _ in range(MATTING_ROUNDS):
                fits = 1.0 / SHARE_DEVIATION**2
                expected = fits * outline
                for c in range(3):
                    for e in range(3):
                        fits += contrast[c] * precision[c, e] * contrast[e]
                        expected += contrast[c] * precision[c, e] * (here[e] - mean[0, e])
                share = min(max(expected / fits, 0.0), 1.0 - MIN_MATTE)
                _mixture_precision(spread, share, precision)
            # Colours that are not finite give no share.
            if not share >= MIN_MATTE:
                continue
            # The residual is divided by the spread of both colours, so that their mixture is the pixel again.
            off = here - mean[0] - share * contrast
            for c in range(3):
                background, fore = mean[0, c], mean[1, c]
                for e in range(3):
                    part = precision[e, 0] * off[0] + precision[e, 1] * off[1] + precision[e, 2] * off[2]
                    background, fore = (
                        background + (1.0 - share) * spread[0, c, e] * part,
                        fore + share * spread[1, c, e] * part,
                    )
                # The foreground is not darker than black, and the background within the range of its surface
                # around; a small share may give other colours. The other part takes the rest.
                if fore < 0.0:
                    background, fore = here[c] / (1.0 - share), 0.0
                if not darkest[c] <= background <= brightest[c]:
                    background = min(max(background, darkest[c]), brightest[c])
                    fore = (here[c] - (1.0 - share) * background) / share
                own[y, x, c], fringe[y, x, c] = srgb_scalar(background), srgb_scalar(fore)
            # The fringe ray moves with the foreground and covers its share; the own ray stays and fills the pixel.
            fringe_disparity[y, x], coverage[y, x] = foreground, share
