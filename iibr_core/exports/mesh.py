"""The scene as a textured mesh, which any 3D program opens: the photo's surfaces, and the inpainted ones behind them.

The centre view is one mesh. Hidden surfaces have further ones: the farther sides of its depth edges, continued a
little, and the inpainted pixels of each corner view. Each mesh has a picture as its texture.
"""

import math
from dataclasses import replace
from io import BytesIO
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iibr_core.color import bytes_from_encoded, encoded_from_stored, photo_in_srgb
from iibr_core.exports.cameras import cameras_of, nearest_metres
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.points import Y_UP, Mask, Surfaces, surfaces_of
from iibr_core.exports.source import ExportSource
from iibr_core.exports.triangles import triangulate
from iibr_core.formats.cameras import FieldCameras
from iibr_core.formats.glb import TexturedMesh, write_glb
from iibr_core.method.farthest_views import farthest_views, outer_views_of_grid
from iibr_core.method.mixed_pixels import split_mixed_pixels
from iibr_core.method.steep_surfaces import BELOW, RIGHT, join_steep_rays
from iibr_core.scenes.large_photo import read_large
from iibr_core.surfaces import EDGE_PX, SAME_SURFACE_PX, step_of
from iibr_core.types import FloatImage, image_size

MIXED_SHARE = 0.2
"""Share of foreground above which a pixel beside a depth edge, which shows both surfaces, belongs to the foreground."""
SEAM_PX = 8
"""Width of the seam, in pixels, in which an inpainted surface continues behind those of the photo beside it."""
LINING_PX = 3
"""Width of the seam in which a surface of the photo continues behind nearer ones; nothing is inpainted at small steps.
"""
BEHIND_PX = 0.2
"""Distance of hidden surfaces behind the photo's, and slope of seams a pixel, in pixels of the outermost view."""
MAX_TEXTURE_PX = 4096
"""Largest side of a texture that every graphics card takes."""
JPEG_QUALITY = 95
ALL, AFTER, BEFORE = slice(None), slice(1, None), slice(None, -1)
NEIGHBOURS = [((AFTER, ALL), (BEFORE, ALL)), ((BEFORE, ALL), (AFTER, ALL))]
NEIGHBOURS += [((ALL, AFTER), (ALL, BEFORE)), ((ALL, BEFORE), (ALL, AFTER))]
"""Slices of an image, and of the pixels beside these, for all four sides."""
TEXTURE_BLOCK_PX = 16
"""Side of the blocks of a texture that are left grey if nothing shows them."""


