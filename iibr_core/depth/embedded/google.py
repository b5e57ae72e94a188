"""Depth maps that Google's formats put into JPEG photos: GDepth (in XMP, as base64) and Dynamic Depth 1.0 (a picture
appended to the file, described in XMP).

Both store n = 0..1 between a near and a far distance, either linear in distance or linear in its inverse.
"""

from __future__ import annotations

import base64
import binascii
import math
from dataclasses import dataclass
from xml.etree.ElementTree import Element

import numpy as np

from iibr_core.depth.embedded.images import JPEG_START, PNG_START, decode_map
from iibr_core.depth.embedded.xmp import JpegLayout, Xmp, number_in
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.formats.files import printable
from iibr_core.formats.images.xmp import value_in
from iibr_core.types import FloatImage, InputError

GDEPTH = "http://ns.google.com/photos/1.0/depthmap/"
GIMAGE = "http://ns.google.com/photos/1.0/image/"
DEPTH_MAP = "http://ns.google.com/photos/dd/1.0/depthmap/"
# The specification of 2019 names the first of each pair, phones that share their container with HDR photos the second.
CONTAINERS = ("http://ns.google.com/photos/dd/1.0/container/", "http://ns.google.com/photos/1.0/container/")
ITEMS = ("http://ns.google.com/photos/dd/1.0/item/", "http://ns.google.com/photos/1.0/container/item/")
METRES = frozenset({"m", "meter", "meters", "metre", "metres"})
MILLIMETRES = frozenset({"mm", "millimeter", "millimeters", "millimetre", "millimetres"})
MIN_CONFIDENCE = 0.05
"""Depth less sure than this counts as unknown; the maps are JPEGs, so their zeros are not quite 0."""

MAX_METRES = 1e6
"""Farther is as far: infinity stays a number."""


@dataclass(frozen=True)
class DepthRange:
    """How stored values mean distances. is_inverse: linear in 1 / distance. metres_per_unit: None where not known.

    near, far: NaN where they make no sense: then only the order of the values counts, dark before bright.
    """

    near: float
    far: float
    is_inverse: bool
    metres_per_unit: float | None


def gdepth_estimate(xmp: Xmp) -> DepthEstimate | None:
    """The depth map in a photo's GDepth properties, None where there is none. Raises InputError where it is damaged."""
    encoded = xmp.value(GDEPTH, "Data")
    if encoded is None:
        if xmp.value(GDEPTH, "Near") is not None:
            raise InputError("GDepth names a depth map and holds none")
        return None
    depth_range = _depth_range({name: xmp.value(GDEPTH, name) for name in ("Format", "Near", "Far", "Units")})
    stored = decode_map(_from_base64(encoded, "GDepth:Data"), "the depth map of GDepth")
    confidence = xmp.value(GDEPTH, "Confidence")
    sure = decode_map(_from_base64(confidence, "GDepth:Confidence"), "its confidence") if confidence else None
    return _estimate(stored, sure, depth_range)


def range_notes(xmp: Xmp) -> tuple[str, ...]:
    """Return a note where the range of GDepth or Dynamic Depth makes no sense, else none."""
    for namespace in (DEPTH_MAP, GDEPTH):
        found = {name: xmp.value(namespace, name) for name in ("Format", "Near", "Far", "Units")}
        if (found["Near"] or found["Far"]) and math.isnan(_depth_range(found).near):
            near, far = (printable(found[name] or "nothing") for name in ("Near", "Far"))
            return (f"The depth map's range from {near} to {far} makes no sense: only the order of its values counts.",)
    return ()


def all_in_focus(xmp: Xmp) -> bytes | None:
    """The picture before the camera blurred it, as a file's bytes; None without. Raises InputError where damaged."""
    encoded = xmp.value(GIMAGE, "Data")
    return _from_base64(encoded, "GImage:Data") if encoded else None


def dynamic_depth_estimate(xmp: Xmp, data: bytes, layout: JpegLayout) -> DepthEstimate | None:
    """The depth map of a Dynamic Depth container, None where there is none. Raises InputError where it is damaged."""
    described = _depth_map_properties(xmp)
    if described is None:
        return None
    items = _items(xmp)
    depth_item = _item_of(items, described["DepthURI"], "depth")
    if depth_item is None:
        raise InputError("Dynamic Depth names a depth map that its container does not list")
    depth_range = _depth_range(described)
    content = _content(items, items.index(depth_item), data, layout)
    stored = decode_map(content, "the depth map of Dynamic Depth")
    sure_item = _item_of(items, described["ConfidenceURI"], "confidence")
    sure = None
    if sure_item is not None:
        sure = decode_map(_content(items, items.index(sure_item), data, layout), "its confidence")
    return _estimate(stored, sure, depth_range)


