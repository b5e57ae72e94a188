"""Two pictures, for the left and the right eye, in one: cut apart where the file's name or header states it.

Names may be wrong, so the halves are compared. The header is VRex's JPS descriptor, in segment APP3 of stereo JPEGs.
"""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import BinaryIO, Literal

from iibr_core.formats.files import COPY, open_binary, stamp_of
from iibr_core.formats.images.alike_halves import is_one_scene
from iibr_core.formats.images.lfp import open_lfp
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.picture_source import (
    PicturePart,
    PictureSource,
    cut_part,
    small_decoded_picture,
    source_size,
)
from iibr_core.formats.images.rgbd import rgbd_parts
from iibr_core.types import ImageSize, InputError, image_size

FULL_TAG, HALF_TAG, OVER_TAG, HALF_OVER_TAG = "_LRF_Full_SBS", "_LRF_Half_SBS", "_TB", "_HTAB"
"""Endings of names that players know: left first, side by side, the second at half width; top and bottom, the last at
half height.
"""
TAG = re.compile(
    r"[-_. (\[](?:(half)[-_. ]?|(h)[-_]?(?=sbs|t|ou)|full[-_. ]?|f(?=sbs|t|ou))?"
    r"(?:sbs|2x1|lr[bpq]?|rl[bpq]?|left-?right|right-?left|side-?by-?side|cross(?:ed)?(?:-?eyed?)?|3dh"
    r"|(tb|bt|tab|ou|abq?|top-?bottom|bottom-?top|top-?and-?bottom|over-?under|above-?below|3dv))"
    rf"[)\]]?{COPY}$",
    re.IGNORECASE,
)
"""Ending of a file's name, without extension, that states a pair. Groups 1 and 2: half size; group 3: one over the
other. Names as Looking Glass, Leia, video players, StereoPhoto Maker and web viewers write them.
"""
PLAIN_TAG = re.compile(
    r"half|full|h[-_]?sbs|h[-_]?t|h[-_]?ou|fsbs|left-?right|right-?left|top-?bottom|bottom-?top|eye", re.IGNORECASE
)
"""Part of a tag that no other picture has in its name; "_tb" may be initials, "_2x1" and "side by side" a collage."""
RIGHT_FIRST = re.compile(r"rl[bpq]?\b|right-?left|cross|bt\b|bottom-?top", re.IGNORECASE)
SQUASHED = re.compile(r"(lrq|rlq|abq)\b", re.IGNORECASE)
STEREO_ENDINGS = (".jps", ".pns")
"""Endings of JPEG and PNG files of two pictures side by side, the right eye's first."""
START_OF_SCAN = 0xDA
APP3, IDENTIFIER = 0xE3, b"_JPSJPS_"
DESCRIPTOR_AT = 10
"""First byte of the descriptor: one byte each for separation, flags, layout and type."""
STEREO = 1
HALF_HEIGHT, HALF_WIDTH, LEFT_FIRST = 1, 2, 4
Arrangement = Literal["rows", "beside", "over"]
LAYOUTS: dict[int, Arrangement] = {1: "rows", 2: "beside", 3: "over"}
COMPARED_PX = 512
"""Longest side of the picture whose halves are compared."""
LIGHT_FIELD_ENDINGS = (".lfp", ".lfr", ".lfx", ".raw")
PLACES = {"beside": "side by side", "over": "one over the other", "rows": "in every other row"}
PLAIN_ENDING = {"beside": ".left-right", "over": ".top-bottom", "rows": ".jps"}
Eyes = tuple[PictureSource, PictureSource]


