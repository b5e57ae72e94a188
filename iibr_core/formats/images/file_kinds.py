"""Kinds of files by their first bytes: pictures, and others that are mistaken for them, each with advice."""

import re
from collections.abc import Callable
from pathlib import Path
from typing import Literal, NamedTuple

from iibr_core.formats.files import read_bytes

START_BYTES = 1024
BYTE_ORDER_MARK = b"\xef\xbb\xbf"
RAW_ENDING = re.compile(
    r"\.(3fr|arw|cr[23w]|dcr|dng|erf|fff|gpr|iiq|kdc|mef|mos|mrw|n[er][fw]|orf|pef|raf|rw[2l]|sr[2fw]|x3f)",
    re.IGNORECASE,
)
RAW_STARTS = re.compile(
    rb"II\*\0.{4}CR|II\x1a\0.{4}HEAPCCDR|FUJIFILMCCD-RAW|FOVb|\0MRM|IIU\0|IIR[OS]\x08?|MMOR|.{4}ftypcrx ", re.DOTALL
)
TIFF_STARTS = (b"II*\0", b"MM\0*")
AVIF_BRANDS = frozenset({b"avif", b"avis"})
Kind = Literal["HEIC", "AVIF", "Lytro", "Record3D", "RAW", "JPEG", "other"]
"""Kinds of pictures that are read in different ways. Lytro: its raw files, too."""


class FileKind(NamedTuple):
    """A kind of files. name: with its article. way_out: advice for getting a picture."""

    name: str
    way_out: str


RAW = FileKind("a camera's RAW file", "develop it and save it as TIFF or JPEG")
VIDEO = FileKind("a video", "save one of its frames as PNG or JPEG")
ARCHIVE = FileKind("an archive", "unpack it and open the picture in it")
OTHER_JPEG_XL = FileKind("JPEG XL that cannot be read here", "save it as PNG, for example with djxl, or get it again")
KINDS: tuple[tuple[bytes, FileKind], ...] = (
    (rb"\xff\x0a|\0\0\0\x0cJXL ", OTHER_JPEG_XL),
    (rb"%PDF-", FileKind("a PDF document", "save the page or its picture as PNG")),
    (rb"%!PS|\xc5\xd0\xd3\xc6", FileKind("a PostScript drawing", "save it as PNG")),
    (rb"(?i)(<\?xml[^>]*>|<!--.*?-->|<!DOCTYPE svg[^>]*>|\s)*<svg\b", FileKind("a drawing (SVG)", "save it as PNG")),
    (
        rb"(?i)(<\?xml[^>]*>|<!--.*?-->|\s)*<(!DOCTYPE html|html|head|body|script)\b",
        FileKind("a web page, not a picture", "download the picture itself"),
    ),
    (rb"gimp xcf", FileKind("a GIMP image (XCF)", "export it as PNG")),
    (rb"\x93NUMPY", FileKind("an array of numbers (NumPy)", "give it as a depth map")),
    (rb"ply\r?\n|glTF", FileKind("a 3D model", "save a view of it as PNG")),
    (rb"version https://git-lfs", FileKind("a pointer of Git LFS", "get the file itself with `git lfs pull`")),
    (rb"PK\x03\x04|\x1f\x8b|7z\xbc\xaf\x27\x1c|Rar!|\xfd7zXZ|BZh|\x28\xb5\x2f\xfd", ARCHIVE),
    (rb"\x1aE\xdf\xa3|RIFF.{4}AVI |\x30\x26\xb2\x75|FLV\x01|\0\0\x01[\xb3\xba]", VIDEO),
    (rb"[\0-\x08].{3}(moov|mdat|wide|free|skip|ftyp(?!mif|msf|miaf|hei|hev|avi|jp|tmap))", VIDEO),
)
"""Kinds of files by their starts, as regular expressions."""
TEXT = FileKind("a text file, not a picture", "get the picture itself")


def _begins(pattern: bytes) -> Callable[[bytes, str], bool]:
    compiled = re.compile(pattern, re.DOTALL)
    return lambda start, ending: compiled.match(start) is not None


def _is_avif(start: bytes, ending: str) -> bool:
    """Return whether one of the brands in the first box is AVIF's."""
    size = int.from_bytes(start[:4], "big")
    return start[4:8] == b"ftyp" and not AVIF_BRANDS.isdisjoint(start[k : k + 4] for k in range(8, min(size, 256), 4))


def _is_raw(start: bytes, ending: str) -> bool:
    """Return whether a file is a camera's RAW file.

    Most begin as TIFF does, and hold a small preview that other programs take for the picture.
    """
    is_named = RAW_ENDING.fullmatch(ending) is not None and start.startswith(TIFF_STARTS)
    return is_named or RAW_STARTS.match(start) is not None


SNIFFERS: tuple[tuple[Kind, Callable[[bytes, str], bool]], ...] = (
    ("HEIC", _begins(rb".{4}ftyp(?:hei[cxms]|hev[cx]|mif1|msf1)")),
    ("Lytro", _begins(rb"\x89LFP\r\n\x1a\n")),
    ("AVIF", _is_avif),
    ("Record3D", lambda start, ending: ending.lower() == ".r3d" and start.startswith(b"PK")),
    ("RAW", _is_raw),
    ("JPEG", _begins(rb"\xff\xd8\xff")),
)
"""Kinds and their tests by the first bytes and the ending of the name. The first that fits counts."""


def kind_of(start: bytes, ending: str) -> Kind:
    """Return the kind of a picture. start: its first START_BYTES. ending: of its name, with the dot."""
    return next((kind for kind, is_kind in SNIFFERS if is_kind(start, ending)), "other")


def unreadable_kind(path: Path) -> FileKind | None:
    """Return the kind of a file that no reader took; None for an unknown one."""
    start = read_bytes(path, START_BYTES).removeprefix(BYTE_ORDER_MARK)
    for pattern, kind in KINDS:
        if re.match(pattern, start, re.DOTALL):
            return kind
    if RAW_ENDING.fullmatch(path.suffix):
        return RAW
    return TEXT if _is_text(start) else None


def _is_text(start: bytes) -> bool:
    try:
        text = start.decode()
    except UnicodeDecodeError as error:
        # A character may be cut in two.
        text = start[: error.start].decode() if error.start >= START_BYTES - 6 else ""
    return bool(text) and all(character.isprintable() or character.isspace() for character in text)
