"""Metadata of picture files: Exif and XMP, captions, camera facts, and settings of this program.

Saved pictures keep the parts that describe the photo and its camera. They do not keep those that would be wrong in
another picture: thumbnails, depth maps, edits by other programs, maker notes, and, unless asked for, the position.
"""

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from PIL import Image

from iibr_core.formats.images.file_kinds import Kind
from iibr_core.formats.images.heic import heic_info
from iibr_core.formats.images.pillow_reader import DECODE_ERRORS, EXIF_FOLDER, ORIENTATION_TAG, exif_of
from iibr_core.formats.images.record3d import read_recording
from iibr_core.formats.images.xmp import NAMESPACES, list_value_in, parse_packet
from iibr_core.types import SRGB, ColorSpace, ImageSize, InputError

GPS_FOLDER = 0x8825
DESCRIPTION, MAKE, MODEL, ARTIST, COPYRIGHT = 0x010E, 0x010F, 0x0110, 0x013B, 0x8298
COLOR_SPACE, WIDTH, HEIGHT = 0xA001, 0xA002, 0xA003
RESOLUTION_TAGS = (0xA20E, 0xA20F)
"""FocalPlaneXResolution and Y, in pixels for each unit of length."""
DESCRIBING_TAGS = frozenset(
    {DESCRIPTION, MAKE, MODEL, 0x011A, 0x011B, 0x0128, 0x0131, 0x0132, ARTIST, 0x013C, 0x4746, 0x4749, COPYRIGHT}
    | set(range(0x9C9B, 0x9CA0))
)
"""Tags of the first folder that describe the photo, not its file: description, make, model, resolution, software, date,
artist, computer, rating, copyright, and tags of Windows.
"""
DROPPED_TAGS = (0x927C, 0xA005, 0x9214, 0xA214)
"""Maker notes, interoperability, and places in the stored picture."""
UNCALIBRATED = 0xFFFF
MAX_EXIF_BYTES = 65_000
"""Largest Exif that a JPEG holds."""
MAX_CAPTION_CHARACTERS, MAX_FACT_CHARACTERS = 2000, 60
ANIMATED_FORMATS = ("GIF", "PNG", "WEBP", "AVIF")
SETTINGS_KEY = "iibr:settings"
"""Name of the text that holds the settings of this program in a saved picture."""

Tags = dict[int, Any]
"""Values of Exif by their tags."""


@dataclass(frozen=True, eq=False)
class PictureMetadata:
    """Metadata of a picture.

    exif: in the form of JPEG files, b"" without. xmp: a packet, b"" without. texts: of this program, by name. pictures:
    number of those of an animation, 1 for others.
    """

    exif: bytes = b""
    xmp: bytes = b""
    texts: Mapping[str, str] = field(default_factory=dict)
    pictures: int = 1


@dataclass(frozen=True)
class Caption:
    """Texts of one line about a photo, "" where the file has none."""

    title: str = ""
    description: str = ""
    author: str = ""
    rights: str = ""


def metadata_in(path: Path, kind: Kind) -> PictureMetadata:
    """Return the metadata of a file; nothing where it is damaged."""
    try:
        if kind == "Record3D":
            return PictureMetadata(pictures=read_recording(path).frames)
        if kind == "HEIC":
            info = heic_info(path)
            return PictureMetadata(_bytes_of(info.get("exif")), _bytes_of(info.get("xmp")))
        with Image.open(path) as image:
            exif = _bytes_of(image.info.get("exif"))
            if not exif and (stored := image.getexif()):  # a TIFF keeps it in its first folder
                exif = _exif_from(*_folders_of(stored)).tobytes()
            pictures = getattr(image, "n_frames", 1) if image.format in ANIMATED_FORMATS else 1
            return PictureMetadata(exif, _bytes_of(image.info.get("xmp")), pictures=pictures)
    except DECODE_ERRORS:
        return PictureMetadata()


def exif_for(exif: bytes, size: ImageSize, color_space: ColorSpace, keeps_position: bool) -> Image.Exif:
    """Return a photo's Exif, as Pillow's record, for an upright picture of another size; empty where it is damaged."""
    photo, camera, position = _folders_in(exif)
    if photo or camera:
        photo[ORIENTATION_TAG] = 1
    try:
        if camera:
            _set_camera(camera, size, color_space)
        kept = _exif_from(photo, camera, position if keeps_position else {})
        return kept if len(kept.tobytes()) <= MAX_EXIF_BYTES else Image.Exif()
    except DECODE_ERRORS:
        return Image.Exif()


