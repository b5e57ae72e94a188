"""What a photo's file says about it to people: its title, what it shows, whose it is. XMP counts before Exif."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

from iibr_core.formats.images.metadata import EXIF_ERRORS, NAMESPACES, RDF, read_metadata
from iibr_core.formats.images.xmp_packet import parse_packet
from iibr_core.types import InputError

DESCRIPTION, ARTIST, COPYRIGHT = 0x010E, 0x013B, 0x8298
MOST_CHARACTERS = 2000


@dataclass(frozen=True)
class Caption:
    """Texts of a line each, "" where nothing is said."""

    title: str = ""
    description: str = ""
    author: str = ""
    rights: str = ""


def read_caption(path: Path) -> Caption:
    """Of a photo's file; nothing where that says nothing, is damaged, or not there."""
    metadata = read_metadata(path)
    exif, tree = _exif_texts(metadata.exif), _tree(metadata.xmp)
    return Caption(
        _text_in(tree, "title"),
        _text_in(tree, "description") or exif.get(DESCRIPTION, ""),
        _text_in(tree, "creator") or exif.get(ARTIST, ""),
        _text_in(tree, "rights") or exif.get(COPYRIGHT, ""),
    )


def _exif_texts(data: bytes) -> dict[int, str]:
    from PIL import Image

    exif = Image.Exif()
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            exif.load(data)
            found = {tag: exif.get(tag) for tag in (DESCRIPTION, ARTIST, COPYRIGHT)}
    except EXIF_ERRORS:
        return {}
    return {tag: _line(text) for tag, text in found.items() if isinstance(text, str)}


def _tree(xmp: bytes) -> Element | None:
    try:
        return parse_packet(xmp) if xmp else None
    except InputError:
        return None


def _text_in(tree: Element | None, name: str) -> str:
    """The first text of a property of Dublin Core: of a list its first entry."""
    key = f"{{{NAMESPACES['dc']}}}{name}"
    for element in () if tree is None else tree.iter(key):
        texts = [entry.text for entry in element.iter(f"{{{RDF}}}li")] or [element.text]
        if found := _line(next(filter(None, texts), "")):
            return found
    return ""


def _line(text: str) -> str:
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())[:MOST_CHARACTERS]
