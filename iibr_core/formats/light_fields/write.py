"""Write light fields: a folder laid out as in the HCI 4D Light Field Benchmark, or one lenslet image (ESLF)."""

import math
import re
from collections.abc import Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iibr_core.color import bytes_from_encoded, encoded_from_stored
from iibr_core.formats.cameras import infinity_of
from iibr_core.formats.files import COPY
from iibr_core.formats.images.write import write_image  # brings numba, which errors should not wait for
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.outputs import check_output, check_output_folder, write_folder
from iibr_core.runtime.tiling import side_by_side
from iibr_core.types import GridShape, ImageSize, InputError, ViewUpdate, image_size

PARAMETERS_NAME = "parameters.cfg"
WRITERS = ("hci", "eslf")
"""Layouts that can be written, by the names that people type."""
LENSLET_TAG = re.compile(rf"_eslf(?:[-_]\d{{1,6}})?{COPY}$", re.IGNORECASE)
"""End of the stem of a lenslet image's name; then the number of a copy."""
LENSLET_KEY = "iibr:Lenslet"
"""Key in the header of our lenslet images: columns and rows of the pixels under each lens."""

MIN_OFFSET_PX = 1e-4
"""Smallest disparity that infinitely far points lack to the focused ones: a focus at infinity cannot be stated."""
UNKNOWN_RANGE_PX = (-1.0, 1.0)
MIN_RANGE_PX = 0.01

HCI_FILES = r"input_Cam\d+\.(png|exr)|disp_Cam\d+\.pfm|gt_disp_lowres\.pfm|parameters\.cfg"
ESLF_ENDING = "_eslf.png"
SENSOR_SIZE_MM = 36.0
PARAMETERS = """[intrinsics]
focal_length_mm = {focal_mm}
image_resolution_x_px = {size.width}
image_resolution_y_px = {size.height}
sensor_size_mm = {sensor_mm}
fstop = 100.0

[extrinsics]
num_cams_x = {grid.columns}
num_cams_y = {grid.rows}
baseline_mm = {baseline_mm}
focus_distance_m = {focus_m}
center_cam_x_m = 0.0
center_cam_y_m = 0.0
center_cam_z_m = 0.0
center_cam_rx_rad = 0.0
center_cam_ry_rad = 0.0
center_cam_rz_rad = 0.0
offset = 0

[meta]
scene = {name}
category = iibr
disp_min = {low}
disp_max = {high}
depth_map_scale = 1.0
"""


def note_on_rows(row_step: float) -> str | None:
    """Return a sentence that no layout states unequal steps; None if rows stand as far apart as columns."""
    words = "Rows stand {:.2g} times as far apart as columns; the written layout cannot state that."
    return None if row_step == 1 else words.format(row_step)


class FieldScale(NamedTuple):
    """Geometry that HCI's parameters state.

    infinity_px: disparity of infinitely far points; range_px: least and greatest disparity, for views without it; both
    in px per view step, None where unknown. baseline_mm: length of a view step; any, where metres are unknown.
    """

    infinity_px: float | None = None
    range_px: tuple[float, float] | None = None
    baseline_mm: float = 1.0


UNKNOWN_SCALE = FieldScale()


def check_light_field(path: Path, layout: str, inputs: Iterable[Path] = (), force: bool = False) -> None:
    """Raise InputError if a light field of this layout cannot be written to `path`.

    inputs: files and folders that are read. force: whether an existing output may be replaced. A folder that holds
    anything but a light field is never replaced.
    """
    if layout not in WRITERS:
        raise InputError(f"{layout!r} is not a layout that can be written: give {' or '.join(WRITERS)}")
    if layout == "hci":
        check_output_folder(path, inputs, force, HCI_FILES)
        return
    if not path.name.lower().endswith(ESLF_ENDING):
        raise InputError(f"{path}: a light field in one file must end in {ESLF_ENDING}")
    check_output(path, inputs, force)


