"""Whether the views of one light field agree: what one shows, another must show where its disparity says.

Colours differ by rms in 1/255 of sRGB-encoded values. Holes: content that was inpainted in both views. Surfaces: what
the photo shows. Lines: in EPIs, a point of the photo must lie on a straight line of its own colour.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, map_coordinates, maximum_filter, minimum_filter

from iibr_core.method.farthest_views import outer_views
from iibr_core.method.view import View
from iibr_core.surfaces import SAME_SURFACE_PX, step_of
from iibr_core.types import FloatImage, ViewOffset

LINE_VIEWS = 9
WINDOW_PX = 2.0
LEAST_TEXTURE = 1e-4
"""Mean squared gradient below which no shift can be told."""


@dataclass(frozen=True)
class Consistency:
    """hole_rms, surface_rms, line_rms: in 1/255. line_off_px: how far points lie off their lines in EPIs (rms, px).

    hole_pixels: how many were compared. NaN where there was nothing to compare.
    """

    hole_rms: float
    surface_rms: float
    line_rms: float
    line_off_px: float
    hole_pixels: int


@dataclass(frozen=True, eq=False)
class LineView:
    """A view of the photo's own row: s, colors (H, W, 3), disparity (H, W)."""

    s: float
    colors: FloatImage
    disparity: FloatImage


def consistency(
    make: Callable[[ViewOffset], View],
    offsets: Iterable[ViewOffset],
    photo: FloatImage,
    disparity: FloatImage,
) -> Consistency:
    """Of the views that `make` makes within the box around these offsets: each outer one with the one half-way to it,
    and the photo's own row.
    """
    holes, surfaces = [], []
    outer = outer_views(offsets)
    for offset in outer:
        half = ViewOffset(offset.t / 2, offset.s / 2)
        one, other = make(offset), make(half)
        difference, was_hole = disagreement(one, other, offset, half)
        holes.append(difference[was_hole])
        surfaces.append(difference[~was_hole])
    left, right = min([at.s for at in outer], default=0.0), max([at.s for at in outer], default=0.0)
    row = []
    for s in np.linspace(left, right, LINE_VIEWS):
        if abs(s) > 1e-9:
            view = make(ViewOffset(0.0, float(s)))
            row.append(LineView(float(s), view.colors, view.disparity))
    line_rms, off_px = line_straightness(photo, disparity, row)
    return Consistency(_rms(holes), _rms(surfaces), line_rms, off_px, sum(map(len, holes)))


def disagreement(
    one: View, other: View, at: ViewOffset, other_at: ViewOffset
) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
    """Differences (N, 3) in 1/255 of all pixels whose surface both views show, and which of them (N,) are inpainted
    in both. Pixels near edges, and those inpainted in one view only, are left out.
    """
    t, s = other_at.t - at.t, other_at.s - at.s
    tolerance = step_of(SAME_SURFACE_PX, max(abs(t), abs(s)))
    y, x = np.nonzero(_inside_a_surface(one.disparity, tolerance))
    d = one.disparity[y, x]
    there = np.stack([y - d * t, x - d * s]).astype(np.float64)
    inside = ((there >= 1) & (there <= np.array(one.disparity.shape)[:, None] - 2)).all(axis=0)
    y, x, d, there = y[inside], x[inside], d[inside], there[:, inside]
    pixel = tuple(np.rint(there).astype(int))
    same = _inside_a_surface(other.disparity, tolerance)[pixel] & (np.abs(other.disparity[pixel] - d) < tolerance)
    in_hole = _erode(one.inpainted)[y, x] & _erode(other.inpainted)[pixel]
    same &= in_hole | ~(one.inpainted[y, x] | other.inpainted[pixel])
    warped = np.stack([map_coordinates(other.colors[..., c], there[:, same], order=3) for c in range(3)], axis=-1)
    return 255 * (warped - one.colors[y[same], x[same]]).astype(np.float64), in_hole[same]


def line_straightness(photo: FloatImage, disparity: FloatImage, row: Sequence[LineView]) -> tuple[float, float]:
    """(rms of colours along the lines in 1/255, rms of the distance from them in px) of views of the photo's row.

    photo: (H, W, 3), disparity: (H, W). The distance is what a least-squares shift of a small window along x gives
    (Lucas and Kanade 1981); windows without texture tell none.
    """
    differences, shifts = [], []
    y, x = np.mgrid[0 : photo.shape[0], 0 : photo.shape[1]].astype(np.float64)
    slope = np.gradient(photo.mean(axis=2), axis=1) if photo.shape[1] > 1 else np.zeros(photo.shape[:2])
    texture = gaussian_filter(slope**2, WINDOW_PX)
    for view in row:
        tolerance = step_of(SAME_SURFACE_PX, abs(view.s))
        there = np.stack([y, x - disparity * view.s])
        inside = (there[1] >= 1) & (there[1] <= photo.shape[1] - 2)
        seen = np.abs(map_coordinates(view.disparity, there, order=0, mode="nearest") - disparity) < tolerance
        seen &= inside & _inside_a_surface(disparity, tolerance)
        back = np.stack([map_coordinates(view.colors[..., c], there, order=3, mode="nearest") for c in range(3)], -1)
        difference = np.where(seen[..., None], back - photo, 0.0)
        differences.append(255 * difference[seen])
        # A window that reaches over what is not seen would mix surfaces.
        whole = seen & (minimum_filter(seen, round(4 * WINDOW_PX) + 1)) & (texture > LEAST_TEXTURE)
        shift = gaussian_filter(slope * difference.mean(axis=2), WINDOW_PX) / np.maximum(texture, LEAST_TEXTURE)
        shifts.append(shift[whole])
    return _rms(differences), _rms(shifts)


def _inside_a_surface(disparity: FloatImage, tolerance: float) -> NDArray[np.bool_]:
    return np.asarray(maximum_filter(disparity, 3) - minimum_filter(disparity, 3) < tolerance)


def _erode(mask: NDArray[np.bool_]) -> NDArray[np.bool_]:
    return np.asarray(minimum_filter(mask, 3))


def _rms(parts: Sequence[NDArray[np.float64]]) -> float:
    values = np.concatenate([part.ravel() for part in parts]) if parts else np.empty(0)
    return float(np.sqrt(np.mean(np.square(values)))) if values.size else math.nan
