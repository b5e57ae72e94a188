"""Small path-traced light fields of glossy things, by Mitsuba: the truth that benchmarks.gloss judges by.

python -m benchmarks.gloss_scenes --out FOLDER [--samples 256] [--scene NAME ...]

A scene is one .npz: every view with its gloss and without, the centre view's exact disparity, and where the glossy
thing is seen in each view.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.path_traced import CameraRig, Image, Shapes, load_mitsuba, matte
from iibr_core.types import GridShape, ImageSize

LIGHT_RADIUS_DEG, LIGHT_DISTANCE = 3.0, 400.0
FACING_LIGHT = 1.0
"""Linear light of white paper that faces the light."""
WALL_DEPTH = 6.0
INDEX = 1.5
REFLECTANCE = ((INDEX - 1) / (INDEX + 1)) ** 2
SQUARE = CameraRig(ImageSize(96, 96), field_of_view_deg=40.0, step=0.12, still_depth=4.0)
APART = CameraRig(ImageSize(96, 96), field_of_view_deg=40.0, step=0.2, still_depth=4.0)
WIDE = CameraRig(ImageSize(128, 128), field_of_view_deg=50.0, step=0.2, still_depth=1.7)
FIELD, ROW = GridShape(5, 5), GridShape(1, 9)
BLUE_AND_BROWN = (0.12, 0.16, 0.22), (0.30, 0.20, 0.14)
GREEN_AND_RED = (0.10, 0.26, 0.12), (0.42, 0.14, 0.10)
WOOD = (0.34, 0.20, 0.10), (0.16, 0.09, 0.05)


@dataclass(frozen=True)
class GlossScene:
    """light: direction towards it, x right, y down, z away. glossy: makes the glossy thing of its material. paint: seed
    and two colours of its matt part.
    """

    name: str
    roughness: float
    light: tuple[float, float, float]
    glossy: Callable[[Any, Shapes], Shapes]
    rig: CameraRig = SQUARE
    grid: GridShape = FIELD
    paint: tuple[int, tuple[tuple[float, float, float], tuple[float, float, float]]] = (5, BLUE_AND_BROWN)


def sphere(center: tuple[float, float, float], radius: float) -> Callable[[Any, Shapes], Shapes]:
    return lambda mi, material: {"type": "sphere", "center": list(center), "radius": radius, "surface": material}


def plane(center: tuple[float, float, float], across: float, down: float) -> Callable[[Any, Shapes], Shapes]:
    """Turned by so many degrees about the axes across and down."""

    def make(mi: Any, material: Shapes) -> Shapes:
        to = mi.ScalarTransform4f()
        turned = to.rotate([1, 0, 0], across) @ to.rotate([0, 1, 0], down)
        place = to.translate(list(center)) @ turned @ to.scale([1.1, 0.9, 1])
        return {"type": "rectangle", "to_world": place, "surface": material}

    return make


def cylinder(
    start: tuple[float, float, float], end: tuple[float, float, float], radius: float
) -> Callable[[Any, Shapes], Shapes]:
    ends = {"p0": list(start), "p1": list(end)}
    return lambda mi, material: {"type": "cylinder", **ends, "radius": radius, "surface": material}


NEAR_CYLINDER = cylinder((-0.1, -1.2, -2), (0.1, 1.2, -2.2), 0.6)
POST = cylinder((0.2, -1.1, -3.4), (-0.2, 1.1, -3.7), 0.6)
SCENES = (
    GlossScene("sphere", 0.3, (-0.35, -0.45, -0.8), sphere((0, 0, -4), 0.85)),
    GlossScene("plane", 0.3, (0.38, -0.61, -0.69), plane((0, 0, -4), -20, 12)),
    GlossScene("cylinder", 0.55, (0.6, -0.15, -0.8), cylinder((-0.25, -1.1, -4), (0.25, 1.1, -4.2), 0.7)),
    # as curved on the EPI as highlights get: wide steps, near things, light from the side or from behind
    GlossScene("near_sphere", 0.2, (-0.6, -0.2, -0.7), sphere((0, 0, -2.4), 0.8), WIDE, ROW, (6, GREEN_AND_RED)),
    GlossScene("grazed_sphere", 0.25, (-0.9, -0.2, 0.3), sphere((0, 0, -2.0), 0.7), WIDE, ROW, (7, BLUE_AND_BROWN)),
    GlossScene("near_cylinder", 0.5, (0.85, -0.1, -0.3), NEAR_CYLINDER, WIDE, ROW, (8, WOOD)),
    # not looked at while anything was fitted
    GlossScene("table", 0.25, (0.1, -0.94, 0.3), plane((0, -0.2, -3.6), -55, 5), APART, FIELD, (9, WOOD)),
    GlossScene("ball", 0.35, (0.5, -0.5, -0.7), sphere((0.1, 0, -3.6), 0.95), APART, FIELD, (10, GREEN_AND_RED)),
    GlossScene("post", 0.3, (-0.5, -0.1, -0.85), POST, APART, FIELD, (11, WOOD)),
)


def material_of(mi: Any, scene: GlossScene, shine: float) -> Shapes:
    """Plastic whose matt part is the same with (shine 1) and without gloss (shine 0)."""
    seed, colors = scene.paint
    return {
        "type": "roughplastic",
        "distribution": "ggx",
        "alpha": scene.roughness**2,
        "int_ior": INDEX,
        "nonlinear": False,
        "diffuse_reflectance": matte(mi, seed, *colors, 16)["reflectance"],
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
        "to_world": move([0, 0, -WALL_DEPTH]) @ scale([4, 4, 1]),
        "surface": matte(mi, 1, (0.10, 0.22, 0.34), (0.62, 0.60, 0.48), 44),
    }
    glossy = scene.glossy(mi, material_of(mi, scene, shine))
    integrator = {"type": "path", "max_depth": 2}
    return mi.load_dict({"type": "scene", "integrator": integrator, "lamp": lamp, "wall": wall, "glossy": glossy})


def make(mi: Any, scene: GlossScene, folder: Path, samples: int) -> None:
    """Write a scene."""
    rig, grid = scene.rig, scene.grid
    shining, matt = load(mi, scene, 1.0), load(mi, scene, 0.0)
    views: Image = np.empty((*grid, *rig.size, 3), np.float16)
    matt_views = np.empty_like(views)
    depths = np.empty((*grid, *rig.size))
    for v, u in np.ndindex(*grid):
        sensor = rig.pinhole(mi, grid.offset(v, u))
        views[v, u] = np.array(mi.render(shining, sensor=sensor, spp=samples))
        matt_views[v, u] = np.array(mi.render(matt, sensor=sensor, spp=samples))
        depths[v, u] = rig.depths(matt, sensor)
    disparity = rig.disparity_at(depths[grid.centre]).astype(np.float32)
    np.savez_compressed(
        folder / f"{scene.name}.npz",
        views=views, matt_views=matt_views, glossy=depths < WALL_DEPTH - 0.1, disparity=disparity,
        light=np.array(scene.light), roughness=scene.roughness, reflectance=REFLECTANCE, light_color=FACING_LIGHT,
        light_radius=LIGHT_RADIUS_DEG, focal_px=rig.focal_px, infinity=rig.infinity_px,
    )  # fmt: skip
    gained = (views - matt_views).astype(np.float32)
    print(f"{scene.name}: disparity {disparity.min():.2f} to {disparity.max():.2f}, gloss up to {gained.max():.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder for a file a scene")
    parser.add_argument("--samples", type=int, default=256, help="of a pixel")
    names = [scene.name for scene in SCENES]
    parser.add_argument("--scene", choices=names, nargs="+", default=names, help="usually all")
    args = parser.parse_args()
    mi = load_mitsuba("benchmarks.gloss_scenes")
    args.out.mkdir(parents=True, exist_ok=True)
    for scene in (scene for scene in SCENES if scene.name in args.scene):
        make(mi, scene, args.out, args.samples)


if __name__ == "__main__":
    main()
