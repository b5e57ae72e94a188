"""Measures speed against error for every switch, and writes tables and plots: speed.md, speed.svg, speed.png.

    python -m benchmarks.speed --out out/bench [--data DATA [--yardsticks BENCH]]          # make bench

Without DATA, which holds scenes as `iibr evaluate` takes them, a made-up scene with known views and the demo photo are
measured. BENCH holds scripts that judge from outside, judge_views.py and plain_refocus.py. Machines differ and are
shared: quote medians and ratios.
"""

from __future__ import annotations

import os
import platform
import sys
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from iibr_core.types import ImageSize, InputError, Quality, ReportProgress, image_size
from viewer.cli.options import MaxPixels
from viewer.cli.terminal import show_progress

if TYPE_CHECKING:
    from benchmarks.speed.figures import SceneFigures
    from benchmarks.speed.prediction import BenchInput, Prediction
    from benchmarks.speed.rendering_figures import DrawingFigures
    from benchmarks.speed.report import Bench
    from benchmarks.speed.targets import SpeedTarget
    from benchmarks.speed.variants import BenchScene
    from viewer.gpu.context import GLContext

TARGET_SIZE, TARGET_REACH = ImageSize(512, 512), 4


def bench(
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for speed.md, speed.svg and speed.png.")],
    data: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="A scene with true views and disparity, or a folder of such.",
            show_default="a made-up scene, and the demo photo",
        ),
    ] = None,
    repeats: Annotated[int, typer.Option(min=1, help="Rounds; figures are their medians.")] = 3,
    max_pixels: MaxPixels = None,
    yardsticks: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help="Folder of judge_views.py and plain_refocus.py.", show_default=False),
    ] = None,
    quick: Annotated[
        bool, typer.Option("--quick", help="Small series, no soft maps, no window: to see that it works.")
    ] = False,
) -> None:
    """Measure speed against error for every switch, and how cost grows with what a scene asks for.

    Example: python -m benchmarks.speed --data data --out docs
    """
    if not out.is_dir():
        raise InputError(f"{out}: is no folder; --out names one that exists")
    from benchmarks.speed.inputs import demo_input, made_up_scenes, scenes_of_folder
    from benchmarks.speed.prediction import whole_field
    from benchmarks.speed.processes import require_yardsticks
    from benchmarks.speed.report import write_bench

    require_yardsticks(yardsticks, data)
    scenes = scenes_of_folder(data, max_pixels, not quick) if data else made_up_scenes(not quick)
    inputs = [whole_field(scene) for scene in scenes if not scene.is_soft] + ([] if data else [demo_input()])
    for path in write_bench(out, measure(scenes, inputs, repeats, quick, yardsticks, data)):
        print(path)


def measure(
    scenes: list[BenchScene],
    inputs: list[BenchInput],
    repeats: int,
    quick: bool,
    yardsticks: Path | None,
    data: Path | None,
) -> Bench:
    """Everything, with a bar on stderr. scenes: with true views. inputs: fields that are made in several ways.

    What the plan predicts is judged on scenes that no constant was fitted to; on the first input if it must be quick.
    """
    from benchmarks.prediction import judged_scenes
    from benchmarks.provenance import made_by
    from benchmarks.speed.checks import view_agreement
    from benchmarks.speed.prediction import predict
    from benchmarks.speed.processes import window_lines, yardstick_lines
    from benchmarks.speed.report import Bench
    from benchmarks.speed.scaling import growth, series

    qualities: tuple[Quality, ...] = ("fast", "balanced") if quick else ("fast", "balanced", "exact")
    with headless_gl() as gl, show_progress("measuring") as show:
        figures, drawings = measure_scenes(scenes, repeats, gl, show)
        unseen = inputs[:1] if quick else list(judged_scenes(data))
        predicted = tuple(f for one in unseen for f in predict([one], qualities, repeats, show))
        growths = tuple(growth(name, points, repeats, show) for name, points in series(quick).items())
        targets = tuple(all_targets(scenes, inputs, figures, predicted, 0 if quick else repeats, show))
        show(0, 0, "whether views agree")
        agreements = tuple((one.name, view_agreement(one)) for one in inputs)
        window = () if quick else window_lines()
        outside = yardstick_lines(yardsticks, data) if yardsticks and data else ()
    machine = f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}" + (f", {gl.renderer}" if gl else "")
    words = made_by("benchmarks.speed")
    return Bench(figures, drawings, predicted, growths, targets, machine, words, agreements, window, outside)


def measure_scenes(
    scenes: list[BenchScene], repeats: int, gl: GLContext | None, report_progress: ReportProgress
) -> tuple[tuple[SceneFigures, ...], tuple[DrawingFigures, ...]]:
    """Every variant of the core on each scene, and of the renderer on those with views enough to leave some out."""
    from benchmarks.speed.figures import measure_scene
    from benchmarks.speed.rendering import measure_drawing, pinhole_renderer
    from benchmarks.speed.variants import LEAST_STORED_SIDE, VARIANTS

    with nullcontext() if gl is None else pinhole_renderer(gl) as draw:
        figures = tuple(measure_scene(scene, VARIANTS, repeats, report_progress, draw) for scene in scenes)
    if gl is None:
        return figures, ()
    large = [scene for scene in scenes if not scene.is_soft and 2 * scene.reach + 1 >= LEAST_STORED_SIDE]
    return figures, tuple(f for scene in large for f in measure_drawing(gl, scene, repeats, report_progress))


def all_targets(
    scenes: list[BenchScene],
    inputs: list[BenchInput],
    figures: tuple[SceneFigures, ...],
    predicted: tuple[Prediction, ...],
    repeats: int,
    report_progress: ReportProgress,
) -> Iterator[SpeedTarget]:
    """Figures that have a target. repeats: 0 leaves out those that take long."""
    from benchmarks.speed.checks import invariance_targets
    from benchmarks.speed.processes import first_picture_target
    from benchmarks.speed.targets import field_targets, front_targets, prediction_targets

    own = [scene for scene in scenes if not scene.is_soft]
    usual = next((s for s in own if image_size(s.photo) == TARGET_SIZE and s.reach == TARGET_REACH), None)
    if usual is not None and repeats:
        yield from field_targets(usual, repeats, report_progress)
        yield first_picture_target(usual)
    yield from front_targets([one for one in figures if not one.is_soft])
    yield from prediction_targets(predicted)
    report_progress(0, 0, "other orders, other bands")
    yield from invariance_targets(inputs[-1])


@contextmanager
def headless_gl() -> Iterator[GLContext | None]:
    """What draws without a display; None where there is no OpenGL."""
    from viewer.gpu.headless_context import create_headless

    try:
        gl = create_headless()
    except InputError as error:
        print(f"note: drawing, and variants that leave views out, are not measured: {error}", file=sys.stderr)
        yield None
        return
    try:
        yield gl
    finally:
        gl.release()


def main() -> None:
    """Run the command line; bad input ends in one line and exit code 2."""
    try:
        typer.run(bench)
    except InputError as error:
        print(f"benchmarks.speed: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
