"""Every lens of the program against its definition: the mean of 256 pinhole views, and the time that takes.

    python -m benchmarks.refocus [--data FOLDER] [--only NAME,...] [--max-pixels N] [--apertures N]

The demo, three drawn scenes and, of FOLDER, photos and a wide field are drawn through apertures from 0.2 view steps to
the grid, at three planes of focus, from three viewpoints. The reference sums views that the core makes at the cameras'
own places; nothing in it is blended from stored views. Times are medians, and ratios to a plain gather.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.bench_scenes import DEMO, BenchScene, data_scenes, drawn_scene, offsets_of
from benchmarks.harness.reports import emit, is_wanted, markdown, parser_of, start
from benchmarks.harness.timing import cost_of, in_turns, median_cost
from iibr_core.beyond.aperture_sampling import aperture_points
from iibr_core.beyond.lens import LensSum
from iibr_core.beyond.optics import CENTRE, ApertureShape, Optics
from iibr_core.color import encoded_from_stored, srgb_from_linear
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.interface.public_scene import from_arrays
from iibr_core.method.light_field import generate
from iibr_core.method.photo_views import PhotoViews
from iibr_core.method.plan import plan_for_viewing, plan_literal
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import (
    FloatImage,
    GridShape,
    ImageSize,
    ViewOffset,
    image_size,
)
from viewer.gpu.context import GLContext
from viewer.gpu.headless_context import create_headless
from viewer.gpu.refocus.picture_renderer import Renderer

CAMERAS = 256
VIEWPOINTS = (CENTRE, ViewOffset(0.37, -0.81), ViewOffset(-0.5, 0.5))
FOCUS_PERCENT = (5, 50, 95)
INTERFACE_APERTURES = (0.6, 1.1, 2.0)
DRAWN_SIZE, DRAWN_PX, DRAWN_GRID, DRAWN_SEEDS = ImageSize(240, 320), 5.0, GridShape(5, 5), (3, 8, 21)
BESIDE = ViewOffset(0.0, 0.2)
"""A viewpoint beside a stored view."""
PLAIN_VERTEX = """#version 330 core
out vec2 uv;
void main() { uv = vec2(gl_VertexID % 2, gl_VertexID / 2) * 2.0; gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0); }
"""
PLAIN_FRAGMENT = """#version 330 core
uniform sampler2DArray views;
uniform int fetches;
uniform vec2 shear;
in vec2 uv;
out vec4 color;
void main() {
    vec3 sum = vec3(0.0);
    for (int i = 0; i < fetches; i++) {
        vec3 root = textureLod(views, vec3(uv + shear * float(i), i), 0.0).rgb;
        sum += root * root;
    }
    color = vec4(sqrt(sum / float(fetches)), 1.0);
}
"""


@dataclass
class Figures:
    """Errors of one scene's pictures.

    settled: dB against the reference. first_db, first_mean: the first frame of a drag against the settled picture, dB
    and share of white. rises: growth of the mean gradient from one aperture to the next. interface: dB of
    `field.refocus`. sharpness: gradient beside a stored view over that at it.
    """

    settled: list[float]
    first_db: list[float]
    first_mean: list[float]
    rises: list[float]
    interface: list[float]
    sharpness: float = 1.0

    @property
    def row(self) -> tuple[Any, ...]:
        """Cells of the table."""
        least, mean = min(self.settled), float(np.mean(self.settled))
        first = f"{min(self.first_db):.1f}", f"{100 * max(self.first_mean):.2f} %"
        rest = f"{100 * max(self.rises):+.1f} %", f"{min(self.interface):.1f}", f"{100 * (self.sharpness - 1):+.1f} %"
        return f"{least:.1f}", f"{mean:.1f}", *first, *rest


def main() -> None:
    parser = parser_of(__doc__, "data", "only", "repeats")
    parser.add_argument("--max-pixels", type=int, default=120_000, help="of each photo")
    parser.add_argument("--apertures", type=int, default=12)
    options = parser.parse_args()
    gl = create_headless()
    heads = ("scene", "settled, least dB", "mean dB", "first frame, least dB", "mean off by", "gradient rises by")
    heads = (*heads, "`field.refocus`, least dB", "sharpness at 0.2,0")
    try:
        scenes = [s for s in scenes_of(options.data, options.max_pixels) if is_wanted(s.name, options.only)]
        rows = [(scene.name, *figures_of(gl, scene, options.apertures).row) for scene in scenes]
        times = [(scene.name, *times_of(gl, scene, options.repeats)) for scene in scenes]
        names = ("scene", "first frame, ms", "settled, ms", "first frame / 25 fetches", "first frame / 81 fetches")
        emit(["## Error\n", markdown(heads, rows), "\n## Time, aperture of 4 view steps or the grid\n"])
        emit([markdown(names, times)])
    finally:
        gl.release()


def scenes_of(data: Path | None, max_pixels: int) -> Iterator[BenchScene]:
    """The scenes to draw, each with the field that the window makes of it."""
    yield photo_field("demo", DEMO, DepthChoice(), max_pixels)
    if data is not None:
        antinous = data / "hci_antinous"
        choice = DepthChoice(file=str(antinous / "gt_disp_u04_v04.npy"))
        yield photo_field("antinous", antinous / "views" / "v04_u04.png", choice, max_pixels)
        yield photo_field("pug", data / "apple_pug_heic" / "pug.heic", DepthChoice(), max_pixels)
        yield photo_field("coffee", data / "photos_free" / "coffee.png", DepthChoice("rough"), max_pixels)
        yield from (s for s in data_scenes(data, with_soft=False) if s.name == "blender_shop_9x9")
    for seed in DRAWN_SEEDS:
        yield drawn_scene(seed, DRAWN_SIZE, DRAWN_PX, DRAWN_GRID)


def photo_field(name: str, path: Path, choice: DepthChoice, max_pixels: int) -> BenchScene:
    """A photo with its plan's grid and disparity."""
    found = open_with_depth(path, choice, max_pixels)
    plan = plan_for_viewing(found.photo, found.disparity)
    return BenchScene(name, found.photo.pixels, plan.field_disparity(found.disparity).values, {}, offsets_of(plan.grid))


