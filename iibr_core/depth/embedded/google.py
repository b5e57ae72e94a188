"""Depth maps of Google's formats in JPEG photos.

XMP holds GDepth as base64; a map of Dynamic Depth 1.0 is a picture behind the photo that XMP describes. Both store
0..1 between a near and a far distance, either linear in distance or linear in its inverse.
"""

from __future__ import annotations

import base64
import math
from xml.etree.ElementTree import Element

import numpy as np

from iibr_core.depth.embedded.images import PICTURE_STARTS, decode_map
from iibr_core.depth.embedded.jpeg import number_in
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.formats.files import printable
from iibr_core.formats.images.xmp import value_in
from iibr_core.types import FloatImage, InputError

GDEPTH = "http://ns.google.com/photos/1.0/depthmap/"
GIMAGE = "http://ns.google.com/photos/1.0/image/"
DEPTH_MAP = "http://ns.google.com/photos/dd/1.0/depthmap/"
# The specification of 2019 names the first of each pair, phones that share their container with HDR photos the second.
ITEM_TAGS = tuple(f"{{http://ns.google.com/photos/{version}/container/}}Item" for version in ("dd/1.0", "1.0"))
ITEMS = ("http://ns.google.com/photos/dd/1.0/item/", "http://ns.google.com/photos/1.0/container/item/")

ORIGINAL_ENDS = ("original_image", "/original")
"""Ends of the names of the picture before the camera blurred it, such as "android/original_image"."""

Properties = dict[str, str]


def gdepth_estimate(xmp: Element) -> DepthEstimate | None:
    """Return the depth map in GDepth properties, None without. Raises InputError if it is damaged."""
    encoded, confidence = value_in(xmp, GDEPTH, "Data"), value_in(xmp, GDEPTH, "Confidence")
    if encoded is None:
        if value_in(xmp, GDEPTH, "Near") is not None:
            raise InputError("GDepth names a depth map and holds none")
        return None
    stored = decode_map(_from_base64(encoded, "GDepth:Data"), "the depth map of GDepth")
    sure = decode_map(_from_base64(confidence, "GDepth:Confidence"), "its confidence") if confidence else None
    return _estimate(stored, sure, _properties(xmp, GDEPTH))


def dynamic_depth_estimate(xmp: Element, data: bytes, end: int) -> DepthEstimate | None:
    """Return the depth map of a Dynamic Depth container behind a photo that ends at `end`, None without.

    Raises InputError if it is damaged.
    """
    described = _properties(xmp, DEPTH_MAP)
    if not (described["Format"] or described["DepthURI"]):
        return None
    content = _content(xmp, described["DepthURI"], "depth", data, end)
    if content is None:
        raise InputError("Dynamic Depth names a depth map that its container does not list")
    stored = decode_map(content, "the depth map of Dynamic Depth")
    sure = _content(xmp, described["ConfidenceURI"], "confidence", data, end)
    return _estimate(stored, None if sure is None else decode_map(sure, "its confidence"), described)


def dynamic_original(xmp: Element, data: bytes, end: int) -> bytes | None:
    """Return the file of the picture before the camera blurred it, from such a container; None without.

    Raises InputError if it is damaged.
    """
    uris = (item[0] for item in _items(xmp))
    uri = next((uri for uri in uris if uri.lower().endswith(ORIGINAL_ENDS)), "")
    return _content(xmp, uri, "original", data, end)


def range_notes(xmp: Element) -> tuple[str, ...]:
    """Return a note if the range of GDepth or Dynamic Depth makes no sense, else none."""
    for properties in (_properties(xmp, DEPTH_MAP), _properties(xmp, GDEPTH)):
        near, far = properties["Near"], properties["Far"]
        if (near or far) and _range(properties) is None:
            ends = f"{printable(near or 'nothing')} to {printable(far or 'nothing')}"
            return (f"The depth map's range from {ends} makes no sense: only the order of its values counts.",)
    return ()


def all_in_focus(xmp: Element) -> bytes | None:
    """Return the file of the picture before the camera blurred it, None without. Raises InputError if it is damaged."""
    encoded = value_in(xmp, GIMAGE, "Data")
    return _from_base64(encoded, "GImage:Data") if encoded else None


