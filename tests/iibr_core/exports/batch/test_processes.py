"""Worker processes of this machine: what they are given, how they die, what they leave."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from iibr_core.exports.batch.processes import local_workers
from iibr_core.exports.batch.task import BatchSettings, Outcome, PhotoTask, Place
from iibr_core.exports.batch.workers import MOST_DEATHS, Workers, outcomes_of
from iibr_core.runtime.machine import THREADS_VARIABLE, core_count
from iibr_core.scenes.scene import Source

SETTINGS = BatchSettings("disparity", Source(""))
DEADLY, ILL_FATED = "deadly.png", "ill-fated.png"


def task(name: str, folder: Path = Path()) -> PhotoTask:
    return PhotoTask(name, Place(str(folder), name), name, SETTINGS)


def deadly_or_not(task: PhotoTask) -> Outcome:
    """One photo kills every worker, another one all but the last that it may."""
    with open(Path(task.place.folder, task.photo), "ab+") as tries:
        tries.write(b".")
        tries.seek(0)
        count = len(tries.read())
    if task.photo == DEADLY or (task.photo == ILL_FATED and count < MOST_DEATHS):
        os.kill(os.getpid(), signal.SIGKILL)
    return Outcome(task.photo)


def threads_in_worker(task: PhotoTask) -> Outcome:
    from iibr_core.runtime.tiling import THREADS

    libraries = {os.environ[name] for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "NUMBA_NUM_THREADS")}
    return Outcome(f"{THREADS} {libraries}")


def process_of_worker(task: PhotoTask) -> Outcome:
    return Outcome(str(os.getpid()))


@pytest.fixture(scope="module")
def workers() -> Iterator[Workers]:
    with local_workers(2, 3) as workers:
        yield workers


def test_workers_take_their_part_of_the_cores(workers: Workers) -> None:
    before = os.environ.get(THREADS_VARIABLE)
    ((_, outcome),) = outcomes_of(workers, [task("a.png")], threads_in_worker)
    assert outcome.output == f"{min(3, core_count())} {{'3'}}"
    with local_workers(1, 1) as one:
        ((_, outcome),) = outcomes_of(one, [task("a.png")], threads_in_worker)
    assert outcome.output == "1 {'1'}"
    assert os.environ.get(THREADS_VARIABLE) == before


def test_photos_wait_outside_until_a_worker_is_free(workers: Workers, tmp_path: Path) -> None:
    taken = finished = most = 0

    def tasks() -> Iterator[PhotoTask]:
        nonlocal taken, most
        for number in range(20):
            taken += 1
            most = max(most, taken - finished)
            yield task(f"{number}.png", tmp_path)

    for _ in outcomes_of(workers, tasks(), deadly_or_not):
        finished += 1
    assert (taken, finished, most) == (20, 20, 2)


def test_a_photo_is_given_up_once_it_has_killed_so_many_workers_and_no_other_is(
    workers: Workers, tmp_path: Path
) -> None:
    names = ["a.png", DEADLY, ILL_FATED, "b.png", "c.png"]
    tasks = [task(name, tmp_path) for name in names]
    outcomes = {task.photo: outcome for task, outcome in outcomes_of(workers, tasks, deadly_or_not)}
    assert sorted(outcomes) == sorted(names)
    assert {name: outcome.reason for name, outcome in outcomes.items() if outcome.reason} == {
        DEADLY: f"killed its worker, {MOST_DEATHS} times: too little memory, or a fault"
    }
    tried = {name: (tmp_path / name).stat().st_size for name in names}
    assert tried == {"a.png": 1, DEADLY: MOST_DEATHS, ILL_FATED: MOST_DEATHS, "b.png": 1, "c.png": 1}


def test_workers_are_reached_by_no_port_and_no_socket(workers: Workers) -> None:
    pids = {int(outcome.output) for _, outcome in outcomes_of(workers, [task("a"), task("b")], process_of_worker)}
    assert pids
    assert [psutil.Process(pid).net_connections(kind="all") for pid in pids] == [[]] * len(pids)


def wait_long(folder: Path) -> None:
    """Much longer than any test takes to leave."""
    (folder / "begun").touch()
    time.sleep(20)
    (folder / "done").touch()


def test_a_worker_in_the_midst_of_a_photo_ends_with_the_block(tmp_path: Path) -> None:
    with local_workers(1, 1) as workers:
        future = workers.executor.submit(wait_long, tmp_path)
        while not (tmp_path / "begun").exists():
            assert not future.done()
    assert isinstance(future.exception(), workers.death)
    assert not (tmp_path / "done").exists()


def test_no_worker_is_left_behind() -> None:
    with local_workers(2, 1) as workers:
        outcomes = [outcome for _, outcome in outcomes_of(workers, [task("a"), task("b")], process_of_worker)]
    assert not any(psutil.pid_exists(int(outcome.output)) for outcome in outcomes)
