"""Folders of pictures whose cameras are known: NeRF's LLFF scenes, nerfstudio's transforms.json, COLMAP's models.

Cameras that look the same way from a regular grid make a light field. LLFF's are mostly held by hand near a plane: only
an evaluation reads those. LLFF's pictures are in the order of their poses, other files name them.
"""

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import printable, stays_within
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.picture_source import PictureSource
from iibr_core.formats.light_fields.multi_view_scene import (
    GridIndex,
    KnownView,
    MultiView,
    line_numbers,
    pictures_in,
    place_on_grid,
    slope,
    turned_upright,
)
from iibr_core.formats.poses import central_camera, poses_in, read_llff_poses, read_named_poses
from iibr_core.types import Camera, InputError, ViewOffset

LLFF_FOLDERS = ("images_8", "images_4", "images", "images_2")
"""Folders of pictures in the order of preference: papers evaluate on small copies."""
MAX_STRAY = 0.03
"""Largest distance of a camera from its place on a grid, in steps of its rows and columns."""
MIN_STEP_RATIO = 0.05
"""Smallest step between rows as a share of the one between columns, and the other way round."""
MAX_ERROR_PX = 0.5
"""Largest error in pixels of directions of view, focal lengths and principal points on a grid."""

Positions = NDArray[np.float64]
"""Positions of cameras (N, 3) by the axes of the central one: right, down, forward."""


def read_llff(folder: Path) -> MultiView | None:
    """Return the views of an LLFF scene, None without poses_bounds.npy.

    Viewpoints are positions across the viewing direction of the central camera, in steps of the mean distance of
    neighbours. The `camera` of each view adds its distance from that plane and its rotation.
    """
    path = folder / "poses_bounds.npy"
    if not path.is_file():
        return None
    cameras = read_llff_poses(path)
    inside, pictures = _llff_pictures(path, len(cameras))
    notes = (f"Pictures from {inside.name}.",)
    scene = _field_of(folder, "LLFF", pictures, cameras, notes)
    return scene or _free_scene(folder, pictures, cameras, notes)


def read_posed(folder: Path) -> MultiView | None:
    """Return the views of a folder with transforms.json or a COLMAP model, None for other folders."""
    path = poses_in(folder)
    if path is None:
        return None
    named = read_named_poses(folder)
    pictures, cameras = [_picture(folder, name) for name, _ in named], [camera for _, camera in named]
    scene = _field_of(folder, "COLMAP" if path.is_dir() else "nerfstudio", pictures, cameras, ())
    if scene is None:
        raise InputError(
            f"{path}: its {len(cameras)} cameras do not look the same way from a regular grid, so they make no light"
            " field; give them as poses for views of a photo"
        )
    return scene


def _llff_pictures(path: Path, count: int) -> tuple[Path, list[Path]]:
    """Return the first folder that holds as many pictures as there are poses, and its pictures."""
    folders = [path.parent / name for name in LLFF_FOLDERS if (path.parent / name).is_dir()] or [path.parent]
    pictures = {folder: pictures_in(folder) for folder in folders}
    for folder in folders:
        if len(pictures[folder]) == count > 1:
            return folder, pictures[folder]
    held = " and ".join(f"{len(pictures[folder])} pictures in {folder.name}" for folder in folders)
    raise InputError(f"{path}: {count} poses for {held}; give a picture for each, and at least two")


def _picture(folder: Path, name: str) -> Path:
    """Return the picture of a camera; without an ending it is a PNG."""
    if not name or not stays_within(name):
        raise InputError(f"{folder}: the picture {printable(name)!r} of a camera does not lie in this folder")
    path = Path(name) if Path(name).suffix else Path(f"{name}.png")
    for place in (folder / "images" / path, folder / path):
        if os.path.isfile(place):  # unlike is_file() also for names that are too long
            return place
    raise InputError(f"{folder}: the picture {printable(name)} of a camera is missing; get the whole data set")


def _field_of(
    folder: Path, kind: str, pictures: Sequence[Path], cameras: Sequence[Camera], notes: tuple[str, ...]
) -> MultiView | None:
    """Return the light field of cameras that look the same way from a regular grid, None for others.

    One view step is that of columns, of one column that of rows.
    """
    cameras = [camera.resized(open_picture(picture).size) for camera, picture in zip(cameras, pictures)]
    central = cameras[central_camera(cameras)]
    if len(cameras) < 2 or not all(_looks_alike(camera, central) for camera in cameras):
        return None
    found = _grid_in(np.array([camera.position - central.position for camera in cameras]) @ central.world_from_camera)
    if found is None:
        return None
    offsets, places, step = found
    infinity_px = _infinity_of(cameras, central, offsets)
    if infinity_px is None:
        return None
    views = tuple(
        KnownView(picture.stem, ViewOffset(float(t), float(s)), PictureSource(picture))
        for picture, (t, s) in zip(pictures, offsets)
    )
    name, focal_px, near_far = folder.resolve().name, central.focal_px[0], central.depth_range
    range_px = near_far and (focal_px * step / near_far[1] + infinity_px, focal_px * step / near_far[0] + infinity_px)
    scene = MultiView(name, kind, views, {}, range_px, notes, focal_px=focal_px, infinity_px=infinity_px)
    placed = place_on_grid(scene, places)
    if placed.grid is None:
        return None
    orientations = {open_picture(picture).orientation for picture in pictures}
    placed = turned_upright(placed, orientations.pop()) if len(orientations) == 1 else placed
    assert placed.grid is not None
    return replace(placed, layout=f"{kind}, {placed.grid.columns}x{placed.grid.rows}")


