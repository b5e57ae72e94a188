"""XMP packets: properties of photos that saved pictures keep, and texts of this program."""

import base64
import binascii
import zlib
from collections.abc import Mapping
from contextlib import suppress
from xml.etree import ElementTree
from xml.etree.ElementTree import Element, ParseError, SubElement

from defusedxml.common import DefusedXmlException
from defusedxml.ElementTree import fromstring

from iibr_core.formats.files import MAX_PART_BYTES
from iibr_core.types import InputError

MAX_TAGS = 40_000
"""Largest number of tags of an XMP packet; real ones have some hundreds."""
RDF, XMP_META, OURS = "http://www.w3.org/1999/02/22-rdf-syntax-ns#", "adobe:ns:meta/", "urn:iibr:1.0/"
NAMESPACES = {
    "x": XMP_META,
    "rdf": RDF,
    "dc": "http://purl.org/dc/elements/1.1/",
    "xmp": "http://ns.adobe.com/xap/1.0/",
    "xmpRights": "http://ns.adobe.com/xap/1.0/rights/",
    "photoshop": "http://ns.adobe.com/photoshop/1.0/",
    "Iptc4xmpCore": "http://iptc.org/std/Iptc4xmpCore/1.0/xmlns/",
    "lr": "http://ns.adobe.com/lightroom/1.0/",
    "cc": "http://creativecommons.org/ns#",
    "plus": "http://ns.useplus.org/ldf/xmp/1.0/",
    "MicrosoftPhoto": "http://ns.microsoft.com/photo/1.0/",
    "iibr": OURS,
}
KEPT_NAMESPACES = frozenset(NAMESPACES.values()) - {XMP_META, RDF, OURS}
"""Namespaces of properties that saved pictures keep: author, title, description, keywords, rating and rights."""
DROPPED_NAMES = frozenset({"Thumbnails", "DocumentAncestors", "SidecarForExtension"})
MAX_PLAIN_CHARACTERS = 20_000
"""Longest text that is not packed: a JPEG holds 64 KB of XMP."""
PACKED = "zlib,base64:"
MAX_UNPACKED_BYTES = 4_000_000
PACKET_START, PACKET_END = b'<?xpacket begin="\xef\xbb\xbf" id="W5M0MpCehiHzreSzNTczkc9d"?>\n', b'\n<?xpacket end="w"?>'


def parse_packet(packet: bytes) -> Element:
    """Parse an XMP packet without expanding entities.

    Raises InputError where it is no XML, declares a document type, or is too large.
    """
    if len(packet) > MAX_PART_BYTES or packet.count(b"<") > MAX_TAGS:
        raise InputError(f"XMP of {len(packet):,} bytes or its number of tags is too large")
    try:
        tree: Element = fromstring(packet.strip(b"\0 \t\r\n"), forbid_dtd=True)
    except DefusedXmlException as error:
        raise InputError("XMP declares a document type; entities are not expanded") from error
    except (ParseError, ValueError, LookupError) as error:  # LookupError: of an encoding
        raise InputError(f"XMP is damaged ({error})") from error
    return tree


def value_in(tree: Element, namespace: str, name: str) -> str | None:
    """Return the first value of a property in a tree, its root included, as attribute or element; None without."""
    key = f"{{{namespace}}}{name}"
    for element in tree.iter():
        if key in element.attrib:
            return element.attrib[key]
        if element.tag == key:
            return "".join(element.itertext())
    return None


def list_value_in(tree: Element, namespace: str, name: str) -> str:
    """Return the first text of a property, of a list its first entry; "" without."""
    for element in tree.iter(f"{{{namespace}}}{name}"):
        texts = [entry.text for entry in element.iter(f"{{{RDF}}}li")] or [element.text]
        if text := next(filter(None, texts), "").strip():
            return text
    return ""


def xmp_for(xmp: bytes, texts: Mapping[str, str]) -> bytes:
    """Return a packet with the kept properties of a photo's XMP, and with texts of ours; b"" where there are none."""
    described = Element(f"{{{RDF}}}Description", {f"{{{RDF}}}about": ""})
    for name, text in texts.items():
        described.set(f"{{{OURS}}}{name.rpartition(':')[2]}", _pack(text))
    with suppress(InputError):  # a photo without XMP is a photo, too
        for source in parse_packet(xmp).iter(f"{{{RDF}}}Description") if xmp else ():
            _copy_properties(source, described)
    if len(described) == 0 and len(described.attrib) == 1:
        return b""
    for prefix, uri in NAMESPACES.items():
        ElementTree.register_namespace(prefix, uri)
    root = Element(f"{{{XMP_META}}}xmpmeta")
    SubElement(root, f"{{{RDF}}}RDF").append(described)
    packet: bytes = ElementTree.tostring(root, encoding="utf-8")
    return PACKET_START + packet + PACKET_END


def text_in(xmp: bytes, name: str) -> str:
    """Return a text of ours in a packet, packed or not; "" without."""
    return value_in(parse_packet(xmp), OURS, name.rpartition(":")[2]) or "" if OURS.encode() in xmp else ""


def unpack(text: str) -> str:
    """Return a text of ours as it was before it was packed."""
    if not text.startswith(PACKED):
        return text
    try:
        packed = base64.b64decode(text.removeprefix(PACKED))
        return zlib.decompressobj().decompress(packed, MAX_UNPACKED_BYTES).decode()
    except (ValueError, binascii.Error, zlib.error) as error:
        raise InputError("its settings are damaged; set them by hand") from error


def _pack(text: str) -> str:
    if len(text) <= MAX_PLAIN_CHARACTERS:
        return text
    return PACKED + base64.b64encode(zlib.compress(text.encode(), 9)).decode("ascii")


def _copy_properties(source: Element, target: Element) -> None:
    for name, value in source.attrib.items():
        if _is_kept(name) and name not in target.attrib:
            target.set(name, value)
    known = {child.tag for child in target}
    target.extend(child for child in source if _is_kept(child.tag) and child.tag not in known)


def _is_kept(name: str) -> bool:
    namespace, _, local = name[1:].partition("}")
    return name.startswith("{") and namespace in KEPT_NAMESPACES and local not in DROPPED_NAMES
