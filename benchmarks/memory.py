"""What memory the commands take at most under `--memory`, and what stays after many photos in one process.

python -m benchmarks.memory predicted | bounds [12 24 ...] | day | beyond: what twelve commands were predicted to take,
and took; the peaks of fresh processes for photos of so many MP; memory after 10 and after 150 photos; what making a
field takes at most beside its views and its rays. docs/memory.md has what they printed.
"""

from __future__ import annotations

import argparse
import math
import sys
import tempfile
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import psutil

from benchmarks.harness.bench_scenes import MEGAPIXELS, write_photo
from benchmarks.harness.reports import emit, head, parser_of, row, start
from benchmarks.harness.timing import COMMAND_LINE, in_own_process, run
from iibr_core.formats.maps.writer import write_map
from iibr_core.runtime.machine import give_back_memory, limit_arenas
from iibr_core.types import Disparity, GridShape, Photo

MIB = 2**20
BUDGETS = {"700M": 700, "1G": 1024, "2G": 2048}
KINDS = (".jpg", ".png", ".exr")
PHOTOS, LOOKED_AT, LARGEST = 150, 10, 600_000
SQUARES = 16
FIELD = GridShape(5, 5)
FIELDS = ((500, 500), (1000, 1000), (1200, 1600))
"""(height, width) of photos whose fields are made."""
PREDICTED = (
    ((480, 640), "generate PHOTO --grid 3 --out OUT"),
    ((760, 800), "generate PHOTO --grid 17 --quality fast --out OUT"),
    ((1000, 1500), "generate PHOTO --grid 7 --quality balanced --out OUT"),
    ((1500, 2000), "generate PHOTO --grid 3 --quality fast --max-pixels 3000000 --out OUT"),
    ((4000, 6000), "generate PHOTO --grid 5 --out OUT"),
    ((480, 640), "screenshot PHOTO --grid 5 --view 1,1 --aperture 3 -o OUT.png"),
    ((900, 1200), "screenshot PHOTO --grid 9 --quality fast --view 2,1 -o OUT.png"),
    ((2000, 3000), "screenshot PHOTO --grid 5 --view 1,-1 -o OUT.png"),
    ((700, 900), "export PHOTO --grid 7 --to gif --frames 6 -o OUT.gif"),
    ((1200, 1000), "export PHOTO --grid 3 --to sbs -o OUT.png"),
    ((2450, 3650), "screenshot PHOTO --full --grid 3 --max-pixels 600000 --view 1,0.5 -o OUT.png"),
    ((4000, 6000), "screenshot PHOTO --full --max-pixels 400000 --view 0,0 -o OUT.png"),
)
"""(height, width) of a photo, and what is done with it. The constants of `memory_model` were compared with other cases:
1, 2, 6 and 12 MP, grids of 3, 5 and 9, with one step of disparity.
"""
UNDER_BUDGET = (
    "plan PHOTO",
    "plan PHOTO --max-pixels 100000000",
    "screenshot PHOTO -o OUT.png --force",
    "generate PHOTO --grid 5 --out OUT --force",
)


def main() -> None:
    ways = {"predicted": predicted, "watched": watched, "bounds": bounds, "day": day, "beyond": beyond}
    parser = parser_of(__doc__)
    parser.add_argument("way", choices=ways, metavar="predicted | bounds | day | beyond")
    parser.add_argument("more", nargs=argparse.REMAINDER, help=argparse.SUPPRESS)
    given = parser.parse_args()
    emit(ways[given.way](*given.more))


def words_of(command: str, photo: Path) -> list[str]:
    """The words of a command about a photo; it writes beside that."""
    return command.replace("PHOTO", str(photo)).replace("OUT", str(photo.with_name("out"))).split()


def predicted() -> Iterator[str]:
    """What PREDICTED are predicted to take, and take."""
    yield head("photo", "command", "predicted, MiB", "peak, MiB", "ratio")
    with tempfile.TemporaryDirectory() as folder:
        for size, command in PREDICTED:
            photo = write_photo(Path(folder) / "photo.jpg", size, with_map=False)
            write_map(photo.with_name("photo_disparity.pfm"), squares_before_wall(size))
            asked = photo.with_name("asked")
            watch = (sys.executable, "-m", "benchmarks.memory", "watched", asked)
            ended = run((*watch, *words_of(command, photo), "--force"))
            needed = float(asked.read_text()) / MIB if ended.code == 0 else math.nan
            peak = f"{ended.peak_mib:.0f}", f"{needed / ended.peak_mib:.2f}"
            yield row(f"{math.prod(size) / 1e6:.1f} MP", command, f"{needed:.0f}", *peak)


def watched(asked_path: str, *arguments: str) -> Iterator[str]:
    """One process of `predicted`: the command line, which writes down what it asked the budget for."""
    from iibr_core.generation.memory_model import Budget
    from viewer.entry import main as run_command

    require, asked = Budget.require, [0.0]

    def noted(budget: Budget, needed: float, what: str, advice: str) -> None:
        asked.append(needed)
        require(budget, needed, what, advice)

    Budget.require = noted  # type: ignore[method-assign]
    sys.argv = ["iibr", *arguments]
    try:
        run_command()
    finally:
        Path(asked_path).write_text(str(max(asked)))
    yield ""


