"""A glossy surface in the views of a light field: each view is shaded as it comes, from its own disparity.

out = matt (1 - a) + light a, with the share a that a lobe reflects, in linear light: never more than the light given.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import acos, atan2, floor, pi, sqrt

import numpy as np

from iibr_core.color import encoded_from_stored, linear_from_srgb, stored_from_encoded
from iibr_core.rendering.gloss.environment import prefilter_environment
from iibr_core.rendering.gloss.geometry import SceneGeometry
from iibr_core.rendering.gloss.gloss_settings import Gloss, Triple, require_sound
from iibr_core.rendering.gloss.gloss_surface import fit_normals, surface_mask
from iibr_core.rendering.gloss.light_search import find_light
from iibr_core.rendering.gloss.microfacet import lobe_shares, reflected_share
from iibr_core.rendering.gloss.reflection import reflection_disparity
from iibr_core.rendering.gloss.separation import reflected_light, separate_light
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import linear_scalar, srgb_scalar
from iibr_core.runtime.tiling import in_bands
from iibr_core.surfaces import EDGE_PX
from iibr_core.types import (
    FloatImage,
    GridShape,
    ViewOffset,
    ViewUpdate,
    image_size,
)

FIXED_POINT_STEPS = 4
NO_ENVIRONMENT = np.zeros((1, 2, 3), np.float32)


@dataclass(frozen=True, eq=False)
class GlossMaps:
    """What a gloss means for one photo, in the photo's pixels.

    normals: (H, W, 3). disparity, mask: (H, W). reflected: (H, W, 3), linear light that the photo shows reflected,
    None without; reflected_disparity: virtual, (H, W, 2, 2), None where the light's lobe comes in its place.
    environment: (h, 2h, 3), smoothed linear light, or None.
    """

    gloss: Gloss
    geometry: SceneGeometry
    normals: FloatImage
    disparity: FloatImage
    mask: FloatImage
    reflected: FloatImage | None
    reflected_disparity: FloatImage | None
    environment: FloatImage | None


def make_gloss_maps(
    gloss: Gloss,
    photo: FloatImage,
    disparity: FloatImage,
    geometry: SceneGeometry,
    environment: FloatImage | None = None,
    normals: FloatImage | None = None,
) -> GlossMaps:
    """photo: (H, W, 3) sRGB-encoded. disparity: (H, W), the field's. environment: (h, w, 3) linear light of the gloss's
    picture. normals: of `fit_normals`, where they are known already.

    Raises InputError where the gloss is not sound.
    """
    require_sound(gloss)
    if normals is None:
        normals = fit_normals(disparity, geometry)
    mask = surface_mask(gloss.surface, photo, disparity)
    around = None if environment is None else prefilter_environment(environment, gloss.roughness)
    maps = GlossMaps(gloss, geometry, normals, disparity, mask, None, None, around)
    if not gloss.photo_shines:
        return maps
    linear, points = linear_from_srgb(photo), geometry.points(disparity)
    direction: Triple | None = gloss.light.direction
    if not any(gloss.light.color):
        direction = find_light(gloss, linear, points, normals, mask)
    if direction is None:
        virtual = reflection_disparity(disparity, normals, geometry)
        return replace(maps, reflected=reflected_light(linear, normals, mask), reflected_disparity=virtual)
    white = replace(gloss.light, direction=direction, color=(1.0, 1.0, 1.0))
    lobe = mask * _lobe_of(replace(gloss, light=white), points, normals)
    color, reflected = separate_light(linear, normals, mask, lobe)
    red, green, blue = map(float, color)
    found = replace(gloss, light=replace(white, color=(red, green, blue)))
    return replace(maps, gloss=found, reflected=reflected)


def _lobe_of(gloss: Gloss, points: FloatImage, normals: FloatImage) -> FloatImage:
    """Linear light (H, W) that a gloss adds to black surfaces as the photo's eye sees them, in the first channel."""
    to_eye = -points / np.linalg.norm(points, axis=-1, keepdims=True)
    towards, (width2, disc) = np.array(gloss.light.unit_direction, np.float32), gloss.lobe_widths
    shares = lobe_shares(normals.reshape(-1, 3), to_eye.reshape(-1, 3), towards, width2, disc, gloss.reflectance)
    return np.asarray(shares.reshape(points.shape[:2]) * np.float32(gloss.light.radiance[0]))


