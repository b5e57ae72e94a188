"""The renderer's switches: time of a picture, drawn in many ways and by the plainest shader, against its error.

    python -m benchmarks.refocus --data FOLDER [--only NAME,...] [--repeats 3]

Fields of the scenes of FOLDER are drawn through an aperture and through a pinhole between the views, in turns: *at
once*, which the viewer shows first, and otherwise. Errors are against a plain float sum in numpy over four times as
many views as are stored. The plain shader shifts and sums views from their texture, and does nothing else.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial

import moderngl
import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.bench_scenes import BenchScene, data_scenes
from benchmarks.harness.reports import emit, is_wanted, parser_of, start
from benchmarks.harness.timing import Cost, cost_of, in_turns, median_cost, median_ratio
from benchmarks.speed.speed_report import Figures, Measured, table
from iibr_core.color import encoded_from_stored, stored_from_encoded
from iibr_core.evaluation.focal_stacks import FocalStack, Focus
from iibr_core.evaluation.metrics import bounded_psnr, flip
from iibr_core.generation.cost_model import CORES
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_literal
from iibr_core.rendering.optics import Optics
from iibr_core.types import FloatImage, GridShape, ViewOffset
from viewer.gpu.context import GLContext
from viewer.gpu.headless_context import create_headless
from viewer.gpu.refocus.frame_budget import BEST_QUALITY, QualityLevel, scale_size, stretch_image
from viewer.gpu.refocus.picture_renderer import Renderer

APERTURE_VIEWS = 6.0
BETWEEN = ViewOffset(-0.5, 1.5)
"""An eye between the stored views, on one of those that only the best picture has."""
LEAST_SIDE = 5
"""Fields with fewer views a side have none to leave out."""
FINER = 2
"""Views of the best picture, to each stored one across and down."""
PLAIN = "plain shader"
PLAIN_VERTEX = """#version 330 core
out vec2 uv;
void main() { uv = vec2(gl_VertexID % 2, gl_VertexID / 2) * 2.0; gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0); }
"""
PLAIN_FRAGMENT = """#version 330 core
uniform sampler2DArray views;
uniform int columns, first, last;
uniform vec2 shear, eye;
uniform float radius;
in vec2 uv;
out vec4 color;
void main() {
    vec4 sum = vec4(0.0);
    for (int v = first; v <= last; v++)
        for (int u = first; u <= last; u++) {
            vec2 offset = vec2(u, v) - eye;
            vec3 root = textureLod(views, vec3(uv + shear * offset, v * columns + u), 0.0).rgb;
            sum += clamp(radius + 0.5 - length(offset), 0.0, 1.0) * vec4(root * root, 1.0);
        }
    color = vec4(sqrt(sum.rgb / sum.a), 1.0);
}
"""


@dataclass(frozen=True)
class DrawVariant:
    """One way to draw the same picture. every: of the views across and down, one in so many is stored; 0: centre and
    corners only. is_half_float: textures of half floats instead of bytes. is_converged: every sample there is.
    """

    name: str
    level: QualityLevel = BEST_QUALITY
    prefilter: bool = True
    adaptive: bool = True
    every: int = 1
    is_half_float: bool = False
    knows_disparity: bool = True
    is_converged: bool = False


REFERENCE = DrawVariant("at once")
SHARED = (
    DrawVariant("until converged", is_converged=True),
    DrawVariant("half the picture's width", QualityLevel(scale=0.5)),
    DrawVariant("textures of half floats", is_half_float=True),
    DrawVariant("every 2nd view stored", every=2),
    DrawVariant("centre and corners stored", every=0),
    DrawVariant("views without disparity", knows_disparity=False),
)
APERTURE_VARIANTS = (
    REFERENCE,
    *SHARED,
    DrawVariant("every 2nd sample across and down", QualityLevel(stride=2)),
    DrawVariant("every 2nd sample, half width", QualityLevel(stride=2, scale=0.5)),
    DrawVariant("no smoothing", prefilter=False),
    DrawVariant("tiles skip nothing", adaptive=False),
    DrawVariant(PLAIN),
)
PINHOLE_VARIANTS = (
    REFERENCE,
    *SHARED,
    DrawVariant("of 2 views", QualityLevel(sources=2)),
    DrawVariant("of 1 view", QualityLevel(sources=1)),
)


def main() -> None:
    parser = parser_of(__doc__, "repeats", "only", data={"required": True})
    options = parser.parse_args()
    scenes = (scene for scene in data_scenes(options.data, with_soft=False) if is_wanted(scene.name, options.only))
    large = (scene for scene in scenes if 2 * scene.reach + 1 >= LEAST_SIDE)
    gl = create_headless()
    try:
        drawn = (figures for scene in large for figures in measure_drawing(gl, scene, options.repeats))
        emit(f"## {each.what}\n\n{table(each)}\n" for each in drawn)
    finally:
        gl.release()


def measure_drawing(gl: GLContext, scene: BenchScene, repeats: int) -> Iterator[Figures]:
    """A refocused picture, and one through a pinhole between the views, of a scene's field, drawn in every way."""
    focus, diameter = float(np.median(scene.disparity)), min(APERTURE_VIEWS, 2.0 * scene.reach)
    refocused = Optics(focus_disparity=focus, aperture_diameter=diameter)
    pictures = {
        f"{scene.name}, refocused, aperture of {diameter:g} view steps": (refocused, APERTURE_VARIANTS),
        f"{scene.name}, pinhole between views": (Optics(eye=BETWEEN), PINHOLE_VARIANTS),
    }
    drawer = _Drawer(gl, scene)
    try:
        for truth, (what, (optics, variants)) in zip(best_pictures(scene, refocused), pictures.items()):
            errors = [drawer.errors(optics, variant, truth) for variant in variants]
            costs = in_turns({variant.name: partial(drawer.cost, optics, variant) for variant in variants}, repeats)
            drawn = tuple(
                Measured(name, median_cost(own), median_ratio(own, costs[REFERENCE.name]), *figures)
                for (name, own), figures in zip(costs.items(), errors)
            )
            yield Figures(what, "", drawn)
    finally:
        drawer.renderer.release()


