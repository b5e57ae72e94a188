"""Figures of the optics: speed against error for every level, bokeh from few samples, aliasing,
pinhole, the field while it fills, dragging, memory.

    python -m benchmarks.optics --data FOLDER [--out docs/optics.md] [--rounds 5] [--switches 1000]

FOLDER holds hci_antinous and blender_shop_9x9 (views/vVV_uUU.* and the centre view's disparity as *.npy). Errors are
against the converged picture of all views, or a plain numpy sum where that is said. On software GL, times are processor
time over the number of cores, which other programs disturb less.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import psutil
from numpy.typing import NDArray

from benchmarks.light_fields import StoredField, read_field
from benchmarks.provenance import made_by
from benchmarks.refocus import plain_pass
from benchmarks.speed.rendering import DrawVariant, draw, drawing_cost, shear_light
from iibr_core.color import encoded_from_stored, srgb_from_linear
from iibr_core.evaluation.metrics import flip, psnr
from iibr_core.generation.cost_model import CORES
from iibr_core.types import FloatImage, GridShape, ViewOffset
from viewer.gpu.context import GLContext
from viewer.gpu.headless_context import create_headless
from viewer.gpu.refocus.frame_budget import QUALITY_LEVELS, stretch_image
from viewer.gpu.refocus.renderer import Renderer
from viewer.gpu.refocus.view_sampling import aperture_samples
from viewer.model.state.optics import Optics

Image = NDArray[np.uint8]
SIZE_PX = 768, 512
BORDER_PX = 16
BETWEEN = ViewOffset(0.2, 0.37)
FIVE = ((4, 4), (0, 0), (0, 8), (8, 0), (8, 8))
EVERY_SECOND = tuple((v, u) for v in range(0, 9, 2) for u in range(0, 9, 2))


PLAIN = DrawVariant("every view of the aperture")
LEVEL_APERTURES = 0.0, 4.0, 8.0
"""View steps: a drag chooses another level for each."""


def draw_picture(renderer: Renderer, optics: Optics, size_px: tuple[int, int], variant: DrawVariant) -> Image:
    """The picture of a variant whose views are uploaded."""
    draw(renderer, optics, size_px, variant)
    return stretch_image(renderer.read_image(), size_px)


class Stopwatch:
    """Times pictures in alternation with the plain shader."""

    def __init__(self, gl: GLContext, field: StoredField, optics: Optics, rounds: int) -> None:
        flat = field.views.reshape(-1, *field.views.shape[2:])
        radius = optics.aperture_diameter / 2
        self._plain = plain_pass(gl.ctx, field.grid, flat, SIZE_PX, radius, optics.focus_disparity)
        self._gl, self._rounds = gl, rounds

    def milliseconds(self, draw_it: Callable[[], None], rounds: int | None = None) -> tuple[float, float]:
        """Median time of a drawing, and that over the plain shader's."""
        own, plain = [], []
        for _ in range(rounds or self._rounds):
            plain.append(drawing_cost(self._gl, lambda: self._plain(0.0)).cpu_s)
            own.append(drawing_cost(self._gl, draw_it).cpu_s)
        return 1e3 * float(np.median(own)), float(np.median(own) / np.median(plain))


def quality_level_table(gl: GLContext, field: StoredField, optics: Optics, rounds: int) -> Iterator[str]:
    """Rows of speed against error, one a level; for each aperture milliseconds and FLIP."""
    renderer, watch = Renderer(gl), Stopwatch(gl, field, optics, rounds)
    field.upload(renderer, field.every)
    chosen = [replace(optics, eye=BETWEEN, aperture_diameter=diameter) for diameter in LEVEL_APERTURES]
    references = [draw_picture(renderer, each, SIZE_PX, replace(PLAIN, is_converged=True)) for each in chosen]
    for level in QUALITY_LEVELS:
        row = f"| {level.stride} | {level.sources} | {level.scale:g} |"
        for each, reference in zip(chosen, references):
            variant = DrawVariant("", level)
            image = draw_picture(renderer, each, SIZE_PX, variant)
            own, _ = watch.milliseconds(partial(draw, renderer, each, SIZE_PX, variant))
            row += f" {own:.0f} | {flip(image, reference):.4f} |"
        yield row
    renderer.release()


