"""`iibr batch` with real worker processes, and what is left when they, or photos, go wrong."""

from __future__ import annotations

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest

from iibr_core.formats.images.photo import write_image
from viewer.app.batch.cluster import ALLOWED_FAILURES, local_workers, outcomes_of, remote_workers
from viewer.app.batch.task import BatchSettings, Outcome, PhotoTask
from viewer.model.state.scene import Source

SETTINGS = BatchSettings("disparity", Source(""))
DEADLY = "deadly.png"


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    """Three photos, and a damaged one."""
    folder = tmp_path / "photos"
    (folder / "sub").mkdir(parents=True)
    for number, name in enumerate(("a.png", "b.png", "sub/a.png")):
        texture = np.random.default_rng(number).integers(0, 255, (24, 32, 3))
        write_image(folder / name, texture.astype(np.uint8))
    (folder / "torn.png").write_bytes((folder / "a.png").read_bytes()[:200])
    return folder


def run_batch(*words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-P", "-m", "viewer", "batch", *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, timeout=300)


def test_an_archive_is_exported_once(archive: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = (archive, "--to", "depth", "-o", out, "--workers", 2)
    done = run_batch(*words)
    assert (done.returncode, done.stdout) == (2, f"{out}: 3 written, 0 there before, 1 failed\n"), done.stderr
    assert done.stderr.splitlines() == [f"iibr: {out / 'failures.csv'}: tells what failed, and why"]
    written = {"a_depth.pfm", "b_depth.pfm", "sub/a_depth.pfm"}
    files = {path.relative_to(out).as_posix() for path in out.rglob("*") if path.is_file()}
    assert files == written | {"manifest.jsonl", "failures.csv"}
    lines = [json.loads(line) for line in (out / "manifest.jsonl").read_text().splitlines()]
    assert {line["output"] for line in lines} == written
    (failure,) = csv.DictReader((out / "failures.csv").read_text().splitlines())
    assert failure["photo"] == str(archive / "torn.png")
    assert "torn.png" in failure["reason"]

    (archive / "torn.png").unlink()
    before = {name: (out / name).stat().st_mtime_ns for name in written}
    again = run_batch(*words)
    assert (again.returncode, again.stdout) == (0, f"{out}: 0 written, 3 there before, 0 failed\n"), again.stderr
    assert before == {name: (out / name).stat().st_mtime_ns for name in written}


@pytest.fixture
def long_archive(archive: Path) -> Path:
    """So many photos that a batch can be ended in their midst."""
    photo = (archive / "a.png").read_bytes()
    shutil.rmtree(archive)
    archive.mkdir()
    for number in range(60):
        (archive / f"{number}.png").write_bytes(photo)
    return archive


def started_batch(*words: object, until: Path) -> subprocess.Popen[str]:
    """One that runs, in a process group of its own, and has finished something."""
    command = [sys.executable, "-P", "-m", "viewer", "batch", *map(str, words)]
    run = subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True)
    while run.poll() is None and not (until.is_file() and until.stat().st_size):
        time.sleep(0.01)
    return run


def goes_on(archive: Path, out: Path, *words: object) -> None:
    """What was finished is not made again, and of the rest one photo is."""
    finished = {json.loads(line)["name"] for line in (out / "manifest.jsonl").read_text().splitlines()}
    left = [path for path in sorted(archive.iterdir()) if path.stem not in finished]
    assert finished
    assert left
    for path in left[1:]:
        path.unlink()
    again = run_batch(*words)
    assert again.stdout == f"{out}: 1 written, {len(finished)} there before, 0 failed\n", again.stderr


@pytest.mark.skipif(os.name != "posix", reason="process groups")
def test_an_interruption_is_one_line_and_the_next_run_goes_on(long_archive: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = (long_archive, "--to", "hci", "--grid", 3, "-o", out, "--workers", 2)
    with started_batch(*words, until=out / "manifest.jsonl") as run:
        os.killpg(run.pid, signal.SIGINT)  # as a terminal does, to the workers too
        _, said = run.communicate(timeout=120)
    assert (run.returncode, said) == (130, "iibr: interrupted\n")
    goes_on(long_archive, out, *words)


@pytest.mark.skipif(os.name != "posix", reason="process groups")
def test_when_all_is_killed_nothing_finished_is_lost(long_archive: Path, tmp_path: Path) -> None:
    """As by a power cut, to what the disk holds of it."""
    out = tmp_path / "out"
    words = (long_archive, "--to", "hci", "--grid", 3, "-o", out, "--workers", 2)
    with started_batch(*words, until=out / "manifest.jsonl") as run:
        for process in (*psutil.Process(run.pid).children(recursive=True), psutil.Process(run.pid)):
            process.kill()
        run.communicate(timeout=120)
    whole = [json.loads(line)["output"] for line in (out / "manifest.jsonl").read_text().splitlines()]
    assert all(len(list((out / name).glob("input_Cam*.png"))) == 9 for name in whole)
    goes_on(long_archive, out, *words)


@pytest.fixture
def cluster_elsewhere(tmp_path: Path) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """A scheduler with a worker, as users start them: its process and address."""
    told = tmp_path / "scheduler.json"
    dask = [sys.executable, "-P", "-m", "dask"]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    where = ["--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(told)]
    scheduler = subprocess.Popen([*dask, "scheduler", *where], **quiet)  # type: ignore[call-overload]
    while scheduler.poll() is None and not (told.is_file() and told.stat().st_size):
        time.sleep(0.01)
    address = json.loads(told.read_text())["address"]
    worker = subprocess.Popen([*dask, "worker", address, "--nthreads", "1", "--no-dashboard"], **quiet)  # type: ignore[call-overload]
    yield scheduler, address
    for process in (*psutil.Process(worker.pid).children(recursive=True), worker, scheduler):
        process.kill()
    worker.wait()
    scheduler.wait()


def test_when_the_scheduler_is_killed_it_is_one_line_and_nothing_finished_is_lost(
    long_archive: Path, tmp_path: Path, cluster_elsewhere: tuple[subprocess.Popen[bytes], str]
) -> None:
    scheduler, address = cluster_elsewhere
    out = tmp_path / "out"
    words = (long_archive, "--to", "hci", "--grid", 3, "-o", out)
    with started_batch(*words, "--scheduler", address, until=out / "manifest.jsonl") as run:
        scheduler.kill()
        _, said = run.communicate(timeout=120)
    (line,) = said.splitlines()
    assert run.returncode == 2
    assert line.startswith("iibr: the workers were lost"), said
    goes_on(long_archive, out, *words, "--workers", 1)


def deadly_or_not(task: PhotoTask) -> Outcome:
    if task.photo == DEADLY:
        os.kill(os.getpid(), signal.SIGKILL)
    return Outcome(task.photo)


def threads_in_worker() -> int:
    from iibr_core.runtime.tiling import THREADS

    return THREADS


@pytest.fixture(scope="module")
def client() -> Iterator[Any]:
    with local_workers(2, 1) as client:
        yield client


def task(name: str) -> PhotoTask:
    return PhotoTask(name, name, name, SETTINGS)


def test_workers_take_their_part_of_the_cores(client: Any) -> None:
    assert set(client.run(threads_in_worker).values()) == {1}


def test_photos_wait_outside_until_there_is_a_worker(client: Any) -> None:
    taken = finished = 0

    def tasks() -> Iterator[PhotoTask]:
        nonlocal taken
        for number in range(40):
            taken += 1
            assert taken - finished <= 2
            yield task(f"{number}.png")

    for _ in outcomes_of(client, tasks(), deadly_or_not):
        finished += 1
    assert (taken, finished) == (40, 40)


def test_a_scheduler_elsewhere_lends_its_workers(client: Any) -> None:
    with remote_workers(client.scheduler.address) as other:
        outcomes = dict(outcomes_of(other, map(task, ("a.png", "b.png", "c.png")), deadly_or_not))
    assert sorted(outcome.output for outcome in outcomes.values()) == ["a.png", "b.png", "c.png"]


def test_a_worker_that_is_killed_costs_no_photo_and_a_deadly_photo_is_named(client: Any) -> None:
    os.kill(next(iter(client.run(os.getpid).values())), signal.SIGKILL)
    names = [*(f"{number}.png" for number in range(6)), DEADLY]
    outcomes = {task.photo: outcome for task, outcome in outcomes_of(client, map(task, names), deadly_or_not)}
    assert sorted(outcomes) == sorted(names)
    assert [name for name, outcome in outcomes.items() if outcome.reason] == [DEADLY]
    assert f"killed its worker, {ALLOWED_FAILURES + 1} times" in outcomes[DEADLY].reason