def _grid_in(positions: Positions) -> tuple[NDArray[np.float64], list[GridIndex], float] | None:
    """Return viewpoints (N, 2), t down and s right, in view steps; rows and columns; and the length of a view step.

    None if the cameras stand on no regular grid.
    """
    largest = max(float(np.diff(np.sort(positions[:, axis])).max()) for axis in (0, 1))
    lines = [line_numbers(positions[:, axis], MIN_STEP_RATIO * largest) for axis in (1, 0)]  # rows, columns
    steps = [slope(numbers, positions[:, axis]) for axis, numbers in zip((1, 0), lines)]
    step = steps[1] or steps[0]
    if step == 0:
        return None
    shorter = min(filter(None, steps))
    for axis, numbers, distance in zip((1, 0, 2), [*lines, np.zeros(len(positions))], [*steps, 0.0]):
        off = positions[:, axis] - distance * numbers
        if np.abs(off - off.mean()).max() > MAX_STRAY * (distance or shorter):
            return None
    rows, columns = lines
    return positions[:, 1::-1] / step, list(zip(rows.tolist(), columns.tolist())), step


def _infinity_of(cameras: Sequence[Camera], central: Camera, offsets: NDArray[np.float64]) -> float | None:
    """Return the disparity of infinitely far points, px per view step: principal points move by it from view to view.

    None if they move in another manner.
    """
    moved = np.array([np.subtract(camera.centre_px, central.centre_px)[::-1] for camera in cameras])
    centred = offsets - offsets.mean(axis=0)
    infinity_px = -round(float((moved * centred).sum() / (centred**2).sum()), 3)
    rest = moved + infinity_px * offsets
    return infinity_px if np.abs(rest - rest.mean(axis=0)).max() <= MAX_ERROR_PX else None


def _looks_alike(camera: Camera, central: Camera) -> bool:
    """Return whether a camera has the size, focal lengths and direction of another."""
    if camera.size != central.size:
        return False
    turn = np.abs(camera.world_from_camera - central.world_from_camera).max() * max(central.focal_px)
    zoom = np.abs(np.subtract(camera.focal_px, central.focal_px)) / central.focal_px[0] * max(central.size) / 2
    aspect = abs(central.focal_px[0] - central.focal_px[1]) / central.focal_px[0] * max(central.size) / 2
    return bool(max(turn, *zoom, aspect) <= MAX_ERROR_PX)


def _free_scene(folder: Path, pictures: Sequence[Path], cameras: Sequence[Camera], notes: tuple[str, ...]) -> MultiView:
    """Return the views of cameras that stand anywhere near a plane and are turned."""
    central = central_camera(cameras)
    cameras, stray = _in_steps(cameras, cameras[central])
    views = tuple(
        KnownView(picture.stem, ViewOffset(*map(float, camera.position[1::-1])), PictureSource(picture), camera)
        for picture, camera in zip(pictures, cameras)
    )
    focal_px = cameras[central].resized(open_picture(pictures[central]).size).focal_px[0]
    near, far = cameras[central].depth_range or (1.0, 1.0)
    note = (
        f"Cameras stand up to {stray:.1f} view steps before or behind the plane of the given one, and are turned"
        " against it; each view is made for the camera of its photo."
    )
    name, layout = folder.resolve().name, f"LLFF, {len(views)} photos"
    range_px = focal_px / far, focal_px / near
    return MultiView(name, layout, views, {}, range_px, (note, *notes), central, focal_px=focal_px)


def _in_steps(cameras: Sequence[Camera], central: Camera) -> tuple[tuple[Camera, ...], float]:
    """Return the cameras as the central one sees them, in view steps, and their largest distance from its plane."""
    turned = central.world_from_camera.T
    positions = np.array([turned @ (camera.position - central.position) for camera in cameras])
    squared = ((positions[:, None, :2] - positions[None, :, :2]) ** 2).sum(axis=2)
    np.fill_diagonal(squared, np.inf)
    step = float(np.sqrt(squared.min(axis=1)).mean()) or 1.0
    moved = []
    for camera, position in zip(cameras, positions / step):
        near, far = camera.depth_range or (1.0, 1.0)
        rotation, depths = turned @ camera.world_from_camera, (near / step, far / step)
        moved.append(replace(camera, world_from_camera=rotation, position=position, depth_range=depths))
    return tuple(moved), float(np.abs(positions[:, 2]).max()) / step
