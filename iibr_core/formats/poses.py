"""Read cameras of any poses: LLFF's poses_bounds.npy, nerfstudio's and NeRF's transforms.json, COLMAP's models.

Worlds may have any axes: only the poses of cameras relative to each other count. `cameras.py` writes these files, but
for COLMAP's, which `colmap.py` reads and writes.
"""

from collections.abc import Mapping, Sequence
from math import tan
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.cameras import MAX_POSES, NamedCamera, require_count, size_of_pictures
from iibr_core.formats.colmap import model_in, read_colmap
from iibr_core.formats.files import MAX_PART_BYTES, PARSE_ERRORS, parsing, printable, read_text, stays_within
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.maps.npy import read_named_array
from iibr_core.types import Camera, ImageSize, InputError

MAX_DISTORTION = 1e-3
"""Largest coefficient of a distortion that is ignored: in usual lenses it moves pixels by less than half a pixel."""
PINHOLE_MODELS = ("", "PINHOLE", "SIMPLE_PINHOLE", "PERSPECTIVE", "OPENCV", "FULL_OPENCV", "SIMPLE_RADIAL", "RADIAL")
"""Camera models that are pinholes where their distortion is 0."""
COEFFICIENTS = ("k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2")
OTHER_CAMERAS = ("is_fisheye", "latlong", "ftheta_p0", "distortion_params")
"""Values of cameras that are no pinholes (instant-ngp, nerfstudio)."""
LLFF_FROM_CAMERA = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Rows: LLFF's axes (down, right, backwards) by a camera's x right, y down, z forward; its own inverse."""
OPENGL_FROM_CAMERA = np.diag([1.0, -1.0, -1.0])
"""The same for OpenGL's axes: right, up, backwards."""

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
    """Return the cameras of a file or folder, see `read_named_poses`."""
    return tuple(camera for _, camera in read_named_poses(path))


def read_named_poses(path: Path) -> tuple[NamedCamera, ...]:
    """Return the cameras of a file in its order: *.npy as poses_bounds.npy, *.json as transforms.json.

    A folder is searched for either of them, else for COLMAP's model (sorted by picture).
    """
    if path.is_dir():
        found = poses_in(path)
        if found is None:
            raise InputError(f"{path}: holds neither poses_bounds.npy nor transforms.json nor a COLMAP model")
        return read_colmap(found) if found.is_dir() else read_named_poses(found)
    if path.suffix.lower() == ".npy":
        return tuple(NamedCamera("", camera) for camera in read_llff_poses(path))
    if path.suffix.lower() == ".json":
        return _read_transforms(path)
    raise InputError(f"{path}: holds no known poses; give poses_bounds.npy, transforms.json or a folder")


def central_camera(cameras: Sequence[Camera]) -> int:
    """Return the index of the camera nearest to the mean position."""
    positions = np.array([camera.position for camera in cameras])
    return int(((positions - positions.mean(axis=0)) ** 2).sum(axis=1).argmin())


def poses_in(folder: Path) -> Path | None:
    """Return the file or the COLMAP model with the cameras of a folder, None if it holds none."""
    for name in ("poses_bounds.npy", "transforms.json"):
        if (folder / name).is_file():
            return folder / name
    return model_in(folder)


def read_llff_poses(path: Path) -> tuple[Camera, ...]:
    """Return the cameras of poses_bounds.npy (Mildenhall et al. 2019) with their depth ranges.

    A row holds a 3x5 matrix (camera-to-world rotation with columns down, right and backwards; position; height, width,
    focal length), then the least and greatest depth.
    """
    stored, _ = read_named_array(path, 17 * MAX_POSES)
    if stored.ndim != 2 or stored.shape[1] != 17 or stored.dtype.kind != "f":
        raise InputError(f"{path}: holds no poses; N rows of 17 numbers are expected")
    require_count(path, len(stored))
    return tuple(_llff_camera(row, f"{path}, pose {number}") for number, row in enumerate(stored.astype(float), 1))


@np.errstate(invalid="ignore", over="ignore")  # such cameras are refused
def _llff_camera(row: Doubles, source: str) -> Camera:
    matrix, (near, far) = row[:15].reshape(3, 5), row[15:]
    height, width, focal = (float(value) for value in matrix[:, 4])
    size = size_of_pictures(height, width, source)
    rotation = matrix[:, :3] @ LLFF_FROM_CAMERA
    return Camera(rotation, matrix[:, 3], size, (focal, focal), _middle(size), source, (float(near), float(far)))


def _read_transforms(path: Path) -> tuple[NamedCamera, ...]:
    text, errors = read_text(path, MAX_PART_BYTES), (msgspec.MsgspecError, *PARSE_ERRORS)
    with parsing(path, "is not a transforms.json with poses ({}); get the file again", errors):
        content = msgspec.json.decode(text, type=dict[str, Any])
        stated = [{**content, **frame} for frame in content["frames"]]
        frames = [msgspec.convert(values, _Frame) for values in stated]
    require_count(path, len(frames))
    for number, values in enumerate(stated, 1):
        _require_pinhole(values, f"{path}, pose {number}")
    return tuple(
        NamedCamera(frame.file_path, _frame_camera(frame, path, f"{path}, pose {number}"))
        for number, frame in enumerate(frames, 1)
    )


def _require_pinhole(values: Mapping[str, Any], source: str) -> None:
    """Raise InputError for the values of a frame whose camera distorts, or is a fisheye or a panorama."""
    model = str(values.get("camera_model") or "")
    named = [f"model {printable(model)}"] if model.upper() not in PINHOLE_MODELS else []
    found = {name: value for name in COEFFICIENTS if not _is_small(value := values.get(name) or 0.0)}
    found |= {name: value for name in OTHER_CAMERAS if (value := values.get(name))}
    if named or found:
        camera = ", ".join([*named, *(f"{name} = {printable(str(value))}" for name, value in found.items())])
        raise InputError(f"{source}: its camera is no pinhole ({camera}); undistort the pictures to get one")


def _is_small(coefficient: object) -> bool:
    return isinstance(coefficient, int | float) and abs(coefficient) <= MAX_DISTORTION


@np.errstate(invalid="ignore", over="ignore")
def _frame_camera(frame: _Frame, path: Path, source: str) -> Camera:
    matrix = np.array(frame.transform_matrix)
    if len(matrix) not in (3, 4):
        raise InputError(f"{source}: its transform_matrix is not 4x4; get the file again")
    if frame.w is None or frame.h is None:
        size = _picture_size(frame.file_path, path, source)
    else:
        size = size_of_pictures(frame.h, frame.w, source)
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
        return open_picture(picture if picture.suffix else picture.with_suffix(".png")).size
    except (InputError, ValueError) as error:
        raise InputError(f"{source} states no size, and its picture has none: {error}") from error


def _middle(size: ImageSize) -> tuple[float, float]:
    return (size.width - 1) / 2, (size.height - 1) / 2
