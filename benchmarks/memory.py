"""What memory the commands take at most under `--memory`, and what stays after many photos in one process.

python -m benchmarks.memory predicted | bounds [12 24 ...] | day | speed: what twelve commands were predicted to take,
and took; the peaks of fresh processes for photos of so many MP; memory after 10 and after 150 photos, by what is done
about freed memory; the time that this costs a light field. docs/memory.md has what they printed.
"""

from __future__ import annotations

import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import psutil
from numpy.typing import NDArray

from benchmarks.speed.measure import cost_of
from iibr_core.runtime.allocator import give_back_memory, limit_arenas
from iibr_core.types import GridShape

MIB = 2**20
SIZES = {12: (3000, 4000), 24: (4000, 6000), 48: (6000, 8000), 100: (8660, 11547)}
BUDGETS = ("700M", "1G", "2G")
KINDS = (".jpg", ".png", ".exr")
PHOTOS, LOOKED_AT, LARGEST = 150, 10, 600_000
POLICIES = {
    "glibc's own ways": {},
    "two heaps, trimmed": {},
    "fixed mmap threshold": {"MALLOC_MMAP_THRESHOLD_": str(1 << 17)},
}
SHIPPED = "two heaps, trimmed"
SQUARES = 16
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


def main() -> None:
    ways = {
        "predicted": predicted,
        "watched": watched,
        "bounds": bounds,
        "day": day,
        "speed": speed,
        "photos": photos_in_turn,
        "views": views_once,
    }
    if len(sys.argv) < 2 or sys.argv[1] not in ways:
        sys.exit(__doc__)
    ways[sys.argv[1]](*sys.argv[2:])


