"""NeRF's LLFF scenes: poses_bounds.npy beside a folder of photos, taken by hand about on a plane, facing forward."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import is_file, is_folder, shown_name
from iibr_core.formats.images.oiio_reader import read_size
from iibr_core.formats.images.picture_source import PictureSource
from iibr_core.formats.light_fields.multi_view_scene import KnownView, MultiView, pictures_in
from iibr_core.formats.poses import central_camera, read_llff_poses
from iibr_core.types import Camera, InputError, ViewOffset

FOLDERS = ("images_8", "images_4", "images")
"""Smaller copies first: the papers evaluate on them."""

Doubles = NDArray[np.float64]


def read_llff(folder: Path) -> MultiView | None:
    """The views of an LLFF scene, None without poses_bounds.npy.

    Viewpoints are positions across the viewing direction of the camera in the middle, in steps of the mean distance
    of neighbours; how cameras stand before or behind it and are turned, each one's own `camera` says. Raises InputError
    where poses are damaged or do not fit the pictures.
    """
    path = folder / "poses_bounds.npy"
    if not is_file(path):
        return None
    inside = next((folder / name for name in FOLDERS if is_folder(folder / name)), folder)
    pictures, cameras = pictures_in(inside), read_llff_poses(path)
    if len(cameras) != len(pictures) or len(pictures) < 2:
        raise InputError(f"{path}: {len(cameras)} poses for {len(pictures)} pictures; give both, and at least two")
    central = central_camera(cameras)
    cameras = tuple(_seen_from(camera, cameras[central]) for camera in cameras)
    positions = np.array([camera.position for camera in cameras])
    step = _neighbour_distance(positions[:, :2])
    cameras = tuple(_in_steps(camera, step) for camera in cameras)
    views = tuple(
        KnownView(picture.stem, ViewOffset(*map(float, camera.position[1::-1])), PictureSource(picture), camera)
        for picture, camera in zip(pictures, cameras)
    )
    focal_px = cameras[central].resized(read_size(pictures[central])).focal_px[0]
    near, far = cameras[central].depth_range or (1.0, 1.0)
    notes = (
        f"Cameras stand up to {np.abs(positions[:, 2]).max() / step:.1f} view steps before or behind the plane of the"
        " given one, and are turned against it: each view is made for its camera as it is.",
        f"Pictures from {inside.name}.",
    )
    name, layout = shown_name(folder.resolve().name), f"LLFF, {len(views)} photos"
    return MultiView(name, layout, views, {}, (focal_px / far, focal_px / near), notes, central, focal_px=focal_px)


def _seen_from(camera: Camera, given: Camera) -> Camera:
    """With the given one for the world."""
    turned = given.world_from_camera.T
    position = turned @ (camera.position - given.position)
    return replace(camera, world_from_camera=turned @ camera.world_from_camera, position=position)


def _in_steps(camera: Camera, step: float) -> Camera:
    """With steps for the unit of lengths."""
    near, far = camera.depth_range or (1.0, 1.0)
    return replace(camera, position=camera.position / step, depth_range=(near / step, far / step))


def _neighbour_distance(points: Doubles) -> float:
    """Mean distance (N, 2) of each point to its nearest other; 1 where all coincide."""
    squared = ((points[:, None] - points[None]) ** 2).sum(axis=2)
    np.fill_diagonal(squared, np.inf)
    return float(np.sqrt(squared.min(axis=1)).mean()) or 1.0
