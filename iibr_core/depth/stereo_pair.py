"""The depth of a stereo photo, from its two views: matched at a moderate size, as depth maps of phones have it."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from iibr_core.color import stored_from_encoded
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.multi_view.estimate_disparity import estimate_coarse, estimate_disparity, sweep_bytes
from iibr_core.formats.images.photo import read_picture
from iibr_core.formats.images.side_by_side import left_picture
from iibr_core.formats.light_fields.view_files import read_stereo_file
from iibr_core.runtime.machine import free_memory_bytes
from iibr_core.runtime.work import report_progress
from iibr_core.types import InputError, image_size

MATCHED_PIXELS = 400_000
"""Of each view; edges are drawn to the photo's afterwards."""


def estimate_from_pair(
    path: Path,
) -> tuple[DepthEstimate, str] | None:
    """Of the picture that a stereo photo's file shows, px from eye to eye, and what kind of file it is; None where a
    file is no stereo photo, or shows another picture than these two.

    Raises InputError where it is damaged, its views differ in size, are too small, or memory does not do.
    """
    scene = read_stereo_file(path)
    held = [view.picture for view in scene.views] if scene is not None else []
    if scene is None or left_picture(path) not in held:
        return None
    report_progress(0, 0, "finding disparity")
    pictures = [read_picture(picture, MATCHED_PIXELS).pixels for picture in held]
    if pictures[0].shape != pictures[1].shape:
        sizes = " and ".join(str(image_size(pixels)) for pixels in pictures)
        raise InputError(f"{path}: its two views differ in shape ({sizes} after reading)")
    views = [stored_from_encoded(pixels, is_hdr=False) for pixels in pictures]
    offsets = [view.offset for view in scene.views]
    reference = held.index(left_picture(path))
    coarse = estimate_coarse(views, offsets, reference)
    if sweep_bytes(coarse.values.shape, coarse.range_px, 1.0) > free_memory_bytes():
        raise InputError(f"{path}: matching its two views takes more memory than there is")
    values = estimate_disparity(views, offsets, reference, coarse.range_px)
    return DepthEstimate(values.astype(np.float32), "disparity"), scene.layout
