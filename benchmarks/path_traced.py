"""What benchmarks share that path-trace their truth with Mitsuba: rows of cameras, and matte surfaces."""

from __future__ import annotations

import importlib
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import ImageSize, ViewOffset

Shapes = dict[str, Any]
"""Mitsuba's descriptions, by name."""
Image = NDArray[np.float32]


def load_mitsuba(module: str) -> Any:
    """Mitsuba, where it is installed; else the program ends, and says what to do."""
    try:
        mi = importlib.import_module("mitsuba")
    except ImportError:
        sys.exit(f"{module}: needs Mitsuba; install it with: pip install mitsuba==3.9.1")
    mi.set_variant("scalar_rgb")
    return mi


@dataclass(frozen=True)
class CameraRig:
    """Cameras side by side that look along -z, that of the centre view from 0.

    size: of a view. step: from view to view, still_depth: of the plane that does not move from view to view; both in
    units of the scene.
    """

    size: ImageSize
    field_of_view_deg: float
    step: float
    still_depth: float

    @property
    def focal_px(self) -> float:
        """Of every camera."""
        return self.size.width / 2 / math.tan(math.radians(self.field_of_view_deg / 2))

    @property
    def infinity_px(self) -> float:
        """Disparity of what is infinitely far, px per view step."""
        return -self.focal_px * self.step / self.still_depth

    def disparity_at(self, depth: Any) -> Any:
        """Pixels per view step of points that far in front of the cameras."""
        return self.focal_px * self.step / depth + self.infinity_px

    def depth_at(self, disparity: float) -> float:
        """The other way round."""
        return self.focal_px * self.step / (disparity - self.infinity_px)

    def camera(self, mi: Any, offset: ViewOffset) -> Shapes:
        """What all sensors of a view have in common."""
        at = np.array([offset.s * self.step, -offset.t * self.step, 0.0])
        film = {"type": "hdrfilm", "width": self.size.width, "height": self.size.height, "rfilter": {"type": "box"}}
        return {
            "fov": self.field_of_view_deg,
            "fov_axis": "x",
            "to_world": mi.ScalarTransform4f().look_at(at.tolist(), (at - [0, 0, 1]).tolist(), [0, 1, 0]),
            "film": film,
            "sampler": {"type": "multijitter"},
        }

    def pinhole(self, mi: Any, offset: ViewOffset) -> Any:
        """The sensor of a view; its frame moves with it, so that the plane at still_depth stays."""
        shifts = {"principal_point_offset_x": self.infinity_px * offset.s / self.size.width}
        shifts["principal_point_offset_y"] = self.infinity_px * offset.t / self.size.height
        return mi.load_dict({"type": "perspective", **self.camera(mi, offset), **shifts})

    def visible_points(self, scene: Any, sensor: Any, y: NDArray[Any], x: NDArray[Any]) -> NDArray[np.float64]:
        """(N, 3): what the rays through these places of a view hit; pixel centres are integers."""
        points = []
        for row, column in zip(y, x):
            place = [(column + 0.5) / self.size.width, (row + 0.5) / self.size.height]
            points.append(np.array(scene.ray_intersect(sensor.sample_ray(0.0, 0.0, place, [0.5, 0.5])[0]).p).ravel())
        return np.array(points)

    def depths(self, scene: Any, sensor: Any) -> NDArray[np.float64]:
        """(H, W), at the pixel centres of a view."""
        y, x = (grid.ravel() for grid in np.mgrid[: self.size.height, : self.size.width])
        return -self.visible_points(scene, sensor, y, x)[:, 2].reshape(self.size)


def matte(mi: Any, seed: int, dark: Sequence[float], bright: Sequence[float], cells: int = 24) -> Shapes:
    """A matte surface of irregular blotches between two colours, the same for the same seed."""
    rng = np.random.default_rng(seed)
    share = np.zeros((256, 256))
    for octave, weight in ((cells // 4, 0.5), (cells, 0.5)):
        at = np.arange(256) * octave / 256
        low = np.floor(at).astype(int)
        rest = (at - low)[:, None]
        nodes = np.pad(rng.random((octave, octave)), (0, 1), mode="wrap")
        rows = nodes[low] * (1 - rest) + nodes[low + 1] * rest
        share += weight * (rows[:, low] * (1 - rest.T) + rows[:, low + 1] * rest.T)
    share = np.clip(0.5 + 2.2 * (share - 0.5), 0, 1)[..., None]
    colors = (np.array(dark) * (1 - share) + np.array(bright) * share).astype(np.float32)
    return {"type": "diffuse", "reflectance": {"type": "bitmap", "bitmap": mi.Bitmap(colors), "raw": True}}
