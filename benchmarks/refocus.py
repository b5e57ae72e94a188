"""Time of a refocused picture, in alternation with the plainest shift-and-sum shader on the same views.

    python -m benchmarks.refocus --data FOLDER [--radius 2] [--size 768x512] [--repeats 3]

FOLDER is a light field of any layout; it may hold the centre view's disparity as *.npy.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Callable, Iterator
from functools import partial

import moderngl
import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.report import emit, head, parser_of, row, start
from benchmarks.harness.scenes import read_views
from benchmarks.harness.timing import cost_of
from iibr_core.rendering.optics import Optics
from iibr_core.types import GridShape, ViewOffset
from viewer.gpu.headless_context import create_headless
from viewer.gpu.refocus.renderer import Renderer

FRAMES = 12

PLAIN_VERTEX = """#version 330 core
out vec2 uv;
void main() { uv = vec2(gl_VertexID % 2, gl_VertexID / 2) * 2.0; gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0); }
"""
PLAIN_FRAGMENT = """#version 330 core
uniform sampler2DArray views;
uniform int columns, first, last;
uniform float shear, radius;
uniform vec2 eye;
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


def open_views(renderer: Renderer, views: NDArray[np.uint8], centre: NDArray[np.float32] | None) -> None:
    """Upload the views, with disparity where the centre view's is given."""
    grid = GridShape(*views.shape[:2])
    renderer.open_field(grid, views.shape[3], views.shape[2], hdr=False, with_disparity=centre is not None)
    for at in np.ndindex(*grid):
        renderer.upload_view(
            *at, views[at], None if centre is None else approximate_disparity(centre, grid.offset(*at))
        )


def approximate_disparity(disparity: NDArray[np.float32], offset: ViewOffset) -> NDArray[np.float32]:
    """Disparity of another view, (H, W), near enough to time with: moved by its own value, looked up backwards."""
    y, x = np.indices(disparity.shape)
    moved = disparity
    for _ in range(2):
        rows = np.clip(np.rint(y + moved * offset.t).astype(int), 0, disparity.shape[0] - 1)
        columns = np.clip(np.rint(x + moved * offset.s).astype(int), 0, disparity.shape[1] - 1)
        moved = disparity[rows, columns]
    return moved


def plain_pass(
    ctx: moderngl.Context, views: NDArray[np.uint8], size_px: tuple[int, int], radius: float, focus: float
) -> Callable[[float], None]:
    """The plain shader, ready to draw for an eye that many view steps right of the centre."""
    rows, columns, height, width, _ = views.shape
    texture = ctx.texture_array((width, height, rows * columns), 3, views.tobytes(), alignment=1)
    texture.filter, texture.repeat_x, texture.repeat_y = (moderngl.LINEAR, moderngl.LINEAR), False, False
    program = ctx.program(PLAIN_VERTEX, PLAIN_FRAGMENT)
    centre, reach = columns // 2, math.floor(radius + 0.5)
    bounds = {"first": max(centre - reach, 0), "last": min(centre + reach, columns - 1)}
    for name, value in {"columns": columns, "shear": -focus / width, "radius": radius, **bounds}.items():
        program[name] = value
    target = ctx.simple_framebuffer(size_px, components=4)
    quad = ctx.vertex_array(program, [])

    def draw(eye_s: float) -> None:
        texture.use(0)
        target.use()
        program["eye"] = (centre + eye_s, float(centre))
        quad.render(moderngl.TRIANGLES, vertices=3)

    return draw


def milliseconds(ctx: moderngl.Context, draw: Callable[[float], None]) -> list[float]:
    """Times of FRAMES pictures, each finished, the eye moving a little; the first two, which warm up, left out."""

    def picture(k: int) -> None:
        draw(0.002 * k)
        ctx.finish()

    return [1e3 * cost_of(partial(picture, k)).wall_s for k in range(FRAMES + 2)][2:]


def main() -> None:
    parser = parser_of(__doc__, "repeats", data={"required": True, "help": "a light field of any layout"})
    parser.add_argument("--radius", type=float, default=2.0, help="of the aperture, in view steps")
    parser.add_argument("--size", default="768x512")
    emit(report(parser.parse_args()))


def report(args: argparse.Namespace) -> Iterator[str]:
    width, height = map(int, args.size.split("x"))
    views = read_views(args.data)
    disparity_file = next(iter(sorted(args.data.glob("*.npy"))), None)
    centre = None if disparity_file is None else np.nan_to_num(np.load(disparity_file)).astype(np.float32)
    focus = 0.0 if centre is None else float(np.quantile(centre, 0.25))
    gl = create_headless()
    renderer = Renderer(gl)
    open_views(renderer, views, centre)

    def ours(eye_s: float) -> None:
        eye = ViewOffset(0.0, eye_s)
        renderer.render(Optics(eye, focus_disparity=focus, aperture_diameter=2 * args.radius), (width, height))

    plain = plain_pass(gl.ctx, views, (width, height), args.radius, focus)
    times: dict[str, list[float]] = {}
    for _ in range(args.repeats):
        times.setdefault("plain shader", []).extend(milliseconds(gl.ctx, plain))
        for renderer.prefilter, name in ((True, "picture, smoothing on"), (False, "picture, smoothing off")):
            times.setdefault(name, []).extend(milliseconds(gl.ctx, ours))
    yield f"{gl.renderer}, {args.size}, aperture radius {args.radius:g} views, focus at {focus:.1f} px per view step\n"
    yield head("what", "least, ms", "median, ms", "times the plain one")
    for name, each in times.items():
        ratio = min(each) / min(times["plain shader"])
        yield row(name, f"{min(each):.1f}", f"{np.median(each):.1f}", f"{ratio:.2f}")


if __name__ == "__main__":
    start("benchmarks.refocus", main)
