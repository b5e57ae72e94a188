"""The depth of a stereo photo, from its two views: matched at a moderate size, as depth maps of phones have it."""

from __future__ import annotations

from pathlib import Path

from iibr_core.color import stored_from_encoded
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.multi_view.estimate import estimate_coarse, estimate_disparity
from iibr_core.depth.multi_view.matching import FINDING
from iibr_core.formats.images.photo import read_picture
from iibr_core.formats.images.side_by_side import left_picture
from iibr_core.formats.light_fields.pair_files import read_two_files
from iibr_core.formats.light_fields.view_files import read_stereo_file
from iibr_core.runtime.work import report_progress
from iibr_core.types import InputError, image_size

MATCHED_PIXELS = 400_000
"""Largest number of pixels of each view; edges are refined by the photo later."""


def estimate_from_pair(path: Path, right: Path | None = None) -> tuple[DepthEstimate, str] | None:
    """Return the disparity of the picture that a stereo photo shows, in px from eye to eye, and the kind of file.

    right: file of the right eye's picture. None if the file is no stereo photo or shows another picture than these two.
    Raises InputError if it is damaged,
    or its views differ in size or are too small.
    """
    scene, shown = read_stereo_file(path) if right is None else read_two_files(path, right), left_picture(path)
    pictures = [view.picture for view in scene.views] if scene is not None else []
    if scene is None or shown not in pictures:
        return None
    report_progress(0, 0, FINDING)
    views = [stored_from_encoded(read_picture(picture, MATCHED_PIXELS).pixels, is_hdr=False) for picture in pictures]
    if views[0].shape != views[1].shape:
        sizes = " and ".join(str(image_size(view)) for view in views)
        raise InputError(f"{path}: its two views differ in shape ({sizes} after reading)")
    offsets, reference = [view.offset for view in scene.views], pictures.index(shown)
    coarse = estimate_coarse(views, offsets, reference)
    return DepthEstimate(estimate_disparity(views, offsets, reference, coarse.range_px), "disparity"), scene.layout
