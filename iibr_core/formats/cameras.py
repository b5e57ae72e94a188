"""Cameras of a light field's views, written for reconstruction programs: LLFF, nerfstudio; see also `colmap.py`.

Records and limits of files with cameras are here, too, for the readers in `poses.py` and `colmap.py`.

All cameras look the same way, from a plane. Lengths are in distances of the nearest point: disparity gives depth up to
its unit. A plane that stands still in the field lies at a finite distance, but moves in cameras that look straight
ahead; therefore their principal points move, unless views are cropped, see `FieldCameras.centred`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iibr_core.types import Camera, FloatImage, GridShape, ImageSize, InputError, ViewOffset

MAX_POSES, MAX_SIDE_PX = 10_000, 2**15
"""Largest number of cameras in a file, and side of their pictures."""
MAX_DEPTH_RATIO = 20.0
"""Ratio of the farthest depth to the nearest one where the disparity at infinity is unknown."""
MIN_BOUNDS_RATIO = 1.1
"""Smallest ratio of the farthest depth to the nearest one in poses_bounds.npy, for flat scenes."""
MIN_KEPT = 0.6
"""Smallest share of a view that is left when views are cropped."""
MAX_OFF_CENTRE_PX = 0.5
"""Largest distance of a principal point from the middle in files that cannot state it."""


class NamedCamera(NamedTuple):
    """A camera and the name of its picture as the file states it, "" where it states none."""

    picture: str
    camera: Camera


def require_count(source: object, count: int) -> None:
    """Raise InputError unless this is a possible number of poses."""
    if not 1 <= count <= MAX_POSES:
        raise InputError(f"{source}: holds {count} poses; give 1 to {MAX_POSES}")


def size_of_pictures(height: float, width: float, source: str) -> ImageSize:
    """Return the size that a camera states for its pictures."""
    if not (1 <= height <= MAX_SIDE_PX and 1 <= width <= MAX_SIDE_PX):
        raise InputError(f"{source}: pictures of {width:g}x{height:g} pixels; give 1 to {MAX_SIDE_PX} each way")
    return ImageSize(round(height), round(width))


@dataclass(frozen=True)
class FieldCameras:
    """Cameras of a field: x to the right, y down, z forward, the centre view's camera in the origin.

    size: size of a view, without its margins. focal_px: its focal length in pixels. range_px: least and greatest
    disparity (px per view step). at_infinity: disparity of infinitely far points, below the least. margins: mean number
    of pixels (y, x) that are cut off at each side, None where views are whole. viewpoints: those by row and column that
    are not on the regular grid.
    """

    grid: GridShape
    size: ImageSize
    focal_px: float
    range_px: tuple[float, float]
    at_infinity: float
    margins: tuple[int, int] | None = None
    viewpoints: Mapping[tuple[int, int], ViewOffset] = field(default_factory=dict)

    def __post_init__(self) -> None:
        low, high = self.range_px
        numbers = (self.focal_px, low, high, self.at_infinity)
        if not (np.isfinite(numbers).all() and self.focal_px > 0 and self.at_infinity < low <= high):
            values = f"focal length {self.focal_px:g}, disparities {low:g} to {high:g}"
            raise InputError(f"{values}: no cameras can be computed from these")

    def offset(self, row: int, column: int) -> ViewOffset:
        """Return the viewpoint of a view."""
        return self.viewpoints.get((row, column)) or self.grid.offset(row, column)

    @property
    def step(self) -> float:
        """Distance from view to view; the nearest point lies at distance 1."""
        return (self.range_px[1] - self.at_infinity) / self.focal_px

    @property
    def depth_range(self) -> tuple[float, float]:
        """Depths of the nearest point, 1, and of the farthest."""
        low, high = self.range_px
        return 1.0, (high - self.at_infinity) / (low - self.at_infinity)

    def place(self, offset: ViewOffset) -> tuple[float, float, float]:
        """Return the position (x, y, z) of a view's camera."""
        return self.step * offset.s, self.step * offset.t, 0.0

    def principal_point(self, offset: ViewOffset) -> tuple[float, float]:
        """Return (x, y) in pixels from the picture's upper left corner, not from the middle of its first pixel."""
        y, x = (half + shift - cut for half, shift, cut in zip(self._middle, self._shifts(offset), self._cuts(offset)))
        return x, y

    def window(self, offset: ViewOffset) -> tuple[slice, slice]:
        """Return the rows and columns of a whole view that are kept."""
        top, left = (margin + cut for margin, cut in zip(self.margins or (0, 0), self._cuts(offset)))
        return slice(top, top + self.size.height), slice(left, left + self.size.width)

    def centred(self, offsets: Iterable[ViewOffset]) -> FieldCameras:
        """Return the cameras with views cropped by whole pixels, so that principal points lie in the middle to half a
        pixel: 3D Gaussian splatting takes them to lie there. Unchanged if less than MIN_KEPT of a view would be left.
        """
        shifts = [self._shifts(offset) for offset in offsets]
        down, across = (max(abs(round(shift)) for shift in axis) for axis in zip(*shifts))
        size = ImageSize(self.size.height - 2 * down, self.size.width - 2 * across)
        if min(size) < 1 or math.prod(size) < MIN_KEPT * math.prod(self.size):
            return self
        return replace(self, size=size, margins=(down, across))

    def off_centre_px(self, offsets: Iterable[ViewOffset]) -> float:
        """Return the largest distance of a principal point from the middle, along x or y."""
        middle_y, middle_x = self._middle
        points = [self.principal_point(offset) for offset in offsets]
        return max(max(abs(x - middle_x), abs(y - middle_y)) for x, y in points)

    @property
    def _middle(self) -> tuple[float, float]:
        return self.size.height / 2, self.size.width / 2

    def _shifts(self, offset: ViewOffset) -> tuple[float, float]:
        """Return (y, x) of the principal point from the middle of a whole view."""
        return -self.at_infinity * offset.t, -self.at_infinity * offset.s

    def _cuts(self, offset: ViewOffset) -> tuple[int, int]:
        """Return by how many pixels (y, x) more is cut off at the upper left than the margins."""
        y, x = self._shifts(offset) if self.margins is not None else (0, 0)
        return round(y), round(x)

    def depth(self, disparity: FloatImage) -> FloatImage:
        """Return the depths of disparities, both of any shape; disparity is limited to range_px."""
        inside = np.clip(disparity, *self.range_px) - np.float32(self.at_infinity)
        return ((self.range_px[1] - self.at_infinity) / inside).astype(np.float32)

    def points(self, disparity: FloatImage, offset: ViewOffset) -> FloatImage:
        """Return the points (H, W, 3) that the pixels of a view show. disparity: (H, W), px per view step."""
        depth = self.depth(disparity)
        rows, columns = np.indices(disparity.shape, np.float32) + np.float32(0.5)
        centre_x, centre_y = self.principal_point(offset)
        x = (columns - np.float32(centre_x)) * depth / np.float32(self.focal_px)
        y = (rows - np.float32(centre_y)) * depth / np.float32(self.focal_px)
        return np.stack([x, y, depth], axis=-1) + np.array(self.place(offset), np.float32)


