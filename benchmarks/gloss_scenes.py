"""Small path-traced light fields of glossy things, by Mitsuba: the truth that benchmarks.gloss judges by.

python -m benchmarks.gloss_scenes --out FOLDER [--samples 256]

A scene is one .npz: every view with its gloss, the centre view with and without it, its exact disparity, and where the
glossy thing is seen in each view.
"""

from __future__ import annotations

import argparse
import importlib
import math
import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.thin_lens import matte
from iibr_core.types import GridShape, ViewOffset

INSTALL = "benchmarks.gloss_scenes: needs Mitsuba; install it with: pip install mitsuba==3.9.1"
SIDE = 96
GRID = GridShape(5, 5)
FIELD_OF_VIEW_DEG = 40.0
FOCAL_PX = SIDE / 2 / math.tan(math.radians(FIELD_OF_VIEW_DEG / 2))
STEP = 0.12
"""From view to view, in units of the scene."""
STILL_DEPTH = 4.0
"""Of the plane that does not move from view to view."""
INFINITY_PX = -FOCAL_PX * STEP / STILL_DEPTH
"""Disparity of what is infinitely far."""
LIGHT_RADIUS_DEG, LIGHT_DISTANCE = 3.0, 400.0
FACING_LIGHT = 1.0
"""Linear light of white paper that faces the light."""
INDEX = 1.5
REFLECTANCE = ((INDEX - 1) / (INDEX + 1)) ** 2

Shapes = dict[str, Any]
Image = NDArray[np.float32]


@dataclass(frozen=True)
class GlossScene:
    """light: direction towards it, x right, y down, z away. glossy: makes the glossy thing of its material."""

    name: str
    roughness: float
    light: tuple[float, float, float]
    glossy: Callable[[Any, Shapes], Shapes]


def sphere(mi: Any, material: Shapes) -> Shapes:
    return {"type": "sphere", "center": [0, 0, -4], "radius": 0.85, "surface": material}


def plane(mi: Any, material: Shapes) -> Shapes:
    move, turn, scale = mi.ScalarTransform4f().translate, mi.ScalarTransform4f().rotate, mi.ScalarTransform4f().scale
    place = move([0, 0, -4]) @ turn([1, 0, 0], -20) @ turn([0, 1, 0], 12) @ scale([1.1, 0.9, 1])
    return {"type": "rectangle", "to_world": place, "surface": material}


def cylinder(mi: Any, material: Shapes) -> Shapes:
    return {"type": "cylinder", "p0": [-0.25, -1.1, -4], "p1": [0.25, 1.1, -4.2], "radius": 0.7, "surface": material}


SCENES = (
    GlossScene("sphere", 0.3, (-0.35, -0.45, -0.8), sphere),
    GlossScene("plane", 0.3, (0.38, -0.61, -0.69), plane),
    GlossScene("cylinder", 0.55, (0.6, -0.15, -0.8), cylinder),
)


def material_of(mi: Any, scene: GlossScene, shine: float) -> Shapes:
    """Plastic whose matt part is the same with (shine 1) and without gloss (shine 0)."""
    return {
        "type": "roughplastic",
        "distribution": "ggx",
        "alpha": scene.roughness**2,
        "int_ior": INDEX,
        "nonlinear": False,
        "diffuse_reflectance": matte(mi, 5, (0.12, 0.16, 0.22), (0.30, 0.20, 0.14), 16)["reflectance"],
        "specular_reflectance": {"type": "rgb", "value": shine},
    }


def load(mi: Any, scene: GlossScene, shine: float) -> Any:
    """The scene, lit by a distant ball."""
    move, scale = mi.ScalarTransform4f().translate, mi.ScalarTransform4f().scale
    x, y, z = np.array(scene.light) / np.linalg.norm(scene.light)
    radiance = FACING_LIGHT / math.sin(math.radians(LIGHT_RADIUS_DEG)) ** 2
    lamp = {
        "type": "sphere",
        "center": [float(v) * LIGHT_DISTANCE for v in (x, -y, -z)],
        "radius": LIGHT_DISTANCE * math.sin(math.radians(LIGHT_RADIUS_DEG)),
        "emitter": {"type": "area", "radiance": {"type": "rgb", "value": radiance}},
    }
    wall = {
        "type": "rectangle",
        "to_world": move([0, 0, -6]) @ scale([4, 4, 1]),
        "surface": matte(mi, 1, (0.10, 0.22, 0.34), (0.62, 0.60, 0.48), 44),
    }
    glossy = scene.glossy(mi, material_of(mi, scene, shine))
    integrator = {"type": "path", "max_depth": 2}
    return mi.load_dict({"type": "scene", "integrator": integrator, "lamp": lamp, "wall": wall, "glossy": glossy})


