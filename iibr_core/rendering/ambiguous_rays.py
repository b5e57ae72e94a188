"""Ambiguous rays: those of which the closed form leaves open which surface they show.

Either it covers them in part, or by several surfaces whose shares nothing tells, or a soft edge of the map lies near:
then it is sure of a surface that may be the wrong one. Of all others it is right, and T has no say.

For each of them K hypotheses are laid out: surfaces that land within a few pixels, as different from each other as
possible. A hypothesis says "this ray shows the source ray that disparity d leads to"; its features say how well that
agrees with the disparity that the source ray really has. This is what a trained T decides on; colours are never among
the features.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import floor

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.ambiguity import AMBIGUOUS_AROUND_PX, SOFT
from iibr_core.rendering.candidates import Candidates
from iibr_core.rendering.coherent_cells import land_marked
from iibr_core.rendering.ray_set import CELL_PX, RaySet
from iibr_core.rendering.resampling import cubic, resample, resample_inpainted
from iibr_core.runtime.jit import kernel, linear_scalar, nearest_pixel, srgb_scalar
from iibr_core.types import FloatImage, ViewOffset

HYPOTHESES = 6
"""K: the paper's 5 surfaces and the plain look-up. More take time and gain little (docs/transformer.md)."""
PLAIN = 128
"""Added to the source of the hypothesis that the ray shows the front-most surface as the photo mixed it at its edge."""
REACH_PX = 6
"""Surfaces that land within this many pixels, each way, are considered."""
AROUND = np.array(
    [
        (0, 1), (0, -1), (1, 0), (-1, 0), (2, 2), (2, -2), (-2, 2), (-2, -2), (0, 3), (0, -3), (3, 0), (-3, 0),
        (4, 4), (4, -4), (-4, 4), (-4, -4), (0, 6), (0, -6), (6, 0), (-6, 0),
    ]
)  # fmt: skip
"""Where, in pixels down and right, the nearest first: this is enough to meet every surface that is not a sliver."""
AROUND_DISTANCE = np.hypot(*AROUND.T)
AROUND_SHARP = 12
"""Where depth edges are not SOFT, only the first so many of AROUND are looked at."""
OWN_LANDING_PX = 0.75
"""What lands near by and differs from a hypothesis by less parallax than this is of its surface."""
DISTINCT_PX = 0.5
"""Hypotheses closer than this are one; where all of a ray's are, nothing is to be decided."""
VISIBLE = 0.08
"""Where the colours of a ray's hypotheses lie no farther apart than this, sRGB-encoded, nothing is to be decided."""
LEAST_WEIGHT = 0.02
LEAST_VOTE = 0.004
"""Weights below this change no colour by a visible step."""
SAME_COLOR = 1e-5
"""Votes no farther apart than this need no mean: so a flat scene's views are the photo to the bit."""
INPAINTED_APART_PX = 100.0
"""What is inpainted and what the photo shows are different hypotheses, however close their disparities."""
PROFILE_PX = (-4.0, -2.5, -1.0, 1.0, 2.5, 4.0)
"""Where the disparity around a source ray is sampled, along the parallax and across it."""
MOST_PX = 1e4
SHARE, INPAINTED, SOFTNESS, UNCOVERED = 6, 8, 11, 12
"""Features: the closed form's weight, whether inpainted, the map's softness, the share that nothing covers."""
SAY = 0.6
"""T's say, 0..1, where surfaces of the photo share a ray they cover, at sharp edges: both are as often right there."""
PROFILE = 15
FEATURES = PROFILE + 2 * len(PROFILE_PX) + 1
"""The last is 0: a multiple of four suits the arithmetic."""


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


@dataclass(frozen=True, eq=False)
class UndecidedRays:
    """Ambiguous rays (N) of one view before T is asked, as small as they can wait for it.

    hypotheses: K. pixel (N): index into the view's pixels, row by row. number (N): hypotheses of each, at most K.
    uncovered (N): share of the ray that nothing covers. disparity, source, share, nearest: of all hypotheses, those of
    one ray after those of the other; share is the closed form's weight, nearest how many pixels away its surface lands.
    """

    offset: ViewOffset
    hypotheses: int
    pixel: NDArray[np.int32]
    number: NDArray[np.uint8]
    uncovered: FloatImage
    disparity: FloatImage
    source: NDArray[np.uint8]
    share: FloatImage
    nearest: FloatImage

    @property
    def nbytes(self) -> int:
        """Memory they take."""
        return sum(part.nbytes for part in vars(self).values() if isinstance(part, np.ndarray))


