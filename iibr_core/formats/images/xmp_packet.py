"""XMP packets: parsed without ever expanding an entity."""

from __future__ import annotations

from xml.etree.ElementTree import Element, ParseError, TreeBuilder

from defusedxml.common import DTDForbidden
from defusedxml.ElementTree import DefusedXMLParser

from iibr_core.types import InputError

MAX_PACKET_BYTES = 64 * 2**20
"""Of extended XMP: twice what the sharp picture of a 100 MP camera would take as base64."""

MAX_ELEMENTS = 20_000
"""Real packets hold some hundreds."""


def value_in(tree: Element, namespace: str, name: str) -> str | None:
    """The first value of a property in a tree, its root included, as attribute or element; None without."""
    key = f"{{{namespace}}}{name}"
    for element in tree.iter():
        if key in element.attrib:
            return element.attrib[key]
        if element.tag == key:
            return "".join(element.itertext())
    return None


class _LimitedTree(TreeBuilder):
    """A tree of at most MAX_ELEMENTS elements."""

    count = 0

    def start(self, tag: str, attrs: dict[str, str]) -> Element:
        self.count += 1
        if self.count > MAX_ELEMENTS:
            raise InputError(f"XMP holds more than {MAX_ELEMENTS:,} elements")
        return super().start(tag, attrs)


def parse_packet(packet: bytes) -> Element:
    """The XML tree of a packet. Raises InputError where it is no XML, declares a document type, or is too large."""
    if len(packet) > MAX_PACKET_BYTES:
        raise InputError(f"XMP of {len(packet):,} bytes exceeds {MAX_PACKET_BYTES:,}")
    parser = DefusedXMLParser(target=_LimitedTree(), forbid_dtd=True)
    try:
        parser.feed(packet.strip(b"\0 \t\r\n"))
        tree: Element = parser.close()
        return tree
    except InputError:
        raise
    except DTDForbidden as error:
        raise InputError("XMP declares a document type; entities are not expanded") from error
    except (ParseError, AssertionError, ValueError, LookupError) as error:  # the last: of an encoding
        raise InputError(f"XMP is damaged ({error})") from error