def refocus_figures(gl: GLContext, field: StoredField, optics: Optics, rounds: int) -> Iterator[str]:
    """Rows about the refocus pass of two apertures against the plain shader."""
    renderer = Renderer(gl)
    field.upload(renderer, field.every)
    for radius, milliseconds in ((2.0, 20), (6.0, 60)):
        wide = replace(optics, aperture_diameter=2 * radius)
        watch = Stopwatch(gl, field, wide, 4 * rounds)
        own, ratio = watch.milliseconds(partial(draw, renderer, wide, SIZE_PX, PLAIN))
        figure = f"<= {milliseconds} ms, <= 1.25 x plain"
        measured = f"{own:.0f} ms, {ratio:.2f} x plain ({own / ratio:.0f} ms)"
        yield f"| refocus, {field.name}, radius {radius:g} | {figure} | {measured} |"
    renderer.release()


def growth_while_filling(gl: GLContext, field: StoredField, optics: Optics) -> float:
    """The most by which a view that arrives makes the picture worse (rms to the full field's, 1 = white)."""
    renderer = Renderer(gl)
    field.upload(renderer, field.every)
    final = draw_picture(renderer, optics, field.size_px, PLAIN).astype(float)
    order = sorted(field.every, key=lambda at: (at != field.grid.centre, -sum((np.array(at) - field.grid.centre) ** 2)))
    renderer.open_field(field.grid, *field.size_px, hdr=False, with_disparity=True)
    errors: list[float] = []
    for at in order:
        renderer.upload_view(*at, field.views[at], field.disparities[at])
        difference = draw_picture(renderer, optics, field.size_px, PLAIN) - final
        errors.append(float(np.sqrt(np.mean(difference**2)) / 255))
    renderer.release()
    return max(after - min(errors[: k + 1]) for k, after in enumerate(errors))


def dragging() -> list[str]:
    """Rows about the window, in a process of its own; none where there is no private X server."""
    command = [sys.executable, "-m", "benchmarks.dragging"]
    return subprocess.run(command, capture_output=True, text=True, check=False).stdout.splitlines()


def bokeh_from_a_quarter(gl: GLContext, field: StoredField, optics: Optics) -> float:
    """FLIP of the picture from at most a quarter of its samples against the converged one."""
    renderer = Renderer(gl)
    field.upload(renderer, field.every)
    renderer.render(optics, field.size_px)
    quarter = renderer.read_image()
    while not renderer.is_converged:
        if 4 * renderer.samples_drawn <= renderer.samples_converged:
            quarter = renderer.read_image()
        renderer.refine(0.0)
    error = flip(quarter, renderer.read_image())
    renderer.release()
    return error


def aliasing(gl: GLContext, field: StoredField, optics: Optics) -> tuple[float, float]:
    """PSNR of refocusing 5x5 stored views, and all 81, against the numpy sum of all 81."""
    reference, inside = numpy_refocus(field, optics), np.s_[BORDER_PX:-BORDER_PX, BORDER_PX:-BORDER_PX]
    renderer = Renderer(gl)
    results = []
    for stored in (EVERY_SECOND, field.every):
        field.upload(renderer, stored)
        image = draw_picture(renderer, optics, field.size_px, PLAIN)
        results.append(psnr(encoded_from_stored(image)[inside], reference[inside]))
    renderer.release()
    return results[0], results[1]


def numpy_refocus(field: StoredField, optics: Optics) -> FloatImage:
    """(H, W, 3), sRGB-encoded: the weighted mean of the views in linear light, sheared by Catmull-Rom interpolation."""
    samples = aperture_samples(optics.eye, optics.aperture_diameter, field.grid, np.ones(field.grid, bool))
    total = np.zeros(field.views.shape[2:])
    for wanted, row, column, weight in samples:
        by_px = optics.focus_disparity * (wanted.t - optics.eye.t), optics.focus_disparity * (wanted.s - optics.eye.s)
        total += weight * shear_light(encoded_from_stored(field.views[row, column]), by_px)
    return np.clip(srgb_from_linear(total / sum(sample.weight for sample in samples)), 0, 1)


def pinhole_from_five(gl: GLContext, field: StoredField) -> tuple[float, float]:
    """Mean and least PSNR over the views that are not stored."""
    renderer = Renderer(gl)
    field.upload(renderer, FIVE)
    values = []
    for at in field.every:
        if at not in FIVE:
            renderer.render(Optics(eye=field.grid.offset(*at)), field.size_px)
            renderer.refine()
            values.append(psnr(renderer.read_image(), field.views[at]))
    renderer.release()
    return float(np.mean(values)), min(values)