def write_light_field(
    path: Path,
    layout: str,
    grid: GridShape,
    views: Iterable[ViewUpdate],
    focal_px: float,
    name: str,
    with_disparity: bool = False,
    scale: FieldScale = UNKNOWN_SCALE,
) -> None:
    """Write a light field, whole or not at all, to a path that `check_light_field` admits; an older one is replaced.

    layout: one of WRITERS. views: each view of the grid in any order, all of one size. focal_px: focal length in pixels
    of a view. with_disparity: whether HCI folders hold the disparity of every view, not of the centre view only. scale:
    geometry for HCI folders.
    """
    views = _require_all(path, grid, views)
    if layout == "eslf":
        _write_eslf(path, grid, views)
    else:
        _write_hci(path, grid, views, focal_px, name, with_disparity, scale)


def _require_all(path: Path, grid: GridShape, views: Iterable[ViewUpdate]) -> Iterator[ViewUpdate]:
    """Yield the views. Raises InputError at the end if some are missing."""
    places = set()
    for view in views:
        places.add((view.row, view.column))
        yield view
    if len(places) < grid.rows * grid.columns:
        raise InputError(
            f"{path}: only {len(places)} of {grid.rows * grid.columns} views were made; nothing was written"
        )


def _write_hci(
    folder: Path,
    grid: GridShape,
    views: Iterable[ViewUpdate],
    focal_px: float,
    name: str,
    with_disparity: bool,
    scale: FieldScale,
) -> None:
    size, low, high = ImageSize(1, 1), math.inf, -math.inf
    with write_folder(folder) as unfinished:
        for view in side_by_side(partial(_write_view, unfinished, grid, with_disparity), views):
            size = image_size(view.colors)
            if view.disparity is not None:
                low, high = min(low, float(view.disparity.min())), max(high, float(view.disparity.max()))
        scale = scale._replace(range_px=(low, high)) if low <= high else scale
        parameters = _parameters(name, grid, size, focal_px, scale)
        (unfinished / PARAMETERS_NAME).write_text(parameters, encoding="utf-8")


def _write_view(folder: Path, grid: GridShape, with_disparity: bool, view: ViewUpdate) -> ViewUpdate:
    number = view.row * grid.columns + view.column
    write_image(folder / f"input_Cam{number:03d}{'.png' if view.colors.dtype == np.uint8 else '.exr'}", view.colors)
    if view.disparity is not None and with_disparity:
        write_pfm(folder / f"disp_Cam{number:03d}.pfm", view.disparity)
    if view.disparity is not None and (view.row, view.column) == grid.centre:
        write_pfm(folder / "gt_disp_lowres.pfm", view.disparity)
    return view


def _parameters(name: str, grid: GridShape, size: ImageSize, focal_px: float, scale: FieldScale) -> str:
    """Return the text of the benchmark's parameters.cfg.

    Its tools compute disparity as focal length in px * baseline * (1 / depth - 1 / focus distance): points at the focus
    distance do not move, infinitely far ones move by infinity_px.
    """
    low, high = scale.range_px or UNKNOWN_RANGE_PX
    if high - low < MIN_RANGE_PX:
        low, high = low - MIN_RANGE_PX / 2, high + MIN_RANGE_PX / 2
    known = scale.infinity_px
    infinity_px = known if known is not None and known < high else infinity_of(low, high)
    return PARAMETERS.format(
        focal_mm=focal_px * SENSOR_SIZE_MM / max(size),
        sensor_mm=SENSOR_SIZE_MM,
        baseline_mm=scale.baseline_mm,
        focus_m=focal_px * scale.baseline_mm / max(-infinity_px, MIN_OFFSET_PX) / 1000,
        size=size,
        grid=grid,
        name=" ".join(name.split()),
        low=low,
        high=high,
    )


def _write_eslf(path: Path, grid: GridShape, views: Iterable[ViewUpdate]) -> None:
    """Write a lenslet image: the pixels that show one place of the scene, one of each view, form a rectangle."""
    pixels = np.empty((0, grid.rows, 0, grid.columns, 3), np.uint8)
    for view in views:
        colors = view.colors if view.colors.dtype == np.uint8 else bytes_from_encoded(encoded_from_stored(view.colors))
        if not pixels.size:
            height, width = image_size(colors)
            pixels = np.empty((height, grid.rows, width, grid.columns, 3), np.uint8)
        pixels[:, view.row, :, view.column] = colors
    height, rows, width, columns, _ = pixels.shape
    write_image(path, pixels.reshape(height * rows, width * columns, 3), {LENSLET_KEY: f"{columns}x{rows}"})
