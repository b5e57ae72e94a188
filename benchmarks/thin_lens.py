"""Two small scenes path-traced by Mitsuba: a grid of pinhole views, the centre view's exact disparity, and the picture
of a thin lens, which refocusing the views has to match. What it writes is kept as tests/data/thin_lens.

python -m benchmarks.thin_lens --out tests/data/thin_lens [--view-samples 64] [--lens-samples 2025]

Mitsuba renders in linear light; lights are rendered one by one and added up, so that pictures have hardly any noise.
"""

from __future__ import annotations

import argparse
import importlib
import json
import math
import sys
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import srgb_from_linear
from iibr_core.types import GridShape, ViewOffset

INSTALL = "benchmarks.thin_lens: needs Mitsuba; install it with: pip install mitsuba==3.9.1"
WIDTH, HEIGHT = 128, 96
GRID = GridShape(5, 5)
FIELD_OF_VIEW_DEG = 40.0
FOCAL_PX = WIDTH / 2 / math.tan(math.radians(FIELD_OF_VIEW_DEG / 2))
STEP = 0.055
"""From view to view, in units of the scene."""
STILL_DEPTH = 3.2
"""Of the plane that does not move from view to view."""
LIGHTS = (((1.6, 2.4, 0.2), 40.0), ((-2.6, 1.2, 0.4), 24.0))
"""Places and strengths; small, so that shadows are hard."""

Shapes = dict[str, Any]
Image = NDArray[np.float32]


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


def disparity_at(depth: float) -> float:
    """Pixels per view step of a point that far in front of the camera."""
    return FOCAL_PX * STEP * (1 / depth - 1 / STILL_DEPTH)


def depth_at(disparity: float) -> float:
    """The other way round."""
    return 1 / (disparity / (FOCAL_PX * STEP) + 1 / STILL_DEPTH)


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


def sensor_of(mi: Any, offset: ViewOffset, lens: ThinLens | None) -> Any:
    """The camera of a view; with a lens, one that is focused, at the centre view's place."""
    at = np.array([offset.s * STEP, -offset.t * STEP, 0.0])
    shift_px = FOCAL_PX * STEP / STILL_DEPTH
    camera = {
        "fov": FIELD_OF_VIEW_DEG,
        "fov_axis": "x",
        "to_world": mi.ScalarTransform4f().look_at(at.tolist(), (at - [0, 0, 1]).tolist(), [0, 1, 0]),
        "film": {"type": "hdrfilm", "width": WIDTH, "height": HEIGHT, "rfilter": {"type": "box"}},
        "sampler": {"type": "multijitter"},
    }
    if lens is None:
        # The frame moves with the camera, so that the plane at STILL_DEPTH stays.
        shifts = {"principal_point_offset_x": -shift_px * offset.s / WIDTH}
        shifts["principal_point_offset_y"] = -shift_px * offset.t / HEIGHT
        return mi.load_dict({"type": "perspective", **camera, **shifts})
    opened = {"aperture_radius": lens.radius_views * STEP, "focus_distance": depth_at(lens.focus_disparity)}
    return mi.load_dict({"type": "thinlens", **camera, **opened})


def render_linear(mi: Any, lit: Sequence[Any], sensor: Any, samples: int) -> Image:
    """Linear light (H, W, 3), the sum over lights."""
    return np.asarray(sum(np.array(mi.render(scene, sensor=sensor, spp=samples)) for scene in lit), np.float32)


def visible_points(mi: Any, scene: Any, sensor: Any, y: NDArray[Any], x: NDArray[Any]) -> NDArray[np.float64]:
    """(N, 3): what the rays through these places of the picture hit; pixel centres are integers."""
    points = []
    for row, column in zip(y, x):
        place = [(column + 0.5) / WIDTH, (row + 0.5) / HEIGHT]
        points.append(np.array(scene.ray_intersect(sensor.sample_ray(0.0, 0.0, place, [0.5, 0.5])[0]).p).ravel())
    return np.array(points)


def exact_disparity(mi: Any, scene: Any) -> Image:
    """(H, W) at the pixel centres of the centre view."""
    y, x = (grid.ravel() for grid in np.mgrid[0:HEIGHT, 0:WIDTH])
    depth = -visible_points(mi, scene, sensor_of(mi, ViewOffset(0, 0), None), y, x)[:, 2]
    return np.array([disparity_at(z) for z in depth], np.float32).reshape(HEIGHT, WIDTH)


def require_convention(mi: Any, scene: Any, disparity: Image) -> None:
    """Raise ValueError unless a view shows at (x - d * s, y - d * t) what the centre view shows at (x, y)."""
    offset = ViewOffset(2.0, -1.0)
    y, x = (grid.ravel() for grid in np.mgrid[8 : HEIGHT - 8 : 4, 8 : WIDTH - 8 : 4])
    d = disparity[y, x]
    here = visible_points(mi, scene, sensor_of(mi, ViewOffset(0, 0), None), y, x)
    there = visible_points(mi, scene, sensor_of(mi, offset, None), y - d * offset.t, x - d * offset.s)
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
    disparity = exact_disparity(mi, lit[0])
    require_convention(mi, lit[0], disparity)
    (folder / "views").mkdir(parents=True, exist_ok=True)
    v, u = GRID.centre
    np.save(folder / f"gt_disp_u{u:02d}_v{v:02d}.npy", disparity)
    brightest = 0.0
    for row, column in np.ndindex(*GRID):
        picture = render_linear(mi, lit, sensor_of(mi, GRID.offset(row, column), None), view_samples)
        brightest = max(brightest, float(picture.max()))
        write(mi, folder / "views" / f"v{row:02d}_u{column:02d}.png", picture, 8)
    through = render_linear(mi, lit, sensor_of(mi, ViewOffset(0, 0), scene.lens), lens_samples)
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
    try:
        mi = importlib.import_module("mitsuba")
    except ImportError:
        sys.exit(INSTALL)
    mi.set_variant("scalar_rgb")
    for scene in SCENES:
        make(mi, scene, args.out / scene.name, args.view_samples, args.lens_samples)


if __name__ == "__main__":
    main()
