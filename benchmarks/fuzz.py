"""Feeds every reader files damaged on purpose: each must give finite values or an error of one line.

    python -m benchmarks.fuzz [--count 10000] [--reader NAME]... [--seed 0] [--out out/fuzz]

Cases run in a worker process with limits on time and memory, so a crash or a hang ends that worker only. Findings are
written to the folder: the file, and beside it what happened. Exits with 1 if there are any.
"""

from __future__ import annotations

import argparse
import os
import re
import resource
import selectors
import subprocess
import sys
import tempfile
import traceback
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import psutil

from benchmarks.fuzz_cases import READERS, case
from benchmarks.harness.reports import parser_of, start
from iibr_core.types import InputError

TIME_LIMIT_S = 20.0
"""For one case; generous, because other programs may load the machine."""
START_LIMIT_S = 300.0
ADDRESS_SPACE = 3 << 30
"""Bytes that a worker may reserve beyond those after reading the valid files."""
RESIDENT_BUDGET = 300 << 20
"""Bytes of them that a case may use."""
KEPT_EACH = 3


def main() -> None:
    parser = parser_of(__doc__, "seed", out={"default": Path("out/fuzz"), "help": "folder for findings"})
    parser.add_argument("--count", type=int, default=10_000, help="cases for each reader")
    parser.add_argument("--reader", action="append", choices=READERS, help="one of them only; may be repeated")
    parser.add_argument("--work", nargs=2, type=int, help=argparse.SUPPRESS)
    given = parser.parse_args()
    if given.work:
        work(given.reader[0], given.seed, *given.work)
        return
    total = 0
    for name in given.reader or READERS:
        findings, read = fuzz_reader(name, given.seed, given.count, given.out)
        total += sum(findings.values())
        kinds = "".join(f"\n    {count} x {what}" for what, count in findings.most_common())
        print(f"{name}: {given.count} cases, {read} read in spite of damage, {sum(findings.values())} findings{kinds}")
        sys.stdout.flush()
    sys.exit(1 if total else 0)


def fuzz_reader(name: str, seed: int, count: int, out: Path) -> tuple[Counter[str], int]:
    """Return the findings by kind, and how many cases were read without complaint; a worker that ends is replaced."""
    findings: Counter[str] = Counter()
    read = next_case = 0
    while next_case < count:
        worker = subprocess.Popen(
            [
                *(sys.executable, "-m", "benchmarks.fuzz", "--reader", name, "--seed", str(seed)),
                *("--work", str(next_case), str(count)),
            ],
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
        )
        case_number = None
        for line in _lines(worker):
            number, outcome = line.split(" ", 1)
            case_number = int(number)
            if outcome == "begin":
                continue
            read += outcome == "read"
            if outcome not in ("read", "refused"):
                _keep(findings, outcome, name, seed, case_number, out)
            next_case = case_number + 1
        code = worker.wait()
        if next_case < count:
            if case_number is None:
                raise SystemExit(f"{name}: the worker does not start (exit code {code}); run it with --work 0 1")
            what = "hang" if code == -9 else f"crash: exit code {code}"
            if case_number == next_case:
                _keep(findings, what, name, seed, case_number, out)
                next_case = case_number + 1
    return findings, read


def _lines(worker: subprocess.Popen[bytes]) -> Iterator[str]:
    """The worker's lines as they come; it is killed where none comes in time."""
    assert worker.stdout is not None
    waiting = selectors.DefaultSelector()
    waiting.register(worker.stdout, selectors.EVENT_READ)
    rest, limit = b"", START_LIMIT_S
    while True:
        if not waiting.select(limit):
            worker.kill()
            return
        chunk = os.read(worker.stdout.fileno(), 1 << 16)
        if not chunk:
            return
        limit = TIME_LIMIT_S
        *lines, rest = (rest + chunk).split(b"\n")
        yield from (line.decode() for line in lines)


def _keep(findings: Counter[str], what: str, name: str, seed: int, number: int, out: Path) -> None:
    findings[what] += 1
    if findings[what] > KEPT_EACH:
        return
    folder = out / name / f"{seed}-{number}"
    folder.mkdir(parents=True, exist_ok=True)
    file_name, data = case(name, seed, number)
    (folder / file_name).write_bytes(data)
    (folder / "what.txt").write_text(what + "\n", "utf-8")


def work(name: str, seed: int, first: int, last: int) -> None:
    """The worker: cases [first, last), two lines each on stdout: when it begins and how it ended."""
    reader = READERS[name]
    with tempfile.TemporaryDirectory(prefix="iibr-fuzz-") as folder:
        reader.prepare(Path(folder))
        for valid in reader.seeds():  # compiles and imports what is needed, outside the limits
            _outcome(name, Path(folder) / valid.name, valid.file_of(valid.data))
        limit = psutil.Process().memory_info().vms + ADDRESS_SPACE
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        for number in range(first, last):
            file_name, data = case(name, seed, number)
            print(number, "begin", flush=True)
            print(number, _outcome(name, Path(folder) / file_name, data), flush=True)


def _outcome(name: str, path: Path, data: bytes) -> str:
    """How reading ended: "read", "refused", or what went wrong in one line."""
    path.write_bytes(data)
    before = _resident_peak(reset=True)
    try:
        READERS[name].read(path)
        outcome = "read"
    except InputError as error:
        outcome = "refused" if "\n" not in str(error) else "a message of several lines"
    except Exception as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        text = re.sub(r"0x[0-9a-f]+|\d+", "#", " ".join(str(error).split()))[:80]
        outcome = f"{type(error).__name__} in {Path(frame.filename).name}:{frame.name}: {text}"
    finally:
        path.unlink(missing_ok=True)
    used = _resident_peak() - before
    return outcome if used <= RESIDENT_BUDGET else f"took {used >> 20 >> 6 << 6} MiB or more"


def _resident_peak(reset: bool = False) -> int:
    """Bytes; since the last reset. Linux only, 0 elsewhere."""
    try:
        if reset:
            Path("/proc/self/clear_refs").write_text("5")
        status = Path("/proc/self/status").read_text()
    except OSError:
        return 0
    return int(status.split("VmHWM:")[1].split()[0]) << 10


if __name__ == "__main__":
    start("benchmarks.fuzz", main)
