"""What the transformer is told of each hypothesis of an ambiguous ray, and what the ray shows once T has weighed them.

Features say how well a hypothesis agrees with the disparity that its source ray really has; colours are never among
them. All differences are pixels of parallax in the view, so that nothing depends on the scene's scale.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.ambiguous_rays import HYPOTHESES, NOWHERE_PX, PLAIN_SOURCE, UndecidedRays, find_undecided_rays
from iibr_core.rendering.candidates import Candidates
from iibr_core.rendering.ray_set import RaySet
from iibr_core.rendering.resampling import ShownRays, cubic, resample, resample_inpainted
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import linear_scalar, nearest_pixel, srgb_scalar
from iibr_core.types import FloatImage, ViewOffset

AGREES, TO_NEAREST, TO_FARTHEST, SHARE, LANDS, INPAINTED, PARALLAX, COVERAGE, UNCOVERED, PLAIN, PROFILE = range(11)
"""The features, in this order; SHARE is the closed form's weight, PROFILE the first of several."""
PROFILE_PX = (-4.0, -2.5, -1.0, 1.0, 2.5, 4.0)
"""Where the disparity around a source ray is sampled, along the parallax and across it."""
FEATURES = PROFILE + 2 * len(PROFILE_PX) + 2
"""The last two are 0: a multiple of four suits the arithmetic."""
MOST_PX = 1e4
LEAST_VOTE = 0.004
"""Weights below this change no colour by a visible step."""
SAME_COLOR = 1e-5
"""Votes no farther apart than this need no mean: so a flat scene's views are the photo to the bit."""


@dataclass(frozen=True, eq=False)
class AmbiguousRays:
    """Ambiguous rays (N) of one view and their hypotheses (K).

    offset: of the view. pixel (N, 2): (row, column) in the view. mask (N, K): hypotheses in use, the first always.
    disparity (N, K). source (N, K). features (N, K, FEATURES).
    """

    offset: ViewOffset
    pixel: NDArray[np.int64]
    mask: NDArray[np.bool_]
    disparity: FloatImage
    source: NDArray[np.uint8]
    features: FloatImage


def find_ambiguous_rays(
    rays: RaySet,
    candidates: Candidates,
    weights: FloatImage,
    shown: ShownRays,
    rows: tuple[int, int],
    every: bool = False,
    hypotheses: int = HYPOTHESES,
) -> AmbiguousRays:
    """The rays of `find_undecided_rays`, described."""
    return describe_rays(rays, find_undecided_rays(rays, candidates, weights, shown, rows, every, hypotheses))


def describe_rays(rays: RaySet, undecided: UndecidedRays) -> AmbiguousRays:
    """With the features that T decides by."""
    offset = undecided.offset
    mask = np.arange(undecided.hypotheses) < undecided.number[:, None]
    disparity, source = np.zeros(mask.shape, np.float32), np.zeros(mask.shape, np.uint8)
    disparity[mask], source[mask] = undecided.disparity, undecided.source
    pixel = np.stack(np.divmod(undecided.pixel.astype(np.int64), rays.size.width), axis=1)
    features = np.zeros((*mask.shape, FEATURES), np.float32)
    parallax = max(*map(abs, offset), 1e-9)
    _describe(rays.arrays, rays.to_view(offset), parallax, pixel, undecided, features)
    return AmbiguousRays(offset, pixel, mask, disparity, source, features)


def hypothesis_colors(rays: RaySet, ambiguous: AmbiguousRays) -> FloatImage:
    """What each hypothesis would show: colours (N, K, 3), sRGB-encoded; black in unused slots."""
    colors = np.zeros((*ambiguous.mask.shape, 3), np.float32)
    one = np.eye(ambiguous.mask.shape[1], dtype=np.float32)
    for a in range(len(one)):
        weights = np.where(ambiguous.mask, one[a], 0.0).astype(np.float32)
        colors[:, a] = np.where(ambiguous.mask[:, a, None], blend_hypotheses(rays, ambiguous, weights)[0], 0.0)
    return colors


def blend_hypotheses(
    rays: RaySet, ambiguous: AmbiguousRays, weights: FloatImage
) -> tuple[FloatImage, FloatImage, NDArray[np.uint8]]:
    """Colours (N, 3), disparity (N) and source (N) of ambiguous rays for weights (N, K) whose rows sum to 1.

    Colours are summed in linear light; disparity and source are the heaviest hypothesis's.
    """
    colors, disparity, source = np.zeros((len(weights), 3), np.float32), ambiguous.disparity, ambiguous.source
    _blend(rays.arrays, rays.to_view(ambiguous.offset), ambiguous.pixel, disparity, source, weights, colors)
    heaviest = np.arange(len(weights)), weights.argmax(axis=1)
    return colors, disparity[heaviest], source[heaviest] % PLAIN_SOURCE


@kernel
def _softsign(px):
    """Pixels on a scale of -4..4 where small differences count most; 0 where there is no difference to tell."""
    if px != px:
        return 0.0
    # 4 softsign(px / 4), finite for all input.
    px = min(max(px, -MOST_PX), MOST_PX)
    return px / (1.0 + 0.25 * abs(px))