def predicted() -> None:
    """What PREDICTED are predicted to take, and take: a table."""
    print("| photo | command | predicted, MiB | peak, MiB | ratio |\n| --- | --- | --- | --- | --- |", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for size, command in PREDICTED:
            photo, out = Path(folder) / "photo.jpg", Path(folder) / "out"
            write_photo(photo, size)
            np.save(photo.with_name("photo_disparity.npy"), squares_before_wall(size))
            words = [word.replace("PHOTO", str(photo)).replace("OUT", str(out)) for word in command.split()]
            code, peak = peak_of([*words, "--force"], [sys.executable, "-m", "benchmarks.memory", "watched", str(out)])
            needed = float(Path(f"{out}.needed").read_text()) / MIB if code == 0 else math.nan
            megapixels = f"{math.prod(size) / 1e6:.1f} MP"
            print(f"| {megapixels} | {command} | {needed:.0f} | {peak:.0f} | {needed / peak:.2f} |", flush=True)


def watched(out: str, *arguments: str) -> None:
    """One process of `predicted`: the command line, which writes down what it asked the budget for."""
    from iibr_core.generation.memory_model import Budget
    from viewer.entry import main as run

    require, asked = Budget.require, [0.0]

    def noted(budget: Budget, needed: float, what: str, advice: str) -> None:
        asked.append(needed)
        require(budget, needed, what, advice)

    Budget.require = noted  # type: ignore[method-assign]
    sys.argv = ["iibr", *arguments]
    try:
        run()
    finally:
        Path(f"{out}.needed").write_text(str(max(asked)))


def squares_before_wall(size: tuple[int, int]) -> NDArray[np.float32]:
    """A slanted wall and squares before it, no larger than 2 MP."""
    smaller = min(math.sqrt(2e6 / math.prod(size)), 1.0)
    height, width = (round(side * smaller) for side in size)
    rng = np.random.default_rng(height)
    disparity = np.linspace(-1, 0, height, dtype=np.float32)[:, None] * np.ones(width, np.float32)
    for _ in range(SQUARES):
        top, left, side = rng.integers(0, height), rng.integers(0, width), rng.integers(height // 20, height // 4)
        disparity[top : top + side, left : left + side] = rng.uniform(0, 2)
    return disparity


def bounds(*megapixels: str) -> None:
    """Peaks of `plan`, `screenshot` and `generate`, as shares of what was allowed; "-" where it is refused."""
    with tempfile.TemporaryDirectory() as folder:
        for size in map(int, megapixels or map(str, SIZES)):
            for kind in KINDS:
                photo = Path(folder) / f"{size}mp{kind}"
                write_photo(photo, SIZES[size])
                for budget in BUDGETS:
                    print(f"{size:4} MP {kind} --memory {budget}:", *_peaks(photo, budget), flush=True)
                photo.unlink()


def _peaks(photo: Path, budget: str) -> Iterator[str]:
    allowed = float(budget[:-1]) * (1024 if budget[-1] == "G" else 1)
    out = photo.parent
    commands = {
        "plan": [],
        "plan --max-pixels 100000000": [],
        "screenshot": ["-o", str(out / "picture.png"), "--force"],
        "generate --grid 5": ["--out", str(out / "field"), "--force"],
    }
    for command, more in commands.items():
        name, *options = command.split()
        code, peak = peak_of([name, str(photo), *options, *more, "--memory", budget])
        yield f"{command} {peak / allowed:.2f}" if code == 0 else f"{command} - ({peak:.0f} MiB)"


COMMAND_LINE = [sys.executable, "-P", "-m", "viewer"]


def peak_of(arguments: list[str], program: list[str] = COMMAND_LINE) -> tuple[int, float]:
    """Exit code of the command line in a process of its own, and its peak, MiB; this one's counts too, but is less."""
    silent = subprocess.DEVNULL
    child = subprocess.Popen([*program, *arguments], stdout=silent, stderr=silent)
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    return child.returncode, used.ru_maxrss / 1024


def write_photo(path: Path, size: tuple[int, int]) -> None:
    """Slopes and noise, with an edge: nothing that compresses as no photo does."""
    height, width = size
    noise = np.random.default_rng(0).integers(0, 40, (256, width, 3), np.uint8)
    spec = oiio.ImageSpec(width, height, 3, "half" if path.suffix == ".exr" else "uint8")
    output = oiio.ImageOutput.create(str(path))
    output.open(str(path), spec)
    across = np.linspace(0, 200, width)[:, None]
    for top in range(0, height, 256):
        rows = np.arange(top, min(top + 256, height))
        slope = 0.5 * (across + 200 * rows[:, None, None] / height) * (1.0, 0.8, 0.6)
        band = slope.astype(np.uint8) + noise[: len(rows)]
        band[:, width // 3 : width // 2] //= 2
        output.write_scanlines(top, int(rows[-1]) + 1, 0, band)
    output.close()


def day() -> None:
    """Memory of a process that was shown PHOTOS photos, under each policy."""
    for policy in POLICIES:
        _in_own_process("photos", policy)


def photos_in_turn(policy: str) -> None:
    """One process's worth of `day`: photos of several sizes, opened by the worker, uploaded, every third left early."""
    from viewer.background.scene_worker import SceneRequest, SceneWorker
    from viewer.display.scene_view import SceneView
    from viewer.gpu.headless_context import create_headless
    from viewer.model.state.scene import Source

    _apply(policy)
    process, after = psutil.Process(), {}
    with tempfile.TemporaryDirectory() as folder, _worker(SceneWorker) as worker:
        photos = [Path(folder) / f"{k}{kind}" for k, kind in enumerate(KINDS)]
        for k, photo in enumerate(photos):
            write_photo(photo, (1500 + 300 * k, 2200 + 200 * k))
        scene_view = SceneView(create_headless())
        for k in range(PHOTOS):
            pixels = LARGEST >> (k % 3)
            source = Source(str(photos[k % len(photos)]), grid=GridShape(3, 3), max_pixels=pixels)
            worker.submit(SceneRequest(k, source))
            _watch(worker, scene_view, k, 4 if k % 3 == 2 else 9)
            if k + 1 in (LOOKED_AT, PHOTOS):
                after[k + 1] = process.memory_info().rss / MIB
    ratio = after[PHOTOS] / after[LOOKED_AT]
    told = ", ".join(f"{rss:.0f} MiB after {count}" for count, rss in after.items())
    print(f"{policy}: {told} ({ratio:.2f} times)", flush=True)


@contextmanager
def _worker(kind):  # type: ignore[no-untyped-def]
    worker = kind(lambda: None)
    try:
        yield worker
    finally:
        worker.close()


def _watch(worker, scene_view, generation: int, views: int) -> None:  # type: ignore[no-untyped-def]
    """Take what the worker posts until so many views of this photo are uploaded."""
    import time

    from viewer.background.jobs import Failed
    from viewer.background.scene_worker import SceneReady, ViewReady

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


def _apply(policy: str) -> None:
    from viewer.background import jobs, scene_worker

    if policy == SHIPPED:
        limit_arenas()
    else:
        scene_worker.give_back_memory = jobs.give_back_memory = lambda: None


def speed(photo: str, disparity: str, rounds: str = "7") -> None:
    """The processor time that a photo's 9 x 9 views take under each policy, against glibc's own ways in each round."""
    seconds: dict[str, list[float]] = {policy: [] for policy in POLICIES}
    for _ in range(int(rounds)):
        for policy, found in seconds.items():
            found.append(float(_in_own_process("views", policy, photo, disparity, read=True)))
    reference = np.array(next(iter(seconds.values())))
    for policy, found in seconds.items():
        ratios = np.array(found) / reference
        told = ", ".join(f"{ratio:.3f}" for ratio in ratios)
        print(f"{policy}: {np.median(ratios):.3f} of the processor time ({told}), median {np.median(found):.1f} s")


def views_once(policy: str, photo: str, disparity: str) -> None:
    """One round of `speed`: prints seconds of processor time, compiling not counted."""
    _apply(policy)
    from iibr_core.formats.images.photo import read_photo
    from iibr_core.formats.maps.disparity_file import read_disparity
    from iibr_core.generation.light_field import generate
    from iibr_core.generation.plan import plan_literal

    read = read_photo(Path(photo))
    given = read_disparity(Path(disparity), read.size)
    for grid in (GridShape(3, 3), GridShape(9, 9)):
        plan = plan_literal(read, given, grid)
        cost = cost_of(lambda plan=plan: [None for _ in generate(read, given, plan)])
        if policy == SHIPPED:
            give_back_memory()
    print(cost.cpu_s)


def _in_own_process(*arguments: str, read: bool = False) -> str:
    environment = {**os.environ, **POLICIES[arguments[1]]}
    command = [sys.executable, "-m", "benchmarks.memory", *arguments]
    done = subprocess.run(command, env=environment, check=True, text=True, stdout=subprocess.PIPE if read else None)
    return done.stdout or ""


if __name__ == "__main__":
    main()