class Reference:
    """The definition of the lens: views at the cameras' own places, summed by the core."""

    def __init__(self, scene: BenchScene) -> None:
        self._size, self._widest = image_size(scene.disparity), float(max(scene.grid))
        self._views = PhotoViews(scene.photo, scene.disparity, scene.field)

    def pictures(self, eye: ViewOffset, diameter: float, foci: list[float]) -> list[FloatImage]:
        """Encoded pictures (H, W, 3), one a focus."""
        sums = [LensSum(Optics(eye, focus_disparity=focus), self._size) for focus in foci]
        points = aperture_points(ApertureShape(), diameter, self._widest, CAMERAS, 0).tolist()
        cameras = [ViewOffset(eye.t + t, eye.s + s) for t, s in points]
        for at, view in zip(cameras, self._views.views(cameras)):
            for total in sums:
                total.add(at, view.colors)
        return [srgb_from_linear(total.light()) for total in sums]


def renderer_of(gl: GLContext, scene: BenchScene) -> Renderer:
    """The scene's field, open."""
    renderer, (height, width) = Renderer(gl), scene.photo.shape[:2]
    renderer.open_field(scene.grid, width, height, hdr=False, with_disparity=True)
    for view in generate(*scene.given, plan_literal(*scene.given, scene.grid)):
        renderer.upload_view(view.row, view.column, view.colors, view.disparity)
    return renderer