def infinity_of(low: float, high: float, inverse_metres: tuple[float, float] | None = None) -> float:
    """Return a disparity for infinitely far points of a scene with disparities from low to high.

    It is known if 1 / distance in metres is: inverse_metres[0] * disparity + inverse_metres[1]. Else it is 0 where that
    gives a ratio of depths up to MAX_DEPTH_RATIO, else so that they have this ratio.
    """
    if inverse_metres is not None and inverse_metres[0] != 0:
        known = -inverse_metres[1] / inverse_metres[0]
        if known < high:
            return known
    if low > 0 and high <= MAX_DEPTH_RATIO * low:
        return 0.0
    return low - (high - low) / (MAX_DEPTH_RATIO - 1) if high > low else low - 1.0


Views = Mapping[str, ViewOffset]
"""Viewpoint of each picture by the name of its file."""


def write_llff(folder: Path, cameras: FieldCameras, views: Views) -> None:
    """Write poses_bounds.npy (Mildenhall et al. 2019), y up and z backwards, one row a picture in the order of names.

    A row holds a 3x5 matrix (rotation with columns down, right, backwards; position; height, width and focal length),
    then the nearest and farthest depth. Raises InputError if principal points move: the file has no place for them.
    """
    if cameras.off_centre_px(views.values()) > MAX_OFF_CENTRE_PX:
        raise InputError(
            f"{folder.name}: points at rest in these views are not at infinity, which poses_bounds.npy cannot express;"
            " export cameras for nerfstudio or COLMAP"
        )
    axes = np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]], float)
    height, width = cameras.size
    near, far = cameras.depth_range
    bounds = near, max(far, MIN_BOUNDS_RATIO * near)
    rows = []
    for name in sorted(views):
        x, y, z = cameras.place(views[name])
        pose = np.column_stack([axes, (x, -y, -z), (height, width, cameras.focal_px)])
        rows.append([*pose.ravel(), *bounds])
    np.save(folder / "poses_bounds.npy", np.array(rows))


def write_nerfstudio(folder: Path, cameras: FieldCameras, views: Views) -> None:
    """Write transforms.json: camera to world by OpenGL's axes, y up and z backwards."""
    frames = []
    for name in sorted(views):
        x, y, z = cameras.place(views[name])
        matrix = [[1.0, 0.0, 0.0, x], [0.0, 1.0, 0.0, -y], [0.0, 0.0, 1.0, -z], [0.0, 0.0, 0.0, 1.0]]
        centre_x, centre_y = cameras.principal_point(views[name])
        frames.append({"file_path": f"images/{name}", "cx": centre_x, "cy": centre_y, "transform_matrix": matrix})
    height, width = cameras.size
    lens = {"camera_model": "OPENCV", "w": width, "h": height, "fl_x": cameras.focal_px, "fl_y": cameras.focal_px}
    (folder / "transforms.json").write_text(json.dumps({**lens, "frames": frames}, indent=1), encoding="utf-8")
