"""What depth inside a photo is brought in line with: the picture that was taken with it, upright."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from iibr_core.depth.embedded.embedded_depth import EmbeddedDepth
from iibr_core.depth.embedded.images import picture_file
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.formats.images.decode import read_orientation
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.picture import upright
from iibr_core.formats.maps.disparity_file import MAX_ASPECT_DIFFERENCE
from iibr_core.types import ImageSize, InputError, Photo


def photo_in_focus(path: Path, photo: Photo, embedded: EmbeddedDepth, max_pixels: int) -> Photo:
    """The all-in-focus picture of a file as the photo, turned like it; the photo itself where there is none, or where
    that is damaged or another one.
    """
    if embedded.all_in_focus is None:
        return photo
    try:
        with picture_file(embedded.all_in_focus, "the all-in-focus picture") as sharp_path:
            sharp = read_photo(sharp_path, max_pixels, keeps_primaries=True)
            turns = read_orientation(sharp_path) == 1
        pixels = upright(sharp.pixels, read_orientation(path)) if turns else sharp.pixels
    except InputError as error:
        return replace(photo, notes=(*photo.notes, f"The blurred picture is shown: {error}"))
    if not _is_alike(pixels.shape[:2], photo.size):
        return replace(photo, notes=(*photo.notes, "The blurred picture is shown: the sharp one has another shape."))
    focal_px = photo.focal_px * pixels.shape[1] / photo.size.width
    note = "The sharp picture that the file holds is shown, not the blurred one."
    return replace(photo, pixels=pixels, focal_px=focal_px, notes=(*photo.notes, note), color_space=sharp.color_space)


def rotate_estimate(estimate: DepthEstimate, size: ImageSize, orientation: int) -> DepthEstimate:
    """The estimate, turned upright as the photo was, unless its writer has turned it already. Maps of another shape
    show the whole photo, stretched, as GDepth's specification says; those that lie across it fit no way.
    """
    values = estimate.values
    turned = upright(values, orientation)
    for candidate in (turned, values):
        if _is_alike(candidate.shape, size):
            return DepthEstimate(candidate, estimate.meaning)
    is_high = size.height > size.width
    for candidate in (turned, values):
        if (candidate.shape[0] > candidate.shape[1]) == is_high or candidate.shape[0] == candidate.shape[1]:
            return DepthEstimate(candidate, estimate.meaning)
    shape, photo_shape = (f"{width}x{height}" for height, width in (values.shape, size))
    raise InputError(f"its {shape} pixels lie across the photo, {photo_shape}")


def _is_alike(shape: tuple[int, ...], size: ImageSize) -> bool:
    """Whether two (height, width) have nearly the same aspect ratio."""
    return abs(shape[1] * size.height / (shape[0] * size.width) - 1) <= MAX_ASPECT_DIFFERENCE
