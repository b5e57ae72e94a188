"""Read cameras of any poses: LLFF's poses_bounds.npy, nerfstudio's and NeRF's transforms.json, COLMAP's text.

Worlds may have any axes: only the poses of cameras relative to each other count. `cameras.py` writes these files.
"""

from collections.abc import Sequence
from math import tan
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import printable, read_text, reason_of, stays_within
from iibr_core.formats.images.decode import read_size
from iibr_core.formats.maps.npy import read_array
from iibr_core.types import Camera, ImageSize, InputError

MAX_POSES = 10_000
MAX_SIDE_PX = 2**15
MAX_TEXT_BYTES = 64 * 2**20
LLFF_FROM_CAMERA = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Rows: LLFF's axes (down, right, backwards) by a camera's x right, y down, z forward; its own inverse."""
OPENGL_FROM_CAMERA = np.diag([1.0, -1.0, -1.0])
"""The same for OpenGL's axes: right, up, backwards."""
COLMAP_FILES = ("cameras.txt", "images.txt")

Doubles = NDArray[np.float64]


class _Frame(msgspec.Struct):
    """A frame of transforms.json with the values that the file gives for all frames. Lengths are in pixels."""

    transform_matrix: tuple[tuple[float, float, float, float], ...] = ()
    file_path: str = ""
    w: float | None = None
    h: float | None = None
    fl_x: float | None = None
    fl_y: float | None = None
    cx: float | None = None
    cy: float | None = None
    camera_angle_x: float | None = None


def read_poses(path: Path) -> tuple[Camera, ...]:
    """Return the cameras of a file in its order: *.npy as poses_bounds.npy, *.json as transforms.json.

    A folder is searched for either of them, else for COLMAP's cameras.txt and images.txt (sorted by picture).
    """
    if path.is_dir():
        return _read_folder(path)
    if path.suffix.lower() == ".npy":
        return read_llff_poses(path)
    if path.suffix.lower() == ".json":
        return _read_transforms(path)
    raise InputError(f"{path}: holds no known poses; give poses_bounds.npy, transforms.json or a folder")


def central_camera(cameras: Sequence[Camera]) -> int:
    """Return the index of the camera nearest to the mean position."""
    positions = np.array([camera.position for camera in cameras])
    return int(((positions - positions.mean(axis=0)) ** 2).sum(axis=1).argmin())


def _read_folder(folder: Path) -> tuple[Camera, ...]:
    for name in ("poses_bounds.npy", "transforms.json"):
        if (folder / name).is_file():
            return read_poses(folder / name)
    for model in (folder, folder / "sparse" / "0"):
        if all((model / name).is_file() for name in COLMAP_FILES):
            return _read_colmap(model)
    raise InputError(f"{folder}: holds neither poses_bounds.npy nor transforms.json nor COLMAP's cameras.txt")


def read_llff_poses(path: Path) -> tuple[Camera, ...]:
    """Return the cameras of poses_bounds.npy (Mildenhall et al. 2019) with their depth ranges.

    A row holds a 3x5 matrix (camera-to-world rotation with columns down, right and backwards; position; height, width,
    focal length), then the least and greatest depth.
    """
    stored = read_array(path, 17 * MAX_POSES)
    if stored.ndim != 2 or stored.shape[1] != 17 or stored.dtype.kind != "f":
        raise InputError(f"{path}: holds no poses; N rows of 17 numbers are expected")
    _require_count(path, len(stored))
    return tuple(_llff_camera(row, f"{path}, pose {number}") for number, row in enumerate(stored.astype(float), 1))


def _llff_camera(row: Doubles, source: str) -> Camera:
    matrix, (near, far) = row[:15].reshape(3, 5), row[15:]
    height, width, focal = (float(value) for value in matrix[:, 4])
    size = _size(height, width, source)
    rotation = matrix[:, :3] @ LLFF_FROM_CAMERA
    return Camera(rotation, matrix[:, 3], size, (focal, focal), _middle(size), source, (float(near), float(far)))


def _read_transforms(path: Path) -> tuple[Camera, ...]:
    text = read_text(path, MAX_TEXT_BYTES)
    try:
        content = msgspec.json.decode(text, type=dict[str, Any])
        frames = [msgspec.convert({**content, **frame}, _Frame) for frame in content["frames"]]
    except (msgspec.MsgspecError, KeyError, TypeError, RecursionError) as error:
        reason = reason_of(error)
        raise InputError(f"{path}: is not a transforms.json with poses ({reason}); get the file again") from error
    _require_count(path, len(frames))
    return tuple(_frame_camera(frame, path, f"{path}, pose {number}") for number, frame in enumerate(frames, 1))


