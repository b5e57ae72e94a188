"""Where the views of a light field stand, as programs for reconstruction are told: LLFF, nerfstudio, COLMAP.

All cameras look the same way, from a plane. Disparity says depth up to its unit: lengths are in distances of the
nearest. A plane that stands still in the field is one at a finite distance; cameras that look straight ahead see it
move, so their principal points move instead.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage, GridShape, ImageSize, InputError, ViewOffset

MOST_DEPTH_RATIO = 20.0
"""From the nearest to the farthest, where disparity leaves open what is infinitely far."""


@dataclass(frozen=True)
class FieldCameras:
    """Cameras of a field: x to the right, y down, z forward, the centre view's in the origin.

    size: of a view. focal_px: of it. range_px: least and greatest disparity (px per view step). at_infinity: the
    disparity of what is infinitely far, less than the least. Raises InputError where nothing is as it must be.
    """

    grid: GridShape
    size: ImageSize
    focal_px: float
    range_px: tuple[float, float]
    at_infinity: float

    def __post_init__(self) -> None:
        low, high = self.range_px
        numbers = (self.focal_px, low, high, self.at_infinity)
        if not (np.isfinite(numbers).all() and self.focal_px > 0 and self.at_infinity < low <= high):
            said = f"focal length {self.focal_px:g}, disparities {low:g} to {high:g}"
            raise InputError(f"{said}: no cameras can be computed from these")

    @property
    def step(self) -> float:
        """From view to view, as long as the nearest is 1 away."""
        return (self.range_px[1] - self.at_infinity) / self.focal_px

    @property
    def depth_range(self) -> tuple[float, float]:
        """Of the nearest, 1, and the farthest."""
        low, high = self.range_px
        return 1.0, (high - self.at_infinity) / (low - self.at_infinity)

    def place(self, offset: ViewOffset) -> tuple[float, float, float]:
        """Of a view's camera."""
        return self.step * offset.s, self.step * offset.t, 0.0

    def principal_point(self, offset: ViewOffset) -> tuple[float, float]:
        """(x, y) in pixels from the picture's upper left corner, not from the middle of its first pixel."""
        return (
            self.size.width / 2 - self.at_infinity * offset.s,
            self.size.height / 2 - self.at_infinity * offset.t,
        )

    def depth(self, disparity: FloatImage) -> FloatImage:
        """Of disparities of any shape; beyond range_px the nearest or the farthest."""
        inside = np.clip(disparity, *self.range_px) - np.float32(self.at_infinity)
        return ((self.range_px[1] - self.at_infinity) / inside).astype(np.float32)

    def points(self, disparity: FloatImage, offset: ViewOffset) -> FloatImage:
        """Where the pixels (H, W) of a view are, (H, W, 3)."""
        depth = self.depth(disparity)
        rows, columns = np.indices(disparity.shape, np.float32) + np.float32(0.5)
        centre_x, centre_y = self.principal_point(offset)
        x = (columns - np.float32(centre_x)) * depth / np.float32(self.focal_px)
        y = (rows - np.float32(centre_y)) * depth / np.float32(self.focal_px)
        return np.stack([x, y, depth], axis=-1) + np.array(self.place(offset), np.float32)


def infinity_of(low: float, high: float) -> float:
    """The disparity of what is infinitely far, where all others lie from low to high: 0 where that says sensible
    depths, else so much less than the least that depths differ by MOST_DEPTH_RATIO.
    """
    if low > 0 and high <= MOST_DEPTH_RATIO * low:
        return 0.0
    return low - (high - low) / (MOST_DEPTH_RATIO - 1) if high > low else low - 1.0


Views = Mapping[str, ViewOffset]
"""Where each picture was taken, by its file's name."""


def write_llff(folder: Path, cameras: FieldCameras, views: Views) -> None:
    """poses_bounds.npy (Mildenhall et al. 2019): a row a picture in the order of the names; rotation (columns down,
    right, backwards), place, height, width and focal length as 3x5, then nearest and farthest. y is up, z backwards.

    Raises InputError where principal points move: the file has no place for them.
    """
    if cameras.at_infinity != 0:
        raise InputError(
            f"{folder.name}: points at rest in these views are not at infinity, which poses_bounds.npy cannot express;"
            " export cameras for nerfstudio or COLMAP"
        )
    axes = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]], float)
    height, width = cameras.size
    rows = []
    for name in sorted(views):
        x, y, z = cameras.place(views[name])
        pose = np.column_stack([axes, (x, -y, -z), (height, width, cameras.focal_px)])
        rows.append([*pose.ravel(), *cameras.depth_range])
    np.save(folder / "poses_bounds.npy", np.array(rows))


def write_nerfstudio(folder: Path, cameras: FieldCameras, views: Views) -> None:
    """transforms.json: camera to world by OpenGL's axes, y up and z backwards."""
    frames = []
    for name in sorted(views):
        x, y, z = cameras.place(views[name])
        matrix = [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, -y], [0.0, 0.0, 1.0, -z], [0.0, 0.0, 0.0, 1.0]]
        centre_x, centre_y = cameras.principal_point(views[name])
        frames.append({"file_path": f"images/{name}", "cx": centre_x, "cy": centre_y, "transform_matrix": matrix})
    whole = {
        "camera_model": "OPENCV",
        "w": cameras.size.width,
        "h": cameras.size.height,
        "fl_x": cameras.focal_px,
        "fl_y": cameras.focal_px,
        "frames": frames,
    }
    (folder / "transforms.json").write_text(json.dumps(whole, indent=1), encoding="utf-8")


def write_colmap(
    folder: Path, cameras: FieldCameras, views: Views, points: FloatImage, colors: NDArray[np.uint8]
) -> None:
    """COLMAP's text model in sparse/0: world to camera, y down and z forward.

    points, colors: (N, 3) each, what of the scene is known from the start.
    """
    model = folder / "sparse" / "0"
    model.mkdir(parents=True)
    names = sorted(views)
    height, width = cameras.size
    camera_lines = [
        f"{i} PINHOLE {width} {height} {cameras.focal_px!r} {cameras.focal_px!r} {centre_x!r} {centre_y!r}"
        for i, name in enumerate(names, 1)
        for centre_x, centre_y in (cameras.principal_point(views[name]),)
    ]
    image_lines = [
        f"{i} 1 0 0 0 {-x!r} {-y!r} {-z!r} {i} {name}\n"  # then a line of what was seen in it: nothing
        for i, name in enumerate(names, 1)
        for x, y, z in (cameras.place(views[name]),)
    ]
    point_lines = [
        f"{i} {x:.6g} {y:.6g} {z:.6g} {red} {green} {blue} 0"
        for i, ((x, y, z), (red, green, blue)) in enumerate(zip(points.tolist(), colors.tolist()), 1)
    ]
    for name, lines in (("cameras", camera_lines), ("images", image_lines), ("points3D", point_lines)):
        (model / f"{name}.txt").write_text("\n".join([*lines, ""]), encoding="utf-8")


def spread(count: int, most: int) -> Sequence[int]:
    """At most so many of `count` things, evenly spread."""
    return [int(i) for i in np.linspace(0, count - 1, min(count, most)).astype(int)] if count else []