@dataclass(frozen=True)
class _Item:
    """One picture of a container. length, padding: in bytes, padding following it."""

    uri: str
    semantic: str
    length: int
    padding: int


def _depth_map_properties(xmp: Xmp) -> dict[str, str | None] | None:
    """Of the first depth map that is described; such a description always tells its format."""
    names = ("Format", "Near", "Far", "Units", "DepthURI", "ConfidenceURI")
    found = {name: xmp.value(DEPTH_MAP, name) for name in names}
    return found if found["Format"] or found["DepthURI"] else None


def _items(xmp: Xmp) -> list[_Item]:
    return [_item(element) for element in xmp.elements(CONTAINERS, "Item")]


def _item(element: Element) -> _Item:
    def text(name: str) -> str:
        found = (value_in(element, namespace, name) for namespace in ITEMS)
        return next((value for value in found if value is not None), "").strip()

    return _Item(text("DataURI"), text("Semantic").lower(), _bytes(text("Length")), _bytes(text("Padding")))


def _bytes(text: str) -> int:
    try:
        count = int(text or 0)
    except ValueError:
        count = -1
    if count < 0:
        raise InputError(f"Dynamic Depth item of {text[:40]!r} bytes")
    return count


def _item_of(items: list[_Item], uri: str | None, semantic: str) -> _Item | None:
    by_uri = (item for item in items if uri and item.uri == uri.strip())
    by_semantic = (item for item in items if item.semantic == semantic)
    return next(by_uri, None) or next(by_semantic, None)


def _content(items: list[_Item], index: int, data: bytes, layout: JpegLayout) -> bytes:
    """The bytes of an item. Items lie one after the other behind the photo; where other trailers precede them, they
    end with the file. The first item is the photo itself, whose length a writer need not tell.
    """
    before = sum(item.length + item.padding for item in items[1:index])
    behind = sum(item.length + item.padding for item in items[index:])
    for start in (layout.end + items[0].padding + before, len(data) - behind):
        content = data[start : start + items[index].length] if start >= 0 else b""
        if content.startswith((PNG_START, JPEG_START)):
            return content
    raise InputError(f"Dynamic Depth names {items[index].length:,} bytes of depth map that are not in the file")


def _depth_range(properties: dict[str, str | None]) -> DepthRange:
    """By the properties; RangeInverse where no known format is told."""
    near, far = number_in(properties["Near"]), number_in(properties["Far"])
    is_inverse = (properties["Format"] or "").strip().lower() != "rangelinear"
    # An inverse range may reach to infinity and a linear one may begin at the lens.
    if not (near > 0 if is_inverse else near >= 0) or not far > near or (not is_inverse and math.isinf(far)):
        near = far = math.nan
    units = (properties["Units"] or "").strip().lower()
    metres = 1.0 if units in METRES else 0.001 if units in MILLIMETRES else None
    return DepthRange(near, far, is_inverse, metres)


def _estimate(stored: FloatImage, confidence: FloatImage | None, depth_range: DepthRange) -> DepthEstimate:
    """stored: (H, W), 0..1. The meaning tells whether distances are known in metres or only up to a scale."""
    near, far = depth_range.near, depth_range.far
    values = stored.astype(np.float64)
    with np.errstate(divide="ignore"):
        if math.isnan(near):
            inverse = 1 - values
        elif depth_range.is_inverse:
            inverse = (1 - values) / near + values / far
        else:
            inverse = 1 / (near + values * (far - near))
    inverse[~np.isfinite(inverse)] = np.nan
    if confidence is not None and confidence.shape == stored.shape and (confidence >= MIN_CONFIDENCE).any():
        inverse[confidence < MIN_CONFIDENCE] = np.nan
    if depth_range.metres_per_unit is None or math.isnan(near):
        with np.errstate(over="ignore"):
            relative = inverse.astype(np.float32)
        return DepthEstimate(np.where(np.isfinite(relative), relative, np.float32(np.nan)), "inverse depth")
    scale = depth_range.metres_per_unit
    return DepthEstimate((scale / np.maximum(inverse, scale / MAX_METRES)).astype(np.float32), "metres")


def _from_base64(text: str, what: str) -> bytes:
    try:
        return base64.b64decode("".join(text.split()), validate=True)
    except (binascii.Error, ValueError) as error:
        raise InputError(f"{what} is not complete base64 ({error})") from error
