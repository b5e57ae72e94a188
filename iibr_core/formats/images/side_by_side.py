"""Two pictures, for the left and the right eye, in one: cut apart where the file's name or header states it.

Names may be wrong, so the halves are compared.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from iibr_core.formats.files import status_of
from iibr_core.formats.images.alike_halves import is_one_scene
from iibr_core.formats.images.file_kinds import raw_kind
from iibr_core.formats.images.lfp import open_lfp
from iibr_core.formats.images.pair_layout import PairLayout, stated_layout
from iibr_core.formats.images.picture_source import PictureSource, cut_part, source_size, upright_size
from iibr_core.formats.images.rgbd import rgbd_parts
from iibr_core.formats.images.small_picture import small_decoded_picture
from iibr_core.types import ImageSize, InputError, image_size

COMPARED_PX = 512
"""Longest side of the picture whose halves are compared."""
LIGHT_FIELD_ENDINGS = (".lfp", ".lfr", ".lfx", ".raw")
PLACES = {"beside": "side by side", "over": "one over the other", "rows": "in every other row"}
PLAIN_ENDING = {"beside": ".left-right", "over": ".top-bottom", "rows": ".jps"}


@dataclass(frozen=True)
class StatedPair:
    """A picture whose file states that it holds two.

    eyes: the left eye's picture and the right one's; None where the halves differ and it may be one picture.
    note: what was done, for people.
    """

    eyes: tuple[PictureSource, PictureSource] | None
    note: str


def side_by_side_pair(path: Path) -> tuple[PictureSource, PictureSource] | None:
    """Return the left eye's picture and the right one's; None for a file that holds one picture."""
    pair = stated_pair(path)
    return None if pair is None else pair.eyes


def stated_pair(path: Path) -> StatedPair | None:
    """Return the pair that a file's name or header states; None where neither does."""
    status = status_of(path)
    return None if status is None else _stated_pair(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=64)
def _stated_pair(path: Path, modified_ns: int, size_bytes: int) -> StatedPair | None:
    layout = stated_layout(path)
    if layout is None:
        return None
    size = upright_size(path)
    parts, shown = layout.eyes(size)
    if min(parts[0].size) < 1 and layout.is_plain:
        raise InputError(f"{path}: of {size} pixels there are none for each eye; is its name right?")
    left, right = (PictureSource(path, part=part, shown_size=shown) for part in parts)
    is_alike = min(parts[0].size) > 0 and _is_one_scene(path, layout)
    is_pair = is_alike or layout.is_plain
    return StatedPair((left, right) if is_pair else None, _note(layout, is_pair, is_alike))


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


def left_picture(path: Path) -> PictureSource:
    """Return the picture that a file shows as a photo: the left eye's of two, the one beside a depth map, else all.

    Raises InputError also for raw files of light-field cameras.
    """
    refuse_raw_light_field(path)
    parts = side_by_side_pair(path) or rgbd_parts(path)
    return PictureSource(path) if parts is None else parts[0]


def refuse_raw_light_field(path: Path) -> None:
    """Raise InputError for raw files of light-field cameras, which are mosaics of microlens images."""
    if path.suffix.lower() in LIGHT_FIELD_ENDINGS and raw_kind(path) is None and open_lfp(path) is None:
        raise InputError(
            f"{path}: is a raw light field (Lytro), which must be decoded first: PlenoptiCam or the Light Field Toolbox"
            " make views of it, and their folder opens here"
        )


def photo_size(path: Path) -> ImageSize:
    """Return the size of a file's photo from its header, as stored, before it is upright."""
    return source_size(left_picture(path))
