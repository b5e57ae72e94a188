"""Views of free cameras against the truth: ours beside a forward warp of the same photo, disparity and poses.

    python -m benchmarks.free_views [--scenes 12] [--size 480x320] [--seed 0]

Scenes are drawn, seen from eight cameras each: beside the photo's, before and behind it, turned, and with another lens.
"resampled" is the reference warp: the disparity comes from nine points a pixel, colours by Lanczos' kernel, holes are
filled from beside. Disparity is the truth. PSNR in dB (of the frame; of what the photo sees; of what it does not), the
frame's gain over the warp of the same scene and pose, and the share of the frame's squared error that lies beyond the
photo's frame; medians over scenes. Processor time a view.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import cos, radians, sin

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.reports import emit, head, parser_of, row, start
from benchmarks.harness.timing import cost_of
from iibr_core.beyond.free_cameras import FreeViews
from iibr_core.beyond.free_view import target_from_photo
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.evaluation.warp import reference_warp_to
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import RaycastScene, render
from iibr_core.types import (
    Camera,
    FloatImage,
    ImageSize,
    ViewOffset,
)

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

Row = tuple[float, float, float, float, float, float]
"""PSNR of the frame, its gain over the warp's, PSNR of pixels that the photo sees and of the others; share of
the error that lies beyond the photo's frame; milliseconds of processor time.
"""
Table = dict[tuple[str, str], list[Row]]
"""Rows of all scenes, by pose and way."""


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
    """Return the camera of the centre view, in the scene's world."""
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
    """Return the colours (H, W, 3) and 1 / depth (H, W) that a camera sees of a scene."""
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


def outside_frame(disparity: FloatImage, photo_from_target: NDArray[np.float64], size: ImageSize) -> NDArray[np.bool_]:
    """Which pixels of a view with this disparity (H, W) see what lies beyond the frame of a photo of a size."""
    y, x = np.indices(disparity.shape)
    source = photo_from_target @ np.stack([x, y, np.ones_like(x), disparity]).reshape(4, -1)
    at_x, at_y = (source[:2] / source[2]).reshape(2, *disparity.shape)
    return ~(
        (abs(at_x - (size.width - 1) / 2) <= size.width / 2) & (abs(at_y - (size.height - 1) / 2) <= size.height / 2)
    )


def main() -> None:
    parser = parser_of(__doc__, "seed")
    parser.add_argument("--scenes", type=int, default=12)
    parser.add_argument("--size", default="480x320")
    options = parser.parse_args()
    width, height = map(int, options.size.split("x"))
    emit(report(options.scenes, ImageSize(height, width), options.seed))


def report(scenes: int, size: ImageSize, seed: int) -> Iterator[str]:
    rng = np.random.default_rng(seed)
    table: Table = {}
    ray_set_ms = [judge(random_scene(rng, size, float(rng.uniform(1, 3))), size, table) for _ in range(scenes)]
    figures = "frame dB", "gain dB", "seen dB", "unseen dB", "error beyond the frame", "ms of processor time"
    yield head("pose", "way", *figures)
    yield row("all, once", "ray set", "", "", "", "", "", f"{np.median(ray_set_ms):.0f}")
    for (pose, way), rows in table.items():
        yield line(pose, way, rows)
    for way in ("resampled", "ours"):
        yield line("all", way, [one for (_, other), rows in table.items() if other == way for one in rows])


def line(pose: str, way: str, rows: list[Row]) -> str:
    """Return a line of the table: medians."""
    frame, gain, seen, unseen, beyond, ms = np.nanmedian(np.array(rows), axis=0)
    return row(pose, way, f"{frame:.2f}", f"{gain:+.2f}", f"{seen:.2f}", f"{unseen:.2f}", f"{beyond:.0%}", f"{ms:.0f}")


def judge(scene: RaycastScene, size: ImageSize, table: Table) -> float:
    """Add the figures of one scene; the milliseconds of processor time that its ray set took."""
    taken = photo_camera(scene, size)
    photo, inverse_depth = truth(scene, taken)
    cameras = cameras_of(scene, size, 1 / float(inverse_depth.max()))
    # In view steps of a fiftieth of the nearest's distance.
    scale_px = scene.focal_px * 0.02 / float(inverse_depth.max())
    disparity = inverse_depth * np.float32(scale_px)
    made: list[FreeViews] = []
    ray_set = cost_of(lambda: made.append(FreeViews(photo, inverse_depth, taken, list(cameras.values()))))
    for name, camera in cameras.items():
        true, true_inverse = truth(scene, camera)
        matrix = target_from_photo(taken, camera, scale_px)
        is_beyond = outside_frame(true_inverse * np.float32(scale_px), np.linalg.inv(matrix), size)
        judged = reference_warp_to(photo, disparity, matrix, size)
        ways: dict[str, Callable[[], FloatImage]] = {
            "resampled": lambda at=matrix: reference_warp_to(photo, disparity, at, size).colors,
            "ours": lambda at=camera: made[0].view(at).colors,
        }
        for way, make in ways.items():
            images: list[FloatImage] = []
            cost = cost_of(lambda make=make, images=images: images.append(np.clip(make(), 0, 1)))
            frame, seen, unseen = (bounded_psnr(images[0], true, mask) for mask in (None, judged.visible, judged.hole))
            warped = frame if way == "resampled" else table[name, "resampled"][-1][0]
            error = (images[0] - true) ** 2
            beyond = float(error[is_beyond].sum() / error.sum())
            table.setdefault((name, way), []).append((frame, frame - warped, seen, unseen, beyond, 1e3 * cost.cpu_s))
    return 1e3 * ray_set.cpu_s


if __name__ == "__main__":
    start("benchmarks.free_views", main)
