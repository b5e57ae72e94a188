"""All views: as a light field, as NumPy arrays, or with their cameras for programs that reconstruct scenes."""

import math
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import bytes_from_encoded, encoded_from_stored
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.source import ExportSource
from iibr_core.formats.cameras import MAX_OFF_CENTRE_PX, FieldCameras, infinity_of, write_llff, write_nerfstudio
from iibr_core.formats.colmap import write_colmap
from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields import write
from iibr_core.formats.light_fields.multi_view_scene import GridIndex
from iibr_core.formats.light_fields.views import offsets_by_place
from iibr_core.formats.outputs import write_file, write_folder
from iibr_core.method.memory import require_memory
from iibr_core.scenes.light_fields import find_range, open_field
from iibr_core.types import CENTRE, ImageSize, InputError, ViewOffset, ViewUpdate

MAX_POINTS = 20_000
"""Largest number of points for COLMAP, about as many as a reconstruction finds."""
SHIFTED = (
    "Principal points lie up to {:.0f} px off the middle, as the files state; 3D Gaussian splatting ignores that, and"
    " cropping the views would take two fifths of them."
)
MAX_DEPTH_RATIO = 1000.0
"""Ratio of the farthest distance to the nearest one; anything farther, such as the sky, is put there."""


def cameras_of(source: ExportSource) -> FieldCameras:
    """Return the cameras of the scene's views."""
    scene = source.scene
    if source.loaded is None:
        if scene.depth_source == "none":
            raise InputError(f"{scene.name}: no depth is known; open a photo with a disparity map")
        (low, high), known = scene.disparity_range_px, scene.infinity_px
        focal_px = scene.focal_px or float(scene.width)
        if known is None or not -scene.width < known < high:
            known = infinity_of(low, high)
        at_infinity = float(math.floor(known))  # views are then cropped without resampling
    else:
        plan, focal_px = source.plan(), source.loaded.photo.focal_px
        at_infinity = (_given_infinity(source) - plan.disparity_zero) * plan.disparity_scale
        low, high = plan.disparity_range_px
    low = max(low, at_infinity + (high - at_infinity) / MAX_DEPTH_RATIO)
    size, viewpoints = ImageSize(scene.height, scene.width), {} if source.loaded else _viewpoints(source)
    return FieldCameras(scene.grid, size, focal_px, (low, high), at_infinity, viewpoints=viewpoints)


def _viewpoints(source: ExportSource) -> dict[GridIndex, ViewOffset]:
    """Return the viewpoints of a light field from disk in steps of its grid, from the centre view's."""
    return offsets_by_place(open_field(source.field_source))


def _given_infinity(source: ExportSource) -> float:
    """Return the disparity (as given) of a point at infinity, which is known if distances are known in metres."""
    plan = source.plan()
    if plan.disparity_scale <= 0:
        raise InputError(f"{source.scene.name}: its depth is flat or inverted; open it with a depth map")
    low, high = (value / plan.disparity_scale + plan.disparity_zero for value in plan.disparity_range_px)
    return infinity_of(low, high, source.scene.inverse_metres)


def nearest_metres(source: ExportSource) -> float | None:
    """Return the distance of the scene's nearest point in metres, None if metres are not known."""
    known, plan = source.scene.inverse_metres, source.scene.plan
    if known is None or plan is None or plan.disparity_scale <= 0:
        return None
    inverse = known[0] * (plan.disparity_range_px[1] / plan.disparity_scale + plan.disparity_zero) + known[1]
    return 1 / inverse if inverse > 0 else None


def _straight_cameras(source: ExportSource) -> tuple[FieldCameras, float | None]:
    """Return cameras that look straight ahead, as LLFF requires, and the disparity (as given) that does not move in
    their views, see `ExportSource.views`; the cameras of a light field from disk and None.
    """
    cameras = cameras_of(source)
    if source.loaded is None:
        return cameras, None
    low, high = (value - cameras.at_infinity for value in cameras.range_px)
    return replace(cameras, range_px=(low, high), at_infinity=0.0), _given_infinity(source)


