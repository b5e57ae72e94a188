"""Which way a glossy surface faces, and which pixels belong to it."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.gloss.geometry import SceneGeometry
from iibr_core.rendering.gloss.gloss_settings import GlossStroke, GlossSurface
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import FloatImage, image_size

NORMAL_TAPS = 4
"""To each side of a pixel that its normal is fitted to."""
REACH = 0.012
"""Of the picture's longer side: how far these taps reach, in pixels at least one apiece."""
STEEPEST_SLOPE = np.float32(np.tan(np.deg2rad(80)))
"""A surface that is seen more slanted than this is a depth edge."""
STEP_SHARE = np.float32(1 / 128)
"""Of the disparity range: steps below it are the map's rounding, never an edge."""
SOFT_DEPTH, SOFT_COLOR = 0.02, 0.05
"""Over so much beyond its limits, of the range of depth and of colour, a surface fades."""


def fit_normals(disparity: FloatImage, geometry: SceneGeometry) -> FloatImage:
    """Normals (H, W, 3) of a disparity map (H, W), towards the camera, of length 1.

    The plane a X + b Y + c Z = 1 is linear in disparity, as 1 / Z = a X / Z + b Y / Z + c. So the slopes of disparity
    are fitted, by quadratic least squares over the taps of the same surface, weighed by a Gaussian (Savitzky and Golay
    1964; where depth edges take taps away, by solving for all six terms).

    """
    near = geometry.nearness(disparity)
    spacing = max(round(REACH * max(disparity.shape) / NORMAL_TAPS), 1)
    step = STEP_SHARE * np.float32(near.max() - near.min())
    focal, size = np.float32(geometry.focal_px), image_size(disparity)
    fitted = np.empty((*disparity.shape, 3), np.float32)
    in_bands(lambda first, last: _fit_rows(near, focal, spacing, step, first, last, fitted), size)
    if spacing == 1:
        return fitted
    # taps that lie apart leave out the pixels between: those of the neighbours make up for it
    normals = np.empty_like(fitted)
    in_bands(lambda first, last: _mean_rows(fitted, near, focal, spacing, step, first, last, normals), size)
    return normals


def surface_mask(surface: GlossSurface, photo: FloatImage, disparity: FloatImage) -> FloatImage:
    """How far each pixel (H, W) belongs to the surface, 0..1. photo: (H, W, 3) sRGB-encoded; disparity: (H, W)."""
    if surface.strokes_only:
        mask = np.zeros(disparity.shape, np.float32)
    else:
        mask = _depth_membership(surface, disparity)
        if surface.color is not None:
            apart = np.linalg.norm(photo - np.array(surface.color, np.float32), axis=2)
            mask *= np.clip(1 + (np.float32(surface.tolerance) - apart) / np.float32(SOFT_COLOR), 0, 1)
    for stroke in surface.strokes:
        raise_if_stopped()
        np.putmask(mask, _touched(stroke, mask), np.float32(not stroke.erases))
    return mask


def _depth_membership(surface: GlossSurface, disparity: FloatImage) -> FloatImage:
    low, high = float(disparity.min()), float(disparity.max())
    if high <= low:
        return np.ones(disparity.shape, np.float32)
    share = (disparity - np.float32(low)) / np.float32(high - low)
    inside = np.minimum(share - np.float32(surface.farthest), np.float32(surface.nearest) - share)
    return np.asarray(np.clip(1 + inside / np.float32(SOFT_DEPTH), 0, 1), np.float32)


def _touched(stroke: GlossStroke, mask: FloatImage) -> NDArray[np.bool_]:
    """The pixels (H, W) that a stroke covers: all that are near enough to its path."""
    height, width = mask.shape
    touched = np.zeros(mask.shape, np.bool_)
    path = np.array(stroke.points, np.float64) * (width, height) - 0.5
    radius = max(stroke.radius * width, 0.5)
    for start, end in zip(path, path[1:] if len(path) > 1 else path):
        first, last = np.minimum(start, end) - radius, np.maximum(start, end) + radius
        (left, top), (right, bottom) = (
            np.clip(np.floor(edge), 0, (width, height)).astype(int) for edge in (first, last + 1)
        )
        y, x = np.mgrid[top:bottom, left:right]
        along = end - start
        share = ((x - start[0]) * along[0] + (y - start[1]) * along[1]) / max(float(along @ along), 1e-12)
        share = np.clip(share, 0, 1)
        apart = np.hypot(x - start[0] - share * along[0], y - start[1] - share * along[1])
        touched[top:bottom, left:right] |= apart <= radius
    return touched