@kernel
def _own_disparity(surfaces, k, x, y, d):
    """The disparity that a source really has at a place, bilinear over its surfaces; d where it has none."""
    _, height, width = surfaces.shape
    column, row = floor(x), floor(y)
    fx, fy = x - column, y - row
    own = total = 0.0
    for j in range(2):
        for i in range(2):
            v, u = min(max(row + j, 0), height - 1), min(max(column + i, 0), width - 1)
            w = (fx if i else 1.0 - fx) * (fy if j else 1.0 - fy)
            if surfaces[k, v, u] == surfaces[k, v, u]:
                own, total = own + w * surfaces[k, v, u], total + w
    return own / total if total > 0 else d


@kernel
def _describe(rays, offsets, parallax, pixel, undecided, features):
    surfaces = rays.disparity
    _, height, width = surfaces.shape
    # Unit vectors along each source's parallax.
    steps = np.empty_like(offsets)
    for image in range(len(offsets)):
        steps[image] = offsets[image] / max(np.hypot(offsets[image, 0], offsets[image, 1]), 1e-9)
    log_parallax = np.log1p(parallax)
    at = 0
    for n in range(len(pixel)):
        y, x = pixel[n]
        # What the whole ray has in common: its nearest and farthest hypothesis.
        last = at + int(undecided.number[n])
        foreground, background = undecided.disparity[at:last].max(), undecided.disparity[at:last].min()
        for a in range(at, last):
            # Backward warp: where in its source the hypothesis looks.
            d, k = undecided.disparity[a], np.int64(undecided.source[a]) % np.int64(PLAIN_SOURCE)
            out = features[n, a - at]
            source_x = min(max(x + d * offsets[k, 1], -0.5), width - 0.5)
            source_y = min(max(y + d * offsets[k, 0], -0.5), height - 0.5)
            own = _own_disparity(surfaces, k, source_x, source_y, d)

            # Its profile: how far its source lies from the hypothesis, along the parallax and across it.
            for i in range(len(PROFILE_PX)):
                step_x, step_y = PROFILE_PX[i] * steps[k, 1], PROFILE_PX[i] * steps[k, 0]
                for j in range(2):
                    row = np.uint64(min(max(nearest_pixel(source_y + (step_x if j else step_y)), 0), height - 1))
                    column = np.uint64(min(max(nearest_pixel(source_x + (-step_y if j else step_x)), 0), width - 1))
                    out[PROFILE + 2 * i + j] = _softsign((surfaces[k, row, column] - d) * parallax)

            # All differences in pixels of parallax in this view: T need not know the scene's scale.
            v, u = min(max(nearest_pixel(source_y), 0), height - 1), min(max(nearest_pixel(source_x), 0), width - 1)
            out[AGREES] = _softsign((d - own) * parallax)  # does the source agree?
            out[TO_NEAREST] = _softsign((foreground - d) * parallax)  # against the nearest hypothesis
            out[TO_FARTHEST] = _softsign((d - background) * parallax)  # ... and the farthest
            out[SHARE] = undecided.share[a]
            out[LANDS] = undecided.nearest[a] / NOWHERE_PX  # how far away the surface lands, 0..1
            out[INPAINTED] = 1.0 if k >= rays.photo_images else 0.0  # whether it is inpainted
            out[PARALLAX] = log_parallax
            out[COVERAGE] = rays.coverage[k, v, u]
            out[UNCOVERED] = undecided.uncovered[n]  # share of the pixel that nothing covers
            out[PLAIN] = 1.0 if undecided.source[a] >= PLAIN_SOURCE else 0.0
        at = last


@kernel
def _blend(rays, offsets, pixel, disparity, source, weights, colors):
    images, surfaces = rays.colors, rays.disparity
    _, height, width = surfaces.shape
    for n in range(len(weights)):
        total = red = green = blue = apart = 0.0
        first_r = first_g = first_b = 0.0
        for a in range(weights.shape[1]):
            w = weights[n, a]
            if not w > LEAST_VOTE:
                continue
            # Each hypothesis votes with the colour that its disparity leads to (paper, section 3.2).
            d, k = disparity[n, a], np.int64(source[n, a] % PLAIN_SOURCE)
            t, s = offsets[k, 0], offsets[k, 1]
            x = min(max(pixel[n, 1] + d * s, -0.5), width - 0.5)
            y = min(max(pixel[n, 0] + d * t, -0.5), height - 0.5)
            if source[n, a] >= PLAIN_SOURCE:
                r, g, b = cubic(images, k, x, y)
            elif k < rays.photo_images:
                r, g, b = resample(images, surfaces, k, x, y, d, max(abs(s), abs(t), 1e-9))
            else:
                r, g, b = resample_inpainted(images, surfaces, k, x, y, d, max(abs(s), abs(t), 1e-9))
            # How far the votes lie apart; the first is kept as it is.
            if total == 0.0:
                first_r, first_g, first_b = max(r, 0.0), max(g, 0.0), max(b, 0.0)
            apart = max(apart, abs(r - first_r), abs(g - first_g), abs(b - first_b))
            # The weighted sum of the paper's equation 1, in linear light.
            total += w
            red += w * linear_scalar(r)
            green += w * linear_scalar(g)
            blue += w * linear_scalar(b)
        # To linear light and back costs the last digits: votes that agree do without.
        colors[n, 0], colors[n, 1], colors[n, 2] = first_r, first_g, first_b
        if apart > SAME_COLOR:
            colors[n, 0] = srgb_scalar(red / total)
            colors[n, 1] = srgb_scalar(green / total)
            colors[n, 2] = srgb_scalar(blue / total)
