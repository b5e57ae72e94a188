"""A light field in memory: its views, views between them, pictures through a lens, and writing it."""

import math
import warnings
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.aperture_mask import read_mask
from iibr_core.beyond.aperture_sampling import aperture_points, views_in_aperture
from iibr_core.beyond.lens import LensSum
from iibr_core.beyond.optics import Optics
from iibr_core.color import encoded_from_stored, srgb_from_linear
from iibr_core.formats.light_fields.write import WRITERS, check_light_field, write_light_field
from iibr_core.method.view import View as MadeView
from iibr_core.runtime.work import (
    ReportProgress,
    ShouldStop,
    ignore_progress,
    never,
    raise_if_stopped,
    stoppable,
    watched,
)
from iibr_core.runtime.work import report_progress as report
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import CENTRE, FloatImage, GridShape, InputError, StoredColors, ViewOffset, ViewUpdate, image_size

CAMERAS_PER_PX = 4.0
"""Views that `LightField.refocus` makes for each pixel of its widest blur."""
MIN_CAMERAS, MAX_CAMERAS = 16, 256
"""Least and greatest number of these views, unless a number is asked for."""

FORMATS = WRITERS
"""Formats of `LightField.save`."""

View = ViewUpdate
"""One view of a light field: row, column, colors (H, W, 3), disparity (H, W) and inpainted (H, W)."""

MakeView = Callable[[ViewOffset], FloatImage]


class LensOptions(TypedDict, total=False):
    """Options of `LightField.refocus`, by the words of the command line.

    at: place (x, y) in focus, in pixels of the photo. focus_range: disparity before and behind the focus that is sharp,
    too. tilt: change of the focus to the right and to the lower border. f_number: of a full-frame lens, as the window
    shows it. blades, ring, cat_eye, mask: shape of the aperture, one of them: corners of a polygon, blocked share of
    a ring's radius, share that the barrel cuts off in the corners, or a file with a grey picture. roundness: of the
    sides between blades, 0..1. rotation: of blades or mask, clockwise in degrees. highlights: stops by which clipped
    light counts for more than white, 0..4.
    """

    at: tuple[float, float]
    focus_range: float
    tilt: tuple[float, float]
    f_number: float
    blades: int
    roundness: float
    rotation: float
    ring: float
    cat_eye: float
    mask: str | Path
    highlights: float


@dataclass(frozen=True, eq=False)
class LensViews:
    """Source of the views that a lens adds up, and the scene that its f-numbers follow from.

    maker_of: function (optics, reach) that returns a maker of views up to `reach` view steps from the middle, in which
    points in focus do not move and highlights are recovered.
    """

    scene: Scene
    maker_of: Callable[[Optics, float], Callable[[ViewOffset], MadeView]]


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
    _lens: LensViews | None = field(default=None, repr=False)

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

    def refocus(
        self,
        focus: float | None = None,
        aperture: float | None = None,
        cameras: int | None = None,
        should_stop: ShouldStop = never,
        report_progress: ReportProgress = ignore_progress,
        **options: Unpack[LensOptions],
    ) -> FloatImage:
        """Return a picture through a lens in the middle of the field, (H, W, 3) float32, 1 = white.

        It is the mean, in linear light, of what pinhole cameras inside the lens see, moved so that points in focus do
        not move. focus: disparity that is sharp, px from view to view. aperture: diameter in view steps; 0 is the
        middle view. A focus without an aperture opens the lens a little. options: see `LensOptions`. cameras: number of
        views of a photo that are made for it, None for 16 to 256; more are smoother. A light field from disk uses its
        stored views. Raises InputError for numbers that are out of range, at odds, or beyond the stored views,
        Cancelled once should_stop is true; a choice that changes nothing is a warning.
        """
        optics = self._optics(focus, aperture, options)
        if optics.aperture_diameter == 0:
            return self.view(0, 0)
        with stoppable(should_stop), watched(report_progress):
            light = self._light_through(optics, cameras)
            raise_if_stopped()
        return srgb_from_linear(light)

    def _optics(self, focus: float | None, aperture: float | None, options: LensOptions) -> Optics:
        """Return the lens of these choices, not clamped. Raises InputError."""
        chosen: dict[str, Any] = dict(options)
        chosen["focus_at"] = chosen.pop("at", None)
        if "mask" in chosen:
            chosen["mask"] = read_mask(Path(chosen["mask"]))
        choice = LensChoice(focus=focus, aperture=aperture, **chosen)
        scene = self._scene
        optics = choice.wanted_on(scene, self._centre_disparity)
        for note in choice.notes(optics, scene):
            warnings.warn(note, stacklevel=3)
        return optics

    @property
    def _scene(self) -> Scene:
        """The scene of the photo, or that of these views."""
        if self._lens is not None:
            return self._lens.scene
        (height, width), disparity = image_size(self.views[0, 0]), self._centre_disparity
        range_px = (0.0, 0.0) if disparity is None else (float(disparity.min()), float(disparity.max()))
        return Scene(
            Source(""), self.name, width, height, self.grid, range_px, "", self.views.dtype == np.float16,
            has_view_disparity=disparity is not None,
        )  # fmt: skip

    @property
    def _centre_disparity(self) -> FloatImage | None:
        return None if self.disparity is None else self.disparity[self.grid.centre]

    def _light_through(self, optics: Optics, cameras: int | None) -> FloatImage:
        """Return the picture, linear light (H, W, 3)."""
        size, is_hdr = image_size(self.views[0, 0]), self.views.dtype == np.float16
        if self._lens is None:
            return self._light_of_stored(optics, LensSum(optics, size, is_hdr))
        picture = LensSum(replace(optics, focus_disparity=0.0, highlight_recovery=0.0), size, is_hdr)
        count = self._camera_count(optics) if cameras is None else cameras
        points = aperture_points(optics.aperture_shape, optics.aperture_diameter, math.inf, count)
        view_at = self._lens.maker_of(optics, float(np.abs(points).max()))
        for done, (t, s) in enumerate(points.tolist()):
            raise_if_stopped()
            report(done, len(points), "refocusing")
            view = view_at(ViewOffset(t, s))
            picture.add(ViewOffset(t, s), view.colors, disparity=view.disparity if optics.focus_range else None)
        return picture.light()

    def _light_of_stored(self, optics: Optics, picture: LensSum) -> FloatImage:
        """Return the light of the stored views inside the lens. Raises InputError for a lens wider than the grid."""
        diameter, widest = optics.aperture_diameter, float(max(self.grid))
        if diameter > widest:
            raise InputError(f"an aperture of {diameter:.3g} view steps: the views reach {widest:g}; give no more")
        weights = views_in_aperture(optics.aperture_shape, diameter, CENTRE, self.grid)
        for row, column in np.argwhere(weights > 0):
            (t, s), disparity = self.grid.offset(row, column), self.disparity
            picture.add(
                ViewOffset(self.row_step * t, s),
                encoded_from_stored(self.views[row, column]),
                float(weights[row, column]),
                disparity[row, column] if optics.focus_range and disparity is not None else None,
            )
        return picture.light()

    def _camera_count(self, optics: Optics) -> int:
        """Return the number of views that turn the edge blurred most into a smooth ramp."""
        disparity = self._centre_disparity
        if disparity is None:
            return MAX_CAMERAS
        beside = float(np.abs(disparity - optics.focus_disparity).max()) + sum(map(abs, optics.focus_tilt))
        return math.ceil(min(max(CAMERAS_PER_PX * optics.aperture_diameter * beside, MIN_CAMERAS), MAX_CAMERAS))

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
    return LightField(colors, disparity, inpainted, focal_px, name, row_step)
