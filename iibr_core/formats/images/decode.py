"""Decodes picture files of every kind. Headers are checked before memory is spent. A JPEG is read as far as it goes."""

import itertools
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray
from PIL.Image import Image

from iibr_core.color import ROWS_AT_ONCE
from iibr_core.formats.files import decoding_fault, require_file
from iibr_core.formats.images.avif import open_avif
from iibr_core.formats.images.file_kinds import unreadable_kind
from iibr_core.formats.images.picture import EXIF_NUMBERS, Picture, exif_focal_px, opaque_as_none, require_sound_size
from iibr_core.formats.images.pillow_reader import open_with_pillow, orientation_in, picture_of
from iibr_core.formats.images.stereo_jpeg import lif_bytes, open_lif
from iibr_core.types import ImageSize, InputError

HARMLESS_MESSAGE = "extraneous bytes"
"""Complaint of the JPEG decoder about padding, which some cameras write; nothing is lost."""
CUT_OFF_MESSAGE = "Premature end of JPEG file"
"""Complaint of the JPEG decoder about a file that is cut off; it makes the rest of the picture grey."""
NO_READER = "could not find a format reader"
"""Complaint of OpenImageIO about a file of unknown kind."""
TEXT_NAMES = ("ImageDescription", "iibr:settings", "iibr:Lenslet")
"""Names of the texts in a header that this program reads. OpenImageIO's own records must not outlive the program."""
FLOATING_TYPES = ("half", "float", "double")
WIDE_TYPES = {"int16": "int16", "int": "int32", "uint": "uint32"}
"""NumPy's names of types whose integers are scaled by their own range, by the names that OpenImageIO gives to them."""
IS_REDUCED = 1
"""Bit of a TIFF page's NewSubfileType: a preview of another page."""
MAX_PAGES = 16
"""Largest number of pages among which the photo is looked for."""
MIN_PREVIEW_RATIO, MAX_PREVIEW_STRETCH = 2.0, 0.03
"""How much larger the page after a preview is along each side, and the largest difference of their aspect ratios."""
LINEAR_TRANSFERS = (2, 8)
"""Transfer curves of ITU-T H.273 that leave light unchanged: "unspecified" and "linear"."""
NOTES_OF_MODELS = {
    **dict.fromkeys(("CMYK", "YCCK"), "CMYK was converted to RGB without its colour profile."),
    "LAB": "Lab was converted to RGB with a tint: save the photo as RGB for its true colours.",
}
"""Notes on colour models by parts of the names that OpenImageIO gives to them."""


class _Stored(NamedTuple):
    """Channels of a picture.

    colors: number of colour channels. alpha_at: index of alpha, -1 without. channels: number of those that are read.
    dtype: NumPy's name of the type to read, "float32" for linear light.
    """

    colors: int
    alpha_at: int
    channels: int
    dtype: str


class Header(NamedTuple):
    """Header of a picture. size: as stored. orientation: Exif's, 1 to 8. texts: those of TEXT_NAMES, by name."""

    size: ImageSize
    orientation: int = 1
    texts: Mapping[str, str] = MappingProxyType({})

    def text(self, name: str) -> str:
        """Return a text; "" where it is missing or damaged, and for files that OpenImageIO does not read."""
        return self.texts.get(name, "")


def oiio_header(path: Path) -> Header:
    """Return the header of a picture that OpenImageIO reads."""
    spec = _open(path).spec()
    texts = {name: text_attribute(spec, name) for name in TEXT_NAMES}
    return Header(ImageSize(spec.height, spec.width), int(spec.get_int_attribute("Orientation", 1)), texts)


def pillow_header(path: Path, number: int = 0) -> Header:
    """Return the header of an AVIF, or of a further picture in a file."""
    with _open_with_pillow(path, number) as image:
        return Header(ImageSize(image.height, image.width), orientation_in(image.getexif()))


def decode_by_pillow(path: Path, number: int = 0) -> Picture:
    """Decode an AVIF, or a further picture in a file."""
    with _open_with_pillow(path, number) as image:
        return picture_of(image)


