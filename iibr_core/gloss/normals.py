"""Surface normals from a disparity map."""

from __future__ import annotations

import numpy as np

from iibr_core.gloss.geometry import SceneGeometry
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.types import FloatImage, image_size

TAPS = 4
"""Taps of the fit on each side of a pixel."""
REACH = 0.012
"""Distance of the outermost tap as a share of the picture's longer side; taps are at least a pixel apart."""
MAX_SLANT = np.float32(np.tan(np.deg2rad(80)))
"""Steepest slope of a surface; a steeper slope is a depth edge."""
ROUNDING = np.float32(1 / 128)
"""Largest rounding error of a map, as a share of its range; smaller steps are no edges."""
RIDGE = np.float32(1e-4)
"""Regularisation of slopes that the taps leave open."""
_OFFSETS = np.arange(-TAPS, TAPS + 1)
_WEIGHTS = np.exp(-2 * (_OFFSETS[:, None] ** 2 + _OFFSETS**2) / TAPS**2).astype(np.float32)


def fit_normals(disparity: FloatImage, geometry: SceneGeometry) -> FloatImage:
    """Return normals (H, W, 3) of a disparity map (H, W), towards the camera, of length 1.

    A plane a X + b Y + c Z = 1 is linear in disparity: 1 / Z = a X / Z + b Y / Z + c. Its slopes are fitted by linear
    least squares to taps on the same surface, with Gaussian weights.
    """
    near = geometry.nearness(disparity)
    spacing = max(round(REACH * max(disparity.shape) / TAPS), 1)
    rounding = ROUNDING * np.float32(near.max() - near.min())
    max_slope = MAX_SLANT * near / np.float32(geometry.focal_px)
    size, slopes = image_size(disparity), np.empty((*disparity.shape, 2), np.float32)
    in_bands(lambda first, last: _fit_rows(near, max_slope, spacing, rounding, first, last, slopes), size)
    if spacing > 1:  # taps that lie apart skip pixels: the neighbours' slopes make up for them
        fitted, slopes = slopes, np.empty_like(slopes)
        in_bands(lambda first, last: _mean_rows(fitted, near, max_slope, spacing, rounding, first, last, slopes), size)
    return _normals_of(slopes, near, geometry.focal_px)


def _normals_of(slopes: FloatImage, near: FloatImage, focal_px: float) -> FloatImage:
    """Return normals (H, W, 3) of surfaces whose nearness (H, W) changes by `slopes` (H, W, 2: right, down)."""
    height, width = near.shape
    x = np.arange(width, dtype=np.float32) - np.float32((width - 1) / 2)
    y = np.arange(height, dtype=np.float32)[:, None] - np.float32((height - 1) / 2)
    right, down = slopes[..., 0], slopes[..., 1]
    away = (near - x * right - y * down) / np.float32(focal_px)
    length = np.hypot(np.hypot(right, down), away)
    return np.asarray(-np.dstack([right, down, away]) / length[..., None], np.float32)


@kernel
def _mean_rows(fitted, near, max_slope, side, rounding, first, last, slopes):
    """Fill rows [first, last) with the mean slopes of `side` x `side` pixels of the same surface."""
    height, width = near.shape
    before, after = side // 2, (side - 1) // 2
    for y in range(first, last):
        for x in range(width):
            limit = rounding + max_slope[y, x] * side
            right, down, count = np.float32(0), np.float32(0), 0
            for v in range(max(y - before, 0), min(y + after, height - 1) + 1):
                for u in range(max(x - before, 0), min(x + after, width - 1) + 1):
                    if abs(near[v, u] - near[y, x]) <= limit:
                        right, down, count = right + fitted[v, u, 0], down + fitted[v, u, 1], count + 1
            slopes[y, x, 0], slopes[y, x, 1] = right / count, down / count


@kernel
def _fit_rows(near, max_slope, spacing, rounding, first, last, slopes):
    """Fill rows [first, last) with the slopes of nearness, (right, down) per pixel."""
    height, width = near.shape
    for y in range(first, last):
        for x in range(width):
            w, wx, wy, wz = np.float32(0), np.float32(0), np.float32(0), np.float32(0)
            wxx, wxy, wyy, wxz, wyz = np.float32(0), np.float32(0), np.float32(0), np.float32(0), np.float32(0)
            for i in range(-TAPS, TAPS + 1):
                v = y + i * spacing
                if v < 0 or v >= height:
                    continue
                for j in range(-TAPS, TAPS + 1):
                    u = x + j * spacing
                    if u < 0 or u >= width:
                        continue
                    z = near[v, u] - near[y, x]
                    if abs(z) > rounding + max_slope[y, x] * np.float32(spacing * max(abs(i), abs(j))):
                        continue
                    weight = _WEIGHTS[i + TAPS, j + TAPS]
                    right, down = weight * np.float32(j), weight * np.float32(i)
                    w, wx, wy, wz = w + weight, wx + right, wy + down, wz + weight * z
                    wxx, wxy, wyy = wxx + right * np.float32(j), wxy + right * np.float32(i), wyy + down * np.float32(i)
                    wxz, wyz = wxz + right * z, wyz + down * z
            xx, xy, yy = wxx - wx * wx / w + RIDGE, wxy - wx * wy / w, wyy - wy * wy / w + RIDGE
            xz, yz = wxz - wx * wz / w, wyz - wy * wz / w
            scale = np.float32(spacing) * (xx * yy - xy * xy)
            slopes[y, x, 0], slopes[y, x, 1] = (xz * yy - yz * xy) / scale, (yz * xx - xz * xy) / scale