@dataclass(frozen=True)
class PairLayout:
    """Arrangement of two pictures in one.

    arrangement: side by side, one over the other, or in every other row. is_half: both are squeezed to half their size.
    right_first: the right eye's is at the left or at the top. stated_by: source of this, for notes. is_plain: whether
    it is stated so plainly that unlike halves are a pair, too.
    """

    arrangement: Arrangement
    is_half: bool
    right_first: bool
    stated_by: str
    is_plain: bool

    def eyes(self, size: ImageSize) -> tuple[tuple[PicturePart, PicturePart], ImageSize | None]:
        """Return the parts of a picture (height, width) for the left and the right eye, and the size they are shown at.

        The size is None for that of the parts. Parts are empty where the picture is too small.
        """
        height, width = size
        eye = ImageSize(height, width // 2) if self.arrangement == "beside" else ImageSize(height // 2, width)
        second = {"beside": (0, eye.width), "over": (eye.height, 0), "rows": (1, 0)}[self.arrangement]
        step = (2, 1) if self.arrangement == "rows" else (1, 1)
        parts = PicturePart((0, 0), eye, step), PicturePart(second, eye, step)
        shown = ImageSize(eye.height, 2 * eye.width) if self.arrangement == "beside" else ImageSize(height, width)
        is_stretched = self.is_half or self.arrangement == "rows"
        return (parts[1], parts[0]) if self.right_first else parts, shown if is_stretched else None


def stated_pair(path: Path) -> tuple[Eyes | None, str]:
    """Return the left eye's picture and the right one's, where a file's name or header states them, and a note.

    They are None where a file states no pair, with "" as note, and where its halves differ and it may be one picture.
    """
    return _stated_pair(path, stamp_of(path))


@lru_cache(maxsize=64)
def _stated_pair(path: Path, stamp: tuple[int, ...]) -> tuple[Eyes | None, str]:
    layout = stated_layout(path)
    if layout is None:
        return None, ""
    size = open_picture(path).upright_size
    parts, shown = layout.eyes(size)
    if min(parts[0].size) < 1 and layout.is_plain:
        raise InputError(f"{path}: {size} pixels cannot be split between two eyes; is its name right?")
    left, right = (PictureSource(path, part=part, shown_size=shown) for part in parts)
    is_alike = min(parts[0].size) > 0 and _is_one_scene(path, layout)
    is_pair = is_alike or layout.is_plain
    return (left, right) if is_pair else None, _note(layout, is_pair, is_alike)


def _is_one_scene(path: Path, layout: PairLayout) -> bool:
    """Return whether the two parts of a picture look alike."""
    if layout.arrangement == "rows":
        return True  # a small copy mixes the rows
    pixels = small_decoded_picture(path, COMPARED_PX)
    (first, second), _ = layout.eyes(image_size(pixels))
    return is_one_scene(cut_part(pixels, first), cut_part(pixels, second))


def _note(layout: PairLayout, is_pair: bool, is_alike: bool) -> str:
    name = layout.stated_by
    if not is_pair:
        ending = PLAIN_ENDING[layout.arrangement]
        return (
            f"Shown whole: {name} is that of a stereo pair, but its halves differ. If it is a pair, let the name end in"
            f" '{ending}'."
        )
    result = ": the left eye's picture is shown" if is_alike else ", though its halves differ"
    place = PLACES[layout.arrangement]
    return f"Taken for a stereo pair, {place}, because of {name}{result}. Rename the file if it is one photo."


def stated_layout(path: Path) -> PairLayout | None:
    """Return the arrangement of a file's two pictures by its JPS descriptor, else by its name; None for most files."""
    is_stereo_file = path.suffix.lower() in STEREO_ENDINGS
    if (layout := _jps_layout(path, is_stereo_file)) is not None:
        return layout
    match = TAG.search(path.stem)
    if match is None:
        return PairLayout("beside", False, True, f"its ending ('{path.suffix}')", True) if is_stereo_file else None
    tag = match[0]
    return PairLayout(
        arrangement="beside" if match[3] is None else "over",
        is_half=bool(match[1] or match[2] or SQUASHED.search(tag)),
        right_first=RIGHT_FIRST.search(tag) is not None,
        stated_by=f"its name ('{tag}')",
        is_plain=PLAIN_TAG.search(tag) is not None or is_stereo_file,
    )


def _jps_layout(path: Path, is_stereo_file: bool) -> PairLayout | None:
    """Return the arrangement by a JPEG's descriptor; None for other files, and for anaglyphs."""
    if open_picture(path).kind != "JPEG":
        return None
    with open_binary(path) as file:
        descriptor = next((content for content in _app3_segments(file) if content.startswith(IDENTIFIER)), b"")
    _, flags, layout, kind = descriptor[DESCRIPTOR_AT : DESCRIPTOR_AT + 4].ljust(4, b"\0")
    if kind != STEREO or layout not in LAYOUTS:
        return None
    arrangement = LAYOUTS[layout]
    is_half = bool(flags & (HALF_WIDTH if arrangement == "beside" else HALF_HEIGHT))
    return PairLayout(arrangement, is_half, not flags & LEFT_FIRST, "its JPS descriptor", is_stereo_file)


def _app3_segments(file: BinaryIO) -> Iterator[bytes]:
    """Yield the content of each such segment of a JPEG before the first scan."""
    file.seek(2)
    while len(mark := file.read(4)) == 4 and mark[0] == 0xFF and mark[1] != START_OF_SCAN:
        content = file.read(max(int.from_bytes(mark[2:], "big") - 2, 0))
        if mark[1] == APP3:
            yield content


def left_picture(path: Path) -> PictureSource:
    """Return the picture that a file shows as a photo: the left eye's of two, the one beside a depth map, else all.

    Raises InputError also for raw files of light-field cameras.
    """
    refuse_raw_light_field(path)
    parts = stated_pair(path)[0] or rgbd_parts(path)
    return PictureSource(path) if parts is None else parts[0]


def refuse_raw_light_field(path: Path) -> None:
    """Raise InputError for raw files of light-field cameras, which are mosaics of microlens images."""
    if path.suffix.lower() in LIGHT_FIELD_ENDINGS and open_picture(path).kind != "RAW" and open_lfp(path) is None:
        raise InputError(
            f"{path}: is a raw light field (Lytro), which must be decoded first: PlenoptiCam or the Light Field Toolbox"
            " make views of it, and their folder opens here"
        )


def photo_size(path: Path) -> ImageSize:
    """Return the size of a file's photo from its header, as stored, before it is upright."""
    return source_size(left_picture(path))
