"""Ambiguous rays: rays of which the closed form leaves open which surface they show. The transformer decides them.

Either the closed form covers such a ray in part, or by several surfaces whose shares are unknown. For each of them K
hypotheses are laid out: the surfaces on it, then those that land within a few pixels, as different from each other as
possible, last the plain look-up. A hypothesis says "this ray shows the source ray that disparity d leads to". Its
features measure how well it agrees with the disparity that its source ray really has; colours are never among them.
All differences are pixels of parallax in the view, so nothing depends on the scene's scale.
"""

from __future__ import annotations

from math import floor
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.method.candidates import Candidates
from iibr_core.method.look_up import ShownRays, cubic, cubic_on_surface
from iibr_core.method.rays import CELL_PX, RaySet
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import linear_scalar, nearest_pixel, srgb_scalar
from iibr_core.surfaces import SAME_SURFACE_PX
from iibr_core.types import FloatImage, ViewOffset

HYPOTHESES = 6
"""K: the paper's 5 surfaces and the plain look-up. More take time and gain little."""
FAINT_WEIGHT = 0.02
"""Weight below which a surface on a ray is no hypothesis."""
SEARCH_PX = 3
"""Distance within which surfaces that land are considered, in pixels: twice as far would gain 0.002 dB at most."""
BESIDE, DIAGONAL = np.array([(0, 1), (0, -1), (1, 0), (-1, 0)]), np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])
AROUND = np.concatenate([BESIDE, 2 * DIAGONAL, 3 * BESIDE])
"""Offsets (down, right) at which they are looked for."""
AROUND_DISTANCE = np.hypot(*AROUND.T).astype(np.float32)
NOWHERE_PX = 7.0
"""Distance of a surface that lands nowhere around, in pixels, as the transformer was trained."""
MIN_COLOR_CHANGE = 0.05
"""Change of colour, sRGB-encoded, below which the transformer is not asked: the share that the heaviest surface leaves
of a ray, times the difference of its hypotheses' colours.
"""
AGREES, TO_NEAREST, TO_FARTHEST, SHARE, LANDS, INPAINTED, PARALLAX, COVERAGE, UNCOVERED, PLAIN, PROFILE = range(11)
"""Indices of the features; SHARE is the closed form's weight, PROFILE the first of several."""
PROFILE_PX = (-4.0, -2.5, -1.0, 1.0, 2.5, 4.0)
"""Places around a source ray where the disparity is sampled, along the parallax and across it, in pixels."""
FEATURES = PROFILE + 2 * len(PROFILE_PX) + 2
"""Number of features. The last two are 0: a multiple of four suits the arithmetic."""
MAX_PX = 1e4
MIN_HYPOTHESIS_WEIGHT = 0.004
"""Weight below which a hypothesis changes no colour by a visible step."""
SAME_COLOR = 1e-5
"""Largest difference of colours that need no mean: so a flat scene's views are the photo to the bit."""


class AmbiguousRays(NamedTuple):
    """Ambiguous rays (N) of one view and their hypotheses (K).

    pixel (N, 2): (row, column) in the images. number (N): hypotheses in use, at least 2; the last one in use is the
    plain look-up: the ray shows the front-most surface as the photo mixed it at its edge. disparity, source (N, K).
    features (N, K, FEATURES).
    """

    offset: ViewOffset
    pixel: NDArray[np.int64]
    number: NDArray[np.uint8]
    disparity: FloatImage
    source: NDArray[np.uint8]
    features: FloatImage

    @property
    def mask(self) -> NDArray[np.bool_]:
        """Hypotheses in use (N, K)."""
        return np.arange(self.disparity.shape[1]) < self.number[:, None]

    def chosen(self, rays: NDArray[Any]) -> AmbiguousRays:
        """Return these rays, an index array or a mask (N)."""
        return AmbiguousRays(self.offset, *(part[rays] for part in self[1:]))


