"""Types that modules exchange, and the conventions of all of them.

Light field     L[v, u, y, x, c]: v down, u right. The centre view is (V // 2, U // 2).
View offset     (t, s) = (v - v_centre, u - u_centre) in view steps: t down, s right; real-valued for virtual views.
Disparity d     pixels per view step, of the view it is given for. A point seen at (x, y) in the centre view is seen at
                (x - d * s, y - d * t) in view (t, s). Larger is closer; 0 is the plane that does not move.
Pixel centres   integers in arrays (the picture spans -0.5 .. width - 0.5); + 0.5 only in GL texture coordinates.
Rows            row 0 is the top everywhere on the CPU.
Colour          encoded by sRGB's curve, 1 = white, as photos are; HDR values exceed 1 on the same curve, continued.
                With the photo's own primaries (`ColorSpace`), so that no colour is clipped; sRGB unless stated.
                Sums of light are taken in linear light (`iibr_core.color`).
"""

from __future__ import annotations

from collections.abc import Callable, Collection
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatImage = NDArray[np.float32]
"""float32: (H, W) or (H, W, 3) where no other shape is given."""

StoredColors = NDArray[np.uint8] | NDArray[np.float16]
"""(H, W, 3), encoded by sRGB's curve: uint8 for ordinary photos (255 = white), float16 for HDR ones (1 = white)."""


TOTAL_PARALLAX = 0.04
"""Parallax of the nearest against the farthest across the grid, for viewing, as a share of the photo's width."""
MAX_DISPARITY_WIDTHS = 4.0
"""Largest known disparity, in photo widths per view step."""

LARGEST_LENGTH = 1e12
"""Largest coordinate of a camera, in any unit: products of larger ones lose all digits."""
MAX_FOCAL_WIDTHS = 100.0
"""Longest focal length, that of a telescope, in widths of the picture; the shortest is its inverse."""


class ViewOffset(NamedTuple):
    """Position of a view relative to the centre view, in view steps: t down, s right."""

    t: float
    s: float


CENTRE = ViewOffset(0.0, 0.0)

Wanted = Callable[[], Collection[ViewOffset] | None]
"""Function that returns the offsets of the views to make or read, None for all views of the grid."""


class ImageSize(NamedTuple):
    """Height and width of an image in pixels: the order of an array's shape, in every module."""

    height: int
    width: int

    def __str__(self) -> str:
        """Return width and height, such as "640x480"."""
        return f"{self.width}x{self.height}"


class Margins(NamedTuple):
    """Numbers of pixels beyond each side of an image."""

    top: int = 0
    bottom: int = 0
    left: int = 0
    right: int = 0

    def around(self, size: ImageSize) -> ImageSize:
        """Return the size of an image with its margins."""
        return ImageSize(size.height + self.top + self.bottom, size.width + self.left + self.right)


class GridShape(NamedTuple):
    """Numbers of view rows (V) and view columns (U)."""

    rows: int
    columns: int

    @property
    def centre(self) -> tuple[int, int]:
        """Index (v, u) of the centre view."""
        return self.rows // 2, self.columns // 2

    def offset(self, row: int, column: int) -> ViewOffset:
        """Return the offset of the view at index (row, column)."""
        v, u = self.centre
        return ViewOffset(float(row - v), float(column - u))

    def index_of(self, offset: ViewOffset) -> tuple[int, int]:
        """Return the index (row, column) of the view nearest to an offset."""
        v, u = self.centre
        return v + round(offset.t), u + round(offset.s)


def image_size(pixels: NDArray[Any]) -> ImageSize:
    """Return the size of an image (H, W, ...)."""
    return ImageSize(pixels.shape[0], pixels.shape[1])


@dataclass(frozen=True)
class ColorSpace:
    """Red, green and blue primaries of a picture; the curve is sRGB's in every space.

    xyz_from_linear: the rows of a matrix to XYZ under D50, the white of colour profiles (ICC.1:2022, annex E).
    """

    name: str
    xyz_from_linear: tuple[tuple[float, float, float], ...]


SRGB = ColorSpace(
    "sRGB",
    ((0.4360747, 0.3850649, 0.1430804), (0.2225045, 0.7168786, 0.0606169), (0.0139322, 0.0971045, 0.7141733)),
)
"""IEC 61966-2-1."""
DISPLAY_P3 = ColorSpace(
    "Display P3",
    ((0.5151187, 0.2919778, 0.1571035), (0.2411892, 0.6922441, 0.0665668), (-0.0010505, 0.0418791, 0.7840713)),
)
"""Colour space of current phones and screens: primaries of SMPTE EG 432-1 under D65."""


