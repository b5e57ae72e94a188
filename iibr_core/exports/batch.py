"""Export every photo of some folders, with processes of this machine or the workers of a Dask scheduler.

A photo is skipped where its output exists and is newer than the photo and the map beside it.
"""

import csv
import logging
import os
import signal
import traceback
from collections import Counter, deque
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, as_completed, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import closing
from dataclasses import dataclass, replace
from glob import escape
from multiprocessing import active_children, get_context
from pathlib import Path
from typing import NamedTuple, cast

from iibr_core.depth.sidecar import map_to_read
from iibr_core.exports.kinds import (
    DEFAULT_OPTIONS,
    EXPORTS,
    ExportOptions,
    export_path,
    require_export_place,
)
from iibr_core.exports.photo_folder import list_photos, without_maps
from iibr_core.exports.source import OpenDrawn, open_for_export, write_export
from iibr_core.formats.files import reason_of
from iibr_core.formats.outputs import check_output_folder, remove_leftovers
from iibr_core.formats.quilts import TAG
from iibr_core.runtime import machine
from iibr_core.runtime.work import report_progress
from iibr_core.scenes.inputs import inputs_of
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import InputError

NO_CHOICE = LensChoice()
FAILURES, LOG = "failures.csv", "failures.log"
KILLED = "its worker was killed: too little memory, or a fault"
WORKER_BYTES = 3 * 2**29
"""Memory for one process."""
CONNECT_S = 15
"""Longest wait for a Dask scheduler, and for its first worker, in seconds."""


@dataclass(frozen=True)
class BatchSettings:
    """Choices for every photo of a batch.

    kind: name of the export kind. source: choices for opening a photo; its path is ignored. open_drawn: function that
    opens a scene for drawing, importable by workers; None for kinds that are not drawn.
    """

    kind: str
    source: Source
    depth_strength: float = 1.0
    options: ExportOptions = DEFAULT_OPTIONS
    lens: LensChoice = NO_CHOICE
    open_drawn: OpenDrawn | None = None


@dataclass(frozen=True)
class PhotoTask:
    """One photo to export.

    target: output, before its kind adds a tag to the name. inputs: folders in which nothing is written. threads: number
    of threads to use, unless the worker's environment sets it.
    """

    photo: Path
    target: Path
    settings: BatchSettings
    inputs: tuple[Path, ...] = ()
    threads: int = 1


class Outcome(NamedTuple):
    """Result of a task: the output, or the reason of the failure, with the traceback of an unexpected error."""

    task: PhotoTask
    output: Path | None = None
    is_guess: bool = False
    reason: str = ""
    trace: str = ""


@dataclass
class BatchCount:
    """Numbers of photos. guessed: those among the written ones whose depth is a guess."""

    written: int = 0
    there_before: int = 0
    failed: int = 0
    guessed: int = 0


def photos_in(folders: Sequence[Path]) -> list[tuple[Path, str]]:
    """Return all photos in these folders and their subfolders, without hidden ones and without maps of photos.

    Each photo comes with the name of its output, without ending, relative to the output folder. The names repeat the
    subfolders; they begin with the folder's name if there are several folders. Raises InputError for a missing folder
    and for two folders of the same name.
    """
    for folder in folders:
        if not folder.is_dir():
            raise InputError(f"{folder}: no such folder")
    tops = [folder.absolute().name if len(folders) > 1 else "" for folder in folders]
    top, count = Counter(tops).most_common(1)[0]
    if count > 1:
        raise InputError(f"{top}: two folders have this name; export them one after the other")
    return [photo for folder, top in zip(folders, tops) for photo in _photos_below(folder, top)]


def _photos_below(folder: Path, top: str) -> Iterator[tuple[Path, str]]:
    for place, subfolders, _ in os.walk(folder):
        inner = os.path.join(top, os.path.relpath(place, folder))
        names = sorted(photo.name for photo in list_photos(place))
        subfolders[:] = without_maps(subfolders, bool(names))
        taken = Counter(name.casefold() for name in names)
        taken.update(os.path.splitext(name)[0].casefold() for name in names)
        for name in names:
            stem = os.path.splitext(name)[0]
            output_name = stem if taken[stem.casefold()] == 1 else name
            yield Path(place, name), os.path.normpath(os.path.join(inner, output_name))


