"""What handing photos to workers costs: `iibr batch`'s rate against that of one process times the workers.

    python -m benchmarks.batch --photos 20 --rounds 5 --megapixels 1 --workers 2 --kind depth

Photos are textured squares before a texture, all different, with maps beside them. Starting and the first photo count
apart. Every round has one process export the photos, so many such processes that know nothing of each other, and the
workers. Processes side by side share caches and memory: only against the second figure the batch's own cost shows, and
on a machine that others use only processor time says much.
"""

from __future__ import annotations

import argparse
import math
import multiprocessing
import statistics
import tempfile
import time
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import NamedTuple

import numpy as np
import psutil

from iibr_core.depth.choice import DepthChoice
from iibr_core.formats.images.photo import write_image
from iibr_core.formats.maps.writer import write_map
from iibr_core.runtime.allocator import limit_arenas
from viewer.app.batch.archive import photos_in
from viewer.app.batch.processes import local_workers
from viewer.app.batch.task import BatchSettings, PhotoTask, Place, key_of, target_name
from viewer.app.batch.threads import QUIET_AND_SAFE, set_environment, thread_variables
from viewer.app.batch.work import export_photo
from viewer.app.batch.workers import outcomes_of
from viewer.model.state.scene import Source


class Cost(NamedTuple):
    """Seconds a photo."""

    wall: float
    processor: float


Run = Callable[[Sequence[PhotoTask]], object]


def write_photos(folder: Path, count: int, megapixels: float) -> None:
    height = round(math.sqrt(megapixels * 1e6 * 3 / 4))
    size = height, height * 4 // 3
    rows, columns = np.indices(size)
    for number in range(count):
        generator = np.random.default_rng(number)
        texture = generator.integers(0, 80, (-(-size[0] // 8), -(-size[1] // 8), 3))
        colors = texture.repeat(8, 0).repeat(8, 1)[: size[0], : size[1]]
        place = generator.random(2) * size / 2
        is_near = (abs(rows - place[0]) < size[0] / 4) & (abs(columns - place[1]) < size[1] / 4)
        write_image(folder / f"{number:05}.png", (colors + np.where(is_near, 150, 30)[..., None]).astype(np.uint8))
        write_map(folder / f"{number:05}_disparity.pfm", np.where(is_near, 2.0, 0.5).astype(np.float32))


def tasks_for(photos: Path, settings: BatchSettings) -> list[PhotoTask]:
    return [
        PhotoTask(photo.path, Place("", target_name(settings, photo)), key_of(settings, photo), settings)
        for photo in photos_in([photos])
    ]


def export(task: PhotoTask) -> None:
    outcome = export_photo(task)
    assert not outcome.reason, outcome.reason


def serve(pipe: Connection) -> None:
    """A process of its own, which exports what it is given."""
    limit_arenas()  # as the program does
    while tasks := pipe.recv():
        for task in tasks:
            export(task)
        pipe.send(None)


def plain_process(stack: ExitStack) -> Connection:
    here, there = multiprocessing.Pipe()
    process = multiprocessing.get_context("spawn").Process(target=serve, args=(there,), daemon=True)
    process.start()
    stack.callback(process.kill)
    return here


def in_plain_processes(pipes: Sequence[Connection], tasks: Sequence[PhotoTask]) -> None:
    for number, pipe in enumerate(pipes):
        pipe.send(tasks[number :: len(pipes)])
    for pipe in pipes:
        pipe.recv()


def processor_seconds() -> float:
    """Of this process and its workers."""
    processes = [psutil.Process(), *psutil.Process().children(recursive=True)]
    return sum(sum(process.cpu_times()[:2]) for process in processes)


def measure(run: Run, tasks: Sequence[PhotoTask], folder: Path) -> Cost:
    moved = [replace(task, place=replace(task.place, folder=str(folder))) for task in tasks]
    folder.mkdir()
    wall, processor = time.perf_counter(), processor_seconds()
    run(moved)
    return Cost((time.perf_counter() - wall) / len(tasks), (processor_seconds() - processor) / len(tasks))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--photos", type=int, default=20)
    parser.add_argument("--rounds", type=int, default=5)
    parser.add_argument("--megapixels", type=float, default=1.0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kind", default="depth")
    given = parser.parse_args()
    settings = BatchSettings(given.kind, Source("", DepthChoice()))
    with tempfile.TemporaryDirectory() as scratch, ExitStack() as stack:
        photos = Path(scratch, "photos")
        photos.mkdir()
        write_photos(photos, given.photos, given.megapixels)
        tasks = tasks_for(photos, settings)
        stack.enter_context(set_environment(thread_variables(1) | QUIET_AND_SAFE))
        pipes = [plain_process(stack) for _ in range(given.workers)]
        workers = stack.enter_context(local_workers(given.workers, 1))
        runs: dict[str, Run] = {
            "one process": lambda tasks: in_plain_processes(pipes[:1], tasks),
            f"{given.workers} on their own": lambda tasks: in_plain_processes(pipes, tasks),
            f"{given.workers} workers": lambda tasks: list(outcomes_of(workers, tasks)),
        }
        costs: dict[str, list[Cost]] = {name: [] for name in runs}
        for number in range(given.rounds + 1):
            for name, run in runs.items():
                cost = measure(run, tasks, Path(scratch, f"{number} {name}"))
                if number > 0:  # the first one compiles and loads
                    costs[name].append(cost)
    middle = {name: Cost(*(statistics.median(column) for column in zip(*of))) for name, of in costs.items()}
    one = middle["one process"]
    for name, cost in middle.items():
        count = 1 if cost is one else given.workers
        print(f"{name:14} {cost.wall:.3f} s a photo, {cost.processor:.3f} s of processors;"
              f" rate of one process times {count}: {one.wall / cost.wall / count:.1%} by the clock,"
              f" {one.processor / cost.processor:.1%} by processor time")  # fmt: skip


if __name__ == "__main__":
    main()
