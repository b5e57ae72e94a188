"""What ambiguous rays show once their hypotheses have weights."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.ambiguity import SOFT
from iibr_core.rendering.ambiguous_rays import (
    INPAINTED,
    LEAST_WEIGHT,
    PLAIN,
    SHARE,
    SOFTNESS,
    UNCOVERED,
    AmbiguousRays,
)
from iibr_core.rendering.ray_set import RaySet
from iibr_core.rendering.resampling import cubic, resample, resample_inpainted
from iibr_core.runtime.jit import kernel, linear_scalar, srgb_scalar
from iibr_core.types import FloatImage

LEAST_VOTE = 0.004
"""Weights below this change no colour by a visible step."""
SAME_COLOR = 1e-5
"""Votes no farther apart than this need no mean: so a flat scene's views are the photo to the bit."""
SAY = 0.6
"""T's say, 0..1, where surfaces of the photo share a ray they cover, at sharp edges: both are as often right there."""


def bound_weights(ambiguous: AmbiguousRays, weights: FloatImage) -> FloatImage:
    """T's weights (N, K), moved towards the closed form's on rays that this one is fairly sure of: see SAY."""
    share = ambiguous.features[..., SHARE] * ambiguous.mask
    first = ambiguous.features[:, 0]
    has_inpainted = ((share > 0) & (ambiguous.features[..., INPAINTED] > 0)).any(axis=1)
    sure = (first[:, UNCOVERED] <= LEAST_WEIGHT) & (first[:, SOFTNESS] <= SOFT) & ~has_inpainted
    closed = share[sure] / np.maximum(share[sure].sum(axis=1, keepdims=True), np.float32(LEAST_WEIGHT))
    bounded = weights.copy()
    bounded[sure] = SAY * weights[sure] + (1 - SAY) * closed
    return bounded


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
    colors = np.zeros((len(weights), 3), np.float32)
    arrays = rays.arrays
    _blend(
        arrays.colors, arrays.disparity, rays.to_view(ambiguous.offset), rays.photo_images,
        ambiguous.pixel, ambiguous.disparity, ambiguous.source, weights, colors,
    )  # fmt: skip
    heaviest = weights.argmax(axis=1)[:, None]
    return (
        colors,
        np.take_along_axis(ambiguous.disparity, heaviest, axis=1)[:, 0],
        np.take_along_axis(ambiguous.source, heaviest, axis=1)[:, 0] % PLAIN,
    )


@kernel
def _blend(images, surfaces, offsets, photo_images, pixel, disparity, source, weights, colors):
    _, height, width = surfaces.shape
    for n in range(len(weights)):
        total = red = green = blue = apart = 0.0
        first_r = first_g = first_b = 0.0
        for a in range(weights.shape[1]):
            w = weights[n, a]
            if not w > LEAST_VOTE:
                continue
            # Each hypothesis votes with the colour that its disparity leads to (paper, section 3.2).
            d, k = disparity[n, a], np.int64(source[n, a] % PLAIN)
            t, s = offsets[k, 0], offsets[k, 1]
            x = min(max(pixel[n, 1] + d * s, -0.5), width - 0.5)
            y = min(max(pixel[n, 0] + d * t, -0.5), height - 0.5)
            if source[n, a] >= PLAIN:
                r, g, b = cubic(images, k, x, y)
            elif k < photo_images:
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