def _properties(xmp: Element, namespace: str) -> Properties:
    names = ("Format", "Near", "Far", "Units", "DepthURI", "ConfidenceURI")
    return {name: (value_in(xmp, namespace, name) or "").strip() for name in names}


def _content(xmp: Element, uri: str, semantic: str, data: bytes, end: int) -> bytes | None:
    """Return the bytes of the container's item with this URI, or else this meaning; None without.

    Items lie one after the other behind the photo; if other trailers precede them, they end with the file. The first
    item is the photo itself, whose length a writer need not state.
    """
    items = _items(xmp)
    by_uri = [index for index, item in enumerate(items) if uri and item[0] == uri]
    by_meaning = [index for index, item in enumerate(items) if item[1].lower() == semantic]
    if not (by_uri or by_meaning):
        return None
    index = (by_uri + by_meaning)[0]
    # No file is as long as a number of more digits, which Python would refuse to parse.
    sizes = [[int(text[:20]) if text.isdecimal() else 0 for text in item[2:]] for item in items]
    before, behind = (sum(map(sum, part)) for part in (sizes[1:index], sizes[index:]))
    for start in (end + sizes[0][1] + before, len(data) - behind):
        content = data[start : start + sizes[index][0]] if start >= 0 else b""
        if content.startswith(PICTURE_STARTS):
            return content
    raise InputError(f"Dynamic Depth names {sizes[index][0]:,} bytes of a picture that are not in the file")


def _items(xmp: Element) -> list[list[str]]:
    """Return URI, meaning, length and padding of each item of a container, "" where they are not stated."""
    names = ("DataURI", "Semantic", "Length", "Padding")
    return [
        [next(filter(None, (value_in(item, namespace, name) for namespace in ITEMS)), "").strip() for name in names]
        for item in xmp.iter()
        if item.tag in ITEM_TAGS
    ]


def _range(properties: Properties) -> tuple[float, float] | None:
    """Return the near and far distance, None if they make no sense.

    An inverse range may reach to infinity and a linear range may begin at the lens.
    """
    near, far = number_in(properties["Near"]), number_in(properties["Far"])
    is_sound = 0 < near < far if _is_inverse(properties) else 0 <= near < far < math.inf
    return (near, far) if is_sound else None


def _is_inverse(properties: Properties) -> bool:
    """Return whether values are linear in inverse distance, as they are without a known format."""
    return properties["Format"].lower() != "rangelinear"


def _estimate(stored: FloatImage, confidence: FloatImage | None, properties: Properties) -> DepthEstimate:
    """Return depth in metres if the unit is known, else inverse depth. stored: (H, W), 0..1."""
    values, ends = stored.astype(np.float64), _range(properties)
    with np.errstate(divide="ignore"):
        if ends is None:  # only the order counts, dark before bright
            inverse = 1 - values
        elif _is_inverse(properties):
            inverse = (1 - values) / ends[0] + values / ends[1]
        else:
            inverse = 1 / (ends[0] + values * (ends[1] - ends[0]))
    inverse[~np.isfinite(inverse)] = np.nan
    # In JPEGs, a confidence of zero is stored as nearly 0. A map without any confidence is ignored.
    if confidence is not None and confidence.shape == stored.shape and (confidence >= 0.05).any():
        inverse[confidence < 0.05] = np.nan
    units = {"m": 1.0, "meter": 1.0, "metre": 1.0, "mm": 0.001, "millimeter": 0.001, "millimetre": 0.001}
    metres = units.get(properties["Units"].lower().rstrip("s"))
    if metres is not None and ends is not None:  # a million metres stand for infinity
        return DepthEstimate((metres / np.maximum(inverse, metres / 1e6)).astype(np.float32), "metres")
    with np.errstate(over="ignore"):
        relative = inverse.astype(np.float32)
    return DepthEstimate(np.where(np.isfinite(relative), relative, np.float32(np.nan)), "inverse depth")


def _from_base64(text: str, what: str) -> bytes:
    try:
        return base64.b64decode("".join(text.split()), validate=True)
    except ValueError as error:
        raise InputError(f"{what} is not complete base64 ({error})") from error
