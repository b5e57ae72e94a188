"""The time that a job says it still takes, once a tenth of its work is done, against what it then took.

    python -m benchmarks.time_left [--only WORDS] [--fresh]

Every job is a process of its own: an `iibr` command as users run it, or the opening of a light field as the window does
it. Each runs twice, and the second run counts, as kernels are compiled once for a machine; --fresh: once. A prediction
counts from the first that is told with at least a tenth of the work done. On a machine that is shared the clock says
little, so both are held against processor time too: the prediction times the cores that the job had until then.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import psutil

from benchmarks.harness.bench_scenes import DEMO, write_photos
from benchmarks.harness.reports import emit, head, holds, is_wanted, parser_of, row, start
from benchmarks.harness.timing import COMMAND_LINE
from iibr_core.runtime.time_left import TimeLeft
from iibr_core.scenes import opening_work
from viewer.cli import terminal

ENOUGH = 0.1
WITHIN = 1.5
WINDOW = "open"
"""Instead of a command: a light field is opened as the window opens it."""


@dataclass(frozen=True)
class Record:
    """What was told at a time. cpu_s: processor time of the job so far."""

    at_s: float
    cpu_s: float
    share: float
    left_s: float | None


@dataclass(frozen=True)
class Outcome:
    """share: of the work that was done when this was told, left_s. Then it took true_s, and cpu_s of processor time.

    cores: that it had until then.
    """

    share: float
    left_s: float
    true_s: float
    cpu_s: float
    cores: float

    @property
    def by_clock(self) -> float:
        """Predicted over true."""
        return self.left_s / self.true_s

    @property
    def by_processor(self) -> float:
        """The same in processor time."""
        return self.left_s * self.cores / self.cpu_s


def jobs(folder: Path) -> dict[str, list[str]]:
    """Commands by what they do. The folder holds what `prepare` made."""
    photo, large, field, sparse = (folder / name for name in ("photo.png", "large", "field", "sparse"))
    own, out = f"{large / '00000.png'}", folder / "out"
    return {
        "generate 9x9 fast": ["generate", f"{photo}", "--grid", "9", "--quality", "fast", "-o", f"{out / 'a'}"],
        "generate 7x7 balanced": ["generate", f"{photo}", "--grid", "7", "--quality", "balanced", "-o", f"{out / 'b'}"],
        "generate 11x11 of 2 MP": ["generate", own, "--grid", "11", "-o", f"{out / 'c'}"],
        "export quilt": ["export", f"{photo}", "--to", "quilt", "--device", "portrait", "-o", f"{out / 'd.png'}"],
        "export video": ["export", f"{photo}", "--to", "gif", "-o", f"{out / 'e.gif'}"],
        "open a light field": [WINDOW, f"{field}"],
        "picture of 2 MP, views of 0.2": ["screenshot", own, "--max-pixels", "200000", "--full", "--aperture", "2",
                                          "-o", f"{out / 'f.png'}"],
        "light field 3x3 to 9x9": ["generate", f"{sparse}", "--grid", "9", "-o", f"{out / 'g'}"],
        "depth of a light field": ["depth", f"{field}", "-o", f"{out / 'h.pfm'}"],
        "30 cameras": ["generate", f"{photo}", "--poses", f"{folder / 'poses'}", "-o", f"{out / 'i'}"],
        "batch of 10 photos": ["batch", f"{folder / 'archive'}", "--to", "epi", "-o", f"{out / 'j'}"],
        "train 40 steps": ["train", "--steps", "40", "--out", f"{out / 'k.safetensors'}"],
    }  # fmt: skip


def prepare(folder: Path) -> None:
    """Photos, light fields without disparity, poses."""
    photo = folder / "photo.png"
    for path in DEMO.parent.glob(f"{DEMO.stem}*"):
        (folder / path.name.replace(DEMO.stem, "photo", 1)).write_bytes(path.read_bytes())
    for name, count, megapixels in (("large", 1, 2.0), ("archive", 10, 0.5)):
        write_photos(folder / name, count, megapixels)
    iibr("export", f"{photo}", "--to", "numbered-grid", "--grid", "9", "-o", f"{folder / 'field'}")
    iibr("export", f"{photo}", "--to", "numbered-grid", "--grid", "3", "-o", f"{folder / 'sparse'}")
    iibr("export", f"{photo}", "--to", "nerfstudio", "--grid", "5x6", "-o", f"{folder / 'poses'}")


def iibr(*words: str) -> None:
    subprocess.run([*COMMAND_LINE, *words], check=True, stdout=subprocess.DEVNULL)


def measure(words: list[str]) -> Outcome | str:
    """Run a job; a sentence where it told nothing."""
    environment = {**os.environ, "FORCE_COLOR": "1", "COLUMNS": "100"}  # a bar is drawn
    command = [sys.executable, "-m", "benchmarks.time_left", "--job", json.dumps(words)]
    done = subprocess.run(command, capture_output=True, text=True, env=environment, check=False)
    if done.returncode:
        return f"failed: {done.stderr[-400:]}"
    *records, end = [Record(**line) for line in json.loads(done.stdout.splitlines()[-1])]
    told = [record for record in records if record.share >= ENOUGH and record.left_s]
    if not told:
        return f"nothing was told in {end.at_s:.1f} s"
    first = told[0]
    assert first.left_s is not None
    cores = first.cpu_s / first.at_s
    return Outcome(first.share, first.left_s, end.at_s - first.at_s, end.cpu_s - first.cpu_s, cores)


def run_job(words: list[str]) -> list[Record]:
    """In a process of its own: what was told, and at last when it ended."""
    records: list[Record] = []
    begun, before = time.perf_counter(), processor_s()

    class Recorded(TimeLeft):
        """What is shown: a command's bar, or the window's."""

        def update(self, done: float, total: float) -> float | None:
            left_s = super().update(done, total)
            records.append(Record(time.perf_counter() - begun, processor_s() - before, self.share, left_s))
            return left_s

    if words[0] == WINDOW:
        opening_work.TimeLeft = Recorded  # type: ignore[misc]
        open_field(words[1])
    else:
        terminal.TimeLeft = Recorded  # type: ignore[misc]
        command(words)
    return [*records, Record(time.perf_counter() - begun, processor_s() - before, 1.0, 0.0)]


def open_field(path: str) -> None:
    from iibr_core.rendering.optics import CENTRE
    from iibr_core.scenes.opening import SceneRequest, results_of
    from iibr_core.scenes.scene import Source

    for _ in results_of(SceneRequest(1, Source(path)), lambda: False, lambda: CENTRE):
        pass


def command(words: list[str]) -> None:
    from viewer.cli.main import app

    try:
        app([*words, *(["--force"] if words[0] != "batch" else [])])
    except SystemExit as end:
        if end.code:
            raise


def processor_s() -> float:
    """Of this process and its children that live."""
    process, seconds = psutil.Process(), 0.0
    for each in (process, *process.children(recursive=True)):
        times = each.cpu_times()
        seconds += times.user + times.system
    return seconds


def main() -> None:
    parser = parser_of(__doc__, "only")
    parser.add_argument("--fresh", action="store_true")
    parser.add_argument("--job", help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.job:
        print("\n" + json.dumps([vars(record) for record in run_job(json.loads(options.job))]))
    else:
        emit(report(options.only, options.fresh))


def report(only: str, is_fresh: bool) -> Iterator[str]:
    yield head("job", "told at", "about, s", "took, s", "by the clock", "by processor time", "holds")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "out").mkdir()
        prepare(folder)
        for what, words in jobs(folder).items():
            if is_wanted(what, only):
                if not is_fresh:
                    measure(words)
                yield row(what, *cells(measure(words)))


def cells(outcome: Outcome | str) -> tuple[str, ...]:
    """Of a row; holds: whether both factors are within WITHIN."""
    if isinstance(outcome, str):
        return (outcome, *[""] * 5)
    factors = outcome.by_clock, outcome.by_processor
    is_near = all(1 / WITHIN <= factor <= WITHIN for factor in factors)
    times = f"{outcome.share:.0%}", f"{outcome.left_s:.1f}", f"{outcome.true_s:.1f}"
    return (*times, *(f"{factor:.2f}" for factor in factors), holds(is_near))


if __name__ == "__main__":
    start("benchmarks.time_left", main)
