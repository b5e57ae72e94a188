"""Two small scenes path-traced by Mitsuba: a grid of pinhole views, the centre view's exact disparity, and the picture
of a thin lens, which refocusing the views has to match. What it writes is kept as tests/data/thin_lens.

python -m benchmarks.thin_lens --out tests/data/thin_lens [--view-samples 64] [--lens-samples 2025]

Mitsuba renders in linear light; lights are rendered one by one and added up, so that pictures have hardly any noise.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.path_traced import CameraRig, Image, Shapes, load_mitsuba, matte
from iibr_core.color import srgb_from_linear
from iibr_core.types import GridShape, ImageSize, ViewOffset

RIG = CameraRig(ImageSize(96, 128), field_of_view_deg=40.0, step=0.055, still_depth=3.2)
GRID = GridShape(5, 5)
LIGHTS = (((1.6, 2.4, 0.2), 40.0), ((-2.6, 1.2, 0.4), 24.0))
"""Places and strengths; small, so that shadows are hard."""


@dataclass(frozen=True)
class ThinLens:
    """focus_disparity: px per view step, sharp. radius_views: of the aperture, in view steps."""

    focus_disparity: float
    radius_views: float


@dataclass(frozen=True)
class LensScene:
    """shapes: makes Mitsuba's descriptions of everything but lights and camera, which looks along -z from 0."""

    name: str
    lens: ThinLens
    shapes: Callable[[Any], Shapes]


def room(mi: Any, seed: int) -> Shapes:
    """A wall at depth 5 and a floor that comes towards the camera."""
    move, turn, scale = mi.ScalarTransform4f().translate, mi.ScalarTransform4f().rotate, mi.ScalarTransform4f().scale
    wall = {
        "type": "rectangle",
        "to_world": move([0, 0.8, -5]) @ scale([3, 2.2, 1]),
        "surface": matte(mi, seed, (0.10, 0.22, 0.34), (0.62, 0.60, 0.48), 44),
    }
    floor = {
        "type": "rectangle",
        "to_world": move([0, -0.62, -3]) @ turn([1, 0, 0], -90) @ scale([3, 2.6, 1]),
        "surface": matte(mi, seed + 1, (0.30, 0.18, 0.10), (0.66, 0.50, 0.34), 40),
    }
    return {"wall": wall, "floor": floor}


def shelf(mi: Any) -> Shapes:
    """A box, a ball behind it, and a wire across the front."""
    move, turn, scale = mi.ScalarTransform4f().translate, mi.ScalarTransform4f().rotate, mi.ScalarTransform4f().scale
    box = {
        "type": "cube",
        "to_world": move([-0.36, -0.32, -2.75]) @ turn([0, 1, 0], 32) @ scale([0.22, 0.30, 0.22]),
        "surface": matte(mi, 11, (0.50, 0.08, 0.06), (0.78, 0.44, 0.20), 12),
    }
    ball = {
        "type": "sphere",
        "center": [0.55, -0.24, -3.6],
        "radius": 0.38,
        "surface": matte(mi, 12, (0.06, 0.28, 0.12), (0.56, 0.72, 0.40), 16),
    }
    wire = {
        "type": "cylinder",
        "p0": [-0.10, -0.60, -2.25],
        "p1": [0.62, 0.66, -2.25],
        "radius": 0.013,
        "surface": matte(mi, 13, (0.62, 0.62, 0.66), (0.78, 0.78, 0.74)),
    }
    return {**room(mi, 1), "box": box, "ball": ball, "wire": wire}


def fence(mi: Any) -> Shapes:
    """Narrow posts and a rail in front of two balls."""
    move, scale = mi.ScalarTransform4f().translate, mi.ScalarTransform4f().scale
    wood = matte(mi, 21, (0.46, 0.36, 0.22), (0.80, 0.72, 0.56), 12)
    posts = {
        f"post_{k}": {
            "type": "cube",
            "to_world": move([-0.60 + 0.4 * k, -0.20, -2.2]) @ scale([0.035, 0.46, 0.02]),
            "surface": wood,
        }
        for k in range(4)
    }
    rail = {"type": "cube", "to_world": move([0, 0.02, -2.25]) @ scale([0.9, 0.03, 0.015]), "surface": wood}
    near = {
        "type": "sphere",
        "center": [-0.28, -0.27, -3.3],
        "radius": 0.35,
        "surface": matte(mi, 22, (0.10, 0.10, 0.42), (0.52, 0.58, 0.80), 16),
    }
    far = {
        "type": "sphere",
        "center": [0.72, -0.14, -4.1],
        "radius": 0.48,
        "surface": matte(mi, 23, (0.52, 0.22, 0.06), (0.82, 0.66, 0.22), 16),
    }
    return {**room(mi, 3), **posts, "rail": rail, "near": near, "far": far}


