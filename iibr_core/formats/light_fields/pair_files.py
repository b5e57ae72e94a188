"""Two files that are a stereo pair: left and right, NAME_L and NAME_R, and the like; or a folder of two pictures."""

import re
from contextlib import suppress
from functools import lru_cache
from pathlib import Path

from iibr_core.formats.files import stamp_of
from iibr_core.formats.images.alike_halves import is_one_scene
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.picture_source import PictureSource, small_decoded_picture
from iibr_core.formats.light_fields.grids import MAP_WORDS
from iibr_core.formats.light_fields.multi_view_scene import KnownView, MultiView, pictures_in
from iibr_core.types import GridShape, InputError, ViewOffset

TWO_FILES = "stereo, two files"
"""Layout of such a pair, for people."""
SIDE = re.compile(r"(?<![A-Za-z])(?i:left|right|l|r)(?![A-Za-z])|(?<=[a-z])(?:Left|Right)(?![a-z])")
"""Word for an eye in the stem of a name."""
OTHER_SIDE = {"left": "right", "right": "left", "l": "r", "r": "l"}
COMPARED_PX = 512
"""Longest side of the copies that are compared."""


def pair_of(path: Path) -> tuple[Path, Path] | None:
    """Return the left and the right file of a pair that a file's name states and both pictures show, None without."""
    for match in reversed(list(SIDE.finditer(path.stem))):
        word = match[0]
        other = OTHER_SIDE[word.lower()]
        other = other.upper() if word.isupper() else other.capitalize() if word[0].isupper() else other
        partner = path.with_name(f"{path.stem[: match.start()]}{other}{path.stem[match.end() :]}{path.suffix}")
        if partner.is_file() and is_pair(path, partner):
            return (path, partner) if word[0].lower() == "l" else (partner, path)
    return None


def is_pair(first: Path, second: Path) -> bool:
    """Return whether two files show one scene at one size, as a pair does; False if one of them cannot be read."""
    with suppress(InputError):
        return _is_pair(first, second, stamp_of(first), stamp_of(second))
    return False


@lru_cache(maxsize=8)
def _is_pair(first: Path, second: Path, *stamps: tuple[int, ...]) -> bool:
    if open_picture(first).upright_size != open_picture(second).upright_size:
        return False
    return is_one_scene(*(small_decoded_picture(path, COMPARED_PX) for path in (first, second)))


def read_two_files(left: Path, right: Path) -> MultiView:
    """Return the two views of a pair; names that state the eyes count before the order."""
    files = pair_of(left)
    is_named = files is not None and {path.resolve() for path in files} == {left.resolve(), right.resolve()}
    left, right = files if files is not None and is_named else (left, right)
    views = tuple(
        KnownView(name, ViewOffset(0.0, float(u)), PictureSource(path), place=(0, u))
        for u, (name, path) in enumerate((("left", left), ("right", right)))
    )
    return MultiView(left.stem, TWO_FILES, views, grid=GridShape(1, 2))


def read_pair_folder(folder: Path) -> MultiView | None:
    """Return the two pictures of a folder, None if it has others, or they do not show one scene."""
    pictures = [path for path in pictures_in(folder) if not MAP_WORDS.search(path.stem)]
    if len(pictures) != 2 or not is_pair(*pictures):
        return None
    scene, is_stated = read_two_files(*pictures), pair_of(pictures[0]) is not None
    name, numbers = folder.resolve().name, () if is_stated else ((0, 0), (0, 1))
    return MultiView(name, TWO_FILES, scene.views, grid=scene.grid, numbers=numbers, is_guess=not is_stated)