def check_batch_folder(folder: Path, inputs: Sequence[Path], force: bool) -> None:
    """Raise InputError where outputs would lie among inputs, or, without `force`, among files that no batch wrote."""
    check_output_folder(folder, inputs, force or (folder / FAILURES).is_file())


def run_batch(
    photos: Sequence[tuple[Path, str]],
    settings: BatchSettings,
    folder: Path,
    inputs: Sequence[Path] = (),
    *,
    workers: int | None = None,
    dask: str = "",
    force: bool = False,
) -> BatchCount:
    """Export photos, as `photos_in` returns them, into `folder`; write the list of failures there. Return the numbers.

    inputs: the photos' folders. workers: number of processes, None for one a core. dask: address of a scheduler whose
    workers are used instead. force: replace outputs that are up to date, too.
    """
    folder, read = folder.absolute(), tuple(path.absolute() for path in inputs)
    processes, threads = (0, 1) if dask else shares_of_machine(workers)
    ending = (*EXPORTS[settings.kind].endings, "")[0]
    tasks = [PhotoTask(path.absolute(), folder / (name + ending), settings, read, threads) for path, name in photos]
    finished = {} if force else {task.photo: output for task in tasks if (output := finished_output(task))}
    waiting = deque(task for task in tasks if task.photo not in finished)
    _begin_failures(folder)
    count, outputs = BatchCount(there_before=len(finished)), list(finished.values())
    report_progress(0, 0, "starting workers")
    try:
        with closing(_run_on_dask(dask, waiting) if dask and waiting else _run_here(processes, waiting)) as outcomes:
            for outcome in outcomes:
                if outcome.output:
                    outputs.append(outcome.output)
                    count.written += 1
                    count.guessed += outcome.is_guess
                else:
                    count.failed += 1
                    _write_failure(folder, outcome)
                report_progress(count.written + count.failed, len(tasks) - len(finished), "exporting")
    finally:
        for place in {task.target.parent for task in tasks}:
            remove_leftovers(place)
    kind = EXPORTS[settings.kind]
    if kind.gallery:
        kind.function(kind.gallery)(folder, [os.path.relpath(output, folder) for output in outputs])
    return count