SCENES = (
    LensScene("shelf", ThinLens(focus_disparity=0.4, radius_views=2.0), shelf),
    LensScene("fence", ThinLens(focus_disparity=-0.3, radius_views=2.0), fence),
)


def lens_sensor(mi: Any, lens: ThinLens) -> Any:
    """The centre view's camera with a lens, focused."""
    opened = {"aperture_radius": lens.radius_views * RIG.step, "focus_distance": RIG.depth_at(lens.focus_disparity)}
    return mi.load_dict({"type": "thinlens", **RIG.camera(mi, ViewOffset(0, 0)), **opened})


def render_linear(mi: Any, lit: Sequence[Any], sensor: Any, samples: int) -> Image:
    """Linear light (H, W, 3), the sum over lights."""
    return np.asarray(sum(np.array(mi.render(scene, sensor=sensor, spp=samples)) for scene in lit), np.float32)


def require_convention(mi: Any, scene: Any, disparity: Image) -> None:
    """Raise ValueError unless a view shows at (x - d * s, y - d * t) what the centre view shows at (x, y)."""
    offset = ViewOffset(2.0, -1.0)
    y, x = (grid.ravel() for grid in np.mgrid[8 : RIG.size.height - 8 : 4, 8 : RIG.size.width - 8 : 4])
    d = disparity[y, x]
    here = RIG.visible_points(scene, RIG.pinhole(mi, ViewOffset(0, 0)), y, x)
    there = RIG.visible_points(scene, RIG.pinhole(mi, offset), y - d * offset.t, x - d * offset.s)
    apart = np.linalg.norm(here - there, axis=1)
    if np.quantile(apart, 0.8) > 1e-3:
        raise ValueError(f"views do not follow the project's convention: points lie {np.median(apart):.4f} apart")


def write(mi: Any, path: Path, linear: Image, bits: int) -> None:
    """sRGB-encoded, with the project's own curve."""
    encoded = np.clip(srgb_from_linear(linear), 0, 1)
    whole = np.rint(encoded * (2**bits - 1)).astype(np.uint8 if bits == 8 else np.uint16)
    mi.Bitmap(whole, mi.Bitmap.PixelFormat.RGB).write(str(path))


def make(mi: Any, scene: LensScene, folder: Path, view_samples: int, lens_samples: int) -> None:
    """Write views/, gt_disp, lens.png and lens.json of a scene."""
    shapes = scene.shapes(mi)
    lit = []
    for position, strength in LIGHTS:
        light = {"type": "point", "position": list(position), "intensity": {"type": "rgb", "value": strength}}
        integrator = {"type": "path", "max_depth": 2}
        lit.append(mi.load_dict({"type": "scene", "integrator": integrator, "light": light, **shapes}))
    centre = RIG.pinhole(mi, ViewOffset(0, 0))
    disparity = RIG.disparity_at(RIG.depths(lit[0], centre)).astype(np.float32)
    require_convention(mi, lit[0], disparity)
    (folder / "views").mkdir(parents=True, exist_ok=True)
    v, u = GRID.centre
    np.save(folder / f"gt_disp_u{u:02d}_v{v:02d}.npy", disparity)
    brightest = 0.0
    for row, column in np.ndindex(*GRID):
        picture = render_linear(mi, lit, RIG.pinhole(mi, GRID.offset(row, column)), view_samples)
        brightest = max(brightest, float(picture.max()))
        write(mi, folder / "views" / f"v{row:02d}_u{column:02d}.png", picture, 8)
    through = render_linear(mi, lit, lens_sensor(mi, scene.lens), lens_samples)
    write(mi, folder / "lens.png", through, 16)
    about = {**asdict(scene.lens), "samples": lens_samples, "mitsuba": mi.__version__, "variant": mi.variant()}
    (folder / "lens.json").write_text(json.dumps(about, indent=1) + "\n")
    print(f"{scene.name}: disparity {disparity.min():.2f} to {disparity.max():.2f}, brightest {brightest:.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", type=Path, required=True, help="folder for a subfolder a scene")
    parser.add_argument("--view-samples", type=int, default=64, help="of a pixel, for each light")
    parser.add_argument("--lens-samples", type=int, default=2025, help="of a pixel, for each light")
    args = parser.parse_args()
    mi = load_mitsuba("benchmarks.thin_lens")
    for scene in SCENES:
        make(mi, scene, args.out / scene.name, args.view_samples, args.lens_samples)


if __name__ == "__main__":
    main()
