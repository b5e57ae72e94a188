"""HEIC photos (HEIF with HEVC), which OpenImageIO's wheel does not read."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import MAX_FILE_PIXELS, SAVE_ELSEWHERE, open_binary, require_file
from iibr_core.formats.images.picture import Picture, opaque_as_none, require_sound_size
from iibr_core.formats.images.pillow_reader import damage_as_input_error, exif_of, facts_of, orientation_in
from iibr_core.types import FloatImage, ImageSize, InputError, image_size

BRANDS = frozenset({b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1"})


def is_heic(path: Path) -> bool:
    """Return whether a file begins as HEIF files do, whatever its name."""
    with open_binary(path) as file:
        start = file.read(12)
    return start[4:8] == b"ftyp" and start[8:12] in BRANDS


def read_heic(path: Path, number: int = 0) -> Picture:
    """Decode a HEIC's photo, which libheif turns upright, or the picture of another number, see `heic_pair`."""
    picture = _open(path, number)
    pixels = _pixels(path, picture)
    alpha = opaque_as_none(pixels[..., 3]) if pixels.shape[2] == 4 else None
    is_premultiplied = bool(getattr(picture, "premultiplied_alpha", False))
    colors = pixels[..., : 3 if pixels.shape[2] >= 3 else 1]
    return Picture(colors, alpha, is_premultiplied, **facts_of(picture.info, image_size(pixels)))


def heic_size(path: Path, number: int = 0) -> ImageSize:
    """Return the size of a HEIC's picture from its header."""
    width, height = _open(path, number).size
    return ImageSize(height, width)


def heic_pair(path: Path) -> tuple[int, int] | None:
    """Return the numbers of the left and the right eye's picture (ISO/IEC 23008-12, `ster`); None without such a group.

    A picture's number is its place in the file, except that the photo itself and the first picture are swapped.
    """
    file = _open_file(path)
    with damage_as_input_error(path):
        groups = [group for group in file.info.get("entity_groups") or () if group.get("type") == "ster"]
    if not groups:
        return None
    places = [place for place in groups[0].get("images") or () if isinstance(place, int)]
    if len(places) != 2 or places[0] == places[1] or not all(0 <= place < len(file) for place in places):
        raise InputError(
            f"{path}: its pair is described in an unknown way ({places} of {len(file)} pictures);"
            " save both eyes side by side, under a name that ends in '_2x1'"
        )
    left, right = (_swapped(place, file.primary_index) for place in places)
    return left, right


def _swapped(number: int, primary: int) -> int:
    """Return the place of a number, or the number of a place: the photo itself has number 0."""
    return {0: primary, primary: 0}.get(number, number)


def read_heic_depth(path: Path) -> tuple[FloatImage, dict[str, Any]] | None:
    """Return the depth map of a portrait photo, upright: (H, W), 0..1, and libheif's description of its range.

    None for other photos.
    """
    maps = _open(path).info.get("depth_images") or []
    if not maps:
        return None
    width, height = maps[0].size
    if width < 1 or height < 1 or width * height > MAX_FILE_PIXELS:
        raise InputError(f"{path}: its depth map of {width}x{height} pixels is too large")
    pixels = _pixels(path, maps[0])
    scale = np.float32(1 / np.iinfo(pixels.dtype).max)
    return np.ascontiguousarray(pixels[..., 0]) * scale, dict(maps[0].info.get("metadata") or {})


def heic_info(path: Path) -> dict[str, Any]:
    """Return pillow-heif's description of a HEIC's photo."""
    return dict(_open(path).info)


def heic_orientation(path: Path) -> int:
    """Return Exif's Orientation, 1..8, of a HEIC; its photo is read upright."""
    return orientation_in(exif_of(heic_info(path).get("exif")))


def heic_auxiliaries(path: Path) -> tuple[str, ...]:
    """Return the types of the auxiliary pictures of a HEIC, but depth and alpha."""
    return tuple(str(kind) for kind in heic_info(path).get("aux") or {})


def _open_file(path: Path) -> Any:
    import pillow_heif

    require_file(path)
    with damage_as_input_error(path):
        file = pillow_heif.open_heif(path, convert_hdr_to_8bit=False)
    if not len(file):
        raise InputError(f"{path}: holds no picture of a known codec; {SAVE_ELSEWHERE}")
    return file


def _open(path: Path, number: int = 0) -> Any:
    file = _open_file(path)
    with damage_as_input_error(path):
        picture = file[_swapped(number, file.primary_index)] if number else file
        width, height = picture.size
    require_sound_size(path, width, height, width * height * 4)
    return picture


def _pixels(path: Path, picture: Any) -> NDArray[Any]:
    with damage_as_input_error(path):
        pixels = np.array(picture)  # a copy: pillow-heif 1.0's own array does not outlive the file
    return pixels.reshape(*pixels.shape[:2], -1)
