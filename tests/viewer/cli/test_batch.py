"""`iibr batch` with real processes: killed workers, Ctrl-C, and a Dask cluster on this machine."""

import csv
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import psutil
import pytest
from PIL import Image

from iibr_core.exports import batch
from viewer.cli.messages import BETTER_DEPTH

needs_process_groups = pytest.mark.skipif(os.name != "posix", reason="process groups")


@pytest.fixture
def archive(tmp_path):
    """A folder of many photos: a batch can be interrupted before its end."""
    folder = tmp_path / "photos"
    folder.mkdir()
    for number in range(8):
        pixels = np.random.default_rng(number).integers(0, 255, (24, 32, 3)).astype(np.uint8)
        Image.fromarray(pixels).save(folder / f"{number:02}.png")
    return folder


def command(archive, *words):
    options = ("--to", "hci", "--grid", "3", "-o", archive.with_name("out"))
    return [sys.executable, "-P", "-m", "viewer", "batch", str(archive), *map(str, (*options, *words))]


def start_batch(archive, *words):
    """Start a batch in a process group of its own."""
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE}
    return subprocess.Popen(command(archive, *words), text=True, start_new_session=True, **pipes)


def wait_until(run, is_reached):
    while not is_reached():
        assert run.poll() is None, run.communicate()
        time.sleep(0.01)


def exports_in(out):
    return sorted(path for path in out.glob("*") if path.name.isdecimal())


def workers_of(run):
    children = psutil.Process(run.pid).children()
    return [child for child in children if "spawn_main" in " ".join(child.cmdline())]


def test_an_archive_is_exported_once(iibr, archive, monkeypatch):
    """In threads: those below run in processes."""
    monkeypatch.setattr(batch, "ProcessPoolExecutor", lambda *_: ThreadPoolExecutor(1))
    for variable in ("IIBR_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "PYTHONWARNINGS", "PYTHONSAFEPATH"):
        monkeypatch.setenv(variable, os.environ.get(variable, ""))
    out = archive.with_name("out")
    words = "batch", archive, "--to", "depth", "--grid", 3, "-o", out
    for path in sorted(archive.iterdir())[3:]:
        path.unlink()
    (archive / "torn.png").write_bytes((archive / "00.png").read_bytes()[:200])
    assert "unknown address scheme" in iibr(*words, "--dask", "nonsense://127.0.0.1:1").stderr.splitlines()[-1]
    done = iibr(*words)
    guesses = f"3 of 3 written have guessed depth. {BETTER_DEPTH}"
    assert done.stdout.splitlines() == [f"{out}: 3 written, 0 there before, 1 failed", guesses]
    assert done.returncode == 2
    assert done.stderr.splitlines()[-1] == f"iibr: {out / 'failures.csv'}: lists what failed, and why"
    assert {path.name for path in out.iterdir()} == {"failures.csv", *(f"0{n}_depth.pfm" for n in range(3))}
    (failure,) = csv.DictReader((out / "failures.csv").read_text().splitlines())
    assert failure["photo"] == str(archive / "torn.png")
    (archive / "torn.png").unlink()
    again = iibr(*words)
    assert (again.returncode, again.stdout, again.stderr) == (0, f"{out}: 0 written, 3 there before, 0 failed\n", "")


@needs_process_groups
def test_ctrl_c_ends_all_processes_with_one_line(archive):
    out = archive.with_name("out")
    for number in range(8, 60):  # so many that it is far from its end when it is interrupted
        shutil.copyfile(archive / "00.png", archive / f"{number:02}.png")
    with start_batch(archive, "--workers", 2) as run:
        wait_until(run, lambda: len(exports_in(out)) > 2)
        workers = workers_of(run)
        os.killpg(run.pid, signal.SIGINT)  # a terminal sends it to the workers too
        output = run.communicate(timeout=60)
    assert (run.returncode, output) == (130, ("", "iibr: interrupted\n"))
    assert not psutil.wait_procs(workers, timeout=1)[1]
    assert not list(out.glob(".*"))


def test_a_killed_worker_costs_no_photo(archive):
    out = archive.with_name("out")
    with start_batch(archive, "--workers", 2) as run:
        wait_until(run, lambda: len(exports_in(out)) > 2)
        workers_of(run)[0].kill()
        output, errors = run.communicate(timeout=300)
    assert (run.returncode, errors) == (0, "")
    assert output.startswith(f"{out}: 8 written, 0 there before, 0 failed")
    assert len(exports_in(out)) == 8


@pytest.fixture
def cluster(tmp_path):
    """A Dask scheduler on a free port and two workers: the address, and the three processes."""
    pytest.importorskip("distributed")
    file = tmp_path / "scheduler.json"
    dask, pipes = [sys.executable, "-P", "-m", "dask"], {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    scheduler = [*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", file]
    processes = [subprocess.Popen(scheduler, **pipes)]
    try:
        while not (file.is_file() and file.stat().st_size):
            assert processes[0].poll() is None
            time.sleep(0.01)
        address = json.loads(file.read_text())["address"]
        worker = [*dask, "worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"]
        processes += [subprocess.Popen(worker, **pipes) for _ in range(2)]
        yield address, processes
    finally:
        for process in processes:
            process.kill()
        for process in processes:
            process.wait()


def test_a_dask_cluster_exports_all_photos_although_a_worker_is_killed_and_its_end_is_one_line(archive, cluster):
    address, (scheduler, worker, _) = cluster
    out = archive.with_name("out")
    with start_batch(archive, "--dask", address) as run:
        wait_until(run, lambda: len(exports_in(out)) > 2)
        worker.kill()
        output, errors = run.communicate(timeout=300)
    assert (run.returncode, errors) == (0, "")
    assert output.startswith(f"{out}: 8 written, 0 there before, 0 failed")
    shutil.rmtree(out)
    with start_batch(archive, "--dask", address) as run:
        wait_until(run, lambda: len(exports_in(out)) > 2)
        scheduler.kill()
        output, errors = run.communicate(timeout=120)
    assert (run.returncode, output) == (2, "")
    assert errors.startswith("iibr: the workers were lost")
    assert len(errors.splitlines()) == 1
