"""Times every switch, measures its error, writes tables and plots: speed.md, speed.svg, speed.png.

python -m benchmarks.speed --data DATA --out docs
"""

from __future__ import annotations

import os
import platform
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from iibr_core.types import GridShape, ImageSize, InputError
from viewer.cli.options import MaxPixels
from viewer.cli.terminal import show_progress

if TYPE_CHECKING:
    from benchmarks.speed.rendering_figures import DrawingFigures
    from benchmarks.speed.report import Bench
    from benchmarks.speed.targets import SpeedTarget
    from benchmarks.speed.variants import BenchScene, Draw, Stored
    from iibr_core.types import FloatImage, Quality, ViewOffset
    from viewer.gpu.context import GLContext

TARGET_SIZE = ImageSize(512, 512)
FIRST_FRAME_S = 1.5


def bench(
    data: Annotated[
        Path, typer.Option(metavar="DIR", help="A scene with true views and disparity, or a folder of such.")
    ],
    out: Annotated[Path, typer.Option(metavar="DIR", help="Folder for speed.md, speed.svg and speed.png.")],
    repeats: Annotated[int, typer.Option(min=1, help="Rounds; figures are their medians.")] = 3,
    max_pixels: MaxPixels = None,
    quick: Annotated[bool, typer.Option("--quick", help="Small series, no soft maps: to see that it works.")] = False,
) -> None:
    """Measure speed against error for every switch, and how cost grows with what a scene asks for.

    Example: python -m benchmarks.speed --data data --out docs
    """
    if not out.is_dir():
        raise InputError(f"{out}: is no folder; --out names one that exists")
    from iibr_core.evaluation.packages import require_packages

    require_packages("scipy", "skimage", "matplotlib")
    from benchmarks.speed.report import write_bench

    measured = _measured(data, repeats, max_pixels, quick)
    for path in write_bench(out, measured):
        print(path)


def _measured(data: Path, repeats: int, max_pixels: int | None, quick: bool) -> Bench:
    from benchmarks.speed.figures import measure_scene
    from benchmarks.speed.prediction import predict, whole_field
    from benchmarks.speed.report import Bench
    from benchmarks.speed.scaling import growth, series
    from benchmarks.speed.targets import field_targets, front_targets, prediction_targets
    from benchmarks.speed.variants import LEAST_STORED_SIDE, VARIANTS

    scenes = _scenes(data, max_pixels, with_soft=not quick)
    whole = [scene for scene in scenes if not scene.is_soft]
    drawings: tuple[DrawingFigures, ...] = ()
    with headless() as gl, show_progress("measuring") as show:
        with drawing(gl) as draw:
            figures = tuple(measure_scene(scene, VARIANTS, repeats, show, draw) for scene in scenes)
        large = [scene for scene in whole if 2 * scene.reach + 1 >= LEAST_STORED_SIDE]
        if gl is not None:
            from benchmarks.speed.rendering import measure_drawing

            drawings = tuple(f for scene in large for f in measure_drawing(gl, scene, repeats, show))
        qualities: tuple[Quality, ...] = ("fast", "balanced") if quick else ("fast", "balanced", "exact")
        predicted = tuple(f for scene in whole for f in predict([whole_field(scene)], qualities, repeats, show))
        growths = tuple(growth(name, points, repeats, show) for name, points in series(quick).items())
        targets = [*front_targets([f for f in figures if not f.is_soft]), *prediction_targets(predicted)]
        judged = next((s for s in whole if s.photo.shape[:2] == TARGET_SIZE and s.reach == 4), None)
        if judged is not None and not quick:
            targets = [*field_targets(judged, repeats, show), first_frame(judged), *targets]
    machine = f"{platform.machine()}, {os.cpu_count()} cores, {platform.system()}" + (f", {gl.renderer}" if gl else "")
    command = shlex.join(["python", "-m", "benchmarks.speed", *sys.argv[1:]])
    return Bench(figures, drawings, predicted, growths, tuple(targets), machine, command)


def _scenes(data: Path, max_pixels: int | None, with_soft: bool) -> list[BenchScene]:
    from benchmarks.speed.variants import bench_scenes
    from iibr_core.evaluation.datasets import find_scenes
    from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS

    limit = max_pixels or DEFAULT_MAX_PIXELS
    known = [scene for scene in find_scenes(data) if scene.disparity]
    if not known:
        raise InputError(
            f"{data}: holds no scene with disparity; give one, such as views/v00_u00.png and gt_disp_*.npy"
        )
    return [made for scene in known for made in bench_scenes(scene, limit, with_soft)]


@contextmanager
def headless() -> Iterator[GLContext | None]:
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


@contextmanager
def drawing(gl: GLContext | None) -> Iterator[Draw | None]:
    """What draws pinhole pictures from stored views."""
    if gl is None:
        yield None
        return
    from viewer.gpu.refocus.renderer import Renderer

    renderer = Renderer(gl)
    try:
        yield lambda stored, offsets: _drawn(renderer, stored, offsets)
    finally:
        renderer.release()


def _drawn(renderer: Any, stored: Stored, offsets: Iterable[ViewOffset]) -> list[FloatImage]:
    import numpy as np

    from viewer.model.state.app_state import Optics

    reach = round(max(abs(part) for at in stored for part in at))
    grid = GridShape(2 * reach + 1, 2 * reach + 1)
    colors = next(iter(stored.values()))[0]
    height, width = colors.shape[:2]
    renderer.open_field(grid, width, height, hdr=colors.dtype != np.uint8, with_disparity=True)
    for at, (pixels, disparity) in stored.items():
        renderer.upload_view(round(at.t) + reach, round(at.s) + reach, pixels, disparity)
    pictures = []
    for at in offsets:
        renderer.render(Optics(eye=at), (width, height))
        renderer.refine()
        pictures.append(renderer.read_image().astype(np.float32) / 255)
    return pictures


def first_frame(scene: BenchScene) -> SpeedTarget:
    """From the start of a process to the first picture of the scene, drawn without a display."""
    import time

    import numpy as np

    from benchmarks.speed.targets import SpeedTarget
    from iibr_core.formats.images.photo import write_image

    seconds = []
    with tempfile.TemporaryDirectory() as folder:
        photo = Path(folder) / "photo.png"
        write_image(photo, scene.photo)
        np.save(Path(folder) / "photo_disparity.npy", scene.disparity)
        words = ["screenshot", str(photo), "--grid", "1", "-o", str(Path(folder) / "picture.png")]
        for _ in range(3):
            start = time.perf_counter()
            subprocess.run([sys.executable, "-m", "viewer", *words], check=True, capture_output=True)
            seconds.append(time.perf_counter() - start)
    said = f"{min(seconds):.2f} s, the least of {len(seconds)}"
    return SpeedTarget(
        "photo and disparity: process start to first picture", "<= 1.5 s", said, min(seconds) <= FIRST_FRAME_S
    )


def main() -> None:
    """Run the command line; bad input ends in one line and exit code 2."""
    try:
        typer.run(bench)
    except InputError as error:
        print(f"benchmarks.speed: {error}", file=sys.stderr)
        sys.exit(2)


if __name__ == "__main__":
    main()