def find_ambiguous_rays(
    rays: RaySet,
    candidates: Candidates,
    weights: FloatImage,
    shown: ShownRays,
    asked: NDArray[np.bool_],
    every: bool = False,
) -> AmbiguousRays:
    """Return the ambiguous rays among those of candidates that are asked about (N, W); SEARCH_PX more surround them.

    shown: heaviest candidates, see `look_up`. every: take all rays near which anything lands, for training.
    """
    arrays, to_view = rays.arrays, rays.to_view(candidates.offset)
    parallax = max(*map(abs, candidates.offset), 1e-9)
    if not every:
        asked = asked.copy()
        _keep_open_rays(candidates, weights, rays.photo_images, asked)
    pixel = np.stack(np.divmod(np.flatnonzero(asked), asked.shape[1]), axis=1)
    shape = len(pixel), HYPOTHESES
    found = AmbiguousRays(
        candidates.offset,
        pixel,
        np.zeros(len(pixel), np.uint8),
        np.zeros(shape, np.float32),
        np.zeros(shape, np.uint8),
        np.zeros((*shape, FEATURES), np.float32),
    )
    _lay_out(arrays, to_view, parallax, candidates, weights, shown, every, found)
    found = found.chosen(found.number > 0)
    found.pixel[:, 0] += candidates.first_row
    _describe(arrays, to_view, parallax, found)
    return found


def blend(
    rays: RaySet, ambiguous: AmbiguousRays, weights: FloatImage
) -> tuple[FloatImage, FloatImage, NDArray[np.uint8]]:
    """Return colours (N, 3), disparity (N) and source (N) of ambiguous rays for weights (N, K) with rows of sum 1.

    Colours are summed in linear light; disparity and source are those of the heaviest hypothesis.
    """
    colors = np.zeros((len(weights), 3), np.float32)
    _blend(rays.arrays, rays.to_view(ambiguous.offset), ambiguous, weights, colors)
    heaviest = np.arange(len(weights)), weights.argmax(axis=1)
    return colors, ambiguous.disparity[heaviest], ambiguous.source[heaviest]


