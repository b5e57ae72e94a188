"""Casts rays into procedural scenes: exact disparities, and colours with mixed pixels at edges, of any view.

World: the camera of view offset (t, s) stands at (s, t, 0) and looks along z; x is right, y down, one unit is one view
step. All pictures are sheared to the zero plane, so that a point at depth z has disparity focal / z - infinity_px.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import inf, sqrt
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import srgb_scalar
from iibr_core.runtime.tiling import THREADS, in_pieces
from iibr_core.training.scenes.primitives import PLANE, albedo_at, distance_along, normal_at
from iibr_core.training.scenes.textures import is_cut
from iibr_core.types import FloatImage, ImageSize, ViewOffset

CHUNK_PIXELS = 4096
COARSE_PATTERN_COSINE = 0.5
"""A surface seen at a smaller cosine than this gets a coarser pattern; above, the samples of a pixel average it."""


@dataclass(frozen=True, eq=False)
class RaycastScene:
    """Objects and the cameras that see them.

    primitives: (N,) PRIMITIVE, nearest first; the last is a plane without bounds at the greatest depth, seen wherever
    nothing else is. centre_px: (x, y) of the centre view's axis. infinity_px: minus the disparity of infinity.
    depths: least and greatest z; nothing is seen outside. light: unit vector towards it; ambient: share of light from
    everywhere, 1 = no shading.
    """

    primitives: NDArray[Any]
    centre_px: tuple[float, float]
    focal_px: float
    infinity_px: float
    depths: tuple[float, float]
    light: tuple[float, float, float]
    ambient: float


def render(scene: RaycastScene, size: ImageSize, offset: ViewOffset, samples: int = 3) -> tuple[FloatImage, FloatImage]:
    """Return the view at an offset: colours (H, W, 3), sRGB-encoded, and disparity (H, W), exact at pixel centres.

    size: (height, width). See `cast`.
    """
    y, x = np.indices(size)
    colors, disparity = cast(scene, x.ravel(), y.ravel(), offset, samples)
    return colors.reshape(*size, 3), disparity.reshape(size)


def cast(
    scene: RaycastScene, x: NDArray[Any], y: NDArray[Any], offset: ViewOffset, samples: int = 3
) -> tuple[FloatImage, FloatImage]:
    """Return colours (N, 3), sRGB-encoded, and disparities (N,) of pixels centred at (x, y), (N,), px, of a view.

    samples: odd; squared, the rays of a pixel, averaged in linear light over its square. The disparity is that of the
    pixel's centre.
    """
    x, y = x.astype(np.float64), y.astype(np.float64)
    colors, disparity = np.empty((len(x), 3), np.float32), np.empty(len(x), np.float32)
    places, view = _sample_places(samples), _view_of(scene, offset)

    def chunk(first: int) -> None:
        part = slice(first, first + CHUNK_PIXELS)
        _cast(x[part], y[part], places, view, colors[part], disparity[part])

    in_pieces(chunk, range(0, len(x), CHUNK_PIXELS), THREADS)
    return colors, disparity


def _sample_places(samples: int) -> NDArray[np.float64]:
    """Return offsets (S, 2) of a pixel's rays in (x, y), px, the centre first.

    All rays differ in x and in y, so that edges in rows and columns are mixed in samples**2 steps.
    """
    i, j = (a.ravel() for a in np.indices((samples, samples)))
    places = np.stack([(i + (j + 0.5) / samples) / samples, (j + (i + 0.5) / samples) / samples], axis=-1) - 0.5
    centre = len(places) // 2
    places[centre] = 0.0
    return places[np.r_[centre, np.delete(np.arange(len(places)), centre)]]


def _view_of(scene: RaycastScene, offset: ViewOffset) -> tuple[Any, ...]:
    """Return primitives, axes, origins, bounds, camera, lens (centre x, y, focal, infinity, depths) and light."""
    primitives = scene.primitives
    camera = np.array([offset.s, offset.t, 0.0])
    axes = np.ascontiguousarray(primitives["axes"])
    origins = np.einsum("nij,nj->ni", axes, camera - primitives["centre"])
    lens = np.array([*scene.centre_px, scene.focal_px, scene.infinity_px, *scene.depths])
    light = np.array([*scene.light, scene.ambient])
    return primitives, axes, origins, _bounds(scene, camera), camera, lens, light


def _bounds(scene: RaycastScene, camera: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the bounds (N, 4) of each primitive in the view: first x, last x, first y, last y, px."""
    primitives = scene.primitives
    signs = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(8, 1, 3)
    corners = primitives["centre"] + np.einsum("cnj,njk->cnk", signs * primitives["half"], primitives["axes"])
    in_front = corners[..., 2:] > 1e-9
    scale = scene.focal_px / np.where(in_front, corners[..., 2:], 1.0)
    xy = np.array(scene.centre_px) + scene.infinity_px * camera[:2] + scale * (corners[..., :2] - camera[:2])
    low, high = np.where(in_front, xy, -inf).min(axis=0) - 1e-6, np.where(in_front, xy, inf).max(axis=0) + 1e-6
    return np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=-1)