Work = tuple[Callable[[], None], Callable[[], NDArray[np.uint8]]]
"""What draws a picture, and what reads it."""


class _Drawer:
    """Draws variants of one field, with the views that each wants uploaded."""

    def __init__(self, gl: GLContext, scene: BenchScene) -> None:
        self.gl, self.renderer = gl, Renderer(gl)
        self._grid, self._size_px = scene.grid, (scene.photo.shape[1], scene.photo.shape[0])
        self._views = list(generate(*scene.given, plan_literal(*scene.given, scene.grid), quality="fast"))
        self._uploaded: tuple[int, bool, bool] | None = None

    def cost(self, optics: Optics, variant: DrawVariant) -> Cost:
        """Of one picture. cpu_s: what it takes alone: on software GL processor time over the cores, which other
        programs disturb less, else time by the clock.
        """
        draw, _ = self._drawing(optics, variant)
        draw()  # what is uploaded has to arrive first
        self.gl.ctx.finish()
        cost = cost_of(lambda: (draw(), self.gl.ctx.finish()))
        return Cost(cost.wall_s, cost.cpu_s / CORES if self.gl.is_software else cost.wall_s)

    def errors(self, optics: Optics, variant: DrawVariant, truth: FloatImage) -> tuple[float, float, int]:
        """PSNR, FLIP, samples drawn."""
        draw, read = self._drawing(optics, variant)
        draw()
        image = stretch_image(read(), self._size_px).astype(np.float32) / np.float32(255)
        margin = (image.shape[0] - truth.shape[0]) // 2
        image = image[margin : margin + truth.shape[0], margin : margin + truth.shape[1]]
        return bounded_psnr(image, truth), flip(image, truth), self.renderer.samples_drawn

    def _drawing(self, optics: Optics, variant: DrawVariant) -> Work:
        """The picture, its views uploaded."""
        if variant.name == PLAIN:
            return self._plain(optics)
        renderer = self.renderer
        self._upload(variant)

        def draw() -> None:
            renderer.prefilter, renderer.adaptive = variant.prefilter, variant.adaptive
            renderer.render(optics, scale_size(self._size_px, variant.level.scale), level=variant.level)
            if variant.is_converged:
                renderer.refine()

        return draw, renderer.read_image

    def _upload(self, variant: DrawVariant) -> None:
        stored = variant.every, variant.is_half_float, variant.knows_disparity
        if stored == self._uploaded:
            return
        self.renderer.open_field(
            self._grid, *self._size_px, hdr=variant.is_half_float, with_disparity=variant.knows_disparity
        )
        for view in self._views:
            if is_stored(self._grid.offset(view.row, view.column), self._grid.centre[0], variant.every):
                colors = view.colors
                if variant.is_half_float:
                    colors = stored_from_encoded(encoded_from_stored(colors), True)
                disparity = view.disparity if variant.knows_disparity else None
                self.renderer.upload_view(view.row, view.column, colors, disparity)
        self._uploaded = stored

    def _plain(self, optics: Optics) -> Work:
        """The plain shader, for an eye in the middle."""
        ctx, (width, height), centre = self.gl.ctx, self._size_px, self._grid.centre[0]
        in_order = sorted(self._views, key=lambda view: (view.row, view.column))
        pixels = b"".join(view.colors.tobytes() for view in in_order)
        texture = ctx.texture_array((width, height, len(in_order)), 3, pixels, alignment=1)
        texture.filter, texture.repeat_x, texture.repeat_y = (moderngl.LINEAR, moderngl.LINEAR), False, False
        program, radius = ctx.program(PLAIN_VERTEX, PLAIN_FRAGMENT), optics.aperture_diameter / 2
        reach, shear = math.floor(radius + 0.5), -optics.focus_disparity
        told = {"columns": self._grid.columns, "radius": radius, "eye": (float(centre), float(centre))}
        bounds = {"first": max(centre - reach, 0), "last": min(centre + reach, self._grid.columns - 1)}
        for name, value in {**told, **bounds, "shear": (shear / width, shear / height)}.items():
            program[name] = value
        target, quad = ctx.simple_framebuffer(self._size_px, components=3), ctx.vertex_array(program, [])

        def draw() -> None:
            texture.use(0)
            target.use()
            quad.render(moderngl.TRIANGLES, vertices=3)

        return draw, lambda: np.frombuffer(target.read(alignment=1), np.uint8).reshape(height, width, 3)


