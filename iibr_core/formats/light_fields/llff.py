"""NeRF's LLFF scenes: poses_bounds.npy beside a folder of photos, taken by hand about on a plane, facing forward.

Each row is a 3x5 matrix (camera-to-world rotation whose columns point down, right and backwards; position; height,
width, focal length) and the least and greatest depth.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import is_file, is_folder, shown_name
from iibr_core.formats.images.oiio_reader import read_size
from iibr_core.formats.images.picture_source import PictureSource
from iibr_core.formats.light_fields.scene import MOST_VIEWS, KnownView, MultiView, pictures_in
from iibr_core.formats.maps.npy import read_array
from iibr_core.types import ImageSize, InputError, ViewOffset

FOLDERS = ("images_8", "images_4", "images")
"""Smaller copies first: the papers evaluate on them."""
DOWN_RIGHT_BACK = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, -1.0]])
"""Rows: x right, y down, z forward, in LLFF's axes."""

Doubles = NDArray[np.float64]


def read_llff(folder: Path) -> MultiView | None:
    """The views of an LLFF scene, None without poses_bounds.npy.

    Viewpoints are positions across the viewing direction of the camera in the middle, in steps of the mean distance
    of neighbours; how far cameras stand before or behind it is left out, and told in the notes. Raises InputError
    where poses are damaged or do not fit the pictures.
    """
    path = folder / "poses_bounds.npy"
    if not is_file(path):
        return None
    inside = next((folder / name for name in FOLDERS if is_folder(folder / name)), folder)
    pictures = pictures_in(inside)
    rotations, positions, shapes, bounds = _read_poses(path, len(pictures))
    central = int(np.argmin(((positions - positions.mean(axis=0)) ** 2).sum(axis=1)))
    local = (positions - positions[central]) @ rotations[central].T
    step = _neighbour_distance(local[:, :2])
    views = tuple(
        KnownView(picture.stem, ViewOffset(float(y / step), float(x / step)), PictureSource(picture))
        for picture, (x, y, _) in zip(pictures, local)
    )
    size = read_size(pictures[central])
    focal_px = float(shapes[central, 2] * size.width / shapes[central, 1])
    turned = _relative_homographies(rotations, central, focal_px, size)
    views = tuple(replace(view, turned=matrix) for view, matrix in zip(views, turned))
    depths = bounds[central]
    notes = (
        f"Cameras stand up to {np.abs(local[:, 2]).max() / step:.1f} view steps before or behind the plane of the given"
        " one, which is not modelled; how they are turned against it is.",
        f"Pictures from {inside.name}.",
    )
    reach = (focal_px * step / float(depths[1]), focal_px * step / float(depths[0]))
    layout = f"LLFF, {len(views)} photos"
    return MultiView(shown_name(folder.resolve().name), layout, views, {}, reach, notes, central, focal_px=focal_px)


def _read_poses(path: Path, pictures: int) -> tuple[Doubles, Doubles, Doubles, Doubles]:
    """World-to-camera rotations (N, 3, 3) for x right, y down, z forward; positions (N, 3); (height, width, focal)
    (N, 3); depths (N, 2).
    """
    stored = read_array(path, 17 * MOST_VIEWS)
    if stored.ndim != 2 or stored.shape[1] != 17 or stored.dtype.kind != "f":
        raise InputError(f"{path}: holds no poses; N rows of 17 numbers are expected")
    if len(stored) != pictures or pictures < 2:
        raise InputError(f"{path}: {len(stored)} poses for {pictures} pictures; both must be there, and at least two")
    stored = stored.astype(np.float64)
    matrices, bounds = stored[:, :15].reshape(-1, 3, 5), stored[:, 15:]
    rotations = DOWN_RIGHT_BACK @ matrices[:, :, :3].transpose(0, 2, 1)
    orthonormal = np.allclose(rotations @ rotations.transpose(0, 2, 1), np.eye(3), atol=1e-3)
    if not np.isfinite(stored).all() or not orthonormal or not (matrices[:, :, 4] > 0).all():
        raise InputError(f"{path}: poses are no rotations with positive sizes; get the whole file again")
    if not ((bounds[:, 0] > 0) & (bounds[:, 1] > bounds[:, 0])).all():
        raise InputError(f"{path}: the depths are not positive and ascending; get the whole file again")
    return rotations, matrices[:, :, 3], matrices[:, :, 4], bounds


def _neighbour_distance(points: Doubles) -> float:
    """Mean distance (N, 2) of each point to its nearest other; 1 where all coincide."""
    squared = ((points[:, None] - points[None]) ** 2).sum(axis=2)
    np.fill_diagonal(squared, np.inf)
    return float(np.sqrt(squared.min(axis=1)).mean()) or 1.0


def _relative_homographies(rotations: Doubles, central: int, focal_px: float, size: ImageSize) -> list[Doubles]:
    """For each camera the matrix from pixels of a camera that looks as the central one does to its own."""
    height, width = size
    camera = np.array([[focal_px, 0.0, (width - 1) / 2], [0.0, focal_px, (height - 1) / 2], [0.0, 0.0, 1.0]])
    back = rotations[central].T @ np.linalg.inv(camera)
    return [camera @ rotation @ back for rotation in rotations]
