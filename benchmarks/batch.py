"""What handing photos to workers costs: `iibr batch`'s rate against that of one process times the workers.

    python -m benchmarks.batch --photos 20 --repeats 5 --megapixels 1 --workers 2 --kind depth

Photos are made up, all different, with maps beside them. Starting and the first photo count
apart. Every round has one process export the photos, so many such processes that know nothing of each other, and the
workers. Processes side by side share caches and memory: only against the second figure the batch's own cost shows, and
on a machine that others use only processor time says much.
"""

from __future__ import annotations

import multiprocessing
import tempfile
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from itertools import count
from multiprocessing.connection import Connection
from pathlib import Path

import psutil

from benchmarks.harness.report import emit, head, parser_of, row, start
from benchmarks.harness.scenes import write_photos
from benchmarks.harness.timing import Cost, in_turns, median_cost
from iibr_core.depth.choice import DepthChoice
from iibr_core.exports.batch.archive import photos_in
from iibr_core.exports.batch.processes import local_workers
from iibr_core.exports.batch.task import BatchSettings, PhotoTask, Place, key_of, target_name
from iibr_core.exports.batch.threads import QUIET_AND_SAFE, set_environment, thread_variables
from iibr_core.exports.batch.work import export_photo
from iibr_core.exports.batch.workers import outcomes_of
from iibr_core.runtime.allocator import limit_arenas
from iibr_core.scenes.scene import Source
from viewer.display.scene_drawer import open_drawn

Run = Callable[[Sequence[PhotoTask]], object]


def tasks_for(photos: Path, settings: BatchSettings) -> list[PhotoTask]:
    return [
        PhotoTask(photo.path, Place("", target_name(settings, photo)), key_of(settings, photo), settings)
        for photo in photos_in([photos])
    ]


def export(task: PhotoTask) -> None:
    outcome = export_photo(task, open_drawn)
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
    """What a photo costs, over all processes."""
    moved = [replace(task, place=replace(task.place, folder=str(folder))) for task in tasks]
    folder.mkdir()
    wall, processor = time.perf_counter(), processor_seconds()
    run(moved)
    return Cost(time.perf_counter() - wall, processor_seconds() - processor).times(1 / len(tasks))


def main() -> None:
    parser = parser_of(__doc__, "repeats")
    parser.add_argument("--photos", type=int, default=20)
    parser.add_argument("--megapixels", type=float, default=1.0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--kind", default="depth")
    given = parser.parse_args()
    settings = BatchSettings(given.kind, Source("", DepthChoice()))
    with tempfile.TemporaryDirectory() as scratch, ExitStack() as stack:
        write_photos(Path(scratch, "photos"), given.photos, given.megapixels)
        tasks = tasks_for(Path(scratch, "photos"), settings)
        work = partial(export_photo, open_drawn=open_drawn)
        stack.enter_context(set_environment(thread_variables(1) | QUIET_AND_SAFE))
        pipes = [plain_process(stack) for _ in range(given.workers)]
        workers = stack.enter_context(local_workers(given.workers, 1))
        runs: dict[str, Run] = {
            "one process": lambda tasks: in_plain_processes(pipes[:1], tasks),
            f"{given.workers} on their own": lambda tasks: in_plain_processes(pipes, tasks),
            f"{given.workers} workers": lambda tasks: list(outcomes_of(workers, tasks, work)),
        }
        folders = (Path(scratch, str(number)) for number in count())
        ways = {name: lambda run=run: measure(run, tasks, next(folders)) for name, run in runs.items()}
        in_turns(ways, 1)  # compiles and loads
        middle = {name: median_cost(costs) for name, costs in in_turns(ways, given.repeats).items()}
    emit(rows(middle, given.workers))


def rows(middle: dict[str, Cost], workers: int) -> Iterator[str]:
    """What each way takes, and of the rate of one process times the workers, how much it comes to."""
    yield head(
        "photos exported by", "s a photo", "of processors", "rate times processes, by the clock", "by processors"
    )
    one = middle["one process"]
    for name, cost in middle.items():
        wall = one.wall_s / cost.wall_s / (1 if cost is one else workers)
        yield row(name, f"{cost.wall_s:.3f}", f"{cost.cpu_s:.3f}", f"{wall:.1%}", f"{one.cpu_s / cost.cpu_s:.1%}")


if __name__ == "__main__":
    start("benchmarks.batch", main)