@kernel
def _mean_rows(fitted, near, focal, spacing, step, first, last, normals):
    """Rows [first, last): each normal becomes the mean over so many pixels across and down, of the same surface."""
    height, width = near.shape
    before, after = spacing // 2, (spacing - 1) // 2
    for y in range(first, last):
        for x in range(width):
            limit = step + STEEPEST_SLOPE * near[y, x] / focal * spacing
            a, b, c = np.float32(0), np.float32(0), np.float32(0)
            for v in range(max(y - before, 0), min(y + after, height - 1) + 1):
                for u in range(max(x - before, 0), min(x + after, width - 1) + 1):
                    if abs(near[v, u] - near[y, x]) <= limit:
                        a, b, c = a + fitted[v, u, 0], b + fitted[v, u, 1], c + fitted[v, u, 2]
            length = np.sqrt(a * a + b * b + c * c)
            normals[y, x, 0], normals[y, x, 1], normals[y, x, 2] = a / length, b / length, c / length


@kernel
def _fit_rows(near, focal, spacing, step, first, last, normals):
    """Rows [first, last) of `fit_normals`. near: (H, W), f / Z. step: of disparity that is never an edge."""
    height, width = near.shape
    centre_x, centre_y = np.float32((width - 1) / 2), np.float32((height - 1) / 2)
    side = 2 * NORMAL_TAPS + 1
    gauss = np.empty((side, side), np.float32)
    norm = np.float32(0)
    for i in range(side):
        for j in range(side):
            gauss[i, j] = np.exp(-0.5 * ((i - NORMAL_TAPS) ** 2 + (j - NORMAL_TAPS) ** 2) / (0.5 * NORMAL_TAPS) ** 2)
            norm += gauss[i, j] * np.float32((j - NORMAL_TAPS) ** 2)
    beside, weights = np.empty((side, side), np.float32), np.empty((side, side), np.float32)
    for y in range(first, last):
        for x in range(width):
            middle = near[y, x]
            slope = STEEPEST_SLOPE * middle / focal * spacing
            right, down, kept = np.float32(0), np.float32(0), 0
            # slopes by the whole window: odd moments vanish, so that each is one weighted sum
            for i in range(side):
                v = y + (i - NORMAL_TAPS) * spacing
                for j in range(side):
                    u = x + (j - NORMAL_TAPS) * spacing
                    weights[i, j] = 0
                    if v < 0 or v >= height or u < 0 or u >= width:
                        continue
                    apart = near[v, u] - middle
                    if abs(apart) > step + slope * np.float32(max(abs(i - NORMAL_TAPS), abs(j - NORMAL_TAPS))):
                        continue
                    beside[i, j], weights[i, j] = apart, gauss[i, j]
                    right += gauss[i, j] * np.float32(j - NORMAL_TAPS) * apart
                    down += gauss[i, j] * np.float32(i - NORMAL_TAPS) * apart
                    kept += 1
            right, down = right / norm, down / norm
            if kept < side * side:
                right, down = _slopes_of_part(beside, weights)
            right, down = right / spacing, down / spacing
            # the plane 1/Z = a x + b y + c through this pixel has the normal (a, b, c), away from the camera
            away = middle / focal - ((x - centre_x) * right + (y - centre_y) * down) / focal
            length = np.sqrt(right * right + down * down + away * away)
            if not length > 0:
                right, down, away, length = np.float32(0), np.float32(0), np.float32(1), np.float32(1)
            normals[y, x, 0], normals[y, x, 1], normals[y, x, 2] = -right / length, -down / length, -away / length


@kernel
def _slopes_of_part(beside, weights):
    """(right, down): slopes of a window that is cut off, where weights are 0: all six terms of the quadratic."""
    system = np.zeros((6, 7), np.float64)
    side = 2 * NORMAL_TAPS + 1
    for i in range(side):
        for j in range(side):
            if weights[i, j] == 0:
                continue
            p, q = (j - NORMAL_TAPS) / NORMAL_TAPS, (i - NORMAL_TAPS) / NORMAL_TAPS
            terms = (1.0, p, q, p * p, p * q, q * q)
            for a in range(6):
                for b in range(a, 6):
                    system[a, b] += weights[i, j] * terms[a] * terms[b]
                system[a, 6] += weights[i, j] * terms[a] * beside[i, j]
    for a in range(6):
        # what the taps do not tell stays 0, the bends first
        system[a, a] += 1e-4 if a < 3 else 0.05
        for b in range(a):
            system[a, b] = system[b, a]
    # elimination: the matrix is positive definite
    for a in range(6):
        for b in range(a + 1, 6):
            factor = system[b, a] / system[a, a]
            for c in range(a, 7):
                system[b, c] -= factor * system[a, c]
    for a in range(5, 0, -1):
        for b in range(a + 1, 6):
            system[a, 6] -= system[a, b] * system[b, 6]
        system[a, 6] /= system[a, a]
    return np.float32(system[1, 6] / NORMAL_TAPS), np.float32(system[2, 6] / NORMAL_TAPS)
