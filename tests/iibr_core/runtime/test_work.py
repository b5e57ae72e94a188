import math
import os
from types import SimpleNamespace

import psutil
import pytest

from iibr_core.runtime import machine
from iibr_core.runtime.time_left import TimeLeft, about_left
from iibr_core.runtime.work import part_of_job, report_progress, watched


def test_parts_count_in_the_whole_job() -> None:
    reports: list[tuple[float, float, str]] = []
    with watched(lambda *now: reports.append(now)), part_of_job(1, 2, 4):
        report_progress(0, 0, "looking")
        with part_of_job(1, 1, 2):
            report_progress(3, 6, "making")
    assert reports == [(1, 4, "looking"), (2.5, 4, "making")]


def test_equal_steps_are_predicted_once_the_pace_is_known_and_it_counts_down_between() -> None:
    clock = SimpleNamespace(now=100.0)
    left, predictions = TimeLeft(lambda: clock.now), []
    assert left.update(0, 0) is None, "unknown work"
    for done in range(1, 6):
        clock.now += 5.0 if done == 1 else 2.0  # the first compiles kernels
        predictions.append(left.update(done, 10))
    assert predictions == [None, 16.0, 14.0, 12.0, 10.0]
    assert left.share == 0.5
    clock.now += 1.0
    assert left.update(5, 10) == 9.0
    clock.now += 60.0
    assert left.update(5, 10) == 0.0
    left.update(6, 20)
    assert left.share == 0.5, "more to do takes no progress back"
    assert left.update(1, 10, "another stage") is None
    assert left.share == 0.1
    said = [about_left(seconds).removeprefix("about ") for seconds in (0.2, 42, 89, 185, 7200)]
    assert said == ["1 s left", "40 s left", "90 s left", "3 min left", "2.0 h left"]


@pytest.mark.parametrize(
    ("own", "files", "memory", "cores"),
    [
        ("0::/\n", {"memory.max": "500\n", "memory.current": "100", "cpu.max": "150000 100000\n"}, 400, 1.5),
        ("0::/a/b\n", {"a/memory.max": "300", "a/b/memory.max": "max", "a/b/cpu.max": "max 100000"}, 300, math.inf),
        ("0::/of/the/host\n", {"memory.max": "700", "cpu.max": "200000 100000"}, 700, 2),
        ("nonsense", {"memory.max": "many"}, math.inf, math.inf),
        ("", {}, math.inf, math.inf),
    ],
)
def test_limits_of_control_groups(tmp_path, own, files, memory, cores):
    for name, text in files.items():
        (tmp_path / "fs" / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "fs" / name).write_text(text)
    (tmp_path / "own").write_text(own)
    assert machine.cgroup_free_bytes(tmp_path / "fs", tmp_path / "own") == memory
    assert machine.cgroup_cores(tmp_path / "fs", tmp_path / "own") == cores


def test_the_machine_is_no_larger_than_the_host():
    assert 1 <= machine.core_count() <= (os.cpu_count() or 1)
    assert 0 < machine.free_memory_bytes() <= psutil.virtual_memory().total
