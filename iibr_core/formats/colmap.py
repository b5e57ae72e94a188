"""COLMAP's models: cameras, images and points3D, as text (.txt) and binary (.bin), world to camera, y down, z forward.

COLMAP 4 stores frames and rigs beside them, which repeat the poses of images.
"""

import struct
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.cameras import FieldCameras, NamedCamera, require_count, size_of_pictures
from iibr_core.formats.files import MAX_PART_BYTES, open_binary, parsing, read_text
from iibr_core.types import Camera, FloatImage, ImageSize, InputError, ViewOffset

MODEL_FOLDERS = ("", "sparse/0", "sparse", "colmap/sparse/0")
FILES = ("cameras", "images")
PINHOLES = ("SIMPLE_PINHOLE", "PINHOLE")
MODELS = (
    ("SIMPLE_PINHOLE", 3), ("PINHOLE", 4), ("SIMPLE_RADIAL", 4), ("RADIAL", 5), ("OPENCV", 8), ("OPENCV_FISHEYE", 8),
    ("FULL_OPENCV", 12), ("FOV", 5), ("SIMPLE_RADIAL_FISHEYE", 4), ("RADIAL_FISHEYE", 5), ("THIN_PRISM_FISHEYE", 12),
    ("RAD_TAN_THIN_PRISM_FISHEYE", 16), ("SIMPLE_DIVISION", 4), ("DIVISION", 5), ("SIMPLE_FISHEYE", 3), ("FISHEYE", 4),
    ("EUCM", 6), ("EQUIRECTANGULAR", 2),
)  # fmt: skip
"""Names of COLMAP's camera models with their numbers of parameters, by the number that binary files store."""
MAX_NAME_BYTES = 4096
MIN_QUATERNION = 1e-6
"""Smallest length of a quaternion, and 1 / the largest: COLMAP writes 1."""
NO_POINT = -1
POINT = np.dtype([("id", "<u8"), ("place", "<f8", 3), ("color", "u1", 3), ("error", "<f8"), ("track", "<u8")])
"""A point of points3D.bin that no picture observes."""


class _Lens(NamedTuple):
    model: str
    width: float
    height: float
    numbers: Sequence[float]


class _Picture(NamedTuple):
    """A picture. pose: quaternion (w, x, y, z) and translation from the world to the camera."""

    name: str
    lens: int
    pose: Sequence[float]


def model_in(folder: Path) -> Path | None:
    """Return the folder of the COLMAP model in a folder, None if it holds none."""
    for model in (folder / name for name in MODEL_FOLDERS):
        if _has(model, ".bin") or _has(model, ".txt"):
            return model
    return None


def read_colmap(model: Path) -> tuple[NamedCamera, ...]:
    """Return the cameras of a model, sorted by picture; the binary files count where both kinds exist, as in COLMAP."""
    with parsing(model, "is not a model of COLMAP ({}); export it again"):
        lenses, pictures = (_read_binary if _has(model, ".bin") else _read_text)(model)
        require_count(model, len(pictures))
        ordered = sorted(pictures, key=lambda picture: picture.name)
        return tuple(_camera(lenses[picture.lens], picture, f"{model}, {picture.name}") for picture in ordered)


def _has(model: Path, ending: str) -> bool:
    return all((model / f"{name}{ending}").is_file() for name in FILES)


def _read_text(model: Path) -> tuple[dict[int, _Lens], list[_Picture]]:
    """Read text: one line a camera; two a picture, the second of which lists points and may be empty."""
    intrinsics, poses = (_lines(model / f"{name}.txt") for name in FILES)
    lenses = {}
    for number, name, width, height, *numbers in (line.split() for line in intrinsics if line):
        lenses[int(number)] = _Lens(name, float(width), float(height), [float(word) for word in numbers])
    rows = [line.split(maxsplit=9) for line in poses[::2] if line]
    return lenses, [_Picture(row[9], int(row[8]), [float(word) for word in row[1:8]]) for row in rows]


def _lines(path: Path) -> list[str]:
    """Return the lines of a file without comments; empty lines stay."""
    return [line.strip() for line in read_text(path, MAX_PART_BYTES).splitlines() if not line.startswith("#")]


def _read_binary(model: Path) -> tuple[dict[int, _Lens], list[_Picture]]:
    with open_binary(model / "cameras.bin") as file:
        lenses = dict(_binary_lens(file) for _ in _counted(file, model))
    with open_binary(model / "images.bin") as file:
        return lenses, [_binary_picture(file) for _ in _counted(file, model)]


def _counted(file: BinaryIO, model: Path) -> Iterator[int]:
    (count,) = _unpack(file, "<Q")
    require_count(model, count)
    return iter(range(count))


def _binary_lens(file: BinaryIO) -> tuple[int, _Lens]:
    number, kind, width, height = _unpack(file, "<IiQQ")
    if not 0 <= kind < len(MODELS):
        raise ValueError(f"unknown camera model {kind}")
    name, count = MODELS[kind]
    return number, _Lens(name, width, height, _unpack(file, f"<{count}d"))


