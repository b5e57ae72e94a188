"""Maps for editors: the disc of defocus of every pixel, the band that is in focus, and the matte of a surface.

A matte is white where the picture shows the surface, and grey where its edge covers a pixel in part.
"""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import Optics
from iibr_core.color import encoded_from_stored
from iibr_core.depth.editing.bucket import surface_at
from iibr_core.depth.editing.edits import Stroke, extent_of
from iibr_core.depth.guided_filter import GuidedFilter
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.render_settings import MAX_PIXELS
from iibr_core.exports.source import ExportSource
from iibr_core.formats.images.write import write_image_file
from iibr_core.scenes.large_photo import load_large
from iibr_core.scenes.lens_choice import require_inside
from iibr_core.types import FloatImage, InputError

GREY_16 = np.iinfo(np.uint16).max
HOLE_RADIUS = 0.01
"""Radius of the largest hole in a surface that belongs to it, as a share of the picture's width."""
EDGE_RADIUS_PX, EDGE_VARIANCE = 2, 1e-3
"""Window in which an edge follows the colours, and the variance of grey below which it is not moved."""


class _OwnSize(NamedTuple):
    """The photo at its own size. colors (H, W, 3): sRGB-encoded. disparity (H, W): field disparity of the views.

    enlarged: its width over that of a view.
    """

    colors: FloatImage
    disparity: FloatImage
    enlarged: float


def _at_own_size(source: ExportSource) -> _OwnSize:
    """Return the photo with its disparity at its own size, of a light field the middle view.

    Raises InputError without disparity.
    """
    scene, loaded = source.scene, source.loaded
    if loaded is not None and scene.own_size is not None and math.prod(scene.own_size) > math.prod(scene.size):
        large = load_large(scene.source, loaded, source.plan(), MAX_PIXELS)
        enlarged = large.size.width / scene.width
        return _OwnSize(large.pixels, large.disparity / np.float32(enlarged), enlarged)
    view, disparity = source.depth_view()
    return _OwnSize(encoded_from_stored(view.colors), disparity, 1.0)


def write_blur(path: Path, source: ExportSource, options: ExportOptions) -> str:
    """Write the radius of each pixel's disc, in pixels, positive before the focus; return a sentence about the file."""
    if source.optics.aperture_diameter == 0:
        raise InputError(f"{path}: a closed lens blurs nothing; open it by an f-number or an aperture")
    photo = _at_own_size(source)
    radius = _out_of_focus(photo.disparity, source.optics) * (source.optics.aperture_diameter / 2 * photo.enlarged)
    meaning = "radius of the disc of defocus in pixels, positive before the focus, negative behind it"
    header = {"ImageDescription": f"iibr: {meaning}"}
    write_image_file(path, radius.astype(np.float32)[..., None], "float", header, channels=("Y",))
    return f"Values are the {meaning}: {radius.min():.1f} to {radius.max():.1f}."


def write_depth_mask(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Write a mask of the surfaces in focus: white, with ends that are soft over `options.soft` of disparity."""
    beside = np.abs(_out_of_focus(_at_own_size(source).disparity, source.optics)) / max(options.soft, 1e-9)
    share = np.clip(1 - beside, 0, 1)
    _write_grey(path, share * share * (3 - 2 * share))


def write_matte(path: Path, source: ExportSource, options: ExportOptions) -> str:
    """Write the matte of the surface at `options.at`; return a sentence about the file."""
    if options.at is None:
        raise InputError(f"{path}: which surface? give a place of it, in pixels from the left and the top")
    (x, y), (width, height) = options.at, require_inside(options.at, source.scene)
    photo = _at_own_size(source)
    stroke = Stroke("fill", ((x / width, y / height),), HOLE_RADIUS, 1.0, tolerance=options.tolerance)
    surface = surface_at(photo.colors, photo.disparity, stroke, 0, extent_of(photo.disparity))
    matte = surface.astype(np.float32)
    grey = np.ascontiguousarray(photo.colors.mean(axis=2), np.float32)
    GuidedFilter(grey, EDGE_RADIUS_PX, EDGE_VARIANCE).apply(matte[None])
    _write_grey(path, np.clip(matte, 0, 1))
    return f"The surface at {x:g},{y:g} fills {surface.mean():.1%} of the picture."


def _write_grey(path: Path, shares: NDArray[np.floating]) -> None:
    """Write shares (H, W), 0..1, as a grey picture of 16 bits."""
    values: NDArray[np.uint16] = np.rint(shares * GREY_16).astype(np.uint16)
    write_image_file(path, values[..., None], "uint16", channels=("Y",))


def _out_of_focus(disparity: FloatImage, optics: Optics) -> FloatImage:
    """Return how far each pixel's disparity lies before the sharp range, negative behind it, 0 within."""
    height, width = disparity.shape
    right, down = optics.focus_tilt
    across, below = (np.arange(width) + 0.5) / width - 0.5, (np.arange(height) + 0.5) / height - 0.5
    focus = optics.focus_disparity + 2 * (right * across[None] + down * below[:, None])
    beside = disparity - np.float32(focus)
    return np.asarray(np.sign(beside) * np.maximum(np.abs(beside) - np.float32(optics.focus_range), 0))
