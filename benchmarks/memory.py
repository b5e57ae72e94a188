"""What memory the commands take at most under `--memory`, and what stays after many photos in one process.

python -m benchmarks.memory bounds [12 24 ...] | day | speed: the peaks of fresh processes for photos of so many MP;
memory after 10 and after 150 photos, by what is done about freed memory; the time that this costs a light field.
docs/memory.md has what they printed.
"""

from __future__ import annotations

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


def main() -> None:
    ways = {"bounds": bounds, "day": day, "speed": speed, "photos": photos_in_turn, "views": views_once}
    if len(sys.argv) < 2 or sys.argv[1] not in ways:
        sys.exit(__doc__)
    ways[sys.argv[1]](*sys.argv[2:])


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


def peak_of(arguments: list[str]) -> tuple[int, float]:
    """Exit code of the command line in a process of its own, and its peak, MiB; this one's counts too, but is less."""
    silent = subprocess.DEVNULL
    child = subprocess.Popen([sys.executable, "-P", "-m", "viewer", *arguments], stdout=silent, stderr=silent)
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