def memory_mib(gl: GLContext, switches: int) -> Iterator[tuple[int, float]]:
    """Resident memory after so many switches of photo, size and aperture. Software GL keeps its textures there too."""
    renderer, rng, process = Renderer(gl), np.random.default_rng(0), psutil.Process(os.getpid())
    for done in range(1, switches + 1):
        width, height = (96, 64) if done % 2 else (80, 120)
        grid = GridShape(3, 3)
        renderer.open_field(grid, width, height, hdr=done % 3 == 0, with_disparity=done % 5 > 0)
        colors = rng.integers(0, 256, (height, width, 3), dtype=np.uint8)
        stored = (colors / 255).astype(np.float16) if done % 3 == 0 else colors
        for at in np.ndindex(*grid):
            renderer.upload_view(*at, stored, rng.normal(0, 3, (height, width)).astype(np.float32))
        size_px = 200 + 40 * (done % 7), 160 + 20 * (done % 4)
        optics = Optics(ViewOffset(0.1, 0.2), focus_disparity=0.5, aperture_diameter=float(done % 4))
        renderer.render_in_time(optics, size_px, 0.01)
        renderer.refine(0.01)
        if done in (switches // 10, switches // 2, switches):
            yield done, process.memory_info().rss / 2**20
    renderer.release()


def report(gl: GLContext, data: Path, rounds: int, switches: int) -> Iterator[str]:
    """Lines of Markdown."""
    antinous, shop = read_field(data / "hci_antinous"), read_field(data / "blender_shop_9x9")
    bokeh = {
        antinous.name: Optics(focus_disparity=2.4, aperture_diameter=8.0),
        shop.name: Optics(focus_disparity=4.8, aperture_diameter=4.0),
    }
    yield "# Optics: speed against error\n"
    yield f"{made_by('benchmarks.optics')}. {gl.renderer}, {CORES} cores.\n"
    yield f"{shop.name} is drawn with {SIZE_PX[0]}x{SIZE_PX[1]} pixels, focus at 4.8 px. Times are medians; on software"
    yield "GL, processor time over the number of cores. Errors are against the converged picture of all 81 views."
    yield "Single switches are in [speed.md](speed.md)."
    yield "\n## Quality levels\n\nWhat a drag leaves out, best to quickest: view steps between samples,"
    yield "stored views that a pinhole view is made of, scale of the picture. Milliseconds and FLIP for an eye between"
    yield "views and apertures of 0, 4 and 8 view steps.\n"
    yield "| stride | sources | scale | 0: ms | FLIP | 4: ms | FLIP | 8: ms | FLIP |"
    yield "| --- | --- | --- | --- | --- | --- | --- | --- | --- |"
    yield from quality_level_table(gl, shop, bokeh[shop.name], rounds)
    yield "\n## Figures\n\n| what | figure | measured |\n| --- | --- | --- |"
    yield from refocus_figures(gl, shop, bokeh[shop.name], rounds)
    for field in (antinous, shop):
        error = bokeh_from_a_quarter(gl, field, replace(bokeh[field.name], aperture_diameter=8.0))
        yield f"| bokeh at 1/4 of the samples against converged, {field.name} | FLIP <= 0.02 | {error:.4f} |"
    for field in (antinous, shop):
        sparse, dense = aliasing(gl, field, replace(bokeh[field.name], aperture_diameter=8.0))
        measured = f"{sparse:.2f} dB against {dense:.2f} dB: {dense - sparse:+.2f} dB"
        yield f"| refocus from 5x5 stored views against all 81, {field.name} | within 0.5 dB | {measured} |"
    for diameter in (0.0, 8.0):
        growth = growth_while_filling(
            gl, antinous, replace(bokeh[antinous.name], eye=BETWEEN, aperture_diameter=diameter)
        )
        what = f"error while the field fills, {antinous.name}, aperture {diameter:g}"
        yield f"| {what} | never grows | by at most {growth:.4f} rms of white |"
    mean, least = pinhole_from_five(gl, antinous)
    yield f"| pinhole from 5 stored views, {antinous.name} | >= 44 dB | mean {mean:.2f}, least {least:.2f} dB |"
    yield from dragging()
    memory = ", ".join(f"{mib:.0f} MiB after {done}" for done, mib in memory_mib(gl, switches))
    yield f"| memory over {switches} switches of photo, size and aperture | flat | {memory} |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--out", type=Path)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--switches", type=int, default=1000)
    args = parser.parse_args()
    gl = create_headless()
    lines = []
    for line in report(gl, args.data, args.rounds, args.switches):
        lines.append(line)
        print(line, flush=True)
    if args.out:
        args.out.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
