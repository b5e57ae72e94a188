"""Depth of Apple's portrait photos: an auxiliary picture of a HEIC, or a second JPEG behind the photo.

The stored 0..1 are linear in inverse distance ("disparity" in Apple's words) or, rarely, in distance. Apple calls most
of these maps relative, so the units of their range are not relied on.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from iibr_core.depth.embedded.images import decode_map
from iibr_core.depth.embedded.jpeg import appended_pictures, number_in, xmp_of
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.formats.images.xmp import value_in
from iibr_core.types import FloatImage

PIXEL_DATA = "http://ns.apple.com/pixeldatainfo/1.0/"


def heic_estimate(depth: FloatImage, metadata: dict[str, Any]) -> DepthEstimate:
    """Return the depth of a HEIC's auxiliary picture: (H, W), 0..1, with libheif's description of it."""
    low, high, near, far = (float(metadata.get(name, math.nan)) for name in ("d_min", "d_max", "z_near", "z_far"))
    if metadata.get("representation_type") == 2:  # HEVC's number for values linear in distance
        return _linear_in_distance(depth, near, far)
    if math.isnan(low + high) and near > 0 and far > 0:
        low, high = 1 / far, 1 / near
    return _linear_in_inverse(depth, low, high)


def appended_estimate(data: bytes, end: int) -> DepthEstimate | None:
    """Return the depth in a JPEG that follows the photo, which ends at `end`; None without.

    iPhones save portraits as JPEG like this. Raises InputError if it is damaged.
    """
    for picture, layout in appended_pictures(data, end):
        if PIXEL_DATA.encode() not in layout.xmp:
            continue
        xmp = xmp_of(layout)
        kind = (value_in(xmp, PIXEL_DATA, "AuxiliaryImageType") or "").strip()
        if kind in ("disparity", "depth"):
            stored = decode_map(picture, "the depth map behind the photo")
            low, high = (number_in(value_in(xmp, PIXEL_DATA, f"Float{side}Value")) for side in ("Min", "Max"))
            return (_linear_in_inverse if kind == "disparity" else _linear_in_distance)(stored, low, high)
    return None


def _linear_in_inverse(stored: FloatImage, low: float, high: float) -> DepthEstimate:
    """Return inverse depth; a senseless range is ignored, because it changes only the unknown scale."""
    if -math.inf < low < high < math.inf:
        stored = np.float32(low) + stored * np.float32(high - low)
    return DepthEstimate(stored, "inverse depth")


def _linear_in_distance(stored: FloatImage, near: float, far: float) -> DepthEstimate:
    """Return inverse depth; only the order of the values counts if the range makes no sense."""
    inverse = 1 - stored
    if 0 < near < far < math.inf:
        inverse = (1 / (near + stored.astype(np.float64) * (far - near))).astype(np.float32)
    return DepthEstimate(inverse, "inverse depth")
