"""Cast rays into procedural scenes: colours with mixed pixels at edges, and exact disparities, of any view.

World: the camera of view offset (t, s) stands at (s, t, 0) and looks along z; x is right, y is down; one unit is one
view step. Pictures are sheared to the zero plane: a point at depth z has disparity focal / z - infinity_px.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import srgb_scalar
from iibr_core.runtime.tiling import THREADS, in_pieces, pieces_of
from iibr_core.training.scenes.primitives import PLANE, distance_along, normal_at, to_own_frame
from iibr_core.training.scenes.textures import albedo_at, is_cut
from iibr_core.types import FloatImage, ImageSize, ViewOffset

CHUNK_PIXELS = 4096


@dataclass(frozen=True, eq=False)
class RaycastScene:
    """Objects, their light, and the cameras that see them.

    primitives: (N,) PRIMITIVE; the last is an endless plane at the greatest depth. centre_px: (x, y) of the centre
    view's axis. infinity_px: minus the disparity of infinity. depths: least and greatest z that are seen. light: unit
    vector towards it. ambient: share of light from everywhere; 1: no shading.
    """

    primitives: NDArray[Any]
    centre_px: tuple[float, float]
    focal_px: float
    infinity_px: float
    depths: tuple[float, float]
    light: tuple[float, float, float]
    ambient: float


def render(scene: RaycastScene, size: ImageSize, offset: ViewOffset, samples: int = 3) -> tuple[FloatImage, FloatImage]:
    """Return colours (H, W, 3), sRGB-encoded, and disparity (H, W) of the view at an offset. See `cast`."""
    y, x = np.indices(size)
    colors, disparity = cast(scene, x.ravel(), y.ravel(), offset, samples)
    return colors.reshape(*size, 3), disparity.reshape(size)


def cast(
    scene: RaycastScene, x: ArrayLike, y: ArrayLike, offset: ViewOffset, samples: int = 3
) -> tuple[FloatImage, FloatImage]:
    """Return colours (N, 3), sRGB-encoded, and disparities (N,) of the pixels at (x, y) of the view at an offset.

    samples: square root of the number of rays that are averaged over a pixel, in linear light. The disparity is that of
    the pixel's centre.
    """
    x, y = np.asarray(x, np.float64), np.asarray(y, np.float64)
    colors, disparity = np.empty((len(x), 3), np.float32), np.empty(len(x), np.float32)
    places, primitives, lens = sample_places(samples), _primitives_in_view(scene, offset), _lens(scene, offset)
    light = *scene.light, scene.ambient

    def cast_piece(part: slice) -> None:
        _cast(x[part], y[part], places, primitives, lens, light, colors[part], disparity[part])

    in_pieces(cast_piece, pieces_of(len(x), CHUNK_PIXELS), THREADS)
    return colors, disparity


def sample_places(samples: int) -> NDArray[np.float64]:
    """Return the offsets (S, 2) of a pixel's rays in (x, y), in pixels.

    All differ in x and in y, so that edges along rows and columns are mixed in samples**2 steps.
    """
    i, j = (a.ravel() for a in np.indices((samples, samples)))
    return np.stack([(i + (j + 0.5) / samples) / samples, (j + (i + 0.5) / samples) / samples], axis=-1) - 0.5


def _lens(scene: RaycastScene, offset: ViewOffset) -> tuple[float, ...]:
    """Return the axis (x, y) in pixels, focal length, disparity of infinity, and least and greatest depth of a view."""
    x, y = scene.centre_px
    sheared = float(x + scene.infinity_px * offset.s), float(y + scene.infinity_px * offset.t)
    return *sheared, float(scene.focal_px), float(scene.infinity_px), *map(float, scene.depths)


def _primitives_in_view(scene: RaycastScene, offset: ViewOffset) -> NDArray[Any]:
    """Return the primitives with `origin` and `bounds` of the view at an offset."""
    primitives, camera = scene.primitives.copy(), np.array([offset.s, offset.t, 0.0])
    primitives["origin"] = np.einsum("nij,nj->ni", primitives["axes"], camera - primitives["centre"])
    signs = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(8, 1, 3)
    corners = primitives["centre"] + np.einsum("cnj,njk->cnk", signs * primitives["half"], primitives["axes"]) - camera
    in_front = corners[..., 2:] > 1e-9
    axis, focal = np.array(_lens(scene, offset)[:2]), scene.focal_px
    xy = axis + focal * corners[..., :2] / np.where(in_front, corners[..., 2:], 1.0)
    low, high = np.where(in_front, xy, -inf).min(axis=0) - 1e-6, np.where(in_front, xy, inf).max(axis=0) + 1e-6
    primitives["bounds"] = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=-1)
    return primitives


@kernel
def _nearest_hit(primitives, x, y, dx, dy, least_z, greatest_z):
    """Return depth and index of the nearest primitive at (x, y), along direction (dx, dy, 1)."""
    depth, nearest = greatest_z, len(primitives) - 1
    for k in range(len(primitives) - 1):
        p = primitives[k]
        if p.bounds[0] <= x <= p.bounds[1] and p.bounds[2] <= y <= p.bounds[3]:
            ex, ey, ez = to_own_frame(p, dx, dy, 1.0)
            z = distance_along(p, ex, ey, ez)
            if least_z <= z < depth and not is_cut(p, p.origin[0] + z * ex, p.origin[1] + z * ey):
                depth, nearest = z, k
    return depth, nearest


@kernel
def _shade(p, x, y, z, depth, focal, light):
    """Return the light (linear) from a point of a primitive, in its frame."""
    nx, ny, nz = normal_at(p, x, y, z)
    # The size of a pixel is that of the centre view, so that all views see the same pattern.
    cx, cy, cz = to_own_frame(p, p.centre[0], p.centre[1], p.centre[2])
    cosine = nx * (x + cx) + ny * (y + cy) + nz * (z + cz)
    cosine /= sqrt((x + cx) ** 2 + (y + cy) ** 2 + (z + cz) ** 2)
    r, g, b = albedo_at(p, x, y, z, depth / focal / max(abs(cosine), 0.05))
    # Lambert's law. Both sides of a plane get the same light, because views may see both.
    lx, ly, lz = to_own_frame(p, light[0], light[1], light[2])
    towards = nx * lx + ny * ly + nz * lz
    lit = light[3] + (1 - light[3]) * (abs(towards) if p.shape == PLANE else max(towards, 0.0))
    return lit * r, lit * g, lit * b


@kernel
def _cast(xs, ys, places, primitives, lens, light, colors, disparity):
    axis_x, axis_y, focal, infinity, least_z, greatest_z = lens
    for n in range(len(xs)):
        dx, dy = (xs[n] - axis_x) / focal, (ys[n] - axis_y) / focal
        disparity[n] = focal / _nearest_hit(primitives, xs[n], ys[n], dx, dy, least_z, greatest_z)[0] - infinity
        red, green, blue = 0.0, 0.0, 0.0
        for i in range(len(places)):
            x, y = xs[n] + places[i, 0], ys[n] + places[i, 1]
            dx, dy = (x - axis_x) / focal, (y - axis_y) / focal
            depth, nearest = _nearest_hit(primitives, x, y, dx, dy, least_z, greatest_z)
            p = primitives[nearest]
            ex, ey, ez = to_own_frame(p, dx, dy, 1.0)
            u, v, w = p.origin[0] + depth * ex, p.origin[1] + depth * ey, p.origin[2] + depth * ez
            r, g, b = _shade(p, u, v, w, depth, focal, light)
            red, green, blue = red + r, green + g, blue + b
        colors[n, 0] = srgb_scalar(red / len(places))
        colors[n, 1] = srgb_scalar(green / len(places))
        colors[n, 2] = srgb_scalar(blue / len(places))
