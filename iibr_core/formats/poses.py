"""Cameras of any poses from files: LLFF's poses_bounds.npy, nerfstudio's and NeRF's transforms.json, COLMAP's text.

What `cameras.py` writes is read here. Worlds have axes of their own: only how cameras stand to each other counts.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from math import tan
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import is_file, is_folder, printable, read_text, reason_of, stays_within
from iibr_core.formats.images.oiio_reader import read_size
from iibr_core.formats.maps.npy import read_array
from iibr_core.types import Camera, ImageSize, InputError

MOST_POSES = 10_000
MOST_SIDE = 2**15
MOST_BYTES = 64 * 2**20
LLFF_FROM_CAMERA = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Rows: LLFF's axes (down, right, backwards) by a camera's x right, y down, z forward; its own inverse."""
OPENGL_FROM_CAMERA = np.diag([1.0, -1.0, -1.0])
"""The same of OpenGL's: right, up, backwards."""
FRAME_NAMES = ("transform_matrix", "file_path", "w", "h", "fl_x", "fl_y", "cx", "cy", "camera_angle_x")
"""Of transforms.json, what counts here; a frame may name a thousand other things."""
COLMAP_FILES = ("cameras.txt", "images.txt")

Doubles = NDArray[np.float64]


def read_poses(path: Path) -> tuple[Camera, ...]:
    """The cameras of a file in its order, one at least: *.npy as LLFF's poses_bounds.npy, *.json as transforms.json; of
    a folder whichever of them lies in it, or COLMAP's cameras.txt and images.txt (by name of picture).

    Raises InputError where there are none, or one is no camera.
    """
    if is_folder(path):
        return _read_folder(path)
    if path.suffix.lower() == ".npy":
        return read_llff_poses(path)
    if path.suffix.lower() == ".json":
        return _read_transforms(path)
    raise InputError(f"{path}: holds no known poses; give poses_bounds.npy, transforms.json or a folder")


def central_camera(cameras: Sequence[Camera]) -> int:
    """Index of the one nearest to the middle of all."""
    positions = np.array([camera.position for camera in cameras])
    return int(((positions - positions.mean(axis=0)) ** 2).sum(axis=1).argmin())


def _read_folder(folder: Path) -> tuple[Camera, ...]:
    for name in ("poses_bounds.npy", "transforms.json"):
        if is_file(folder / name):
            return read_poses(folder / name)
    for model in (folder, folder / "sparse" / "0"):
        if all(is_file(model / name) for name in COLMAP_FILES):
            return _read_colmap(model)
    raise InputError(f"{folder}: holds neither poses_bounds.npy nor transforms.json nor COLMAP's cameras.txt")


def read_llff_poses(path: Path) -> tuple[Camera, ...]:
    """Of poses_bounds.npy (Mildenhall et al. 2019): rows of a 3x5 matrix (camera-to-world rotation whose columns point
    down, right and backwards; position; height, width, focal length), the least and the greatest depth.

    Raises InputError as `read_poses` does.
    """
    stored = read_array(path, 17 * MOST_POSES)
    if stored.ndim != 2 or stored.shape[1] != 17 or stored.dtype.kind != "f":
        raise InputError(f"{path}: holds no poses; N rows of 17 numbers are expected")
    _require_count(path, len(stored))
    return tuple(_llff_camera(row, f"{path}, pose {number}") for number, row in enumerate(stored.astype(float), 1))


def _llff_camera(row: Doubles, source: str) -> Camera:
    matrix, (near, far) = row[:15].reshape(3, 5), row[15:]
    height, width, focal = (float(value) for value in matrix[:, 4])
    size = _size(height, width, source)
    turned = matrix[:, :3] @ LLFF_FROM_CAMERA
    return Camera(turned, matrix[:, 3], size, (focal, focal), _middle(size), source, (float(near), float(far)))


