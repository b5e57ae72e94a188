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
import pytest

from iibr_core.formats.images.photo import write_image
from viewer.app.batch.cluster import ALLOWED_FAILURES, local_workers, outcomes_of, remote_workers
from viewer.app.batch.task import BatchSettings, Outcome, PhotoTask
from viewer.model.state.app_state import Source

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


@pytest.mark.skipif(os.name != "posix", reason="process groups")
def test_an_interruption_is_one_line_and_the_next_run_goes_on(archive: Path, tmp_path: Path) -> None:
    photo = (archive / "a.png").read_bytes()
    shutil.rmtree(archive)
    archive.mkdir()
    for number in range(60):
        (archive / f"{number}.png").write_bytes(photo)
    out = tmp_path / "out"
    words = (archive, "--to", "hci", "--grid", 3, "-o", out, "--workers", 2)
    manifest = out / "manifest.jsonl"
    command = [sys.executable, "-P", "-m", "viewer", "batch", *map(str, words)]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True, start_new_session=True) as run:
        while run.poll() is None and not (manifest.is_file() and manifest.stat().st_size):
            time.sleep(0.01)
        os.killpg(run.pid, signal.SIGINT)  # as a terminal does, to the workers too
        _, said = run.communicate(timeout=120)
    assert (run.returncode, said) == (130, "iibr: interrupted\n")

    finished = {json.loads(line)["name"] for line in manifest.read_text().splitlines()}
    left = [path for path in sorted(archive.iterdir()) if path.stem not in finished]
    assert finished
    assert left
    for path in left[1:]:
        path.unlink()
    again = run_batch(*words)
    assert again.stdout == f"{out}: 1 written, {len(finished)} there before, 0 failed\n", again.stderr


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
