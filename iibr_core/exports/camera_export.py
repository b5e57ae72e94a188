"""Views with their cameras, for programs that reconstruct scenes: LLFF, nerfstudio, COLMAP."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from iibr_core.color import bytes_from_encoded, encoded_from_stored
from iibr_core.exports.settings import ExportSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.cameras import (
    FieldCameras,
    Views,
    infinity_of,
    spread,
    write_colmap,
    write_llff,
    write_nerfstudio,
)
from iibr_core.formats.outputs import write_folder
from iibr_core.types import ImageSize, InputError, ViewOffset, ViewUpdate

MOST_POINTS = 20_000
"""For COLMAP: as many as a reconstruction finds."""
MAX_DEPTH_RATIO = 1000.0
"""Ratio of the farthest distance to the nearest one: what is farther, as the sky is, is put there."""


def cameras_of(source: ExportSource) -> FieldCameras:
    """The cameras of the scene's views as they are. Raises InputError where nothing tells depth."""
    scene = source.scene
    size = ImageSize(scene.height, scene.width)
    if source.loaded is None:
        low, high = scene.disparity_range_px
        if scene.depth_source == "none":
            raise InputError(f"{scene.name}: no depth is known; open a photo with a disparity map")
        return FieldCameras(scene.grid, size, scene.focal_px or float(scene.width), (low, high), infinity_of(low, high))
    plan = source.plan()
    at_infinity = (_given_infinity(source) - plan.disparity_zero) * plan.disparity_scale
    low, high = plan.disparity_range_px
    low = max(low, at_infinity + (high - at_infinity) / MAX_DEPTH_RATIO)
    return FieldCameras(scene.grid, size, source.loaded.photo.focal_px, (low, high), at_infinity)


def _given_infinity(source: ExportSource) -> float:
    """The disparity, as given, of what is infinitely far from the photo: known where distances are known in metres.

    Raises InputError where all is flat.
    """
    plan = source.plan()
    if plan.disparity_scale <= 0:
        raise InputError(f"{source.scene.name}: is flat or inverted; give it depth")
    known = source.scene.inverse_metres
    low, high = (value / plan.disparity_scale + plan.disparity_zero for value in plan.disparity_range_px)
    if known is not None and -known[1] / known[0] < high:
        return -known[1] / known[0]
    return infinity_of(low, high)


def nearest_metres(source: ExportSource) -> float | None:
    """The distance of what is nearest in the scene, in metres; None where distances in metres are not known."""
    known, plan = source.scene.inverse_metres, source.scene.plan
    if known is None or plan is None or plan.disparity_scale <= 0:
        return None
    inverse = known[0] * (plan.disparity_range_px[1] / plan.disparity_scale + plan.disparity_zero) + known[1]
    return 1 / inverse if inverse > 0 else None


def _straight_cameras(source: ExportSource) -> tuple[FieldCameras, float | None]:
    """Cameras that look straight ahead, which is all that some programs know, and the disparity (as given) that stays
    still in their views, see `ExportSource.views`. A light field from disk is as it is: None.
    """
    cameras = cameras_of(source)
    if source.loaded is None:
        return cameras, None
    low, high = (value - cameras.at_infinity for value in cameras.range_px)
    return replace(cameras, range_px=(low, high), at_infinity=0.0), _given_infinity(source)


def write_llff_folder(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """Images and poses_bounds.npy; the others likewise: raises InputError where it cannot be written, Cancelled once
    the export should stop.
    """
    _write(path, source, lambda folder, cameras, views, centre: write_llff(folder, cameras, views))


def write_nerfstudio_folder(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """Images and transforms.json."""
    _write(path, source, lambda folder, cameras, views, centre: write_nerfstudio(folder, cameras, views))


def write_colmap_folder(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """Images and sparse/0, with points of the centre view."""

    def write(folder: Path, cameras: FieldCameras, views: Views, centre: ViewUpdate) -> None:
        disparity = centre.disparity if centre.disparity is not None else np.empty((0, 0), np.float32)
        points = cameras.points(disparity, ViewOffset(0.0, 0.0)).reshape(-1, 3)
        chosen = spread(len(points), MOST_POINTS)
        write_colmap(folder, cameras, views, points[chosen], colors_of(centre).reshape(-1, 3)[chosen])

    _write(path, source, write)


def colors_of(view: ViewUpdate) -> np.ndarray:
    """(H, W, 3) uint8, sRGB-encoded."""
    return view.colors if view.colors.dtype == np.uint8 else bytes_from_encoded(encoded_from_stored(view.colors))


def _write(path: Path, source: ExportSource, write: Callable[[Path, FieldCameras, Views, ViewUpdate], None]) -> None:
    """All views as images/v00_u00.png ..., then what `write` adds: (folder, cameras, views, centre view)."""
    from iibr_core.formats.images.photo import write_image

    cameras, zero = _straight_cameras(source)
    places: dict[str, ViewOffset] = {}
    centre: ViewUpdate | None = None
    with write_folder(path) as unfinished:
        images = unfinished / "images"
        images.mkdir()
        for view in source.views(zero):
            name = f"v{view.row:02d}_u{view.column:02d}.png"
            write_image(images / name, colors_of(view))
            places[name] = cameras.grid.offset(view.row, view.column)
            centre = view if centre is None else centre
        assert centre is not None
        write(unfinished, cameras, places, centre)
