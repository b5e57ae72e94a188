"""Views of free cameras against the truth: ours beside forward warps of the same photo, disparity and poses.

    python -m benchmarks.free_views [--scenes 12] [--size 480x320] [--seed 0]

Scenes are procedural ones, seen from eight cameras each: beside the photo's, before and behind it, turned, and with
another lens. "warp": every pixel's colour lands on one pixel, the nearest wins; holes are filled from beside.
"resampled": nine points a pixel tell the disparity, colours are looked up by Lanczos' kernel. Disparity is the truth.
PSNR in dB (of the frame; of what the photo sees; of what it does not), the median over scenes; processor time a view.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace
from math import cos, radians, sin

import numpy as np
from numpy.typing import NDArray

from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.evaluation.reference_warp import NOWHERE, SAMPLES, WarpedView, _fill_holes, _lanczos
from iibr_core.generation.free_views import FreeViews
from iibr_core.rendering.free_view import target_from_photo
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import RaycastScene, render
from iibr_core.types import Camera, FloatImage, ImageSize, ViewOffset

BOUNDLESS = 1e8
POSES = {
    "beside": ((0.06, 0.03, 0.0), (0.0, 0.0, 0.0), 1.0),
    "far beside": ((-0.12, 0.05, 0.0), (0.0, 0.0, 0.0), 1.0),
    "forward": ((0.0, 0.0, 0.15), (0.0, 0.0, 0.0), 1.0),
    "far forward": ((0.03, 0.0, 0.3), (0.0, 0.0, 0.0), 1.0),
    "backward": ((0.0, 0.02, -0.15), (0.0, 0.0, 0.0), 1.0),
    "turned": ((0.0, 0.0, 0.0), (4.0, 6.0, 5.0), 1.0),
    "around": ((0.1, 0.0, 0.03), (0.0, -5.0, 0.0), 1.0),
    "long lens": ((0.05, -0.05, 0.05), (0.0, 0.0, 0.0), 1.5),
}
"""Place in distances of the nearest (right, down, forward), turns about x, y and z in degrees, focal length in the
photo's.
"""


def rotation(degrees: tuple[float, float, float]) -> NDArray[np.float64]:
    """(3, 3) of turns about x, then y, then z."""
    turned = np.eye(3)
    for axis, angle in enumerate(degrees):
        one = np.eye(3)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        one[i, i] = one[j, j] = cos(radians(angle))
        one[j, i], one[i, j] = sin(radians(angle)), -sin(radians(angle))
        turned = one @ turned
    return turned


def photo_camera(scene: RaycastScene, size: ImageSize) -> Camera:
    """Of the centre view, in the scene's world."""
    return Camera(np.eye(3), np.zeros(3), size, (scene.focal_px,) * 2, scene.centre_px, "photo")


def cameras_of(scene: RaycastScene, size: ImageSize, nearest: float) -> dict[str, Camera]:
    """The cameras of POSES."""
    photo = photo_camera(scene, size)
    return {
        name: replace(
            photo,
            world_from_camera=rotation(degrees),
            position=nearest * np.array(place),
            focal_px=(lens * scene.focal_px,) * 2,
            source=name,
        )
        for name, (place, degrees, lens) in POSES.items()
    }


def truth(scene: RaycastScene, camera: Camera) -> tuple[FloatImage, FloatImage]:
    """What a camera sees of a scene: colours (H, W, 3) and 1 / depth (H, W)."""
    primitives, turned = scene.primitives.copy(), camera.world_from_camera
    primitives["centre"] = (primitives["centre"] - camera.position) @ turned
    primitives["axes"] = primitives["axes"] @ turned
    primitives["nearest_z"] = 0.0  # unsorted: every one is asked
    # The last one is taken for a backdrop that faces the camera: another, that nobody sees, goes behind it.
    primitives = np.concatenate([primitives, primitives[-1:]])
    moved = replace(
        scene,
        primitives=primitives,
        centre_px=camera.centre_px,
        focal_px=camera.focal_px[0],
        infinity_px=0.0,
        depths=(1e-6, BOUNDLESS),
        light=tuple(np.array(scene.light) @ turned),
    )
    colors, disparity = render(moved, camera.size, ViewOffset(0.0, 0.0))
    return colors, disparity / np.float32(camera.focal_px[0])


