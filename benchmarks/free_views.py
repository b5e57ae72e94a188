"""Judge views of cameras that move and turn freely, beside a plain warp of the same photo, disparity and poses.

    python -m benchmarks free-views [--scenes 4]

Drawn scenes; disparity is the truth. PSNR in dB of the frame, of what the photo sees and of the rest: means.
"""

from __future__ import annotations

import argparse
from dataclasses import replace

import cv2
import numpy as np

from benchmarks.report import markdown
from benchmarks.scenes import DRAWN_SIZE
from iibr_core.beyond.free_cameras import FreeViews
from iibr_core.beyond.free_view import target_from_photo
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.evaluation.warp import reference_warp_to
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import RaycastScene, render
from iibr_core.types import Camera, FloatImage, ViewOffset

POSES = {
    "beside": ((0.06, 0.03, 0.0), (0, 0, 0), 1.0),
    "far beside": ((-0.12, 0.05, 0.0), (0, 0, 0), 1.0),
    "forward": ((0.0, 0.0, 0.15), (0, 0, 0), 1.0),
    "backward": ((0.0, 0.02, -0.15), (0, 0, 0), 1.0),
    "turned": ((0.0, 0.0, 0.0), (4, 6, 5), 1.0),
    "around, long lens": ((0.1, 0.0, 0.03), (0, -5, 0), 1.5),
}
"""Place (right, down, forward) in distances of the nearest, turn in degrees, focal length relative to the photo's."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=4)
    figures = np.array([judge(seed) for seed in range(parser.parse_args().scenes)])  # (scene, pose, way and part)
    names = "pose", *(f"{maker}, {part}" for maker in ("iibr", "plain warp") for part in ("frame", "seen", "unseen"))
    means = [*np.nanmean(figures, axis=0), np.nanmean(figures, axis=(0, 1))]
    print(markdown(names, ([pose, *(f"{db:.2f}" for db in found)] for pose, found in zip((*POSES, "mean"), means))))


def judge(seed: int) -> list[list[float]]:
    """Return the PSNR in dB by pose: frame, seen and unseen of ours, then of the warp."""
    scene, size = random_scene(np.random.default_rng(seed), DRAWN_SIZE, 2.0), DRAWN_SIZE
    taken = Camera(np.eye(3), np.zeros(3), size, (scene.focal_px,) * 2, scene.centre_px, "photo")
    photo, inverse_depth = seen_by(scene, taken)
    nearest, cameras = 1 / float(inverse_depth.max()), []
    for place, degrees, lens in POSES.values():
        turn, focal = cv2.Rodrigues(np.radians(degrees))[0], (lens * scene.focal_px,) * 2
        cameras.append(replace(taken, world_from_camera=turn, position=nearest * np.array(place), focal_px=focal))
    views, scale_px, found = FreeViews(photo, inverse_depth, taken, cameras), 0.02 * nearest * scene.focal_px, []
    for camera in cameras:
        matrix = target_from_photo(taken, camera, scale_px)
        warped = reference_warp_to(photo, inverse_depth * np.float32(scale_px), matrix, size)
        pictures, truth = (np.clip(views.view(camera).colors, 0, 1), warped.colors), seen_by(scene, camera)[0]
        parts = None, warped.visible, warped.hole
        found.append([bounded_psnr(picture, truth, part) for picture in pictures for part in parts])
    return found


def seen_by(scene: RaycastScene, camera: Camera) -> tuple[FloatImage, FloatImage]:
    """Return the true colours (H, W, 3) and 1 / depth (H, W) that a camera sees."""
    primitives, turn = scene.primitives.copy(), camera.world_from_camera
    primitives["centre"] = (primitives["centre"] - camera.position) @ turn
    primitives["axes"] = primitives["axes"] @ turn
    primitives["nearest_z"] = 0.0  # unsorted, so that all are asked
    primitives = np.concatenate([primitives, primitives[-1:]])  # the last must be a backdrop that faces the camera
    place = {"centre_px": camera.centre_px, "focal_px": camera.focal_px[0], "infinity_px": 0.0, "depths": (1e-6, 1e8)}
    moved = replace(scene, primitives=primitives, light=tuple(np.array(scene.light) @ turn), **place)
    colors, disparity = render(moved, camera.size, ViewOffset(0.0, 0.0))
    return colors, disparity / np.float32(camera.focal_px[0])


if __name__ == "__main__":
    main()
