"""Finds the scenes below a folder, whatever layout they come in, and reads what a trial needs of them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates

from iibr_core.formats.files import entries_of, is_folder
from iibr_core.formats.images.photo import read_picture
from iibr_core.formats.light_fields.light_field_formats import LAYOUTS, find_light_field
from iibr_core.formats.light_fields.multi_view_scene import KnownDisparity, KnownView, MultiView, common_size
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.types import (
    Disparity,
    FloatImage,
    ImageSize,
    InputError,
    image_size,
)


def read_scene(folder: Path) -> MultiView | None:
    """The scene of a folder, None where it is none that is known. Raises InputError where it is damaged, has one view
    only, or views of different sizes.
    """
    scene = find_light_field(folder)
    if scene is None:
        return None
    if len(scene.views) < 2:
        raise InputError(f"{scene.views[0].path}: is the only view; a comparison needs at least two")
    common_size(scene.views)
    return scene


def find_scenes(folder: Path) -> Iterator[MultiView]:
    """The scene of a folder, or those of its subfolders. Raises InputError where there is none, or one is damaged."""
    if not is_folder(folder):
        raise InputError(f"{folder}: is not a folder; give the folder of a data set ({LAYOUTS})")
    scene = read_scene(folder)
    if scene is not None:
        yield scene
        return
    below = [path for path in entries_of(folder) if is_folder(path) and not path.name.startswith(".")]
    found = [scene for path in below if (scene := read_scene(path)) is not None]
    if not found:
        raise InputError(f"{folder}: holds no scene with several views; laid out as {LAYOUTS}")
    yield from found


def read_known_disparity(known: KnownDisparity, size: ImageSize, colors: FloatImage | None = None) -> Disparity:
    """The map for a picture of (height, width), px per view step. What is unknown is filled as the program does it, by
    the picture's colors (H, W, 3); where they are not given, from behind. Raises InputError.
    """
    return read_disparity(known.path, size, known.scale, colors)


def read_view(view: KnownView, max_pixels: int) -> FloatImage:
    """Colours (H, W, 3) sRGB-encoded in 0..1."""
    return np.clip(read_picture(view.picture, max_pixels).pixels, 0, 1)


def read_straight_view(view: KnownView, max_pixels: int) -> tuple[FloatImage, NDArray[np.bool_]]:
    """The same, a turned camera's picture turned back so that it looks as the given one does, and where it is known
    (H, W).
    """
    pixels = read_view(view, max_pixels)
    if view.camera is None:
        return pixels, np.ones(pixels.shape[:2], np.bool_)
    camera = view.camera.resized(image_size(pixels))
    own = camera.intrinsics
    return undo_rotation(pixels, own @ camera.world_from_camera.T @ np.linalg.inv(own))


def undo_rotation(pixels: FloatImage, turned: NDArray[np.float64]) -> tuple[FloatImage, NDArray[np.bool_]]:
    """The picture (H, W, 3) as an equal camera at its place would see it that looks as the given one does, and where
    that is known. turned: (3, 3), takes a pixel (x, y, 1) of that camera's frame to this picture's.
    """
    height, width = pixels.shape[:2]
    y, x = np.mgrid[0:height, 0:width].astype(np.float64)
    across = np.stack([x, y, np.ones_like(x)], axis=-1) @ turned.T
    with np.errstate(divide="ignore", invalid="ignore"):
        at = np.stack([across[..., 1], across[..., 0]]) / across[..., 2]
    inside = (across[..., 2] > 0) & (at[0] >= 0) & (at[0] <= height - 1) & (at[1] >= 0) & (at[1] <= width - 1)
    at = np.where(inside, at, 0.0)
    channels = [map_coordinates(pixels[..., c], at, order=3, mode="nearest") for c in range(3)]
    return np.clip(np.stack(channels, axis=-1), 0, 1).astype(np.float32), inside
