"""Small path-traced light fields of glossy things, by Mitsuba: the truth that benchmarks.gloss judges by.

python -m benchmarks.gloss_scenes --out FOLDER [--samples 256] [--scene NAME ...]

A scene is one .npz: every view with its gloss and without, the centre view's exact disparity, and where the glossy
thing is seen in each view.
"""

from __future__ import annotations

import importlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.report import parser_of, start
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset

Shapes = dict[str, Any]
"""Mitsuba's descriptions, by name."""
Image = NDArray[np.float32]


def load_mitsuba() -> Any:
    """Mitsuba, where it is installed. Raises InputError where it is not."""
    try:
        mi = importlib.import_module("mitsuba")
    except ImportError:
        raise InputError("needs Mitsuba; install it with: pip install mitsuba==3.9.1") from None
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

    def depths(self, scene: Any, sensor: Any) -> NDArray[np.float64]:
        """(H, W), at the pixel centres of a view, which are integers."""
        depths = np.empty(self.size)
        for y, x in np.ndindex(*self.size):
            place = [(x + 0.5) / self.size.width, (y + 0.5) / self.size.height]
            ray = sensor.sample_ray(0.0, 0.0, place, [0.5, 0.5])[0]
            depths[y, x] = -np.array(scene.ray_intersect(ray).p).ravel()[2]
        return depths


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
    parser = parser_of(__doc__)
    parser.add_argument("--out", type=Path, required=True, help="folder for a file a scene")
    parser.add_argument("--samples", type=int, default=256, help="of a pixel")
    names = [scene.name for scene in SCENES]
    parser.add_argument("--scene", choices=names, nargs="+", default=names, help="usually all")
    args = parser.parse_args()
    mi = load_mitsuba()
    args.out.mkdir(parents=True, exist_ok=True)
    for scene in (scene for scene in SCENES if scene.name in args.scene):
        make(mi, scene, args.out, args.samples)


if __name__ == "__main__":
    start("benchmarks.gloss_scenes", main)
