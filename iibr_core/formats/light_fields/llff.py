"""NeRF's LLFF scenes: poses_bounds.npy beside a folder of photos, taken by hand near a plane, facing forward."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from iibr_core.formats.images.decode import read_size
from iibr_core.formats.images.picture_source import PictureSource
from iibr_core.formats.light_fields.multi_view_scene import KnownView, MultiView, pictures_in
from iibr_core.formats.poses import central_camera, read_llff_poses
from iibr_core.types import Camera, InputError, ViewOffset

FOLDERS = ("images_8", "images_4", "images")
"""Folders of pictures, smaller copies first: papers evaluate on them."""


def read_llff(folder: Path) -> MultiView | None:
    """Return the views of an LLFF scene, None without poses_bounds.npy.

    Viewpoints are positions across the viewing direction of the central camera, in steps of the mean distance of
    neighbours. The `camera` of each view adds its distance from that plane and its rotation.
    """
    path = folder / "poses_bounds.npy"
    if not path.is_file():
        return None
    inside = next((folder / name for name in FOLDERS if (folder / name).is_dir()), folder)
    pictures, cameras = pictures_in(inside), read_llff_poses(path)
    if len(cameras) != len(pictures) or len(pictures) < 2:
        raise InputError(f"{path}: {len(cameras)} poses for {len(pictures)} pictures; give both, and at least two")
    central = central_camera(cameras)
    cameras, stray = _in_steps(cameras, cameras[central])
    views = tuple(
        KnownView(picture.stem, ViewOffset(*map(float, camera.position[1::-1])), PictureSource(picture), camera)
        for picture, camera in zip(pictures, cameras)
    )
    focal_px = cameras[central].resized(read_size(pictures[central])).focal_px[0]
    near, far = cameras[central].depth_range or (1.0, 1.0)
    notes = (
        f"Cameras stand up to {stray:.1f} view steps before or behind the plane of the given one, and are turned"
        " against it; each view is made for the camera of its photo.",
        f"Pictures from {inside.name}.",
    )
    name, layout = folder.resolve().name, f"LLFF, {len(views)} photos"
    return MultiView(name, layout, views, {}, (focal_px / far, focal_px / near), notes, central, focal_px=focal_px)


def _in_steps(cameras: tuple[Camera, ...], central: Camera) -> tuple[tuple[Camera, ...], float]:
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
