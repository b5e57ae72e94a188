"""How many cores and how much memory this process may use: a container may grant less than the host has."""

from __future__ import annotations

import ctypes
import math
import os
import sys
from pathlib import Path

import psutil

THREADS_VARIABLE = "IIBR_THREADS"
"""In the environment, the most threads: several processes share a machine by it."""
CGROUPS, OWN_CGROUP = Path("/sys/fs/cgroup"), Path("/proc/self/cgroup")
M_ARENA_MAX, MAX_ARENAS = -8, 2
"""The number is glibc's, in malloc.h. With two heaps that are trimmed, 150 photos peak at 391 MiB instead of 657, for
1.07 of the processor time.
"""


def core_count() -> int:
    """Return how many cores this process may use at the same time, 1 at least; THREADS_VARIABLE lowers it."""
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    text = os.environ.get(THREADS_VARIABLE, "")
    most = int(text) if text.isascii() and text.isdigit() else math.inf
    return max(1, math.ceil(min(allowed, cgroup_cores(), most)))


def free_memory_bytes() -> int:
    """Return the memory that is free for this process: the machine's, or what its control groups leave of it."""
    return int(max(min(psutil.virtual_memory().available, cgroup_free_bytes()), 0))


def cgroup_free_bytes(mount: Path = CGROUPS, own: Path = OWN_CGROUP) -> float:
    """Return the memory that this process's control groups (version 2) have left, infinite without limits."""
    groups = ((_numbers(folder / "memory.max"), _numbers(folder / "memory.current")) for folder in _folders(mount, own))
    return min((limit[0] - sum(used) for limit, used in groups if limit), default=math.inf)


def cgroup_cores(mount: Path = CGROUPS, own: Path = OWN_CGROUP) -> float:
    """Return how many cores' time the control groups of this process grant it, infinite without a limit."""
    shares = (_numbers(folder / "cpu.max") for folder in _folders(mount, own))
    return min((share[0] / share[1] for share in shares if share), default=math.inf)


def limit_arenas() -> None:
    """Have all threads share two heaps, where the C library is glibc. To be called before threads start."""
    _call_c("mallopt", M_ARENA_MAX, MAX_ARENAS)


def give_back_memory() -> None:
    """Return free memory to the system, where the C library is glibc; takes some milliseconds."""
    _call_c("malloc_trim", 0)


def _call_c(name: str, *arguments: int) -> None:
    function = getattr(ctypes.CDLL(None), name, None) if sys.platform == "linux" else None
    if function is not None:
        function(*arguments)


def _folders(mount: Path, own: Path) -> list[Path]:
    """Return the folders of this process's control group and of those above it; the top one if it is unknown."""
    lines = [line for line in _text(own).splitlines() if line.startswith("0::")]
    # In a container, the group may be known by its path on the host, and mounted as the top.
    inner = Path(lines[0][3:].lstrip("/")) if lines else Path()
    return [mount / part for part in (inner, *inner.parents)]


def _numbers(path: Path) -> list[int]:
    """Return the numbers in a file of a control group; none for "max" and if it cannot be read."""
    words = _text(path).split()
    return [int(word) for word in words] if all(map(str.isdigit, words)) else []


def _text(path: Path) -> str:
    try:
        return path.read_text()
    except (OSError, ValueError):
        return ""