def caption_in(metadata: PictureMetadata) -> Caption:
    """Return the texts about a photo, XMP before Exif; empty where they are damaged or missing."""
    photo = _folders_in(metadata.exif)[0]
    texts = [photo.get(tag) for tag in (0, DESCRIPTION, ARTIST, COPYRIGHT)]
    with suppress(InputError):
        tree = parse_packet(metadata.xmp)
        names = ("title", "description", "creator", "rights")
        texts = [list_value_in(tree, NAMESPACES["dc"], name) or text for name, text in zip(names, texts)]
    return Caption(*(_line(text, MAX_CAPTION_CHARACTERS) for text in texts))


def camera_facts(metadata: PictureMetadata) -> tuple[tuple[str, str], ...]:
    """Return what Exif states about how a photo was taken, for people: (name, value) of each known fact."""
    photo, camera, _ = _folders_in(metadata.exif)
    maker, model, lens, taken = (
        _line(value, MAX_FACT_CHARACTERS)
        for value in (photo.get(MAKE), photo.get(MODEL), camera.get(0xA434), camera.get(0x9003))
    )
    facts = (
        ("Camera", " ".join(dict.fromkeys(f"{maker} {model}".split()))),
        ("Lens", lens),
        ("Exposure", ", ".join(filter(None, _exposure(camera)))),
        ("Taken", taken[:16].replace(":", "-", 2)),
    )
    return tuple((name, value) for name, value in facts if value)


def _exposure(camera: Mapping[int, Any]) -> tuple[str, ...]:
    """Return F-number, time, sensitivity and focal length, "" for unknown ones."""
    tags = (0x829D, 0x829A, 0x8827, 0x920A, 0xA405)
    number, seconds, iso, focal_mm, equivalent_mm = (number_of(camera.get(tag)) for tag in tags)
    time = f"1/{1 / seconds:.0f} s" if 0 < seconds < 0.4 else f"{seconds:g} s"
    return (
        f"f/{number:g}" if number else "",
        time if seconds else "",
        f"ISO {iso:g}" if iso else "",
        f"{equivalent_mm:g} mm (35 mm)" if equivalent_mm else f"{focal_mm:g} mm" if focal_mm else "",
    )


def number_of(value: Any) -> float:
    """Return a number of Exif; 0 where it is none, is not positive, or makes no sense."""
    try:
        number = float(value[0] if isinstance(value, tuple) else value)
    except DECODE_ERRORS:
        return 0.0
    return number if math.isfinite(number) and 0 < number < 1e9 else 0.0


def _line(text: Any, max_characters: int) -> str:
    """Return a text as one line without control characters; "" for other values."""
    if not isinstance(text, str):
        return ""
    return " ".join("".join(c if c.isprintable() else " " for c in text).split())[:max_characters]


def _bytes_of(value: Any) -> bytes:
    return value.encode() if isinstance(value, str) else bytes(value or b"")


def _folders_in(exif: bytes) -> tuple[Tags, Tags, Tags]:
    """Return the tags of the photo, its camera and its position from Exif as JPEGs have it; empty where damaged."""
    with suppress(*DECODE_ERRORS):
        return _folders_of(exif_of(exif))
    return {}, {}, {}


def _folders_of(exif: Image.Exif) -> tuple[Tags, Tags, Tags]:
    photo = {tag: exif[tag] for tag in sorted(DESCRIBING_TAGS & set(exif))}
    return photo, dict(exif.get_ifd(EXIF_FOLDER)), dict(exif.get_ifd(GPS_FOLDER))


def _exif_from(photo: Tags, camera: Tags, position: Tags) -> Image.Exif:
    exif = Image.Exif()
    exif.update(photo)
    for number, folder in ((EXIF_FOLDER, camera), (GPS_FOLDER, position)):
        if folder:
            exif.get_ifd(number).update(folder)
    return exif


def _set_camera(camera: Tags, size: ImageSize, color_space: ColorSpace) -> None:
    """Change the camera's tags that depend on the picture's size and colours, and drop those that no longer fit."""
    for tag in DROPPED_TAGS:
        camera.pop(tag, None)
    width_before = camera.get(WIDTH)
    for tag in RESOLUTION_TAGS:
        if tag in camera and isinstance(width_before, int) and width_before > 0:
            # The longer sides are compared: a portrait picture was stored lying on its side.
            camera[tag] = float(camera[tag]) * max(size) / max(width_before, camera.get(HEIGHT) or 0)
        else:
            camera.pop(tag, None)
    camera[WIDTH], camera[HEIGHT] = size.width, size.height
    camera[COLOR_SPACE] = 1 if color_space == SRGB else UNCALIBRATED