def _binary_picture(file: BinaryIO) -> _Picture:
    """Read a picture; the points in it are skipped."""
    _, *pose, lens = _unpack(file, "<I7dI")
    start = file.tell()
    name, end, _ = file.read(MAX_NAME_BYTES).partition(b"\0")
    file.seek(start + len(name) + len(end))
    (count,) = _unpack(file, "<Q")
    file.seek(24 * count, 1)
    return _Picture(name.decode("utf-8", "replace"), lens, pose)


def _unpack(file: BinaryIO, form: str) -> tuple[Any, ...]:
    return struct.unpack(form, file.read(struct.calcsize(form)))


@np.errstate(invalid="ignore", over="ignore")  # such cameras are refused
def _camera(lens: _Lens, picture: _Picture, source: str) -> NamedCamera:
    size = size_of_pictures(lens.height, lens.width, source)
    if lens.model not in PINHOLES:
        raise InputError(
            f"{source}: its camera model is {lens.model}; undistort the pictures, which makes PINHOLE of it"
        )
    focal_x, focal_y, x, y = lens.numbers if lens.model == "PINHOLE" else (lens.numbers[0], *lens.numbers)
    rotation = _rotation(*picture.pose[:4])  # from the world to the camera
    position = -rotation.T @ picture.pose[4:]
    camera = Camera(rotation.T, position, size, (focal_x, focal_y), (x - 0.5, y - 0.5), source)
    return NamedCamera(picture.name, camera)


def _rotation(w: float, x: float, y: float, z: float) -> NDArray[np.float64]:
    """Return the rotation (3, 3) of a quaternion. SciPy is not in a plain installation."""
    length = np.linalg.norm([w, x, y, z])
    if not MIN_QUATERNION < length < 1 / MIN_QUATERNION:
        raise ValueError(f"a quaternion of length {length:g}")
    w, x, y, z = np.array([w, x, y, z]) / length
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation: NDArray[np.float64] = np.eye(3) + 2 * w * cross + 2 * cross @ cross
    return rotation


def write_colmap(
    folder: Path,
    cameras: FieldCameras,
    views: Mapping[str, ViewOffset],
    points: FloatImage,
    colors: NDArray[np.uint8],
) -> None:
    """Write the cameras of a light field to sparse/0, as text and binary: some programs read only one of them.

    views: viewpoint of each picture by name. points, colors: (N, 3), points of the scene to start from. Each picture
    observes its principal point and no other: readers of text stop at empty lines.
    """
    folder = folder / "sparse" / "0"
    folder.mkdir(parents=True)
    lenses: dict[tuple[float, ...], int] = {}
    pictures = []
    for name in sorted(views):
        x, y, z = cameras.place(views[name])
        centre = cameras.principal_point(views[name])
        lens = lenses.setdefault((cameras.focal_px, cameras.focal_px, *centre), len(lenses) + 1)
        pictures.append((_Picture(name, lens, (1.0, 0.0, 0.0, 0.0, -x, -y, -z)), centre))
    model = _Model(cameras.size, lenses, pictures, points, colors)
    _write_text(folder, model)
    _write_binary(folder, model)


class _Model(NamedTuple):
    """A model to be written. lenses: number of each camera by focal lengths and principal point. pictures: with their
    principal points.
    """

    size: ImageSize
    lenses: Mapping[tuple[float, ...], int]
    pictures: Sequence[tuple[_Picture, tuple[float, float]]]
    points: FloatImage
    colors: NDArray[np.uint8]


def _write_text(folder: Path, model: _Model) -> None:
    size = f"{model.size.width} {model.size.height}"
    points = zip(model.points.tolist(), model.colors.tolist())
    lines: dict[str, list[str]] = {
        "cameras": [f"{number} PINHOLE {size} {_words(lens)}" for lens, number in model.lenses.items()],
        "images": [],
        "points3D": [
            f"{i} {x:.6g} {y:.6g} {z:.6g} {red} {green} {blue} 0"
            for i, ((x, y, z), (red, green, blue)) in enumerate(points, 1)
        ],
    }
    for i, (picture, centre) in enumerate(model.pictures, 1):
        lines["images"].append(f"{i} {_words(picture.pose)} {picture.lens} {picture.name}")
        lines["images"].append(f"{_words(centre)} {NO_POINT}")
    for name, content in lines.items():
        (folder / f"{name}.txt").write_text("\n".join([*content, ""]), encoding="utf-8")


def _words(numbers: Sequence[float]) -> str:
    return " ".join(map(repr, numbers))


def _write_binary(folder: Path, model: _Model) -> None:
    (height, width), kind = model.size, PINHOLES.index("PINHOLE")
    lenses = [struct.pack("<IiQQ4d", number, kind, width, height, *lens) for lens, number in model.lenses.items()]
    images = [
        struct.pack("<I7dI", i, *picture.pose, picture.lens)
        + picture.name.encode()
        + struct.pack("<xQ2dq", 1, *centre, NO_POINT)
        for i, (picture, centre) in enumerate(model.pictures, 1)
    ]
    points = np.zeros(len(model.points), POINT)
    points["id"], points["place"], points["color"] = np.arange(1, len(points) + 1), model.points, model.colors
    for name, records in (("cameras", lenses), ("images", images), ("points3D", [point.tobytes() for point in points])):
        (folder / f"{name}.bin").write_bytes(struct.pack("<Q", len(records)) + b"".join(records))
