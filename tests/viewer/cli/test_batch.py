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
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import psutil
import pytest

from iibr_core.depth.choice import BETTER_WAYS
from iibr_core.formats.images.photo import write_image


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


def iibr(*words: object) -> list[str]:
    return [sys.executable, "-P", "-m", "viewer", *map(str, words)]


def run_batch(*words: object) -> subprocess.CompletedProcess[str]:
    return subprocess.run(iibr("batch", *words), capture_output=True, text=True, timeout=300)


def summary_of(out: Path, written: int, there_before: int, failed: int) -> list[str]:
    """What a batch says of photos that have no depth of their own."""
    exported = written + there_before
    return [
        f"{out}: {written} written, {there_before} there before, {failed} failed",
        f"{exported} of {exported} photos have guessed depth. {BETTER_WAYS}",
    ]


def workers_of(run: subprocess.Popen[str]) -> list[psutil.Process]:
    children = psutil.Process(run.pid).children()
    return [process for process in children if "spawn_main" in " ".join(process.cmdline())]


def test_an_archive_is_exported_once(archive: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = (archive, "--to", "depth", "-o", out, "--workers", 2)
    done = run_batch(*words)
    assert (done.returncode, done.stdout.splitlines()) == (2, summary_of(out, 3, 0, 1)), done.stderr
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
    assert (again.returncode, again.stdout.splitlines()) == (0, summary_of(out, 0, 3, 0)), again.stderr
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
    run = subprocess.Popen(iibr("batch", *words), stderr=subprocess.PIPE, text=True, start_new_session=True)
    while run.poll() is None and not (until.is_file() and until.stat().st_size):
        time.sleep(0.01)
    return run


def goes_on(archive: Path, out: Path, *words: object) -> None:
    """What was finished is not made again, and of the rest one photo is, by one worker."""
    lines = [json.loads(line) for line in (out / "manifest.jsonl").read_text().splitlines()]
    finished = {line["name"] for line in lines if line["key"]} - {line["name"] for line in lines if not line["key"]}
    left = [path for path in sorted(archive.iterdir()) if path.stem not in finished]
    assert finished
    assert left
    for path in left[1:]:
        path.unlink()
    again = run_batch(*words, "--workers", 1)
    assert again.stdout.splitlines() == summary_of(out, 1, len(finished), 0), again.stderr


@pytest.mark.skipif(os.name != "posix", reason="process groups")
def test_an_interruption_is_one_line_and_the_next_run_goes_on(long_archive: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = (long_archive, "--to", "hci", "--grid", 3, "-o", out)
    with started_batch(*words, "--workers", 2, until=out / "manifest.jsonl") as run:
        os.killpg(run.pid, signal.SIGINT)  # as a terminal does, to the workers too
        _, said = run.communicate(timeout=120)
    assert (run.returncode, said) == (130, "iibr: interrupted\n")
    assert not list(out.rglob(".*"))
    goes_on(long_archive, out, *words)


@pytest.mark.skipif(os.name != "posix", reason="process groups")
def test_an_interruption_while_workers_start_is_one_line(long_archive: Path, tmp_path: Path) -> None:
    command = ("batch", long_archive, "--to", "depth", "-o", tmp_path / "out", "--workers", 2)
    with subprocess.Popen(iibr(*command), stderr=subprocess.PIPE, text=True, start_new_session=True) as run:
        while run.poll() is None and not workers_of(run):
            time.sleep(0.001)
        os.killpg(run.pid, signal.SIGINT)
        _, said = run.communicate(timeout=120)
    assert (run.returncode, said) == (130, "iibr: interrupted\n")


@pytest.mark.skipif(os.name != "posix", reason="process groups")
def test_workers_end_with_who_started_them(long_archive: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = (long_archive, "--to", "hci", "--grid", 3, "-o", out)
    with started_batch(*words, "--workers", 2, until=out / "manifest.jsonl") as run:
        workers = workers_of(run)
        run.kill()
        run.communicate(timeout=120)
    assert workers
    assert not psutil.wait_procs(workers, timeout=60)[1]
    goes_on(long_archive, out, *words)


def test_a_worker_that_is_killed_costs_no_photo_and_nothing_listens(long_archive: Path, tmp_path: Path) -> None:
    """Neither on a port nor on a socket of the system's."""
    out = tmp_path / "out"
    with started_batch(long_archive, "--to", "depth", "-o", out, "--workers", 2, until=out / "manifest.jsonl") as run:
        workers = workers_of(run)
        sockets = [process.net_connections(kind="all") for process in (psutil.Process(run.pid), *workers)]
        workers[0].kill()
        _, said = run.communicate(timeout=300)
    assert (run.returncode, said) == (0, "")
    assert len(workers) == 2
    assert sockets == [[], [], []]
    assert len(list(out.glob("*_depth.pfm"))) == 60


@pytest.mark.skipif(os.name != "posix", reason="process groups")
def test_when_all_is_killed_nothing_finished_is_lost(long_archive: Path, tmp_path: Path) -> None:
    """As by a power cut, to what the disk holds of it."""
    out = tmp_path / "out"
    words = (long_archive, "--to", "hci", "--grid", 3, "-o", out)
    with started_batch(*words, "--workers", 2, until=out / "manifest.jsonl") as run:
        for process in (*psutil.Process(run.pid).children(recursive=True), psutil.Process(run.pid)):
            process.kill()
        run.communicate(timeout=120)
    whole = [json.loads(line)["output"] for line in (out / "manifest.jsonl").read_text().splitlines()]
    assert all(len(list((out / name).glob("input_Cam*.png"))) == 9 for name in whole)
    goes_on(long_archive, out, *words)


@pytest.fixture
def tls_files(tmp_path: Path) -> list[Path]:
    """A certificate that signed itself, which both sides show: --tls-ca, --tls-cert, --tls-key."""
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("certificates are made by openssl, which is not installed")
    cert, key = tmp_path / "cert.pem", tmp_path / "key.pem"
    words = ["req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=iibr", "-days", "2"]
    subprocess.run([openssl, *words, "-out", cert, "-keyout", key], check=True, capture_output=True)
    return [cert, cert, key]


@pytest.fixture
def tls_options(request: pytest.FixtureRequest) -> list[str]:
    """None, but for tests that ask for TLS."""
    if getattr(request, "param", "") != "tls":
        return []
    names = ("--tls-ca", "--tls-cert", "--tls-key")
    return [str(word) for pair in zip(names, request.getfixturevalue("tls_files")) for word in pair]


@pytest.fixture
def cluster_elsewhere(tmp_path: Path, tls_options: Sequence[str]) -> Iterator[tuple[subprocess.Popen[bytes], str]]:
    """A scheduler with a worker, as users start them: its process and address."""
    told = tmp_path / "scheduler.json"
    dask = [sys.executable, "-P", "-m", "dask"]
    tls = [word.replace("--tls-ca", "--tls-ca-file") for word in tls_options]
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    where = ["--host", "tls://127.0.0.1" if tls else "127.0.0.1", "--port", "0", "--no-dashboard"]
    scheduler = subprocess.Popen([*dask, "scheduler", *where, *tls, "--scheduler-file", str(told)], **quiet)  # type: ignore[call-overload]
    while scheduler.poll() is None and not (told.is_file() and told.stat().st_size):
        time.sleep(0.01)
    address = json.loads(told.read_text())["address"]
    worker = subprocess.Popen(
        [*dask, "worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard", *tls], **quiet
    )  # type: ignore[call-overload]
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
    goes_on(long_archive, out, *words)


@pytest.mark.parametrize("tls_options", ["tls"], indirect=True)
def test_a_scheduler_with_tls_lends_its_workers_to_who_has_a_certificate(
    archive: Path, tmp_path: Path, tls_options: list[str], cluster_elsewhere: tuple[subprocess.Popen[bytes], str]
) -> None:
    (archive / "torn.png").unlink()
    _, address = cluster_elsewhere
    words = (archive, "--to", "depth", "-o", tmp_path / "out", "--scheduler", address)
    refused = run_batch(*words)
    (line,) = refused.stderr.splitlines()
    assert refused.returncode == 2
    assert "--tls-ca" in line
    done = run_batch(*words, *tls_options)
    assert (done.returncode, done.stdout.splitlines()) == (0, summary_of(tmp_path / "out", 3, 0, 0)), done.stderr
