"""Maps of the lens for editors: the disc of defocus of every pixel, and the band that is in focus."""

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import Optics
from iibr_core.color import encoded_from_stored
from iibr_core.exports.full_picture import MAX_PIXELS
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.source import ExportSource
from iibr_core.formats.images.write import write_image_file
from iibr_core.scenes.large_photo import load_large
from iibr_core.types import FloatImage, InputError

GREY_16 = np.iinfo(np.uint16).max


class OwnSize(NamedTuple):
    """The photo at its own size. colors (H, W, 3): sRGB-encoded. disparity (H, W): field disparity of the views.

    enlarged: its width over that of a view.
    """

    colors: FloatImage
    disparity: FloatImage
    enlarged: float


def at_own_size(source: ExportSource) -> OwnSize:
    """Return the photo with its disparity at its own size, of a light field the middle view.

    Raises InputError without disparity.
    """
    scene, loaded = source.scene, source.loaded
    if loaded is not None and scene.own_size is not None and math.prod(scene.own_size) > math.prod(scene.size):
        large = load_large(scene.source, loaded, source.plan(), MAX_PIXELS)
        enlarged = large.size.width / scene.width
        return OwnSize(large.pixels, large.disparity / np.float32(enlarged), enlarged)
    view, disparity = source.depth_view()
    return OwnSize(encoded_from_stored(view.colors), disparity, 1.0)


def write_blur(path: Path, source: ExportSource, options: ExportOptions) -> str:
    """Write the radius of each pixel's disc, in pixels, positive before the focus; return a sentence about the file."""
    if source.optics.aperture_diameter == 0:
        raise InputError(f"{path}: a closed lens blurs nothing; open it by an f-number or an aperture")
    photo = at_own_size(source)
    radius = _out_of_focus(photo.disparity, source.optics) * (source.optics.aperture_diameter / 2 * photo.enlarged)
    meaning = "radius of the disc of defocus in pixels, positive before the focus, negative behind it"
    header = {"ImageDescription": f"iibr: {meaning}"}
    write_image_file(path, radius.astype(np.float32)[..., None], "float", header, channels=("Y",))
    return f"Values are the {meaning}: {radius.min():.1f} to {radius.max():.1f}."


def write_depth_mask(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Write a mask of the surfaces in focus: white, with ends that are soft over `options.soft` of disparity."""
    beside = np.abs(_out_of_focus(at_own_size(source).disparity, source.optics)) / max(options.soft, 1e-9)
    share = np.clip(1 - beside, 0, 1)
    write_grey(path, share * share * (3 - 2 * share))


def write_grey(path: Path, shares: NDArray[np.floating]) -> None:
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