@dataclass(frozen=True, eq=False)
class Photo:
    """A photo.

    pixels: (H, W, 3) float32, encoded by sRGB's curve, of `color_space`, finite, >= 0; `is_hdr` photos exceed 1.
    focal_px: focal length in pixels of this size. notes: changes by reading it, one sentence each, for people.
    """

    pixels: FloatImage
    focal_px: float
    name: str
    is_hdr: bool = False
    notes: tuple[str, ...] = ()
    color_space: ColorSpace = SRGB

    @property
    def size(self) -> ImageSize:
        """Height and width of `pixels`."""
        return image_size(self.pixels)


@dataclass(frozen=True, eq=False)
class Disparity:
    """Disparity of a photo, at the photo's size.

    values: (H, W) float32, finite, pixels per view step. source: its origin, in words for people ("scene.pfm", "none").
    inverse_metres: (slope, offset) of 1 / distance in metres over the values, None if only their order is known.
    unknown: (H, W) bool, True where values were filled in; None: nowhere. is_enlarged: values come from a smaller
    map with soft edges.
    """

    values: FloatImage
    source: str
    notes: tuple[str, ...] = ()
    inverse_metres: tuple[float, float] | None = None
    unknown: NDArray[np.bool_] | None = None
    is_enlarged: bool = False


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole camera anywhere: x to the right, y down, z forward.

    world_from_camera: (3, 3) rotation; position: (3,) in the world's units. size: that of its pictures. focal_px,
    centre_px: focal lengths and principal point (x, y), the latter counted as pixel centres are. source: its origin,
    for people ("transforms.json, pose 3"). depth_range: least and greatest depth that it sees, None if unknown.
    Raises InputError for values that make no camera.
    """

    world_from_camera: NDArray[np.float64]
    position: NDArray[np.float64]
    size: ImageSize
    focal_px: tuple[float, float]
    centre_px: tuple[float, float]
    source: str
    depth_range: tuple[float, float] | None = None

    def __post_init__(self) -> None:
        rotation = self.world_from_camera
        near, far = self.depth_range or (1.0, 2.0)
        numbers = (*rotation.ravel(), *self.position, *self.focal_px, *self.centre_px, near, far)
        if not np.abs(numbers).max() < LARGEST_LENGTH:
            raise InputError(f"{self.source}: holds numbers that are NaN, infinite or too large; give finite ones")
        if not np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-3) or np.linalg.det(rotation) < 0:
            raise InputError(f"{self.source}: its axes are no rotation; get the whole file again")
        widths = tuple(focal / max(self.size) for focal in self.focal_px)
        if min(self.size) < 1 or not all(1 / MAX_FOCAL_WIDTHS <= width <= MAX_FOCAL_WIDTHS for width in widths):
            raise InputError(
                f"{self.source}: pictures of {self.size} with focal lengths of {self.focal_px[0]:g} and"
                f" {self.focal_px[1]:g} px; give the longer side times 1/{MAX_FOCAL_WIDTHS:g} to {MAX_FOCAL_WIDTHS:g}"
            )
        if not 0 < near < far:
            raise InputError(f"{self.source}: depths from {near:g} to {far:g} are not positive and ascending")

    @property
    def intrinsics(self) -> NDArray[np.float64]:
        """Matrix (3, 3) from directions (x / z, y / z, 1) in the camera's axes to pixels (x, y, 1)."""
        (focal_x, focal_y), (x, y) = self.focal_px, self.centre_px
        return np.array([[focal_x, 0.0, x], [0.0, focal_y, y], [0.0, 0.0, 1.0]])

    def resized(self, size: ImageSize) -> Camera:
        """Return the camera with larger or smaller pictures."""
        (height, width), (focal_x, focal_y), (x, y) = self.size, self.focal_px, self.centre_px
        wider, higher = size.width / width, size.height / height
        centre_px = (x + 0.5) * wider - 0.5, (y + 0.5) * higher - 0.5
        return replace(self, size=size, focal_px=(focal_x * wider, focal_y * higher), centre_px=centre_px)


@dataclass(frozen=True, eq=False)
class ViewUpdate:
    """One view of a light field.

    row, column: its index (v, u). colors: (H, W, 3), see StoredColors. disparity: (H, W) float32 of this view, None if
    a light field on disk has none. inpainted: (H, W) bool, True where the photo saw nothing, None if unknown. is_final:
    False for a view that will be replaced by a later one.
    """

    row: int
    column: int
    colors: StoredColors
    disparity: FloatImage | None
    inpainted: NDArray[np.bool_] | None = None
    is_final: bool = True


class InputError(ValueError):
    """Bad input from outside: a file, a value, an option. The message is one line that names it and the remedy."""