def shares_of_machine(workers: int | None) -> tuple[int, int]:
    """Return the number of processes (one a core, if there is memory for them), and of threads for each."""
    cores = machine.core_count()
    processes = workers or max(min(cores, machine.free_memory_bytes() // WORKER_BYTES), 1)
    return processes, max(cores // processes, 1)


def finished_output(task: PhotoTask) -> Path | None:
    """Return the output of a photo if it exists and is newer than the photo and its map, else None."""
    kind, target = EXPORTS[task.settings.kind], task.target
    if task.settings.kind == "quilt":  # its tag depends on the photo's shape
        named = target.parent.glob(f"{escape(target.stem)}_qs*{target.suffix}")
        outputs = [path for path in named if TAG.match(path.stem[len(target.stem) :])]
    else:  # the name does not depend on the scene
        outputs = [export_path(kind, target, cast(Scene, None), task.settings.options)]
    sidecar = map_to_read(task.photo, task.settings.source.depth)
    try:
        changed = max(path.stat().st_mtime_ns for path in (task.photo, sidecar) if path)
        return next((output for output in outputs if output.stat().st_mtime_ns >= changed), None)
    except OSError:  # the output does not exist, or the photo, whose export then fails
        return None


def export_photo(task: PhotoTask) -> Outcome:
    """Export one photo, in a worker. Return the reason where that fails."""
    for variable in (machine.THREADS_VARIABLE, "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        os.environ.setdefault(variable, str(task.threads))
    try:
        return _export(task)
    except (InputError, OSError) as error:
        return Outcome(task, reason=str(error))
    except MemoryError as error:
        return Outcome(task, reason=f"out of memory ({error}): use smaller photos or fewer workers")
    except Exception as error:
        reason = f"unexpected {type(error).__name__}: {error} (please report it with {LOG})"
        return Outcome(task, reason=reason, trace=traceback.format_exc())


def _export(task: PhotoTask) -> Outcome:
    settings, target = task.settings, task.target
    kind, source = EXPORTS[settings.kind], replace(settings.source, path=str(task.photo))

    def check_place(scene: Scene) -> None:
        nonlocal target
        target = export_path(kind, target, scene, settings.options)
        target.parent.mkdir(parents=True, exist_ok=True)
        require_export_place(kind, target, (*task.inputs, *inputs_of(source)), True)

    opened = open_for_export(
        kind, settings.options, source, settings.depth_strength, settings.lens, check_place, settings.open_drawn
    )
    write_export(kind, target, opened, settings.options)
    return Outcome(task, target, opened.scene.is_guessed)


def _run_here(processes: int, waiting: deque[PhotoTask]) -> Generator[Outcome]:
    """Export photos in processes of this machine.

    When a process is killed, the photos that were in work are tried again, one at a time, to find the cause; the other
    photos get new processes.
    """
    while waiting:
        suspects = deque((yield from _run_pool(processes, waiting)))
        while suspects:
            for task in (yield from _run_pool(1, suspects)):
                yield Outcome(task, reason=KILLED)


def _run_pool(processes: int, waiting: deque[PhotoTask]) -> Generator[Outcome, None, list[PhotoTask]]:
    """Export photos until none is left or a process is killed. Return the photos that were in work then."""
    running: dict[Future[Outcome], PhotoTask] = {}
    others = active_children()
    executor = ProcessPoolExecutor(processes, get_context("spawn"), _prepare_worker)
    try:
        while waiting or running:
            while waiting and len(running) < processes:
                future = _submit(executor, waiting[0])
                running[future] = waiting.popleft()
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                yield future.result()
                del running[future]
    except BrokenProcessPool:
        return list(running.values())
    finally:
        for process in set(active_children()).difference(others) if running else ():
            process.kill()  # after Ctrl-C they are still in work
        executor.shutdown()
    return []


def _submit(executor: ProcessPoolExecutor, task: PhotoTask) -> Future[Outcome]:
    """Hand a photo to a process. Ctrl-C in the meantime waits: a process that starts here takes none, not even early.

    Windows cannot make it wait; there a process ignores Ctrl-C from `_prepare_worker` on.
    """
    if not hasattr(signal, "pthread_sigmask"):
        return executor.submit(export_photo, task)
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        return executor.submit(export_photo, task)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _prepare_worker() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # a terminal's Ctrl-C also reaches the main process, which ends this
    machine.limit_arenas()


def _run_on_dask(address: str, tasks: Sequence[PhotoTask]) -> Generator[Outcome]:
    """Export photos with the workers of a Dask scheduler."""
    from distributed import Client
    from distributed.scheduler import KilledWorker

    logging.disable(logging.CRITICAL)  # Dask logs lost connections, which are reported below
    try:
        client = Client(address, timeout=CONNECT_S)
        client.wait_for_workers(1, timeout=CONNECT_S)
    except (OSError, ValueError, TypeError, RuntimeError) as error:
        raise InputError(f"{address}: no Dask scheduler with workers answers ({reason_of(error)})") from error
    with client:
        executor = client.get_executor(pure=False)
        running = {executor.submit(export_photo, task): task for task in tasks}
        try:
            for future in as_completed(running):
                killed = isinstance(future.exception(), KilledWorker)
                yield Outcome(running[future], reason=KILLED) if killed else future.result()
        except (OSError, RuntimeError, CancelledError) as error:
            reason = reason_of(error)
            raise InputError(f"the workers were lost ({reason}); the same command makes what is missing") from error


def _begin_failures(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    for name in (FAILURES, LOG):
        (folder / name).unlink(missing_ok=True)
    (folder / FAILURES).write_text("photo,reason\n", encoding="utf-8")


def _write_failure(folder: Path, outcome: Outcome) -> None:
    photo, reason = outcome.task.photo, " ".join(outcome.reason.split())
    with open(folder / FAILURES, "a", encoding="utf-8", errors="surrogateescape", newline="") as file:
        csv.writer(file).writerow((photo, reason))
    if outcome.trace:
        with open(folder / LOG, "a", encoding="utf-8", errors="surrogateescape") as file:
            file.write(f"{photo}\n{outcome.trace}\n")