def figures_of(gl: GLContext, scene: BenchScene, count: int) -> Figures:
    """Draw the scene in every way."""
    reference, renderer = Reference(scene), renderer_of(gl, scene)
    size = ScreenSize(scene.photo.shape[1], scene.photo.shape[0])
    foci = [float(np.percentile(scene.disparity, percent)) for percent in FOCUS_PERCENT]
    apertures = np.geomspace(0.2, max(scene.grid), count).tolist()
    found = Figures([], [], [], [], [])

    def settled(optics: Optics) -> FloatImage:
        return float_of(renderer.converged_picture(RenderSettings(optics, size)))

    for eye in VIEWPOINTS:
        gradients: list[list[float]] = [[gradient(settled(Optics(eye)))] for _ in foci]
        for diameter in apertures:
            for k, expected in enumerate(reference.pictures(eye, diameter, foci)):
                optics = Optics(eye, focus_disparity=foci[k], aperture_diameter=diameter)
                picture = settled(optics)
                renderer.render(optics, size)
                first = float_of(renderer.read_image())
                found.settled.append(bounded_psnr(picture, expected))
                found.first_db.append(bounded_psnr(first, picture))
                found.first_mean.append(abs(float(first.mean() - picture.mean())))
                gradients[k].append(gradient(picture))
        found.rises += [after / before - 1 for series in gradients for before, after in pairwise(series)]
    found.sharpness = gradient(settled(Optics(BESIDE))) / gradient(settled(Optics()))
    field = from_arrays(scene.photo, scene.disparity).light_field(tuple(scene.grid), parallax="literal")
    for diameter in INTERFACE_APERTURES:
        for focus, expected in zip(foci, reference.pictures(CENTRE, diameter, foci)):
            found.interface.append(bounded_psnr(field.refocus(focus, diameter), expected))
    renderer.release()
    return found


def times_of(gl: GLContext, scene: BenchScene, repeats: int) -> tuple[str, ...]:
    """Milliseconds of the first frame and of the settled picture, and the first over plain gathers."""
    renderer, size = renderer_of(gl, scene), ScreenSize(scene.photo.shape[1], scene.photo.shape[0])
    focus = float(np.percentile(scene.disparity, FOCUS_PERCENT[0]))
    optics = Optics(focus_disparity=focus, aperture_diameter=min(4.0, float(max(scene.grid))))
    first = partial(renderer.render, optics, size)
    settled = partial(renderer.converged_picture, RenderSettings(optics, size))
    ways = {"first": first, "settled": settled, **{f"{n}": plain_gather(gl, scene, n) for n in (25, 81)}}
    for way in ways.values():
        way()
    costs = in_turns(
        {k: partial(cost_of, lambda way=way: (way(), gl.ctx.finish())) for k, way in ways.items()}, repeats
    )
    ms = {name: 1e3 * median_cost(own).wall_s for name, own in costs.items()}
    renderer.release()
    ratios = (f"{ms['first'] / ms[name]:.2f}" for name in ("25", "81"))
    return f"{ms['first']:.0f}", f"{ms['settled']:.0f}", *ratios


def plain_gather(gl: GLContext, scene: BenchScene, fetches: int) -> Any:
    """Return a function that draws the mean of so many layers, each moved, by the plainest shader."""
    height, width = scene.photo.shape[:2]
    pixels = np.rint(255 * np.clip(scene.photo, 0, 1)).astype(np.uint8)
    texture = gl.ctx.texture_array(
        (width, height, fetches), 3, np.repeat(pixels[None], fetches, 0).tobytes(), alignment=1
    )
    texture.filter, texture.repeat_x, texture.repeat_y = (moderngl.LINEAR, moderngl.LINEAR), False, False
    program = gl.ctx.program(PLAIN_VERTEX, PLAIN_FRAGMENT)
    program["fetches"], program["shear"] = fetches, (0.3 / width, 0.2 / height)
    target, quad = gl.ctx.simple_framebuffer((width, height), components=4), gl.ctx.vertex_array(program, [])

    def draw() -> None:
        texture.use(0)
        target.use()
        gl.ctx.disable(moderngl.BLEND)
        quad.render(moderngl.TRIANGLES, vertices=3)

    return draw


def float_of(picture: NDArray[Any]) -> FloatImage:
    """Bytes as floats, 1 = white."""
    return np.asarray(encoded_from_stored(picture), np.float32)


def gradient(picture: FloatImage) -> float:
    """Mean difference of neighbouring pixels."""
    grey = picture.mean(axis=-1)
    return float(np.abs(np.diff(grey, axis=0)).mean() + np.abs(np.diff(grey, axis=1)).mean())


if __name__ == "__main__":
    start("benchmarks.refocus", main)