def landed(photo: Camera, camera: Camera, inverse_depth: FloatImage, samples: int) -> NDArray[np.float64]:
    """(4, H * samples, W * samples): where points of the photo's pixels land, x, y and 1 / depth, and what is before
    the camera.
    """
    height, width = inverse_depth.shape
    y, x = (np.arange(samples * side) // samples for side in (height, width))
    points_y, points_x = (((np.arange(samples * side) + 0.5) / samples - 0.5) for side in (height, width))
    grid = np.stack(
        [
            *np.broadcast_arrays(points_x[None], points_y[:, None]),
            np.ones((len(y), len(x))),
            inverse_depth[y[:, None], x],
        ]
    )
    result = np.einsum("ij,jyx->iyx", target_from_photo(photo, camera, 1.0), grid)
    return np.stack([*(result[[0, 1, 3]] / result[2]), result[2] > 0])


def nearest_points(at: NDArray[np.float64], size: ImageSize) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Pixels of the target (flat) that something lands on, and which point (flat) is the nearest of all there."""
    x, y, inverse_depth, is_before = (part.ravel() for part in at)
    u, v = np.floor(x + 0.5), np.floor(y + 0.5)
    inside = np.flatnonzero((is_before > 0) & (u >= 0) & (v >= 0) & (u < size.width) & (v < size.height))
    order = inside[np.argsort(inverse_depth[inside], kind="stable")]
    best = np.full(size.height * size.width, -1)
    best[(v[order] * size.width + u[order]).astype(int)] = order  # the last one, the nearest, stays
    pixels = np.flatnonzero(best >= 0)
    return pixels, best[pixels]


def plain_warp(photo: FloatImage, inverse_depth: FloatImage, taken: Camera, camera: Camera) -> WarpedView:
    """Colours carried to the nearest pixel."""
    pixels, points = nearest_points(at := landed(taken, camera, inverse_depth, 1), camera.size)
    colors, disparity = np.zeros((*camera.size, 3), np.float32), np.zeros(camera.size, np.float32)
    hole = np.ones(camera.size, np.bool_)
    colors.reshape(-1, 3)[pixels] = photo.reshape(-1, 3)[points]
    disparity.reshape(-1)[pixels] = at[2].ravel()[points]
    hole.reshape(-1)[pixels] = False
    return WarpedView(_fill_holes(colors, hole, disparity), disparity, hole)


def resampled_warp(photo: FloatImage, inverse_depth: FloatImage, taken: Camera, camera: Camera) -> WarpedView:
    """`iibr_core.evaluation.reference_warp`, for any camera: only disparities are carried."""
    pixels, points = nearest_points(at := landed(taken, camera, inverse_depth, SAMPLES), camera.size)
    disparity, hole = np.full(camera.size, NOWHERE, np.float32), np.ones(camera.size, np.bool_)
    disparity.reshape(-1)[pixels] = at[2].ravel()[points]
    hole.reshape(-1)[pixels] = False
    disparity[hole] = 0
    y, x = np.indices(camera.size)
    back = np.linalg.inv(target_from_photo(taken, camera, 1.0))
    from_x, from_y, w, _ = np.einsum("ij,jyx->iyx", back, np.stack([x, y, np.ones_like(x), disparity]))
    from_x, from_y = np.where(hole, 0, from_x / w), np.where(hole, 0, from_y / w)
    height, width = photo.shape[:2]
    hole |= (from_x < -0.5) | (from_y < -0.5) | (from_x > width - 0.5) | (from_y > height - 0.5)
    return WarpedView(_fill_holes(_lanczos(photo, from_x, from_y), hole, disparity), disparity, hole)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=12)
    parser.add_argument("--size", default="480x320")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    rng = np.random.default_rng(options.seed)
    table: dict[tuple[str, str], list[tuple[float, float, float, float]]] = {}
    for _ in range(options.scenes):
        judge(random_scene(rng, ImageSize(height, width), float(rng.uniform(1, 3))), ImageSize(height, width), table)
    print("| pose | way | frame dB | seen dB | unseen dB | ms of processor time |")
    print("| --- | --- | --- | --- | --- | --- |")
    every: dict[str, list[tuple[float, float, float, float]]] = {}
    for (pose, way), rows in table.items():
        every.setdefault(way, []).extend(rows)
        print(line(pose, way, rows))
    for way, rows in every.items():
        print(line("all", way, rows))


def line(pose: str, way: str, rows: list[tuple[float, float, float, float]]) -> str:
    frame, seen, unseen, ms = np.nanmedian(np.array(rows), axis=0)
    return f"| {pose} | {way} | {frame:.2f} | {seen:.2f} | {unseen:.2f} | {ms:.0f} |"


def judge(
    scene: RaycastScene, size: ImageSize, table: dict[tuple[str, str], list[tuple[float, float, float, float]]]
) -> None:
    """Add the figures of one scene."""
    taken = photo_camera(scene, size)
    photo, inverse_depth = truth(scene, taken)
    cameras = cameras_of(scene, size, 1 / float(inverse_depth.max()))
    ours = FreeViews(photo, inverse_depth, taken, list(cameras.values()))
    ways: dict[str, Callable[[Camera], FloatImage]] = {
        "warp": lambda camera: plain_warp(photo, inverse_depth, taken, camera).colors,
        "resampled": lambda camera: resampled_warp(photo, inverse_depth, taken, camera).colors,
        "ours": lambda camera: ours.view(camera).colors,
    }
    for name, camera in cameras.items():
        true, _ = truth(scene, camera)
        judged = resampled_warp(photo, inverse_depth, taken, camera)
        for way, make in ways.items():
            start = time.process_time()
            made = np.clip(make(camera), 0, 1)
            ms = 1e3 * (time.process_time() - start)
            figures = (bounded_psnr(made, true, mask) for mask in (None, judged.visible, judged.hole))
            table.setdefault((name, way), []).append((*figures, ms))


if __name__ == "__main__":
    main()