def write_mesh(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Write a GLB file with a textured mesh, y up and z backwards, and the photo's camera at the origin.

    It is in metres if distances are known in metres, otherwise in distances of the nearest point.
    """
    cameras = cameras_of(source)
    unit = nearest_metres(source) or 1.0
    views = farthest_views(outer_views_of_grid(cameras.grid))
    photo, *inpainted = surfaces_of(source, cameras.grid)
    cut, behind = step_of(EDGE_PX, views), step_of(BEHIND_PX, views)
    front = _with_mixed_pixels(photo, cut)
    lining = _with_seam(_far_sides(front, views), cut, behind, LINING_PX)
    seen = _least_around(photo.disparity)
    hidden = [_moved_behind(lining, seen, 2 * behind)]
    hidden += [_moved_behind(_with_seam(part, cut, behind, SEAM_PX), seen, behind) for part in inpainted]
    meshes = [_mesh(front, _own_size(source, photo.colors), cameras, views)]
    meshes += [_mesh(part, _shown(part), cameras, views) for part in hidden if part.mask.any()]
    height, width = cameras.size
    angle = 2 * math.atan(height / 2 / cameras.focal_px)
    write_glb(path, meshes, unit, angle, width / height)


def _mesh(surfaces: Surfaces, picture: NDArray[np.uint8], cameras: FieldCameras, views: float) -> TexturedMesh:
    """Return surfaces as a mesh, in distances of the nearest point.

    picture: the texture, (M, N, 3), of the shape of the view, whatever its size. views: view steps to the outermost
    view.
    """
    offset, mask = surfaces.offset, surfaces.mask
    disparity = np.clip(surfaces.disparity, *cameras.range_px)
    nearness = disparity - np.float32(cameras.at_infinity)
    triangles = triangulate(nearness, mask, _joins(disparity, views), views)
    depth = np.float32(cameras.range_px[1] - cameras.at_infinity) / triangles.nearness[:, None]
    from_centre = triangles.corners - np.array(cameras.principal_point(offset), np.float32)
    places = np.concatenate([from_centre * depth / np.float32(cameras.focal_px), depth], axis=1)
    places = (places + np.array(cameras.place(offset), np.float32)) * Y_UP
    uv: FloatImage = np.divide(triangles.corners, np.array(mask.shape[::-1], np.float32))
    return TexturedMesh(places, uv, triangles.indices, _jpeg(picture))


def _joins(disparity: FloatImage, views: float) -> tuple[Mask, Mask]:
    """Return which pixels are on one surface with the next one, to the right (H, W - 1) and below (H - 1, W)."""
    steep, cut = join_steep_rays(disparity, step_of(SAME_SURFACE_PX, views)), step_of(EDGE_PX, views)
    right = (np.abs(np.diff(disparity, axis=1)) <= cut) | (steep[:, :-1] & RIGHT != 0)
    below = (np.abs(np.diff(disparity, axis=0)) <= cut) | (steep[:-1] & BELOW != 0)
    return right, below


def _far_sides(photo: Surfaces, views: float) -> Surfaces:
    """Return the pixels of the photo that are cut off from a nearer one beside them."""
    mask, disparity = np.zeros_like(photo.mask), photo.disparity
    right, below = _joins(disparity, views)
    for (here, beside), joined in zip(NEIGHBOURS, (below, below, right, right)):
        mask[here] |= (disparity[beside] > disparity[here]) & ~joined
    return replace(photo, mask=mask)


def _with_mixed_pixels(photo: Surfaces, edge: float) -> Surfaces:
    """Return the photo with the foreground's disparity at pixels of depth edges that show enough of the foreground."""
    _, _, foreground, share = split_mixed_pixels(encoded_from_stored(photo.colors), photo.disparity, edge)
    return replace(photo, disparity=np.where(share > MIXED_SHARE, foreground, photo.disparity))


def _with_seam(surfaces: Surfaces, cut: float, slope: float, width_px: int) -> Surfaces:
    """Return hidden surfaces with a seam around them, in which they continue behind nearer ones, in their colours.

    cut: least step of disparity at which surfaces are cut apart. slope: fall of disparity a pixel in the seam, which
    keeps it behind other hidden surfaces.
    """
    mask, disparity, colors = surfaces.mask.copy(), surfaces.disparity.copy(), surfaces.colors.copy()
    for _ in range(width_px):
        inside = mask.copy()
        for here, beside in NEIGHBOURS:
            step = disparity[here] - disparity[beside]
            joins = inside[beside] & ~mask[here] & (step >= -cut)
            is_nearer = joins & (step > cut)
            disparity[here][is_nearer] = disparity[beside][is_nearer] - np.float32(slope)
            colors[here][is_nearer] = colors[beside][is_nearer]
            mask[here] |= joins
    return replace(surfaces, mask=mask, disparity=disparity, colors=colors)


def _least_around(image: FloatImage) -> FloatImage:
    """Return the least value (H, W) of each pixel and its eight neighbours."""
    windows = np.lib.stride_tricks.sliding_window_view(np.pad(image, 1, mode="edge"), (3, 3))
    return np.asarray(windows.min(axis=(2, 3)))


def _moved_behind(surfaces: Surfaces, seen: FloatImage, step: float) -> Surfaces:
    """Return surfaces a step behind the disparity (H, W) seen from the centre, wherever they would be in front."""
    (t, s), (height, width), disparity = surfaces.offset, image_size(seen), surfaces.disparity
    y, x = np.arange(height)[:, None], np.arange(width)
    v, u = np.rint(y + disparity * t).astype(int), np.rint(x + disparity * s).astype(int)
    is_inside = (v >= 0) & (v < height) & (u >= 0) & (u < width)
    nearest = np.where(is_inside, seen[np.clip(v, 0, height - 1), np.clip(u, 0, width - 1)], np.float32(np.inf))
    return replace(surfaces, disparity=np.minimum(disparity, nearest) - np.float32(step))


def _own_size(source: ExportSource, colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """Return the photo at its own size if its centre view, with these colours, is smaller and has no gloss."""
    own_size, loaded = source.scene.own_size, source.loaded
    if loaded is None or own_size is None or source.optics.gloss is not None:
        return colors
    if math.prod(own_size) <= math.prod(source.scene.size):
        return colors
    photo = read_large(source.scene.source, loaded, MAX_TEXTURE_PX**2)
    return bytes_from_encoded(photo_in_srgb(photo).pixels)


def _shown(surfaces: Surfaces) -> NDArray[np.uint8]:
    """Return the colours of surfaces, and grey away from them, which takes no room in a file."""
    block, (height, width) = TEXTURE_BLOCK_PX, surfaces.mask.shape
    padded = np.pad(surfaces.mask, [(0, -height % block), (0, -width % block)])
    blocks = np.any(padded.reshape(-(-height // block), block, -1, block), axis=(1, 3))
    shown = blocks.repeat(block, axis=0).repeat(block, axis=1)[:height, :width]
    return np.where(shown[..., None], surfaces.colors, np.uint8(128))


def _jpeg(picture: NDArray[np.uint8]) -> bytes:
    """Return a picture as JPEG file, at most MAX_TEXTURE_PX wide and high."""
    image, content = Image.fromarray(picture), BytesIO()
    image.thumbnail((MAX_TEXTURE_PX, MAX_TEXTURE_PX), Image.Resampling.LANCZOS)
    image.save(content, "JPEG", quality=JPEG_QUALITY, subsampling=0)
    return content.getvalue()