def _frame_camera(frame: _Frame, path: Path, source: str) -> Camera:
    matrix = np.array(frame.transform_matrix)
    if len(matrix) not in (3, 4):
        raise InputError(f"{source}: its transform_matrix is not 4x4; get the file again")
    if frame.w is None or frame.h is None:
        size = _picture_size(frame.file_path, path, source)
    else:
        size = _size(frame.h, frame.w, source)
    focal_x, angle = frame.fl_x, frame.camera_angle_x
    focal_x = 0.5 * size.width / tan(0.5 * angle) if focal_x is None and angle else focal_x
    if focal_x is None:
        raise InputError(f"{source}: neither fl_x nor camera_angle_x gives a focal length; add one of them")
    # Principal points count from the picture's corner there, from the middle of its first pixel here.
    x, y = (middle if at is None else at - 0.5 for at, middle in zip((frame.cx, frame.cy), _middle(size)))
    rotation = matrix[:3, :3] @ OPENGL_FROM_CAMERA
    return Camera(rotation, matrix[:3, 3], size, (focal_x, frame.fl_y or focal_x), (x, y), source)


def _picture_size(name: str, path: Path, source: str) -> ImageSize:
    """Return the size of a frame's picture, which is given relative to the file; without an ending it is a PNG."""
    if not stays_within(name):
        raise InputError(f"{source}: its picture {printable(name)} does not lie beside the file; state w and h")
    picture = path.parent / name
    try:
        return read_size(picture if picture.suffix else picture.with_suffix(".png"))
    except (InputError, ValueError) as error:
        raise InputError(f"{source} states no size, and its picture has none: {error}") from error


def _read_colmap(model: Path) -> tuple[Camera, ...]:
    """Return the cameras of COLMAP's text: one line a camera; two a picture, the second of which lists points."""
    intrinsics, poses = (_lines(model / name) for name in COLMAP_FILES)
    try:
        kinds = {words[0]: words for words in (line.split() for line in intrinsics if line)}
        pictures = sorted((line.split(maxsplit=9) for line in poses[::2] if line), key=lambda words: words[9])
        _require_count(model, len(pictures))
        return tuple(_colmap_camera(kinds[words[8]], words, model) for words in pictures)
    except InputError:
        raise
    except (ValueError, KeyError, IndexError) as error:
        raise InputError(f"{model}: is not a text model of COLMAP ({reason_of(error)}); export it again") from error


def _lines(path: Path) -> list[str]:
    """Return the lines of a file without comments; empty lines stay."""
    return [line.strip() for line in read_text(path, MAX_TEXT_BYTES).splitlines() if not line.startswith("#")]


def _colmap_camera(kind: list[str], picture: list[str], model: Path) -> Camera:
    source = f"{model}, {picture[9]}"
    size = _size(float(kind[3]), float(kind[2]), source)
    numbers = [float(word) for word in kind[4:]]
    if kind[1] not in ("PINHOLE", "SIMPLE_PINHOLE"):
        raise InputError(f"{source}: its camera is a {kind[1]}; undistort the pictures, which makes PINHOLE of it")
    focal_x, focal_y, x, y = numbers if kind[1] == "PINHOLE" else (numbers[0], *numbers)
    rotation = _rotation(*(float(word) for word in picture[1:5]))  # from the world to the camera
    position = -rotation.T @ [float(word) for word in picture[5:8]]
    return Camera(rotation.T, position, size, (focal_x, focal_y), (x - 0.5, y - 0.5), source)


def _rotation(w: float, x: float, y: float, z: float) -> Doubles:
    """Return the rotation (3, 3) of a quaternion; NaN if its length is 0. SciPy is not in a plain installation."""
    with np.errstate(invalid="ignore"):
        w, x, y, z = np.array([w, x, y, z]) / np.linalg.norm([w, x, y, z])
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation: Doubles = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    return rotation


def _require_count(path: Path, count: int) -> None:
    if not 1 <= count <= MAX_POSES:
        raise InputError(f"{path}: holds {count} poses; give 1 to {MAX_POSES}")


def _size(height: float, width: float, source: str) -> ImageSize:
    if not (1 <= height <= MAX_SIDE_PX and 1 <= width <= MAX_SIDE_PX):
        raise InputError(f"{source}: pictures of {width:g}x{height:g} pixels; give 1 to {MAX_SIDE_PX} each way")
    return ImageSize(round(height), round(width))


def _middle(size: ImageSize) -> tuple[float, float]:
    return (size.width - 1) / 2, (size.height - 1) / 2