def sensor_of(mi: Any, offset: ViewOffset) -> Any:
    """The camera of a view; its frame moves with it, so that the plane at STILL_DEPTH stays."""
    at = np.array([offset.s * STEP, -offset.t * STEP, 0.0])
    return mi.load_dict(
        {
            "type": "perspective",
            "fov": FIELD_OF_VIEW_DEG,
            "to_world": mi.ScalarTransform4f().look_at(at.tolist(), (at - [0, 0, 1]).tolist(), [0, 1, 0]),
            "principal_point_offset_x": INFINITY_PX * offset.s / SIDE,
            "principal_point_offset_y": INFINITY_PX * offset.t / SIDE,
            "film": {"type": "hdrfilm", "width": SIDE, "height": SIDE, "rfilter": {"type": "box"}},
            "sampler": {"type": "multijitter"},
        }
    )


def trace(scene: Any, sensor: Any) -> tuple[Image, NDArray[np.bool_]]:
    """Disparity (H, W) at the pixel centres of a view, and where the glossy thing is seen."""
    disparity, glossy = np.empty((SIDE, SIDE), np.float32), np.empty((SIDE, SIDE), np.bool_)
    for y, x in np.ndindex(SIDE, SIDE):
        ray = sensor.sample_ray(0.0, 0.0, [(x + 0.5) / SIDE, (y + 0.5) / SIDE], [0.5, 0.5])[0]
        hit = scene.ray_intersect(ray)
        disparity[y, x] = FOCAL_PX * STEP / -hit.p[2] + INFINITY_PX
        glossy[y, x] = hit.p[2] > -5.9
    return disparity, glossy


def make(mi: Any, scene: GlossScene, folder: Path, samples: int) -> None:
    """Write a scene."""
    shining, matt = load(mi, scene, 1.0), load(mi, scene, 0.0)
    views = np.empty((*GRID, SIDE, SIDE, 3), np.float16)
    matt_views = np.empty_like(views)
    glossy = np.empty((*GRID, SIDE, SIDE), np.bool_)
    for v, u in np.ndindex(*GRID):
        sensor = sensor_of(mi, GRID.offset(v, u))
        views[v, u] = np.array(mi.render(shining, sensor=sensor, spp=samples))
        matt_views[v, u] = np.array(mi.render(matt, sensor=sensor, spp=samples))
        glossy[v, u] = trace(matt, sensor)[1]
    disparity, _ = trace(matt, sensor_of(mi, ViewOffset(0, 0)))
    np.savez_compressed(
        folder / f"{scene.name}.npz",
        views=views, matt_views=matt_views, glossy=glossy, disparity=disparity, light=np.array(scene.light),
        roughness=scene.roughness, reflectance=REFLECTANCE, light_color=FACING_LIGHT, light_radius=LIGHT_RADIUS_DEG,
        focal_px=FOCAL_PX, infinity=INFINITY_PX,
    )  # fmt: skip
    gained = (views - matt_views).astype(np.float32)
    print(f"{scene.name}: disparity {disparity.min():.2f} to {disparity.max():.2f}, gloss up to {gained.max():.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder for a file a scene")
    parser.add_argument("--samples", type=int, default=256, help="of a pixel")
    args = parser.parse_args()
    try:
        mi = importlib.import_module("mitsuba")
    except ImportError:
        sys.exit(INSTALL)
    mi.set_variant("scalar_rgb")
    args.out.mkdir(parents=True, exist_ok=True)
    for scene in SCENES:
        make(mi, scene, args.out, args.samples)


if __name__ == "__main__":
    main()
