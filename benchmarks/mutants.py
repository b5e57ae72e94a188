"""Puts one small fault at a time into the rooms of depth edges, in a copy of the tree: do the tests find it?

    python -m benchmarks.mutants [--seed 0] [--count 30] [--only WORDS] [--rooms FILES,...]

Faults: a comparison turned or made strict, + for -, a number doubled or halved, `and` for `or`, min for max, an index
off by one, a condition negated, an assignment left out; each with its counterpart. The seed chooses among all that
there are. One that no test finds shows a hole in the tests, or changes nothing that can be stated. --rooms: other
files, as patterns.
"""

from __future__ import annotations

import os
import random
import re
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Sequence
from pathlib import Path

from benchmarks.harness.reports import DOCS, git, is_wanted, parser_of, start
from benchmarks.small_faults import Fault, faults_of
from iibr_core.types import InputError

ROOT = DOCS.parent
ROOMS = (
    "iibr_core/depth/edges/*.py",
    "iibr_core/method/mixed_pixels.py",
    "iibr_core/method/flying_pixels.py",
    "iibr_core/surfaces.py",
)
TESTS = (
    "tests/iibr_core/depth/edges/test_*.py",
    "tests/iibr_core/**/test_mixed_pixels.py",
    "tests/iibr_core/**/test_flying_pixels.py",
    "tests/iibr_core/test_*cases.py",
    "tests/iibr_core/**/test_small_steps.py",
)
"""Tests of those rooms; the ones named after the file at fault are run first."""
TIME_LIMIT_S = 1200.0
"""Time in seconds after which a test counts as hanging, which is found."""


def main() -> None:
    parser = parser_of(__doc__, "seed", "only")
    parser.add_argument("--count", type=int, default=30, help="so many faults")
    parser.add_argument("--rooms", default=",".join(ROOMS), help="files to put faults into, by commas")
    options = parser.parse_args()
    names = [name for name in matching(ROOT, options.rooms.split(",")) if is_wanted(name, options.only)]
    every = [fault for name in names for fault in faults_of(name, (ROOT / name).read_text("utf-8"))]
    faults = choose(every, options.seed, options.count)
    with tempfile.TemporaryDirectory() as folder:
        whole = copy_tree(Path(folder, "whole"))
        tests = matching(whole, TESTS)
        if failed := failing_test(whole, tests):
            raise InputError(f"{failed} fails as it is")
        dead = 0
        for fault in faults:
            likely = sorted(tests, key=lambda name: f"test_{Path(fault.path).stem}" not in name)
            found = failing_test(with_fault(whole, fault, Path(folder, "faulty")), likely)
            dead += bool(found)
            print(f"{'dies' if found else '**survives**'}: {fault.what}{found and ', ' + found}", flush=True)
    print(f"{dead} of {len(faults)} die")


def matching(tree: Path, patterns: Iterable[str]) -> list[str]:
    """Files of a tree, in order."""
    return [str(path.relative_to(tree)) for pattern in patterns for path in sorted(tree.glob(pattern))]


def choose(faults: Sequence[Fault], seed: int, count: int) -> list[Fault]:
    """Return so many of the faults, at random."""
    return random.Random(seed).sample(faults, min(count, len(faults)))


def copy_tree(to: Path) -> Path:
    """Copy the files that git knows or would add, with the compiled kernels; return the copy."""
    names = git("ls-files", "--full-name", "-co", "--exclude-standard", ":/").splitlines()
    for name in (*names, *matching(ROOT, ["iibr_core/**/__pycache__/*.nb[ic]"])):
        if (ROOT / name).is_file():
            (to / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, to / name)
    return to


def with_fault(whole: Path, fault: Fault, to: Path) -> Path:
    """The tree again, by links, with a fault; nothing writes into files that it shares."""
    shutil.rmtree(to, ignore_errors=True)
    shutil.copytree(whole, to, copy_function=os.link)
    (to / fault.path).unlink()
    (to / fault.path).write_text(fault.source, "utf-8")
    return to


def failing_test(tree: Path, tests: Sequence[str]) -> str:
    """The first test that fails in a tree, "" where none does."""
    words = ["-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", "--hypothesis-seed=0", "--tb=no", *tests]
    try:
        run = subprocess.run(
            [sys.executable, *words], cwd=tree, capture_output=True, text=True, timeout=TIME_LIMIT_S, check=False
        )
    except subprocess.TimeoutExpired:
        return "hangs"
    failed = re.search(r"^(?:FAILED|ERROR) (.+?)(?: - .*)?$", run.stdout, re.MULTILINE)
    return failed[1] if failed else f"exit code {run.returncode}" if run.returncode else ""


if __name__ == "__main__":
    start("benchmarks.mutants", main)