def decode_by_oiio(path: Path) -> Picture:
    """Decode a picture of any kind that OpenImageIO reads."""
    source = _open(path)
    spec, stored = source.spec(), _stored(path, source.spec())
    values: NDArray[Any] = np.empty((spec.height, spec.width, stored.channels), stored.dtype)
    first, is_cut_off = 0, False
    for rows, ends_before in _read_rows(path, source, stored):  # all at once would take the memory twice
        is_cut_off |= ends_before
        values[first : first + len(rows)] = rows
        first += len(rows)
    colors = values[..., : stored.colors]
    wide = colors if stored.dtype in WIDE_TYPES.values() else None
    alpha = opaque_as_none(_narrowed(values[..., stored.alpha_at])) if stored.alpha_at >= 0 else None
    return Picture(_narrowed(colors), alpha, wide=wide, is_cut_off=is_cut_off, **_facts(spec))


def oiio_bands(path: Path) -> Iterator[Picture]:
    """Yield a picture from top to bottom, some rows at a time unless it has alpha or linear light."""
    source = _open(path)
    spec, stored = source.spec(), _stored(path, source.spec())
    if stored.alpha_at < 0 and stored.dtype in ("uint8", "uint16"):
        facts = _facts(spec)
        yield from (Picture(rows, is_cut_off=cut, **facts) for rows, cut in _read_rows(path, source, stored))
    else:
        yield decode_by_oiio(path)


def open_header(path: Path) -> Any | None:
    """Open a file with OpenImageIO; None where it cannot be read."""
    source = oiio.ImageInput.open(oiio_name(path))
    if source is None:
        complaint_of(oiio)
        return None
    return _at_photo(source)


def oiio_name(path: Path) -> str:
    """Return a file's name for OpenImageIO. Raises InputError where it is not UTF-8."""
    try:
        str(path).encode()
    except UnicodeEncodeError as error:
        raise InputError(f"{path}: its name is not UTF-8; rename it") from error
    return str(path)


def text_attribute(spec: Any, name: str) -> str:
    """Return a text of OpenImageIO's header; "" where there is none, or it is damaged."""
    try:
        return str(spec.get_string_attribute(name))
    except UnicodeDecodeError:
        return ""


def complaint_of(source: Any) -> str:
    """Return and clear the error of OpenImageIO or of one of its files, "" without; it may quote bytes of the file."""
    try:
        return str(source.geterror())
    except UnicodeDecodeError:
        return "a name in it is no text"


@contextmanager
def _open_with_pillow(path: Path, number: int) -> Iterator[Image]:
    """Open an AVIF, or a further picture of a Leia image or a multi-picture JPEG."""
    if number == 0:
        with open_avif(path) as image:
            yield image
    elif open_lif(path) is not None:
        with open_with_pillow(path, ("JPEG", "PNG", "WEBP"), lif_bytes(path, number)) as image:
            yield image
    else:
        with open_with_pillow(path, ("JPEG",)) as image:
            image.seek(number)
            yield image


def _narrowed(values: NDArray[Any]) -> NDArray[Any]:
    """Return wide integers as uint16, white being the power of two above the largest; all other numbers as they are."""
    if values.dtype.name not in WIDE_TYPES.values():
        return values
    white = 2 ** max(int(values.max(initial=0)).bit_length(), 8) - 1
    return np.asarray(np.rint(np.maximum(values, 0) * np.float32(65535 / white)), np.uint16)


def _at_photo(source: Any) -> Any:
    """Seek the first page of a TIFF that is no preview of a later one, and return the file."""
    if source.format_name() != "tiff":
        return source
    first, was_reduced = source.spec(), _is_reduced(source.spec())
    for _ in itertools.takewhile(lambda page: source.seek_subimage(page, 0), range(1, MAX_PAGES)):
        spec = source.spec()
        ratio = spec.height / first.height
        is_alike = abs(spec.width / (first.width * ratio) - 1) <= MAX_PREVIEW_STRETCH
        if not _is_reduced(spec) and ratio > 1 and (was_reduced or (is_alike and ratio >= MIN_PREVIEW_RATIO)):
            return source
    complaint_of(source)
    source.seek_subimage(0, 0)
    return source


def _is_reduced(spec: Any) -> bool:
    return bool(spec.get_int_attribute("tiff:subfiletype", 0) & IS_REDUCED)


