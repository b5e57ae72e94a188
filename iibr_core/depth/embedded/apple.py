"""Depth that Apple's portrait photos carry: an auxiliary picture of a HEIC, or a second JPEG behind the photo.

The stored 0..1 are linear in inverse distance ("disparity" in Apple's words) or, rarely, in distance. Apple calls most
of these maps relative, so the units of their range are not relied on.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from iibr_core.depth.embedded.images import decode_map
from iibr_core.depth.embedded.xmp import jpeg_layout, number_in, xmp_of
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.types import FloatImage, InputError

PIXEL_DATA = "http://ns.apple.com/pixeldatainfo/1.0/"
MAX_APPENDED = 8
"""Pictures that are looked at behind a photo: depth, mattes, gain map, and some to spare."""

# HEVC's depth representation information: what the stored values are linear in.
INVERSE_DISTANCE_TYPES = (0, 1, 3)
DISTANCE_TYPE = 2


def heic_estimate(depth: FloatImage, metadata: dict[str, Any]) -> DepthEstimate:
    """Return the depth of a HEIC's auxiliary picture: (H, W), 0..1, with what libheif tells of it.

    Raises InputError where the values mean something unknown.
    """
    kind = metadata.get("representation_type", 1)
    if kind in INVERSE_DISTANCE_TYPES:
        low, high = _pair(metadata, "d_min", "d_max") or _inverse(_pair(metadata, "z_far", "z_near")) or (0.0, 1.0)
        return _linear_in_inverse(depth, low, high)
    if kind == DISTANCE_TYPE:
        near, far = _pair(metadata, "z_near", "z_far") or (math.nan, math.nan)
        return _linear_in_distance(depth, near, far)
    raise InputError(f"the depth map's representation {kind!r} is not known")


def appended_estimate(data: bytes, end: int) -> DepthEstimate | None:
    """Depth in a JPEG that follows the photo (which ends at `end`), as iPhones save portraits as JPEG; None without.

    Raises InputError where it is damaged.
    """
    for _ in range(MAX_APPENDED):
        start = data.find(b"\xff\xd8\xff", end)
        if start < 0:
            return None
        layout = jpeg_layout(data, start)
        if PIXEL_DATA.encode() in layout.xmp:
            xmp = xmp_of(layout)
            kind = (xmp.value(PIXEL_DATA, "AuxiliaryImageType") or "").strip()
            if kind in ("disparity", "depth"):
                stored = decode_map(data[start : layout.end], "the depth map behind the photo")
                low, high = (number_in(xmp.value(PIXEL_DATA, f"Float{side}Value")) for side in ("Min", "Max"))
                return (_linear_in_inverse if kind == "disparity" else _linear_in_distance)(stored, low, high)
        end = max(layout.end, start + 2)
    return None


def _linear_in_inverse(stored: FloatImage, low: float, high: float) -> DepthEstimate:
    """A range that makes no sense is left out: it changes nothing but the unknown scale."""
    if not (math.isfinite(low) and high > low and math.isfinite(high)):
        return DepthEstimate(stored, "inverse depth")
    return DepthEstimate(np.float32(low) + stored * np.float32(high - low), "inverse depth")


def _linear_in_distance(stored: FloatImage, near: float, far: float) -> DepthEstimate:
    """Of a range that makes no sense only the order of the values counts."""
    if not (0 < near < far < math.inf):
        return DepthEstimate(1 - stored, "inverse depth")
    return DepthEstimate((1 / (near + stored.astype(np.float64) * (far - near))).astype(np.float32), "inverse depth")


def _pair(metadata: dict[str, Any], low: str, high: str) -> tuple[float, float] | None:
    if low not in metadata or high not in metadata:
        return None
    return float(metadata[low]), float(metadata[high])


def _inverse(distances: tuple[float, float] | None) -> tuple[float, float] | None:
    if distances is None or 0 in distances:
        return None
    return 1 / distances[0], 1 / distances[1]