@kernel
def _keep_open_rays(candidates, weights, photo_images, asked):
    """Clear asked (N, W) where the closed form leaves nothing open, as in smooth cells.

    A ray is open if the closed form covers it in part, or by several surfaces of which none is a fringe, which states
    the shares; and if the heaviest surface leaves enough of the ray.
    """
    number, source, smooth = candidates.number, candidates.source, candidates.smooth
    rows, width = number.shape
    for y in range(rows):
        # Band rows count from first_row, cells from the picture's first row.
        cell_row = (y + candidates.first_row % CELL_PX) // CELL_PX
        for x in range(width):
            # Most rays lie in smooth cells, which are passed over as a whole.
            if x % CELL_PX == 0 and smooth[cell_row, x // CELL_PX]:
                asked[y, x : x + CELL_PX] = False
            if not asked[y, x]:
                continue
            heaviest, covered, fringed = 0.0, 0.0, False
            for k in range(np.int64(number[y, x])):
                covered += weights[k, y, x]
                heaviest = max(heaviest, weights[k, y, x])
                fringed |= weights[k, y, x] > FAINT_WEIGHT and 0 < source[k, y, x] < photo_images
            is_open = covered < 1.0 - FAINT_WEIGHT or not fringed
            asked[y, x] = is_open and 1.0 - heaviest > MIN_COLOR_CHANGE


@kernel
def _surfaces_around(rays, offsets, candidates, shown, y, x, around):
    """Write what shows around a ray, the nearest first: disparity, source and distance in pixels. Return how many."""
    (near_disparity, near_source, near_px), number, first_row = around, candidates.number, candidates.first_row
    (band_rows, width), height = number.shape, rays.disparity.shape[1]
    n = 0
    for i in range(len(AROUND)):
        v, u = y + AROUND[i, 0], x + AROUND[i, 1]
        if not (0 <= v < band_rows and 0 <= u < width and number[v, u] > 0):
            continue
        d, image = shown.disparity[v, u], np.int64(shown.source[v, u])
        source_x, source_y = x + d * offsets[image, 1], first_row + y + d * offsets[image, 0]
        is_inside = -0.5 <= source_x <= width - 0.5 and -0.5 <= source_y <= height - 0.5
        if is_inside or image >= rays.photo_images:  # the photo shows nothing beyond its frame
            near_disparity[n], near_source[n], near_px[n] = d, image, AROUND_DISTANCE[i]
            n += 1
    return n


@kernel
def _pick_apart(near_disparity, near_source, n, parallax, disparity, source, picked):
    """Add the disparities around a ray by farthest-point sampling, until slots or distinct disparities run out, and
    return the number of hypotheses. One slot stays free. In a hole, begin with the front-most surface around it.
    """
    if picked == 0 and n > 0:
        foreground = np.argmax(near_disparity[:n])
        disparity[0], source[0] = near_disparity[foreground], near_source[foreground]
        picked = 1
    # Differences between near and picked disparities.
    away = np.full(len(AROUND), np.inf)
    compared = 0
    while 0 < picked < len(disparity) - 1:
        for j in range(compared, picked):
            d = np.float64(disparity[j])
            for i in range(n):
                away[i] = min(away[i], abs(near_disparity[i] - d) * parallax)
        best, best_distance = -1, SAME_SURFACE_PX
        for i in range(n):
            if away[i] > best_distance:
                best, best_distance = i, away[i]
        if best < 0:
            break
        compared = picked
        disparity[picked], source[picked] = near_disparity[best], near_source[best]
        picked += 1
    return picked


@kernel
def _lay_out(rays, to_view, parallax, candidates, weights, shown, every, found):
    """Write the hypotheses of each ray: the surfaces on it, those around it, the plain look-up.

    The number stays 0 where nothing is to be decided.
    """
    around = np.empty(len(AROUND)), np.empty(len(AROUND), np.int64), np.empty(len(AROUND))
    near_d, near_k, near_px = around
    for ray in range(len(found.pixel)):
        y, x = found.pixel[ray, 0], found.pixel[ray, 1]
        disparity, source, features = found.disparity[ray], found.source[ray], found.features[ray]
        share = features[:, SHARE]
        # First the surfaces on the ray itself. One slot stays free for the plain hypothesis.
        picked, mixed, left = 0, 0, 1.0
        for k in range(np.int64(candidates.number[y, x])):
            left -= weights[k, y, x]
            if weights[k, y, x] > FAINT_WEIGHT and picked < len(disparity) - 1:
                disparity[picked], source[picked] = candidates.disparity[k, y, x], candidates.source[k, y, x]
                share[picked] = weights[k, y, x]
                mixed = picked if disparity[picked] > disparity[mixed] else mixed
                picked += 1
        n = _surfaces_around(rays, to_view, candidates, shown, y, x, around)
        picked = _pick_apart(near_d, near_k, n, parallax, disparity, source, picked)
        first_row, own = candidates.first_row, disparity[:picked]
        if picked == 0 or not (
            every or _is_undecided(rays.colors, to_view, parallax, first_row + y, x, own, source, share)
        ):
            continue
        # The plain hypothesis: the front-most surface on the ray, colours as the photo mixed them at its edge.
        disparity[picked], source[picked] = disparity[mixed], source[mixed]
        found.number[ray] = picked + 1
        features[: picked + 1, UNCOVERED] = max(left, 0.0)
        # Distance at which each surface lands: 0 on the ray itself, else that of the first landing of it.
        for j in range(picked + 1):
            if share[j] > 0:
                continue
            features[j, LANDS] = 1.0
            for i in range(n):
                if abs(near_d[i] - disparity[j]) * parallax < SAME_SURFACE_PX:
                    features[j, LANDS] = near_px[i] / NOWHERE_PX
                    break


@kernel
def _is_undecided(images, offsets, parallax, y, x, disparity, source, share):
    """Return whether a ray's hypotheses are several surfaces whose colours differ visibly, see MIN_COLOR_CHANGE.

    Their colours are those of the four pixels around where each of them looks its colour up.
    """
    _, height, width, _ = images.shape
    apart = 0.0
    low_r = low_g = low_b = np.float32(np.inf)
    high_r = high_g = high_b = np.float32(-np.inf)
    for j in range(len(disparity)):
        d, k = disparity[j], np.uint64(source[j])
        apart = max(apart, abs(d - disparity[0]) * parallax)
        column = floor(x + d * offsets[k, 1])
        row = floor(y + d * offsets[k, 0])
        for i in range(4):
            u = np.uint64(min(max(column + i % 2, 0), width - 1))
            v = np.uint64(min(max(row + i // 2, 0), height - 1))
            r, g, b = images[k, v, u, 0], images[k, v, u, 1], images[k, v, u, 2]
            low_r, low_g, low_b = min(low_r, r), min(low_g, g), min(low_b, b)
            high_r, high_g, high_b = max(high_r, r), max(high_g, g), max(high_b, b)
    left = 1.0 - share[: len(disparity)].max()
    may_change = left * max(high_r - low_r, high_g - low_g, high_b - low_b)
    return apart > SAME_SURFACE_PX and may_change > MIN_COLOR_CHANGE


@kernel
def _softsign(px):
    """Return pixels on a scale of -4..4 on which small differences count most; 0 for NaN."""
    if px != px:
        return 0.0
    # 4 softsign(px / 4), finite for all input.
    px = min(max(px, -MAX_PX), MAX_PX)
    return px / (1.0 + 0.25 * abs(px))


@kernel
def _source_disparity(surfaces, k, x, y, d):
    """Return the disparity that a source has at a place, bilinear over its surfaces; d if it has none."""
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
def _describe(rays, offsets, parallax, found):
    """Write the features of each hypothesis that the layout did not."""
    surfaces = rays.disparity
    _, height, width = surfaces.shape
    # Unit vectors along each source's parallax.
    steps = np.empty_like(offsets)
    for image in range(len(offsets)):
        steps[image] = offsets[image] / max(np.hypot(offsets[image, 0], offsets[image, 1]), 1e-9)
    log_parallax = np.log1p(parallax)
    for n in range(len(found.pixel)):
        y, x = found.pixel[n]
        number = np.int64(found.number[n])
        foreground, background = found.disparity[n, :number].max(), found.disparity[n, :number].min()
        for a in range(number):
            # Backward warp: where in its source the hypothesis looks.
            d, k, out = found.disparity[n, a], np.int64(found.source[n, a]), found.features[n, a]
            source_x = min(max(x + d * offsets[k, 1], -0.5), width - 0.5)
            source_y = min(max(y + d * offsets[k, 0], -0.5), height - 0.5)
            # Its profile: how far its source lies from the hypothesis, along the parallax and across it.
            for i in range(len(PROFILE_PX)):
                step_x, step_y = PROFILE_PX[i] * steps[k, 1], PROFILE_PX[i] * steps[k, 0]
                for j in range(2):
                    row = np.uint64(min(max(nearest_pixel(source_y + (step_x if j else step_y)), 0), height - 1))
                    column = np.uint64(min(max(nearest_pixel(source_x + (-step_y if j else step_x)), 0), width - 1))
                    out[PROFILE + 2 * i + j] = _softsign((surfaces[k, row, column] - d) * parallax)
            # All differences in pixels of parallax in this view: T need not know the scene's scale.
            v, u = min(max(nearest_pixel(source_y), 0), height - 1), min(max(nearest_pixel(source_x), 0), width - 1)
            out[AGREES] = _softsign((d - _source_disparity(surfaces, k, source_x, source_y, d)) * parallax)
            out[TO_NEAREST] = _softsign((foreground - d) * parallax)
            out[TO_FARTHEST] = _softsign((d - background) * parallax)
            out[INPAINTED] = 1.0 if k >= rays.photo_images else 0.0
            out[PARALLAX] = log_parallax
            out[COVERAGE] = rays.coverage[k, v, u]
            out[PLAIN] = 1.0 if a == number - 1 else 0.0


@kernel
def _blend(rays, offsets, found, weights, colors):
    images, surfaces = rays.colors, rays.disparity
    _, height, width = surfaces.shape
    for n in range(len(weights)):
        total = red = green = blue = apart = 0.0
        first_r = first_g = first_b = 0.0
        for a in range(np.int64(found.number[n])):
            w = weights[n, a]
            if not w > MIN_HYPOTHESIS_WEIGHT:
                continue
            # Each hypothesis votes with the colour that its disparity leads to (paper, section 3.2).
            d, k = found.disparity[n, a], np.int64(found.source[n, a])
            t, s = offsets[k, 0], offsets[k, 1]
            x = min(max(found.pixel[n, 1] + d * s, -0.5), width - 0.5)
            y = min(max(found.pixel[n, 0] + d * t, -0.5), height - 0.5)
            if a == found.number[n] - 1:
                r, g, b = cubic(images, k, x, y)
            else:
                r, g, b = cubic_on_surface(images, surfaces, k, x, y, d, max(abs(s), abs(t), 1e-9))
            # Differences of the votes from the first one, which is kept.
            if total == 0.0:
                first_r, first_g, first_b = max(r, 0.0), max(g, 0.0), max(b, 0.0)
            apart = max(apart, abs(r - first_r), abs(g - first_g), abs(b - first_b))
            # The weighted sum of the paper's equation 1, in linear light.
            total += w
            red += w * linear_scalar(r)
            green += w * linear_scalar(g)
            blue += w * linear_scalar(b)
        # Conversion to linear light and back changes the last digits, so votes that agree are not converted.
        colors[n, 0], colors[n, 1], colors[n, 2] = first_r, first_g, first_b
        if apart > SAME_COLOR:
            colors[n, 0] = srgb_scalar(red / total)
            colors[n, 1] = srgb_scalar(green / total)
            colors[n, 2] = srgb_scalar(blue / total)
