"""What the transformer is told of each hypothesis: how well it agrees with the disparity of its source ray.

All differences are pixels of parallax in the view, so that nothing depends on the scene's scale.
"""

from __future__ import annotations

from math import floor

import numpy as np

from iibr_core.rendering.ambiguous_rays import (
    FEATURES,
    HYPOTHESES,
    INPAINTED,
    PLAIN,
    PROFILE,
    PROFILE_PX,
    REACH_PX,
    SHARE,
    SOFTNESS,
    UNCOVERED,
    AmbiguousRays,
    UndecidedRays,
)
from iibr_core.rendering.candidates import Candidates
from iibr_core.rendering.ray_set import RaySet
from iibr_core.rendering.resampling import ShownRays
from iibr_core.rendering.undecided_rays import find_undecided_rays
from iibr_core.runtime.jit import kernel, nearest_pixel
from iibr_core.types import FloatImage

MOST_PX = 1e4


def find_ambiguous_rays(
    rays: RaySet,
    candidates: Candidates,
    weights: FloatImage,
    shown: ShownRays,
    rows: tuple[int, int],
    every: bool = False,
    hypotheses: int = HYPOTHESES,
) -> AmbiguousRays:
    """The ambiguous rays in rows [first, last) of these candidates, which should reach REACH_PX rows beyond them.

    shown: what `resampling.heaviest_candidate` gives. every: take all rays near which
    anything lands, ambiguous or not. hypotheses: K, at least 2.
    """
    return describe_rays(rays, find_undecided_rays(rays, candidates, weights, shown, rows, every, hypotheses))


def describe_rays(rays: RaySet, undecided: UndecidedRays) -> AmbiguousRays:
    """With the features that T decides by."""
    arrays = rays.arrays
    around = rays.statistics
    mask = np.arange(undecided.hypotheses) < undecided.number[:, None]
    disparity, share, nearest = (np.zeros(mask.shape, np.float32) for _ in range(3))
    source = np.zeros(mask.shape, np.uint8)
    for part, packed in (
        (disparity, undecided.disparity), (source, undecided.source), (share, undecided.share),
        (nearest, undecided.nearest),
    ):  # fmt: skip
        _unpack(packed, undecided.number, part)
    pixel = np.stack(np.divmod(undecided.pixel.astype(np.int64), rays.size.width), axis=1)
    features = np.zeros((*mask.shape, FEATURES), np.float32)
    _describe_hypotheses(
        arrays.disparity, arrays.coverage, around.low, around.high, around.step, around.softness,
        rays.to_view(undecided.offset), rays.photo_images, max(*map(abs, undecided.offset), 1e-9),
        pixel, undecided.number, undecided.uncovered, disparity, source, share, nearest, features,
    )  # fmt: skip
    return AmbiguousRays(undecided.offset, pixel, mask, disparity, source, features)


@kernel
def _unpack(packed, number, rows):
    """What `_pack` made of rows (N, K), back into rows."""
    at = 0
    for n in range(len(number)):
        for a in range(number[n]):
            rows[n, a] = packed[at]
            at += 1


@kernel
def _softsign(px):
    """Pixels on a scale of -4..4 where small differences count most; 0 where there is no difference to tell."""
    if px != px:
        return 0.0
    # 4 softsign(px / 4), finite for all input.
    px = min(max(px, -MOST_PX), MOST_PX)
    return px / (1.0 + 0.25 * abs(px))


@kernel
def _describe_hypotheses(
    surfaces, coverage, low, high, step, softness, offsets, photo_images, parallax,
    pixel, number, uncovered, disparity, source, share, nearest, features,
):  # fmt: skip
    _, height, width = surfaces.shape
    # Unit vectors along each source's parallax.
    steps = np.empty_like(offsets)
    for image in range(len(offsets)):
        steps[image] = offsets[image] / max(np.hypot(offsets[image, 0], offsets[image, 1]), 1e-9)
    log_parallax = np.log1p(parallax)
    for n in range(len(pixel)):
        y, x = pixel[n]
        # What the whole ray has in common: its nearest and farthest hypothesis.
        front = back = disparity[n, 0]
        for a in range(number[n]):
            front, back = max(front, disparity[n, a]), min(back, disparity[n, a])
        for a in range(number[n]):
            # Backward warp: where in its source the hypothesis looks.
            d, k = disparity[n, a], np.int64(source[n, a]) % np.int64(PLAIN)
            t, s = offsets[k, 0], offsets[k, 1]
            source_x = min(max(x + d * s, -0.5), width - 0.5)
            source_y = min(max(y + d * t, -0.5), height - 0.5)

            # The disparity that the source really has there, bilinear over its surfaces.
            column, row = floor(source_x), floor(source_y)
            fx, fy = source_x - column, source_y - row
            own = total = 0.0
            for j in range(2):
                for i in range(2):
                    v, u = min(max(row + j, 0), height - 1), min(max(column + i, 0), width - 1)
                    w = (fx if i else 1.0 - fx) * (fy if j else 1.0 - fy)
                    if surfaces[k, v, u] == surfaces[k, v, u]:
                        own, total = own + w * surfaces[k, v, u], total + w
            own = own / total if total > 0 else d

            # Its profile: how far its source lies from the hypothesis, along the parallax and across it.
            for i in range(len(PROFILE_PX)):
                step_x, step_y = PROFILE_PX[i] * steps[k, 1], PROFILE_PX[i] * steps[k, 0]
                for j in range(2):
                    v = np.uint64(min(max(nearest_pixel(source_y + (step_x if j else step_y)), 0), height - 1))
                    u = np.uint64(min(max(nearest_pixel(source_x + (-step_y if j else step_x)), 0), width - 1))
                    features[n, a, PROFILE + 2 * i + j] = _softsign((surfaces[k, v, u] - d) * parallax)

            # All differences in pixels of parallax in this view: T need not know the scene's scale.
            v, u = min(max(nearest_pixel(source_y), 0), height - 1), min(max(nearest_pixel(source_x), 0), width - 1)
            around_low, around_high = min(low[k, v, u], d), max(high[k, v, u], d)
            out = features[n, a]
            out[0] = _softsign((d - own) * parallax)  # does the source agree?
            out[1] = _softsign((around_high - d) * parallax)  # what lies in front of it there
            out[2] = _softsign((d - around_low) * parallax)  # ... and behind
            out[3] = (own - around_low) / max(around_high - around_low, 1e-6)  # where between both its own lies
            out[4] = _softsign((front - d) * parallax)  # against the nearest hypothesis
            out[5] = _softsign((d - back) * parallax)  # ... and the farthest
            out[SHARE] = share[n, a]
            out[7] = nearest[n, a] / (REACH_PX + 1.0)  # how far away the surface lands, 0..1
            out[INPAINTED] = 1.0 if k >= photo_images else 0.0  # inpainted
            out[9] = log_parallax
            out[10] = coverage[k, v, u]
            out[SOFTNESS] = softness
            out[UNCOVERED] = uncovered[n]  # share of the pixel that nothing covers
            out[13] = _softsign(step[k, v, u] * parallax)  # the depth edge beside it
            out[14] = 1.0 if source[n, a] >= PLAIN else 0.0
