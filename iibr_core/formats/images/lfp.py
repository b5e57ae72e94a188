"""Processed files of Lytro's light-field cameras (`-stk.lfp`, and `.LFP` of the Illum): pictures of one scene focused
at several depths, or seen from several places, with a depth map.

Lytro publishes no description; readers of others found that a file is a list of chunks, named by their hash, and a JSON
that names them. Depth is "lambda", how far the focus is from the captured one: linear in disparity, small is near.
"""

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iibr_core.formats.files import MAX_FILE_PIXELS, MAX_PART_BYTES, decoding_fault, parsing, read_bytes
from iibr_core.formats.images.picture import Picture
from iibr_core.formats.images.pillow_reader import open_with_pillow
from iibr_core.runtime.extras import how_to_install
from iibr_core.types import FloatImage, ImageSize, InputError

LFP_START = b"\x89LFP\r\n\x1a\n"
SECTION_START = b"\x89LF"
JSON_KIND = b"M"
HEADER_BYTES, NAME_BYTES, ALIGNMENT = 16, 80, 16
EXPORT = "export it with Lytro Desktop as a picture"
MAX_PICTURES = 64

Chunks = Mapping[str, bytes]


@dataclass(frozen=True, eq=False)
class LfpPictures:
    """Pictures of one size, focused at several depths.

    files: the file of each picture; or one film of H.264 for all. focus: lambda of each, ascending where there are
    several pictures. frames: number of each picture in the film, () where there is no film.
    """

    files: tuple[bytes, ...]
    focus: tuple[float, ...]
    frames: tuple[int, ...]
    size: ImageSize


@dataclass(frozen=True, eq=False)
class Lfp:
    """Contents of a processed file.

    pictures: None where it holds the map only. depth: (h, w) of lambda, small is near; None without a map.
    """

    pictures: LfpPictures | None
    depth: FloatImage | None


def open_lfp(path: Path) -> Lfp | None:
    """Return the contents of a processed Lytro file; None for raw ones and other files."""
    data = read_bytes(path)
    if not data.startswith(LFP_START):
        return None
    text, chunks, end = _sections(data)
    if end > len(data):
        raise InputError(f"{path}: cut off at {len(data):,} of {end:,} bytes or more; get the whole file again")
    with parsing(path, f"describes its pictures in an unknown way ({{}}); {EXPORT}"):
        return _processed(list(_objects(json.loads(text))), chunks) if text else None


def lfp_size(path: Path) -> ImageSize:
    """Return the size of the picture."""
    return _pictures_and_depth(path)[0].size


def read_lfp(path: Path) -> Picture:
    """Decode the picture that is sharp everywhere: each pixel from the picture focused at its depth.

    Raises InputError also where the file holds a film and PyAV is not installed.
    """
    pictures, depth = _pictures_and_depth(path)
    frames = _film(path, pictures) if pictures.frames else _decoded(path, pictures)
    pixels = next(frames) if depth is None or len(pictures.focus) < 2 else _in_focus(frames, pictures, depth)
    return Picture(np.ascontiguousarray(pixels))


def _pictures_and_depth(path: Path) -> tuple[LfpPictures, FloatImage | None]:
    lfp = open_lfp(path)
    if lfp is None or lfp.pictures is None:
        raise InputError(f"{path}: holds a map of depth without its picture; open the file that ends in -stk.lfp")
    return lfp.pictures, lfp.depth


def _sections(data: bytes) -> tuple[bytes, dict[str, bytes], int]:
    """Return the first JSON, b"" without, the named chunks, and where the last one ends: beyond the data if cut off."""
    text, at, end = b"", 0, 0
    chunks: dict[str, bytes] = {}
    while data.startswith(SECTION_START, at):
        first = at + HEADER_BYTES
        length = int.from_bytes(data[at + 12 : first], "big")
        if length:
            name = data[first : first + NAME_BYTES].rstrip(b"\0").decode("latin-1")
            first += NAME_BYTES
            if data[at + 3 : at + 4] == JSON_KIND:
                text = text or data[first : first + min(length, MAX_PART_BYTES)]
            else:
                chunks.setdefault(name, data[first : first + length])
        end = first + length
        at = end + -end % ALIGNMENT
    return text, chunks, end


def _objects(value: Any) -> Iterator[dict[str, Any]]:
    """Yield all objects of a JSON, the outer ones first."""
    if isinstance(value, dict):
        yield value
    for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from _objects(inner)


def _processed(entries: list[dict[str, Any]], chunks: Chunks) -> Lfp | None:
    stacks = [pictures for entry in entries if (pictures := _pictures_of(entry, chunks)) is not None]
    depth = next((depth for entry in entries if (depth := _depth_of(entry, chunks)) is not None), None)
    if not stacks and depth is None:
        return None
    # Views come before a focal stack: each of them is sharp everywhere.
    return Lfp(min(stacks, key=lambda pictures: len(pictures.focus), default=None), depth)