def shade_views(views: Iterator[ViewUpdate], maps: GlossMaps, grid: GridShape) -> Iterator[ViewUpdate]:
    """The views of a grid with their gloss, drafts too. Views without disparity stay as they are."""
    for view in views:
        if view.disparity is None or not maps.mask.any():
            yield view
            continue
        colors = encoded_from_stored(view.colors)
        shade(colors, view.disparity, grid.offset(view.row, view.column), maps)
        is_hdr = view.colors.dtype != np.uint8
        yield replace(view, colors=stored_from_encoded(colors, is_hdr))


def shade(colors: FloatImage, disparity: FloatImage, offset: ViewOffset, maps: GlossMaps) -> None:
    """Write gloss into the sRGB-encoded colours (H, W, 3) of the view at an offset. disparity: (H, W), of that view."""
    gloss, size = maps.gloss, image_size(colors)
    t, s = map(float, offset)
    near = maps.geometry.nearness(disparity)
    reflected, virtual, environment = maps.reflected, maps.reflected_disparity, maps.environment
    if reflected is not None:
        moves = virtual is not None
        virtual = virtual if virtual is not None else np.zeros((1, 1, 2, 2), np.float32)
        in_bands(
            lambda first, last: _move_reflections(
                colors, disparity, maps.disparity, reflected, moves, virtual, t, s, first, last
            ),
            size, )  # fmt: skip
    if environment is not None or any(gloss.light.color):
        width2, disc = gloss.lobe_widths
        light = np.array((gloss.light.unit_direction, gloss.light.radiance), np.float32)
        around = NO_ENVIRONMENT if environment is None else environment
        in_bands(
            lambda first, last: _add_lobes(
                colors, disparity, near, maps.disparity, maps.normals, maps.mask[..., None], t, s,
                maps.geometry.focal_px, light, width2, disc, gloss.reflectance, environment is not None, around,
                first, last,
            ),
            size, )  # fmt: skip


@kernel
def _is_inside(v, u, height, width):
    """Whether a place is on a pixel of the photo."""
    return v > -0.5 and v < height - 0.5 and u > -0.5 and u < width - 0.5


@kernel
def _is_same(apart, t, s):
    """Whether disparities so far apart are of the same surface, as the view at (t, s) sees it."""
    return apart * apart * (t * t + s * s) <= EDGE_PX * EDGE_PX


