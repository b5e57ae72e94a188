"""One picture file, looked at once: its kind by its first bytes, its header, its metadata, and the pictures in it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from pathlib import Path
from typing import NamedTuple

from iibr_core.formats.files import read_bytes, stamp_of
from iibr_core.formats.images.decode import (
    Header,
    decode_by_oiio,
    decode_by_pillow,
    oiio_bands,
    oiio_header,
    pillow_header,
)
from iibr_core.formats.images.file_kinds import RAW, START_BYTES, Kind, kind_of
from iibr_core.formats.images.heic import heic_size, read_heic
from iibr_core.formats.images.lfp import lfp_size, read_lfp
from iibr_core.formats.images.metadata import SETTINGS_KEY, PictureMetadata, metadata_in
from iibr_core.formats.images.picture import Picture, turned_size
from iibr_core.formats.images.record3d import decode_recording, recording_header
from iibr_core.formats.images.xmp import text_in, unpack
from iibr_core.types import ImageSize, InputError

REMEMBERED = 8
"""Number of files whose headers are kept: a photo's and its maps'; those of a folder's pictures are read once each."""


class Reader(NamedTuple):
    """Functions that read the first picture of a file, which every program shows."""

    header: Callable[[Path], Header]
    decode: Callable[[Path], Picture]


def _refuse_raw(path: Path) -> Header:
    raise InputError(f"{path}: is {RAW.name}; {RAW.way_out}")


READERS: dict[Kind, Reader] = {
    "HEIC": Reader(lambda path: Header(heic_size(path)), read_heic),  # libheif turns it upright
    "Lytro": Reader(lambda path: Header(lfp_size(path)), read_lfp),
    "Record3D": Reader(recording_header, decode_recording),
    "AVIF": Reader(pillow_header, decode_by_pillow),
    "RAW": Reader(_refuse_raw, decode_by_oiio),
    "JPEG": Reader(oiio_header, decode_by_oiio),
    "other": Reader(oiio_header, decode_by_oiio),
}


@dataclass(frozen=True, eq=False)
class OpenPicture:
    """A picture file. start: its first bytes. Every other property is read when it is first asked for, and kept.

    Properties and methods raise InputError, which names the file, where it is damaged or no picture.
    """

    path: Path
    start: bytes
    kind: Kind

    @cached_property
    def header(self) -> Header:
        """Header of the first picture."""
        return READERS[self.kind].header(self.path)

    @property
    def size(self) -> ImageSize:
        """Height and width as stored."""
        return self.header.size

    @property
    def orientation(self) -> int:
        """Exif's Orientation, 1 to 8; 1 for HEIC, which is decoded upright, and for files that cannot be read."""
        with suppress(InputError):
            return self.header.orientation
        return 1

    @property
    def upright_size(self) -> ImageSize:
        """Height and width as shown, turned by the orientation."""
        return turned_size(self.size, self.orientation)

    def text(self, name: str) -> str:
        """Return a text of the header; "" where it is missing or damaged, and for files OpenImageIO cannot read."""
        with suppress(InputError):
            return self.header.text(name)
        return ""

    @cached_property
    def metadata(self) -> PictureMetadata:
        """Exif and XMP, and the number of pictures of an animation; nothing where the file is damaged."""
        return metadata_in(self.path, self.kind)

    def header_of(self, number: int) -> Header:
        """Return the header of a picture in the file."""
        if number == 0:
            return self.header
        return Header(heic_size(self.path, number)) if self.kind == "HEIC" else pillow_header(self.path, number)

    def decode(self, number: int = 0) -> Picture:
        """Read a picture as its file stores it: without conversion of its colours, and not turned by its orientation.

        Palettes and CMYK become RGB. number: the picture within the file; 0 is the one that every program shows.
        """
        if number == 0:
            return READERS[self.kind].decode(self.path)
        return read_heic(self.path, number) if self.kind == "HEIC" else decode_by_pillow(self.path, number)

    def bands(self) -> Iterator[Picture]:
        """Yield the first picture from top to bottom, some rows at a time where that saves memory.

        Files with alpha or linear light, and those that OpenImageIO does not read, come as one.
        """
        return oiio_bands(self.path) if READERS[self.kind].decode is decode_by_oiio else iter([self.decode()])


def open_picture(path: Path) -> OpenPicture:
    """Return the record of a file that may be a picture; the same one again, unless the file has changed.

    Raises InputError where it is missing, empty, no ordinary file, or cannot be read.
    """
    return _open_picture(path, stamp_of(path))


@lru_cache(maxsize=REMEMBERED)
def _open_picture(path: Path, stamp: tuple[int, ...]) -> OpenPicture:
    start = read_bytes(path, START_BYTES)
    return OpenPicture(path, start, kind_of(start, path.suffix))


def read_metadata(path: Path) -> PictureMetadata:
    """Return Exif and XMP of a photo's file; nothing where the file is damaged or missing."""
    with suppress(InputError):
        return open_picture(path).metadata
    return PictureMetadata()


def settings_text_in(path: Path) -> str:
    """Return the text of the settings that a picture was saved with; "" without.

    Raises InputError where the file is no picture, or its settings are damaged.
    """
    picture = open_picture(path)
    text = picture.header.text(SETTINGS_KEY)
    try:
        return unpack(text or text_in(picture.metadata.xmp, SETTINGS_KEY))
    except InputError as error:
        raise InputError(f"{path}: {error}") from error