def _depth_of(entry: Mapping[str, Any], chunks: Chunks) -> FloatImage | None:
    """Return the map that an object of the JSON describes; None for other objects."""
    described = entry.get("depthMap", entry.get("depthLut"))
    if not isinstance(described, dict) or described.get("imageRef") not in chunks:
        return None
    stored = np.frombuffer(chunks[described["imageRef"]], "<f4")
    return stored.reshape(_size_in({**entry, **described})).astype(np.float32)


def _pictures_of(entry: Mapping[str, Any], chunks: Chunks) -> LfpPictures | None:
    """Return the pictures that an object of the JSON lists, files or a film; None for other objects."""
    listed, film = entry.get("imageArray", entry.get("perImage")), entry.get("blockOfImages")
    if film is not None and film["blockOfImagesRef"] in chunks:
        listed = film["metadataArray"]
    elif listed and all(picture.get("imageRef") in chunks for picture in listed):
        film = None
    else:
        return None
    if not 0 < len(listed) <= MAX_PICTURES:
        raise ValueError(f"{len(listed)} pictures")
    size, (order, focus) = _size_in({**entry, **listed[0]}), _order_of(listed)
    if film:
        return LfpPictures((chunks[film["blockOfImagesRef"]],), focus, order, size)
    return LfpPictures(tuple(chunks[listed[k]["imageRef"]] for k in order), focus, (), size)


def _order_of(listed: Sequence[Mapping[str, Any]]) -> tuple[tuple[int, ...], tuple[float, ...]]:
    """Return the numbers of the used pictures, and their lambda; of views, only the middle one is used."""
    if any("coord" in picture for picture in listed):
        places = [abs(picture["coord"]["x"]) + abs(picture["coord"]["y"]) for picture in listed]
        return (int(np.argmin(places)),), (0.0,)
    depths = [float(picture.get("lambda", picture.get("focus"))) for picture in listed]
    if not np.isfinite(depths).all():
        raise ValueError("a focus that is no number")
    order = sorted(range(len(depths)), key=depths.__getitem__)
    return tuple(order), tuple(depths[k] for k in order)


def _size_in(entry: Mapping[str, Any]) -> ImageSize:
    size = ImageSize(int(entry["height"]), int(entry["width"]))
    if min(size) < 1 or size.height * size.width > MAX_FILE_PIXELS:
        raise ValueError(f"a picture of {size}")
    return size


def _decoded(path: Path, pictures: LfpPictures) -> Iterator[NDArray[np.uint8]]:
    """Yield the pictures, (H, W, 3)."""
    for data in pictures.files:
        with open_with_pillow(path, ("JPEG", "PNG"), data) as image:
            pixels = np.asarray(image.convert("RGB"))
        if pixels.shape[:2] != pictures.size:
            raise InputError(f"{path}: its pictures differ from the stated size, {pictures.size}; {EXPORT}")
        yield pixels


def _film(path: Path, pictures: LfpPictures) -> Iterator[NDArray[np.uint8]]:
    """Yield the pictures of a film, (H, W, 3), in the order of their focus."""
    try:
        import av
    except ImportError as error:
        raise InputError(f"{path}: its pictures are H.264; {how_to_install('export')}") from error
    frames: dict[int, NDArray[np.uint8]] = {}
    try:
        with av.open(BytesIO(pictures.files[0]), mode="r", format="h264") as film:
            for number, frame in enumerate(film.decode(video=0)):
                if number in pictures.frames:
                    frames[number] = np.asarray(frame.to_ndarray(format="rgb24"), np.uint8)
                if len(frames) == len(pictures.frames):
                    break
    except (av.error.FFmpegError, ValueError) as error:
        raise InputError(f"{path}: {decoding_fault(error)}") from error
    for number in pictures.frames:
        if number not in frames or frames[number].shape[:2] != pictures.size:
            raise InputError(f"{path}: damaged or cut off (picture {number} is missing); get the whole file again")
        yield frames[number]


def _in_focus(frames: Iterator[NDArray[np.uint8]], pictures: LfpPictures, depth: FloatImage) -> NDArray[np.uint8]:
    """Mix the pictures (H, W, 3) of a focal stack by the map (h, w).

    A picture counts 1 at its focus, linearly less on both sides, and 0 from its neighbours' on.
    """
    height, width = pictures.size
    known = np.nan_to_num(np.clip(depth, pictures.focus[0], pictures.focus[-1]), nan=pictures.focus[0])
    whole = np.asarray(Image.fromarray(known).resize((width, height), Image.Resampling.BILINEAR))
    mixed = np.zeros((height, width, 3), np.float32)
    for weights, pixels in zip(np.eye(len(pictures.focus)), frames, strict=True):
        mixed += np.interp(whole, pictures.focus, weights).astype(np.float32)[..., None] * pixels
    return np.rint(mixed).astype(np.uint8)