@kernel
def _add_lobes(
    colors, disparity, near, photo_disparity, normals, mask, t, s, focal, light, width2, disc, reflectance,
    has_environment, environment, first, last,
):  # fmt: skip
    """Rows [first, last): the lobe of the light, and what is reflected of the surroundings, over the view's colours.

    light: its direction and its radiance, (2, 3).
    """
    height, width = disparity.shape
    centre_y, centre_x = (height - 1) / 2, (width - 1) / 2
    lx, ly, lz = light[0, 0], light[0, 1], light[0, 2]
    rows, columns = environment.shape[:2]
    for y in range(first, last):
        for x in range(width):
            # the place in the photo, and whether the same surface is seen there
            d = disparity[y, x]
            v, u = y + d * t, x + d * s
            if not _is_inside(v, u, height, width) or not _is_same(
                photo_disparity[int(v + 0.5), int(u + 0.5)] - d, t, s
            ):
                continue
            v, u = min(max(v, 0.0), height - 1.0), min(max(u, 0.0), width - 1.0)
            marked = _bilinear(mask, v, u, 0)
            if not marked > 0:
                continue
            nx, ny, nz = _bilinear(normals, v, u, 0), _bilinear(normals, v, u, 1), _bilinear(normals, v, u, 2)
            length = max(sqrt(nx * nx + ny * ny + nz * nz), 1e-12)
            nx, ny, nz = nx / length, ny / length, nz / length
            # from the point to the eye, in view steps
            z = focal / near[y, x]
            ex, ey, ez = s - (u - centre_x) / near[y, x], t - (v - centre_y) / near[y, x], -z
            length = sqrt(ex * ex + ey * ey + ez * ez)
            ex, ey, ez = ex / length, ey / length, ez / length
            lobe = marked * reflected_share(nx, ny, nz, ex, ey, ez, lx, ly, lz, width2, disc, reflectance)
            n_v = nx * ex + ny * ey + nz * ez
            around, v, u = 0.0, 0.0, 0.0
            if has_environment and n_v > 0:
                grazing = 1 - min(n_v, 1.0)
                around = marked * (reflectance + (1 - reflectance) * grazing**5)
                rx, ry, rz = 2 * n_v * nx - ex, 2 * n_v * ny - ey, 2 * n_v * nz - ez
                v = acos(min(max(-ry, -1.0), 1.0)) / pi * rows - 0.5
                u = (atan2(rx, rz) / (2 * pi) + 0.5) * columns - 0.5
            if lobe <= 0 and around <= 0:
                continue
            v = min(max(v, 0.0), rows - 1.0)
            top, left = int(v), floor(u)
            below, a, b = min(top + 1, rows - 1), v - top, u - left
            left, right = left % columns, (left + 1) % columns
            for c in range(3):
                linear = linear_scalar(colors[y, x, c])
                if around > 0:
                    upper = (1 - b) * environment[top, left, c] + b * environment[top, right, c]
                    lower = (1 - b) * environment[below, left, c] + b * environment[below, right, c]
                    linear += around * ((1 - a) * upper + a * lower - linear)
                linear += lobe * (light[1, c] - linear)
                colors[y, x, c] = srgb_scalar(linear)


@kernel
def _move_reflections(colors, disparity, photo_disparity, reflected, moves, virtual, t, s, first, last):
    """Rows [first, last): what the photo shows reflected goes from where it is seen as if painted on the surface, and
    if it moves it comes to where it is reflected now.
    """
    height, width = disparity.shape
    for y in range(first, last):
        for x in range(width):
            d = disparity[y, x]
            own_v, own_u = y + d * t, x + d * s
            if not _is_inside(own_v, own_u, height, width) or not _is_same(
                photo_disparity[int(own_v + 0.5), int(own_u + 0.5)] - d, t, s
            ):
                continue
            # the fixed point place = pixel + M(place) offset, from the surface's own place on
            v, u = own_v, own_u
            for _ in range(FIXED_POINT_STEPS if moves else 0):
                i, j = int(min(max(v, 0.0), height - 1.0) + 0.5), int(min(max(u, 0.0), width - 1.0) + 0.5)
                v = y + virtual[i, j, 1, 0] * s + virtual[i, j, 1, 1] * t
                u = x + virtual[i, j, 0, 0] * s + virtual[i, j, 0, 1] * t
            for c in range(3):
                gone = _bilinear(reflected, own_v, own_u, c)
                is_seen = moves and v >= 0 and v <= height - 1 and u >= 0 and u <= width - 1
                come = _bilinear(reflected, v, u, c) if is_seen else 0.0
                if gone != come:
                    colors[y, x, c] = srgb_scalar(max(linear_scalar(colors[y, x, c]) - gone, 0.0) + come)


@kernel
def _bilinear(image, y, x, channel):
    """One channel of an image (H, W, C) at a place; clamped at its borders."""
    height, width = image.shape[:2]
    y, x = min(max(y, 0.0), height - 1.0), min(max(x, 0.0), width - 1.0)
    top, left = int(y), int(x)
    below, right = min(top + 1, height - 1), min(left + 1, width - 1)
    v, u = y - top, x - left
    upper = (1 - u) * image[top, left, channel] + u * image[top, right, channel]
    lower = (1 - u) * image[below, left, channel] + u * image[below, right, channel]
    return (1 - v) * upper + v * lower
