"""A light field in memory: its views, views between them, pictures through a lens, and writing it."""

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.aperture_sampling import aperture_points, views_in_aperture
from iibr_core.beyond.lens import LensSum
from iibr_core.beyond.optics import CENTRE, ApertureShape, Optics
from iibr_core.color import encoded_from_stored, srgb_from_linear
from iibr_core.formats.light_fields.write import WRITERS, check_light_field, write_light_field
from iibr_core.types import FloatImage, GridShape, InputError, StoredColors, ViewOffset, ViewUpdate, image_size

CAMERAS_PER_PX = 4.0
"""Views that `LightField.refocus` makes for each pixel of its widest blur."""
MIN_CAMERAS, MAX_CAMERAS = 16, 256
"""Least and greatest number of these views."""

FORMATS = WRITERS
"""Formats of `LightField.save`."""

View = ViewUpdate
"""One view of a light field: row, column, colors (H, W, 3), disparity (H, W) and inpainted (H, W)."""

MakeView = Callable[[ViewOffset], FloatImage]


@dataclass(frozen=True, eq=False)
class LightField:
    """A light field in memory.

    views: (V, U, H, W, 3), uint8 (255 = white), float16 for HDR photos (1 = white). disparity: (V, U, H, W) float32, px
    from view to view, None if no view has any. inpainted: (V, U, H, W) bool, True where the photo saw nothing; None if
    it is unknown. focal_px: focal length in px of a view. row_step: distance between rows, in distances between
    columns: from row to row, points move by so many times their disparity.
    """

    views: StoredColors
    disparity: FloatImage | None
    inpainted: NDArray[np.bool_] | None
    focal_px: float
    name: str = "field"
    row_step: float = 1.0
    _view_between: MakeView | None = field(default=None, repr=False)

    @property
    def grid(self) -> GridShape:
        """Rows and columns of views."""
        return GridShape(*self.views.shape[:2])

    def view(self, s: float, t: float) -> FloatImage:
        """Return the view s steps to the right of the middle one and t steps below it, (H, W, 3) float32, 1 = white.

        A photo's light field makes views between the stored ones. Raises InputError outside the grid, and between the
        views of a light field from disk.
        """
        (v, u), (rows, columns) = self.grid.centre, self.grid
        row, column = v + t, u + s
        if not (0 <= row <= rows - 1 and 0 <= column <= columns - 1):
            limits = f"s from {-u} to {columns - 1 - u}, t from {-v} to {rows - 1 - v}"
            raise InputError(f"view {s:g},{t:g}: lies outside the field; give {limits}")
        if row == round(row) and column == round(column):
            return encoded_from_stored(self.views[round(row), round(column)])
        if self._view_between is None:
            raise InputError(f"view {s:g},{t:g}: lies between stored views; open the field and ask for a denser grid")
        return self._view_between(ViewOffset(t, s))

    def refocus(self, disparity: float, aperture: float) -> FloatImage:
        """Return a picture through a round lens in the middle of the field, (H, W, 3) float32, 1 = white.

        It is the mean, in linear light, of the views inside the lens, moved so that points of this disparity (px from
        view to view) are sharp. aperture: diameter in view steps; 0 is the middle view. A photo's light field makes up
        to 256 views for it; a light field from disk uses its stored ones. Raises InputError for a negative aperture and
        numbers that are not finite.
        """
        if not (math.isfinite(disparity) and math.isfinite(aperture) and aperture >= 0):
            raise InputError(
                f"refocus at {disparity:g} with aperture {aperture:g}: give finite numbers, no aperture < 0"
            )
        if aperture == 0:
            return self.view(0, 0)
        picture = LensSum(Optics(focus_disparity=disparity), image_size(self.views[0, 0]))
        for offset, weight, colors in self._views_through(disparity, aperture):
            picture.add(offset, colors, weight)
        return srgb_from_linear(picture.light())

    def _views_through(self, focus: float, aperture: float) -> Iterator[tuple[ViewOffset, float, FloatImage]]:
        """Yield offset, weight and colours of the views that a lens adds up."""
        widest = float(max(self.grid))
        if self._view_between is None:
            weights = views_in_aperture(ApertureShape(), aperture, CENTRE, self.grid)
            for row, column in np.argwhere(weights > 0):
                colors = encoded_from_stored(self.views[row, column])
                t, s = self.grid.offset(row, column)
                yield ViewOffset(self.row_step * t, s), float(weights[row, column]), colors
            return
        count = self._camera_count(focus, min(aperture, widest))
        for t, s in aperture_points(ApertureShape(), aperture, widest, count).tolist():
            yield ViewOffset(t, s), 1.0, self._view_between(ViewOffset(t, s))

    def _camera_count(self, focus: float, aperture: float) -> int:
        """Return the number of views that turn the edge blurred most into a smooth ramp."""
        if self.disparity is None:
            return MAX_CAMERAS
        blur_px = aperture * float(np.abs(self.disparity[self.grid.centre] - focus).max())
        return math.ceil(min(max(CAMERAS_PER_PX * blur_px, MIN_CAMERAS), MAX_CAMERAS))

    def save(self, path: str | Path, format: str = "hci", may_replace: bool = False) -> None:
        """Write the field as a folder or one file, in one of FORMATS.

        Raises InputError if that is not possible, or if something is there that may not be replaced.
        """
        check_light_field(Path(path), format, (), may_replace)
        disparity = self.disparity
        views = (
            ViewUpdate(row, column, self.views[row, column], None if disparity is None else disparity[row, column])
            for row, column in np.ndindex(*self.grid)
        )
        write_light_field(Path(path), format, self.grid, views, self.focal_px, self.name, disparity is not None)


def gather(
    views: Iterator[View],
    grid: GridShape,
    focal_px: float,
    name: str,
    row_step: float,
    view_between: MakeView | None,
) -> LightField:
    """Return the light field of all views."""
    first = next(views)
    parts = (first.colors, first.disparity, first.inpainted)
    arrays = [None if part is None else np.empty((*grid, *part.shape), part.dtype) for part in parts]
    for view in (first, *views):
        for array, values in zip(arrays, (view.colors, view.disparity, view.inpainted)):
            if array is not None:
                array[view.row, view.column] = values
    colors, disparity, inpainted = arrays
    assert colors is not None
    return LightField(colors, disparity, inpainted, focal_px, name, row_step, view_between)