def find_ambiguous_rays(
    rays: RaySet,
    candidates: Candidates,
    weights: FloatImage,
    shown: tuple[FloatImage, NDArray[np.uint8]],
    rows: tuple[int, int],
    every: bool = False,
    hypotheses: int = HYPOTHESES,
) -> AmbiguousRays:
    """The ambiguous rays in rows [first, last) of these candidates, which should reach REACH_PX rows beyond them.

    shown: what `resampling.heaviest_candidate` gives: disparity and source (N, W). every: take all rays near which
    anything lands, ambiguous or not. hypotheses: K, at least 2.
    """
    return describe_rays(rays, find_undecided_rays(rays, candidates, weights, shown, rows, every, hypotheses))


def find_undecided_rays(
    rays: RaySet,
    candidates: Candidates,
    weights: FloatImage,
    shown: tuple[FloatImage, NDArray[np.uint8]],
    rows: tuple[int, int],
    every: bool = False,
    hypotheses: int = HYPOTHESES,
    decided: NDArray[np.bool_] | None = None,
) -> UndecidedRays:
    """The rays of `find_ambiguous_rays`, but for those already decided (N, W), and as little as will do to describe
    them later.
    """
    first, last = rows
    shape = (last - first) * candidates.count.shape[1], hypotheses
    pixel, number = np.empty((shape[0], 2), np.int64), np.zeros(shape[0], np.int64)
    disparity, source = np.empty(shape, np.float32), np.empty(shape, np.uint8)
    share, nearest = np.empty(shape, np.float32), np.empty(shape, np.float32)
    from_sources = np.array(candidates.offset) - rays.arrays[0]
    around = rays.statistics
    parallax = max(*map(abs, candidates.offset), 1e-9)
    is_soft = around.softness > SOFT
    looks = len(AROUND) if is_soft else AROUND_SHARP
    in_band = candidates.first_row, candidates.first_row + len(candidates.count)
    near_soft = land_marked(rays.cells, from_sources, rays.soft_cells, in_band, REACH_PX)
    selected = _select_rays(
        candidates.smooth & (not every), near_soft, candidates.count, candidates.source, weights, *shown,
        around.soft, is_soft, from_sources,
        rays.photo_images, parallax, looks, candidates.first_row, first, last, every, pixel,
    )  # fmt: skip
    count = _collect_hypotheses(
        rays.arrays[1], selected, candidates.count, candidates.disparity, candidates.source, weights, *shown,
        rays.size.height, from_sources, rays.photo_images, parallax, looks, candidates.first_row, every,
        pixel, number, disparity, source, share, nearest,
    )  # fmt: skip
    if decided is None:
        decided = np.zeros(candidates.count.shape, np.bool_)
    packed = _pack(
        candidates.count, weights, decided, candidates.first_row, pixel[:count], number, disparity, source, share,
        nearest,
    )  # fmt: skip
    return UndecidedRays(candidates.offset, hypotheses, *packed)