def write_cameras(path: Path, source: ExportSource, options: ExportOptions, variant: str) -> str | None:
    """Write all views as images/v00_u00.png ... and their cameras as "llff", "nerfstudio" or "colmap".

    Return a sentence about views that are cropped, or whose principal points move.
    """
    whole, static_disparity = _straight_cameras(source)
    offsets = [whole.offset(row, column) for row, column in np.ndindex(*whole.grid)]
    cameras = whole.centred(offsets)
    places: dict[str, ViewOffset] = {}
    centre: ViewUpdate | None = None
    with write_folder(path) as folder:
        (folder / "images").mkdir()
        for view in source.views(static_disparity):
            name, offset = f"v{view.row:02d}_u{view.column:02d}.png", cameras.offset(view.row, view.column)
            write_image(folder / "images" / name, np.ascontiguousarray(colors_of(view)[cameras.window(offset)]))
            places[name] = offset
            centre = view if centre is None else centre
        assert centre is not None
        if variant == "colmap":
            write_colmap(folder, cameras, places, *_points_of(centre, cameras))
        else:
            (write_llff if variant == "llff" else write_nerfstudio)(folder, cameras, places)
    moved_px = cameras.off_centre_px(offsets)
    if cameras.size != whole.size:
        error = f" to {moved_px:.1f} px" if moved_px > 0.05 else ""
        return f"The views are cropped from {whole.size} to {cameras.size}: principal points lie in the middle{error}."
    return SHIFTED.format(moved_px) if moved_px > MAX_OFF_CENTRE_PX else None


def write_light_field(path: Path, source: ExportSource, options: ExportOptions, variant: str) -> str | None:
    """Write all views, with the disparity of every view if the layout has a place for it; return a note on its rows."""
    scene = source.scene
    focal_px = source.focal_px or float(scene.width)
    scale = _scale_of(source, focal_px) if variant == "hci" else write.UNKNOWN_SCALE
    with closing(source.views()) as views:
        write.write_light_field(path, variant, scene.grid, views, focal_px, scene.name, True, scale)
    return write.note_on_rows(scene.row_step)


def write_arrays(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Write all views, their known disparity and their places as arrays of an NPZ file.

    views: (rows, columns, H, W, 3), bytes, sRGB-encoded. disparity: (rows, columns, H, W), float32, in pixels per view
    step, larger is nearer, NaN where it is not known. offsets: (rows, columns, 2), steps down and right of the centre.
    """
    scene, grid = source.scene, source.scene.grid
    shape = (*grid, scene.height, scene.width)
    require_memory(7 * math.prod(shape), f"{grid.columns} x {grid.rows} views of {scene.name} as arrays")
    views, disparity = np.zeros((*shape, 3), np.uint8), np.full(shape, np.nan, np.float32)
    with closing(source.views(with_disparity=True)) as made:
        for view in made:
            views[view.row, view.column] = colors_of(view)
            if view.disparity is not None:
                disparity[view.row, view.column] = view.disparity
    offsets = np.array([grid.offset(*place) for place in np.ndindex(*grid)], np.float32).reshape(*grid, 2)
    with write_file(path) as temporary, temporary.open("wb") as file:
        np.savez(file, views=views, disparity=disparity, offsets=offsets)


def _scale_of(source: ExportSource, focal_px: float) -> write.FieldScale:
    """Return infinity, range and, where metres are known, the baseline of a scene's views."""
    scene, metres = source.scene, nearest_metres(source)
    if scene.depth_source == "none":
        return write.FieldScale(scene.infinity_px, find_range(source.field_source))
    scale = write.FieldScale(scene.infinity_px, scene.disparity_range_px)
    if metres is None or scene.infinity_px is None:
        return scale
    return scale._replace(baseline_mm=1000 * metres * (scene.disparity_range_px[1] - scene.infinity_px) / focal_px)


def _points_of(centre: ViewUpdate, cameras: FieldCameras) -> tuple[NDArray[np.float32], NDArray[np.uint8]]:
    """Return places and colours (N, 3) of at most MAX_POINTS pixels of the centre view."""
    disparity = centre.disparity if centre.disparity is not None else np.empty((0, 0), np.float32)
    window = cameras.window(CENTRE)
    points = cameras.points(disparity[window], CENTRE).reshape(-1, 3)
    chosen = np.linspace(0, len(points) - 1, min(len(points), MAX_POINTS)).astype(int)
    return points[chosen], colors_of(centre)[window].reshape(-1, 3)[chosen]


def colors_of(view: ViewUpdate) -> NDArray[np.uint8]:
    """Return the colours of a view, (H, W, 3), sRGB-encoded."""
    if view.colors.dtype == np.uint8:
        return view.colors.view(np.uint8)
    return bytes_from_encoded(encoded_from_stored(view.colors))
