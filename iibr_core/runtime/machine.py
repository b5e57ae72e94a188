"""How large the machine is for this process: a container, a scheduler or a limit may grant less than the host has."""

from __future__ import annotations

import math
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import psutil

THREADS_VARIABLE = "IIBR_THREADS"
"""Several processes that share a machine are told their parts by it."""
CGROUPS, OWN_CGROUPS = Path("/sys/fs/cgroup"), Path("/proc/self/cgroup")
USUAL_SHARE = 4
"""This part of the memory is taken where the user says nothing, ..."""
LEAST_USUAL_BYTES, MOST_USUAL_SHARE = 3 * 2**29, 0.8
"""... but so much on small machines, as far as they have it."""
MAPPED_BYTES = 600 * 2**20
"""Of address space: libraries, stacks and heaps map it and never fill it."""


def core_count() -> int:
    """Cores that this process may use at the same time, 1 at least; THREADS_VARIABLE in the environment lowers it."""
    allowed = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    told = os.environ.get(THREADS_VARIABLE, "")
    most = int(told) if told.isascii() and told.isdigit() and len(told) < 10 else math.inf
    return max(1, math.ceil(min(allowed, cgroup_cores(), most)))


def memory_bytes() -> int:
    """Memory that this process may fill: the machine's, or what limits of its group and its own leave of it."""
    return int(min(psutil.virtual_memory().total, cgroup_memory_bytes(), own_limit_bytes()))


def usual_budget_bytes() -> int:
    """What this program takes at most where the user says nothing."""
    whole = memory_bytes()
    return max(whole // USUAL_SHARE, min(LEAST_USUAL_BYTES, int(MOST_USUAL_SHARE * whole)))


def cgroup_memory_bytes(mount: Path = CGROUPS, own: Path = OWN_CGROUPS) -> float:
    """The memory limit of the control groups that this process is in (versions 1 and 2), infinite without."""
    limits = [_number(folder / "memory.max") for folder in _folders(mount, own, "")]
    limits += [_number(folder / "memory.limit_in_bytes") for folder in _folders(mount, own, "memory")]
    return min(limits, default=math.inf)


def cgroup_cores(mount: Path = CGROUPS, own: Path = OWN_CGROUPS) -> float:
    """So many cores' time the control groups of this process grant it, infinite without a limit."""
    limits = []
    for folder in _folders(mount, own, ""):
        quota, _, period = _text(folder / "cpu.max").partition(" ")
        limits.append(_share(quota, period))
    for folder in _folders(mount, own, "cpu"):
        limits.append(_share(_text(folder / "cpu.cfs_quota_us"), _text(folder / "cpu.cfs_period_us")))
    return min(limits, default=math.inf)


def own_limit_bytes() -> float:
    """What the limits on this process (`ulimit -v`, `ulimit -d`) let it fill, infinite without.

    Not above 0 where they are smaller than what is mapped and never filled.
    """
    if sys.platform == "win32":
        return math.inf
    import resource

    softs = (resource.getrlimit(kind)[0] for kind in (resource.RLIMIT_AS, resource.RLIMIT_DATA))
    return min((soft - MAPPED_BYTES for soft in softs if soft != resource.RLIM_INFINITY), default=math.inf)


def _folders(mount: Path, own: Path, controller: str) -> Iterator[Path]:
    """The folders of a controller's groups, from this process's own up to the top; controller "": of version 2."""
    for line in _text(own).splitlines():
        _, _, rest = line.partition(":")
        names, _, path = rest.partition(":")
        if controller not in names.split(","):
            continue
        tops = [mount / names, mount / controller] if controller else [mount, mount / "unified"]
        for top in tops:
            # A container may see its own group as the top, under the path that the host knows it by.
            inner = Path(path.strip().lstrip("/"))
            yield from (top / each for each in (inner, *inner.parents))


def _text(path: Path) -> str:
    try:
        return path.read_text().strip()
    except (OSError, ValueError):
        return ""


def _number(path: Path) -> float:
    text = _text(path)
    return float(text) if text.isdigit() else math.inf


def _share(quota: str, period: str) -> float:
    """Microseconds of time in each period; "max", -1 and what cannot be read are no limit."""
    is_limit = quota.isdigit() and period.isdigit() and int(quota) > 0 and int(period) > 0
    return int(quota) / int(period) if is_limit else math.inf