def describe_rays(rays: RaySet, undecided: UndecidedRays) -> AmbiguousRays:
    """With the features that T decides by."""
    offsets, _, surfaces, coverage, _ = rays.arrays
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
        surfaces, coverage, around.low, around.high, around.step, around.softness,
        np.array(undecided.offset) - offsets, rays.photo_images, max(*map(abs, undecided.offset), 1e-9),
        pixel, undecided.number, undecided.uncovered, disparity, source, share, nearest, features,
    )  # fmt: skip
    return AmbiguousRays(undecided.offset, pixel, mask, disparity, source, features)


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
    offsets, images, surfaces, *_ = rays.arrays
    _blend(
        images, surfaces, np.array(ambiguous.offset) - offsets, rays.photo_images,
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


@kernel
def _is_near_soft_edge(soft, is_soft, d, image, x, y, offsets, photo_images):
    """Whether the source ray that shows at (x, y) lies near a soft edge; is_soft: what inpainted ones take for that."""
    if image >= photo_images:
        return is_soft
    height, width = soft.shape
    u = min(max(nearest_pixel(x + d * offsets[image, 1]), 0), width - 1)
    v = min(max(nearest_pixel(y + d * offsets[image, 0]), 0), height - 1)
    return soft[v, u]


@kernel
def _is_open(count, source, weights, photo_images, y, x):
    """Whether the closed form leaves open what a ray shows: it covers the ray in part, or by several surfaces of which
    none is a fringe: a fringe tells the shares.
    """
    used = np.int64(count[y, x])
    # Most rays: one surface.
    if used == 1:
        return weights[0, y, x] < 1.0 - LEAST_WEIGHT
    heavy, fringed, covered = 0, False, 0.0
    for k in range(used):
        covered += weights[k, y, x]
        if weights[k, y, x] > LEAST_WEIGHT:
            heavy += 1
            fringed |= 0 < source[k, y, x] < photo_images
    return covered < 1.0 - LEAST_WEIGHT or (heavy != 1 and not fringed)


@kernel
def _select_rays(
    smooth, near_soft, count, candidate_source, weights, shown_disparity, shown_source, soft, is_soft, offsets,
    photo_images, parallax, looks, first_row, first, last, every, pixel,
):  # fmt: skip
    """Write the (row, column) of the ambiguous rays to pixel; returns how many they are. In smooth cells there are none
    but where soft edges are near.
    """
    rows, width = count.shape
    least_apart = AMBIGUOUS_AROUND_PX / parallax
    found = 0
    for y in range(first, last):
        # Band rows count from first_row, cells from the picture's first row.
        cell_row = (y + first_row % CELL_PX) // CELL_PX
        for x in range(width):
            cell = x // CELL_PX
            if smooth[cell_row, cell] and not near_soft[cell_row, cell]:
                continue
            is_ambiguous = every or _is_open(count, candidate_source, weights, photo_images, y, x)
            if not is_ambiguous and near_soft[cell_row, cell]:
                # Another surface shows near by, and a soft edge lies between.
                d, image = shown_disparity[y, x], np.int64(shown_source[y, x])
                is_soft_here = _is_near_soft_edge(soft, is_soft, d, image, x, first_row + y, offsets, photo_images)
                for i in range(looks):
                    v, u = y + AROUND[i, 0], x + AROUND[i, 1]
                    if not (0 <= v < rows and 0 <= u < width and count[v, u] > 0):
                        continue
                    other, image = shown_disparity[v, u], np.int64(shown_source[v, u])
                    if abs(other - d) > least_apart and (
                        is_soft_here
                        or _is_near_soft_edge(soft, is_soft, other, image, u, first_row + v, offsets, photo_images)
                    ):
                        is_ambiguous = True
                        break
            if is_ambiguous:
                pixel[found, 0], pixel[found, 1] = y, x
                found += 1
    return found


@kernel
def _contrast(images, offsets, x, y, ray, picked, disparity, source):
    """How far the colours that a ray's hypotheses look up lie apart at most: those of the four pixels around each."""
    _, height, width, _ = images.shape
    low_r = low_g = low_b = np.float32(np.inf)
    high_r = high_g = high_b = np.float32(-np.inf)
    for j in range(picked):
        d, k = disparity[ray, j], np.uint64(source[ray, j])
        column, row = floor(x + d * offsets[k, 1]), floor(y + d * offsets[k, 0])
        for i in range(4):
            u = np.uint64(min(max(column + i % 2, 0), width - 1))
            v = np.uint64(min(max(row + i // 2, 0), height - 1))
            r, g, b = images[k, v, u, 0], images[k, v, u, 1], images[k, v, u, 2]
            low_r, low_g, low_b = min(low_r, r), min(low_g, g), min(low_b, b)
            high_r, high_g, high_b = max(high_r, r), max(high_g, g), max(high_b, b)
    return max(high_r - low_r, high_g - low_g, high_b - low_b)


@kernel
def _collect_hypotheses(
    images, selected, count, surface, origin, weights, shown_disparity, shown_source, height, offsets,
    photo_images, parallax, looks, first_row, every,
    pixel, number, disparity, source, share, nearest,
):  # fmt: skip
    """Pick the surfaces on each of the first `selected` rays of pixel, then again and again the one around it farthest
    from those. Rays with nothing to decide are dropped: what is left moves up; returns how many those are.

    nearest: how many pixels away each surface lands.
    """
    rows, width = count.shape
    near_d, near_k, near_px = np.empty(len(AROUND)), np.empty(len(AROUND), np.int64), np.empty(len(AROUND))
    away, near_guess = np.empty(len(AROUND)), np.empty(len(AROUND), np.bool_)
    found = 0
    for ray in range(selected):
        y, x = pixel[ray, 0], pixel[ray, 1]
        # First the surfaces on the ray itself. One slot stays free for the plain hypothesis.
        picked = 0
        for k in range(np.int64(count[y, x])):
            if weights[k, y, x] > LEAST_WEIGHT and picked < disparity.shape[1] - 1:
                disparity[found, picked], source[found, picked] = surface[k, y, x], origin[k, y, x]
                share[found, picked] = weights[k, y, x]
                picked += 1
        # What shows around it, the nearest first.
        n = 0
        for i in range(looks):
            v, u = y + AROUND[i, 0], x + AROUND[i, 1]
            if not (0 <= v < rows and 0 <= u < width and count[v, u] > 0):
                continue
            d, image = shown_disparity[v, u], np.int64(shown_source[v, u])
            source_x, source_y = x + d * offsets[image, 1], first_row + y + d * offsets[image, 0]
            is_inside = -0.5 <= source_x <= width - 0.5 and -0.5 <= source_y <= height - 0.5
            if is_inside or image >= photo_images:  # the photo shows nothing beyond its frame
                near_d[n], near_k[n], near_px[n], near_guess[n] = d, image, AROUND_DISTANCE[i], image >= photo_images
                n += 1
        # In a hole: begin with the front-most surface around it.
        if picked == 0 and n > 0:
            front = np.argmax(near_d[:n])
            disparity[found, 0], source[found, 0], share[found, 0] = near_d[front], near_k[front], 0.0
            picked = 1
        # Farthest-point sampling of the disparities around it, until slots or distinct ones run out. away: how far what
        # is near lies from what is picked.
        own_picked, compared = picked, 0
        for i in range(n):
            away[i] = np.inf
        while 0 < picked < disparity.shape[1] - 1:
            for j in range(compared, picked):
                d, is_guess = np.float64(disparity[found, j]), source[found, j] >= photo_images
                for i in range(n):
                    apart = abs(near_d[i] - d) * parallax + (INPAINTED_APART_PX if near_guess[i] != is_guess else 0.0)
                    away[i] = min(away[i], apart)
            best, best_distance = -1, DISTINCT_PX
            for i in range(n):
                if away[i] > best_distance:
                    best, best_distance = i, away[i]
            if best < 0:
                break
            compared = picked
            disparity[found, picked], source[found, picked] = near_d[best], near_k[best]
            share[found, picked] = 0.0
            picked += 1
        # Is there anything to decide?
        apart = 0.0
        for j in range(picked):
            apart = max(apart, abs(disparity[found, j] - disparity[found, 0]) * parallax)
        if not every and apart > DISTINCT_PX:
            contrast = _contrast(images, offsets, x, first_row + y, found, picked, disparity, source)
            apart = apart if contrast > VISIBLE else 0.0
        if picked > 0 and (every or apart > DISTINCT_PX):
            # The plain hypothesis: the front-most surface on the ray, colours as the photo mixed them at its edge.
            mixed = 0
            for j in range(own_picked):
                if disparity[found, j] > disparity[found, mixed]:
                    mixed = j
            disparity[found, picked], source[found, picked] = disparity[found, mixed], source[found, mixed] + PLAIN
            share[found, picked] = 0.0
            picked += 1
            # How near each surface lands: 0 on the ray itself, else by the first landing like it.
            for j in range(picked):
                nearest[found, j] = 0.0 if share[found, j] > 0 else REACH_PX + 1.0
                if share[found, j] > 0:
                    continue
                for i in range(n):
                    if abs(near_d[i] - disparity[found, j]) * parallax < OWN_LANDING_PX:
                        nearest[found, j] = near_px[i]
                        break
            pixel[found, 0], pixel[found, 1], number[found] = y, x, picked
            found += 1
    return found


@kernel
def _pack(count, weights, decided, first_row, pixel, number, disparity, source, share, nearest):
    """The arrays of `UndecidedRays`, in their order: of the rays of pixel, those that are not decided."""
    width = decided.shape[1]
    rays = hypotheses = 0
    for n in range(len(pixel)):
        if not decided[pixel[n, 0], pixel[n, 1]]:
            rays, hypotheses = rays + 1, hypotheses + number[n]
    index, used = np.empty(rays, np.int32), np.empty(rays, np.uint8)
    uncovered = np.empty(rays, np.float32)
    surfaces, images = np.empty(hypotheses, np.float32), np.empty(hypotheses, np.uint8)
    shares, distances = np.empty(hypotheses, np.float32), np.empty(hypotheses, np.float32)
    ray = at = 0
    for n in range(len(pixel)):
        y, x = pixel[n]
        if decided[y, x]:
            continue
        left = 1.0
        for slot in range(np.int64(count[y, x])):
            left -= weights[slot, y, x]
        index[ray], used[ray], uncovered[ray] = (first_row + y) * width + x, number[n], max(left, 0.0)
        ray += 1
        for a in range(number[n]):
            surfaces[at], images[at] = disparity[n, a], source[n, a]
            shares[at], distances[at] = share[n, a], nearest[n, a]
            at += 1
    return index, used, uncovered, surfaces, images, shares, distances


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
