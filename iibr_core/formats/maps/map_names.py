"""Names of depth maps and of the photos they belong to: the one table of what people and programs call them.

`IMG_1_depth.PNG`, `IMG_1-depthmap (1).tif` and `depth/IMG_1.png` belong to `IMG_1.jpg`, `A_depth.png` and `depth_A.png`
to `A_rgb.jpg`. Case, separators and what file managers add to copies do not matter.
"""

import re
import unicodedata
from pathlib import PurePath
from typing import NamedTuple

from iibr_core.formats.files import COPY

DEPTH_WORDS = r"(?:(?:raw|inv|inverse|metric|mono)[-_. ]?)?(?:depth|disparit(?:y|ies)|disp)s?"
KIND = rf"(?P<kind>{DEPTH_WORDS})(?:[-_. ]?(?:maps?|images?|img))?"
ENCODING = r"(?:[-_. ]?(?:raw|pred|gr[ae]y|bw|(?:u?int|float)?(?:8|16|32)(?: ?bits?)?))*"
PICTURE = r"(?:rgb|colou?r|images?|imgs?|photos?|pictures?|frames?|texture)"
SEPARATOR = r"[-_. ]+"
MAP_BEHIND = re.compile(rf"(?:(?P<photo>.*?){SEPARATOR})?{KIND}{ENCODING}{COPY}", re.IGNORECASE)
MAP_BEFORE_NUMBER = re.compile(rf"{KIND}[-_. ]*(?P<photo>\d+){COPY}", re.IGNORECASE)
MAP_BEFORE = re.compile(rf"{KIND}{SEPARATOR}(?P<photo>.+?){COPY}", re.IGNORECASE)
PAIRED = re.compile(
    rf"(?P<behind>.+?){SEPARATOR}{PICTURE}|{PICTURE}(?:{SEPARATOR}|(?=\d))(?P<before>.+)|{PICTURE}", re.IGNORECASE
)
"""Names of photos that come with a map."""
COPIED = re.compile(rf"(.+?){COPY}", re.IGNORECASE)
FOLDER_OF_MAPS = re.compile(KIND, re.IGNORECASE)
FOLDER_OF_PHOTOS = re.compile(PICTURE, re.IGNORECASE)
OF_COLMAP = (".geometric", ".photometric")
"""Endings that COLMAP adds to the whole name of the photo."""
MAP_ENDINGS = (
    ".pfm", ".exr", ".npy", ".npz", ".tif", ".tiff", ".png", ".webp", ".jpg", ".jpeg", ".dpt", ".depth", ".bin", ".dmb",
    ".flo", ".bmp", ".jxl", ".jp2", ".avif", ".heic", ".tga", ".gif", ".psd", ".pgm", ".ppm", ".hdr",
)  # fmt: skip
"""Endings of files that are read as maps, the best first."""
ONLY_MAPS = (".pfm", ".dpt", ".depth", ".dmb")
"""Endings of files that are maps whatever their name."""
ARRAYS = (".npy", ".npz", ".flo")
"""Endings of files that may be a map if they have the photo's name."""
LIKELY = re.compile(DEPTH_WORDS, re.IGNORECASE)
LIKELY_ENDINGS = (*MAP_ENDINGS, ".mat", ".h5", ".hdf5", ".raw", ".csv", ".txt")


class MapName(NamedTuple):
    """Meaning of a map's name. key: of its photo, see `photo_keys`. is_depth: whether it names depth, not disparity."""

    key: str
    is_depth: bool


def map_name(stem: str) -> MapName | None:
    """Return the meaning of the stem of a map's name; None where it names no map."""
    folded = fold(stem)
    for pattern in (MAP_BEFORE_NUMBER, MAP_BEHIND, MAP_BEFORE):
        if (found := pattern.fullmatch(folded)) is not None:
            return MapName(_without_copy(found["photo"] or ""), "depth" in found["kind"])
    return None


def photo_keys(stem: str) -> tuple[str, ...]:
    """Return the keys under which maps belong to a photo, the best first."""
    whole = _without_copy(fold(stem))
    paired = PAIRED.fullmatch(whole)
    return (whole,) if paired is None else (whole, paired["behind"] or paired["before"] or "")


def says_depth(name: str) -> bool:
    """Return whether the name of a map or of a folder of maps, without ending, names depth and not disparity."""
    said = map_name(name)
    return said is not None and said.is_depth


def is_map_path(path: PurePath) -> bool:
    """Return whether a file is a map by its name or its ending."""
    return path.suffix.lower() in (*ONLY_MAPS, *ARRAYS) or map_name(path.stem) is not None


def fold(text: str) -> str:
    """Return a name for comparisons: without case, its accents composed."""
    return unicodedata.normalize("NFC", text).casefold()


def _without_copy(folded: str) -> str:
    found = COPIED.fullmatch(folded)
    return found[1] if found else folded