def _read_rows(path: Path, source: Any, stored: _Stored) -> Iterator[tuple[NDArray[Any], bool]]:
    """Yield the rows of a picture from top to bottom, (h, W, channels), and whether its file has ended before them."""
    is_cut_off = False
    spec, oiio_type = source.spec(), stored.dtype.removesuffix("32")
    step = spec.tile_height or ROWS_AT_ONCE
    for first in range(0, spec.height, step):
        # A header may place its picture anywhere; rows are counted from there.
        top, bottom = spec.y + first, spec.y + min(first + step, spec.height)
        if spec.tile_width:
            place = spec.x, spec.x + spec.width, top, bottom, spec.z, spec.z + 1
            rows = source.read_tiles(*place, 0, stored.channels, oiio_type)
        else:
            rows = source.read_scanlines(top, bottom, spec.z, 0, stored.channels, oiio_type)
        message = complaint_of(source)
        is_cut_off |= rows is not None and CUT_OFF_MESSAGE in message and bool(np.ptp(rows))
        if rows is None or (message and HARMLESS_MESSAGE not in message and not is_cut_off):
            raise InputError(f"{path}: {decoding_fault(_without_name(message, path))}")
        yield np.asarray(rows).reshape(bottom - top, spec.width, stored.channels), is_cut_off


def _facts(spec: Any) -> dict[str, Any]:
    """Return what `Picture` holds beside pixels."""
    icc, chromaticities, codes = (spec.getattribute(name) for name in ("ICCProfile", "chromaticities", "CICP"))
    model = text_attribute(spec, "jpeg:ColorSpace") or text_attribute(spec, "tiff:ColorSpace")
    exif = {name: spec.get_float_attribute(f"Exif:{name}", 0.0) for name in EXIF_NUMBERS.values()}
    return {
        "is_premultiplied": not spec.get_int_attribute("oiio:UnassociatedAlpha"),
        "orientation": int(spec.get_int_attribute("Orientation", 1)),
        "focal_px": exif_focal_px(exif, ImageSize(spec.height, spec.width)),
        "icc": bytes(icc) if isinstance(icc, np.ndarray) else b"",
        "codes": codes if isinstance(codes, tuple) else (),
        "chromaticities": chromaticities if isinstance(chromaticities, tuple) else (),
        "note": next((note for part, note in NOTES_OF_MODELS.items() if part in model), ""),
    }


def _open(path: Path) -> Any:
    """Open a picture and check its header."""
    require_file(path)
    source = oiio.ImageInput.open(oiio_name(path))
    if source is not None and (source.format_name() == "tiff" or source.spec().nchannels not in (1, 3)):
        hints = oiio.ImageSpec()
        hints.attribute("oiio:UnassociatedAlpha", 1)
        source = oiio.ImageInput.open(oiio_name(path), hints)
    if source is None:
        complaint = complaint_of(oiio)
        if (kind := unreadable_kind(path)) is not None:
            raise InputError(f"{path}: is {kind.name}; {kind.way_out}")
        if NO_READER in complaint:
            raise InputError(f"{path}: cannot be read as a picture (of no known kind); save it as JPEG, PNG or TIFF")
        raise InputError(f"{path}: {decoding_fault(_without_name(complaint, path), is_opened=False)}")
    spec = _at_photo(source).spec()
    if spec.depth > 1 or spec.deep:
        raise InputError(f"{path}: {spec.width}x{spec.height}x{spec.depth} is not a flat picture")
    require_sound_size(path, spec.width, spec.height, spec.image_bytes())
    return source


def _stored(path: Path, spec: Any) -> _Stored:
    try:
        names = [name.upper() for name in spec.channelnames]
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: the names of its channels are not UTF-8; rename them or save it as RGB") from error
    alpha_at = names.index("A") if "A" in names else -1
    colors = 3 if spec.nchannels - (alpha_at >= 0) >= 3 else 1
    if 0 <= alpha_at < colors:
        raise InputError(f"{path}: channels {spec.channelnames} are neither grey nor RGB; convert it to RGB")
    dtype, codes = "uint8" if spec.format.size() == 1 else "uint16", spec.getattribute("CICP")
    is_encoded = isinstance(codes, tuple) and codes[1] not in LINEAR_TRANSFERS  # in JPEG XL, floats may be no light
    if str(spec.format) in FLOATING_TYPES:
        dtype = "uint16" if is_encoded else "float32"
    dtype = WIDE_TYPES.get(str(spec.format), dtype)
    return _Stored(colors, alpha_at, max(colors, alpha_at + 1), dtype)


def _without_name(complaint: str, path: Path) -> str:
    """Return a complaint for a message; some of OpenImageIO's readers repeat the file's name."""
    return re.sub(rf' \("?{re.escape(str(path))}"?\)', "", complaint)