def squares_before_wall(size: tuple[int, int]) -> np.ndarray:
    """A slanted wall and squares before it, no larger than 2 MP."""
    smaller = min(math.sqrt(2e6 / math.prod(size)), 1.0)
    height, width = (round(side * smaller) for side in size)
    rng = np.random.default_rng(height)
    disparity = np.linspace(-1, 0, height, dtype=np.float32)[:, None] * np.ones(width, np.float32)
    for _ in range(SQUARES):
        top, left, side = rng.integers(0, height), rng.integers(0, width), rng.integers(height // 20, height // 4)
        disparity[top : top + side, left : left + side] = rng.uniform(0, 2)
    return disparity


def bounds(*megapixels: str) -> Iterator[str]:
    """Peaks as shares of what was allowed; "refused", with its own peak in MiB, where it is."""
    yield head("photo", "`--memory`", *UNDER_BUDGET)
    with tempfile.TemporaryDirectory() as folder:
        for size in map(int, megapixels or MEGAPIXELS):
            for kind in KINDS:
                photo = write_photo(Path(folder) / f"{size}mp{kind}", MEGAPIXELS[size], with_map=False)
                for budget, allowed in BUDGETS.items():
                    commands = [(*words_of(command, photo), "--memory", budget) for command in UNDER_BUDGET]
                    ends = [run((*COMMAND_LINE, *words)) for words in commands]
                    peaks = (f"refused ({e.peak_mib:.0f})" if e.code else f"{e.peak_mib / allowed:.2f}" for e in ends)
                    yield row(f"{size} MP {kind}", budget, *peaks)
                photo.unlink()


def day() -> Iterator[str]:
    """Memory of this process after photos of several sizes: opened by the worker, uploaded, every third left early."""
    from iibr_core.scenes.opening import SceneRequest
    from iibr_core.scenes.scene import Source
    from viewer.background.scene_worker import SceneWorker
    from viewer.display.scene_view import SceneView
    from viewer.gpu.headless_context import create_headless

    limit_arenas()  # as the program does
    yield head("photos", "memory, MiB")
    with tempfile.TemporaryDirectory() as folder, closing(SceneWorker(lambda: None)) as worker:
        sizes = ((1500 + 300 * k, 2200 + 200 * k) for k in range(len(KINDS)))
        photos = [write_photo(Path(folder) / f"a{kind}", size, 0, False) for kind, size in zip(KINDS, sizes)]
        scene_view = SceneView(create_headless())
        for k in range(PHOTOS):
            source = Source(str(photos[k % len(photos)]), grid=GridShape(3, 3), max_pixels=LARGEST >> (k % 3))
            worker.submit(SceneRequest(k, source))
            take(worker, scene_view, k, 4 if k % 3 == 2 else 9)
            if k + 1 in (LOOKED_AT, PHOTOS):
                yield row(k + 1, f"{psutil.Process().memory_info().rss / MIB:.0f}")


def beyond() -> Iterator[str]:
    """Fields of 5 x 5 views in balanced quality, each in a process of its own."""
    yield head("photo", "views, MiB", "rays, MiB", "beside both at most, MiB")
    for size in FIELDS:
        found = in_own_process(_making_field, size)
        yield row(f"{math.prod(size) / 1e6:.2f} MP", *(f"{mebibytes:.0f}" for mebibytes in found))


def _making_field(size: tuple[int, int]) -> tuple[float, float, float]:
    """Of a second field: what is loaded and kept by the first is not counted."""
    from iibr_core.generation.light_field import generate, ray_set
    from iibr_core.generation.plan import plan_literal

    limit_arenas()
    pixels = np.random.default_rng(0).random((*size, 3), np.float32)
    given = Photo(pixels, float(size[1]), "drawn"), Disparity(squares_before_wall(size), "drawn")
    plan = plan_literal(*given, FIELD)
    for _ in generate(*given, plan, quality="balanced"):
        pass
    give_back_memory()
    before = psutil.Process().memory_info().rss
    Path("/proc/self/clear_refs").write_text("5")  # the peak is counted from here
    views = list(generate(*given, plan, quality="balanced"))
    peak = next(line.split()[1] for line in Path("/proc/self/status").read_text().splitlines() if "VmHWM" in line)
    of_views = sum(part.nbytes for view in views for part in (view.colors, view.disparity, view.inpainted))
    rays, outer = ray_set(*given, plan)
    for _ in outer:
        pass
    parts = *rays.arrays, rays.connected, rays.photo_detail
    of_rays = sum(part.nbytes for part in parts if isinstance(part, np.ndarray))
    return of_views / MIB, of_rays / MIB, (int(peak) * 1024 - before - of_views - of_rays) / MIB


def take(worker: Any, scene_view: Any, generation: int, views: int) -> None:
    """Take what the worker posts until so many views of this photo are uploaded."""
    import time

    from iibr_core.scenes.opening import SceneReady, ViewReady
    from viewer.background.job_threads import Failed

    seen = 0
    while seen < views:
        result = worker.next_result()
        if result is None:
            time.sleep(0.002)
        elif isinstance(result, Failed):
            raise SystemExit(result.message)
        elif isinstance(result, SceneReady):
            scene_view.open(result)
        elif isinstance(result, ViewReady) and result.generation == generation:
            scene_view.add(result.view)
            scene_view.upload_all()
            seen += result.view.is_final


if __name__ == "__main__":
    start("benchmarks.memory", main)