def _read_transforms(path: Path) -> tuple[Camera, ...]:
    """nerfstudio's, or NeRF's first ones with camera_angle_x; what a frame says goes before what the file says."""
    text = read_text(path, MOST_BYTES)
    try:
        whole = json.loads(text)
        frames = whole["frames"]
        _require_count(path, len(frames))
        of_all = _known_names(whole)
        return tuple(
            _frame_camera(of_all | _known_names(frame), path, number) for number, frame in enumerate(frames, 1)
        )
    except (ValueError, TypeError, KeyError, IndexError, ArithmeticError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(
            f"{path}: is not a transforms.json with poses ({reason_of(error)}); get the file again"
        ) from error


def _known_names(said: dict[str, Any]) -> dict[str, Any]:
    return {name: said[name] for name in FRAME_NAMES if name in said}


def _frame_camera(frame: dict[str, Any], path: Path, number: int) -> Camera:
    source = f"{path}, pose {number}"
    matrix = np.array(frame["transform_matrix"], float)
    if matrix.shape not in ((4, 4), (3, 4)):
        raise InputError(f"{source}: a 4x4 matrix is expected, not {matrix.shape}")
    size = _frame_size(frame, path, source)
    if "fl_x" in frame:
        focal_x = float(frame["fl_x"])
        focal_px = focal_x, float(frame.get("fl_y", focal_x))
    else:
        focal_px = (0.5 * size.width / tan(0.5 * float(frame["camera_angle_x"])),) * 2
    middle = _middle(size)
    # Counted from the picture's corner there, from the middle of its first pixel here.
    centre_px = tuple(float(frame[name]) - 0.5 if name in frame else at for name, at in zip(("cx", "cy"), middle))
    return Camera(
        matrix[:3, :3] @ OPENGL_FROM_CAMERA, matrix[:3, 3], size, focal_px, (centre_px[0], centre_px[1]), source
    )


def _frame_size(frame: dict[str, Any], path: Path, source: str) -> ImageSize:
    """As stated, else of the frame's picture."""
    if "w" in frame and "h" in frame:
        return _size(float(frame["h"]), float(frame["w"]), source)
    name = str(frame["file_path"])
    if not stays_within(name):
        raise InputError(f"{source}: its picture {printable(name)} does not lie beside the file; state w and h")
    picture = path.parent / name
    try:
        return read_size(picture if picture.suffix else picture.with_suffix(".png"))
    except InputError as error:
        raise InputError(f"{source} states no size, and its picture has none: {error}") from error


def _read_colmap(model: Path) -> tuple[Camera, ...]:
    """Of COLMAP's text: a line a camera; two lines a picture, the second of which says what was seen in it."""
    intrinsics, poses = (_lines(model / name) for name in COLMAP_FILES)
    try:
        kinds = {words[0]: words for words in (line.split() for line in intrinsics if line)}
        named = [line for line in poses[::2] if line]
        _require_count(model, len(named))
        pictures = sorted((line.split(maxsplit=9) for line in named), key=lambda words: words[9])
        return tuple(_colmap_camera(kinds[words[8]], words, model) for words in pictures)
    except (ValueError, KeyError, IndexError, ArithmeticError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{model}: is not a text model of COLMAP ({reason_of(error)}); export it again") from error


def _lines(path: Path) -> list[str]:
    """Without comments; a picture's second line may be empty."""
    return [line.strip() for line in read_text(path, MOST_BYTES).splitlines() if not line.startswith("#")]


def _colmap_camera(kind: list[str], picture: list[str], model: Path) -> Camera:
    source = f"{model}, {picture[9]}"
    size = _size(float(kind[3]), float(kind[2]), source)
    numbers = [float(word) for word in kind[4:]]
    if kind[1] not in ("PINHOLE", "SIMPLE_PINHOLE"):
        raise InputError(f"{source}: its camera is a {kind[1]}; undistort the pictures, which makes PINHOLE of it")
    focal_x, focal_y, x, y = numbers if kind[1] == "PINHOLE" else (numbers[0], *numbers)
    rotation = _rotation(*(float(word) for word in picture[1:5]))
    position = -rotation.T @ [float(word) for word in picture[5:8]]
    return Camera(rotation.T, position, size, (focal_x, focal_y), (x - 0.5, y - 0.5), source)


def _rotation(w: float, x: float, y: float, z: float) -> Doubles:
    """Of a quaternion; NaN of one that is 0."""
    with np.errstate(invalid="ignore"):
        w, x, y, z = np.array([w, x, y, z]) / np.linalg.norm([w, x, y, z])
    return np.array(
        [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
    )


def _require_count(path: Path, count: int) -> None:
    if not 1 <= count <= MOST_POSES:
        raise InputError(f"{path}: holds {count} poses; give 1 to {MOST_POSES}")


def _size(height: float, width: float, source: str) -> ImageSize:
    """Raises InputError where these are no numbers of pixels."""
    if not (1 <= height <= MOST_SIDE and 1 <= width <= MOST_SIDE):
        raise InputError(f"{source}: pictures of {width:g}x{height:g} pixels; give 1 to {MOST_SIDE} each way")
    return ImageSize(round(height), round(width))


def _middle(size: ImageSize) -> tuple[float, float]:
    return (size.width - 1) / 2, (size.height - 1) / 2