@kernel
def _find_met(bounds, x, y, margin, met):
    """Broad phase: the primitives but the backdrop whose bounds a pixel's rays may meet, in order; returns how many."""
    count = 0
    for k in range(len(bounds) - 1):
        if not (
            x + margin < bounds[k, 0]
            or x - margin > bounds[k, 1]
            or y + margin < bounds[k, 2]
            or y - margin > bounds[k, 3]
        ):
            met[count] = k
            count += 1
    return count


@kernel
def _cast(xs, ys, places, view, colors, disparity):
    """Write what `cast` returns. places: `_sample_places`. view: `_view_of`."""
    weight, margin = 1.0 / len(places), np.abs(places).max()
    primitives, axes, origins, bounds, camera, lens, light = view
    focal, infinity, least_z, greatest_z = lens[2], lens[3], lens[4], lens[5]
    backdrop = len(primitives) - 1
    met = np.empty(len(primitives), np.int64)
    for n in range(len(xs)):
        count = _find_met(bounds, xs[n], ys[n], margin, met)
        red, green, blue = 0.0, 0.0, 0.0
        # A ray a sample. Its direction (wx, wy, 1): distance along it is depth z.
        for sample in range(len(places)):
            wx = (xs[n] + places[sample, 0] - lens[0] - infinity * camera[0]) / focal
            wy = (ys[n] + places[sample, 1] - lens[1] - infinity * camera[1]) / focal
            # Nearest hit. Primitives come nearest first, so the search ends where none can be nearer.
            depth, hit = greatest_z, backdrop
            for m in range(count):
                k = met[m]
                p = primitives[k]
                if p.nearest_z >= depth:
                    break
                # The ray in the primitive's own frame; origins are there already.
                ex = axes[k, 0, 0] * wx + axes[k, 0, 1] * wy + axes[k, 0, 2]
                ey = axes[k, 1, 0] * wx + axes[k, 1, 1] * wy + axes[k, 1, 2]
                ez = axes[k, 2, 0] * wx + axes[k, 2, 1] * wy + axes[k, 2, 2]
                hx, hy, hz = p.half[0], p.half[1], p.half[2]
                origin = origins[k, 0], origins[k, 1], origins[k, 2]
                z = distance_along(p.shape, origin, (ex, ey, ez), (hx, hy, hz))
                # In the range of depths, nearer than all before, and not through a hole cut into it.
                if least_z <= z < depth:
                    u, v = origins[k, 0] + z * ex, origins[k, 1] + z * ey
                    if p.cut == 0 or not is_cut(p.cut, u, v, hx, hy, p.cut_period, p.cut_width, p.seed):
                        depth, hit = z, k
            # The first sample is the pixel's centre.
            if sample == 0:
                disparity[n] = focal / depth - infinity
            # Shading: the point in its primitive's frame, the normal there, turned back into the world.
            p = primitives[hit]
            ex = axes[hit, 0, 0] * wx + axes[hit, 0, 1] * wy + axes[hit, 0, 2]
            ey = axes[hit, 1, 0] * wx + axes[hit, 1, 1] * wy + axes[hit, 1, 2]
            ez = axes[hit, 2, 0] * wx + axes[hit, 2, 1] * wy + axes[hit, 2, 2]
            u, v, w = origins[hit, 0] + depth * ex, origins[hit, 1] + depth * ey, origins[hit, 2] + depth * ez
            a, b, c = normal_at(p.shape, u, v, w, p.half[0], p.half[1], p.half[2])
            nx = axes[hit, 0, 0] * a + axes[hit, 1, 0] * b + axes[hit, 2, 0] * c
            ny = axes[hit, 0, 1] * a + axes[hit, 1, 1] * b + axes[hit, 2, 1] * c
            nz = axes[hit, 0, 2] * a + axes[hit, 1, 2] * b + axes[hit, 2, 2] * c

            # Size of a pixel on the surface, from the centre camera, so that all views see the same pattern.
            px, py = camera[0] + depth * wx, camera[1] + depth * wy
            towards = nx * px + ny * py + nz * depth
            cosine = abs(towards) / sqrt(px * px + py * py + depth * depth)
            pixel = depth / focal * min(max(COARSE_PATTERN_COSINE / max(cosine, 1e-6), 1.0), 20.0)
            r, g, b = albedo_at(p, u, v, w, pixel)

            # Planes have the same light on both sides, or a view from the other side would change their colour.
            facing = -1.0 if p.shape == PLANE and towards > 0 else 1.0
            lit = max(facing * (nx * light[0] + ny * light[1] + nz * light[2]), 0.0)
            # Lambert's law and ambient light; samples are summed in linear light.
            lit = weight * (light[3] + (1 - light[3]) * lit)
            red, green, blue = red + lit * r, green + lit * g, blue + lit * b
        colors[n, 0], colors[n, 1], colors[n, 2] = srgb_scalar(red), srgb_scalar(green), srgb_scalar(blue)