def is_stored(at: ViewOffset, reach: int, every: int) -> bool:
    """Whether a field that stores every so manieth view has this one; 0: the centre and the corners."""
    if every == 0:
        return at == (0, 0) or abs(at.t) == abs(at.s) == reach
    return at.t % every == 0 and at.s % every == 0


def best_pictures(scene: BenchScene, optics: Optics, eye: ViewOffset = BETWEEN) -> tuple[FloatImage, FloatImage]:
    """Of views FINER times as close as the field's: refocused by evaluation's plain sum, the part that all
    show, and the one of an eye; (H, W, 3), sRGB-encoded.
    """
    side = FINER * 2 * scene.reach + 1
    grid, (photo, disparity) = GridShape(side, side), replace(scene, disparity=scene.disparity / FINER).given
    stack = FocalStack([Focus("", optics.focus_disparity / FINER, FINER * optics.aperture_diameter / 2)])
    for view in generate(photo, disparity, plan_literal(photo, disparity, grid), quality="fast"):
        at, colors = grid.offset(view.row, view.column), encoded_from_stored(view.colors)
        stack.add(at, colors)
        if at == (FINER * eye.t, FINER * eye.s):
            between = colors
    return stack.pictures()[0], between


if __name__ == "__main__":
    start("benchmarks.refocus", main)
