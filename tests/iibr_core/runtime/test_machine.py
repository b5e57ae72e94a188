"""The machine's size is what a container, a scheduler or a limit leaves of the host's."""

import math
import os

import psutil
import pytest

from iibr_core.runtime import machine


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
