"""Runs commands against what goes wrong, by combination: every option against values that are none, every file that is
read against what is no such file, every output onto every input, surroundings that are odd.

    python -m benchmarks.hostile [--only TEXT] [--workers 2]

Each case runs in a folder of its own (`tests/hostile`). Exits with 1 where one ends in a traceback, in another exit
code than 0 or 2, in more than one line, not within two minutes, or with anything changed that it was not to write: when
it is refused, nothing is.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from itertools import product
from pathlib import Path

from tests.hostile.case import Case, Ended, run_case
from tests.hostile.forks import KILLED
from tests.hostile.sandbox import make_template

from benchmarks.harness.reports import parser_of, start

OPENING: dict[str, tuple[str, ...]] = {
    "plan": (),
    "screenshot": ("-o", "new.png"),
    "generate": ("--grid", "2", "--out", "new"),
    "export": ("--to", "anaglyph", "--grid", "2", "-o", "new.png"),
}
"""What opens a photo, with what else it needs."""
NUMBERS = ("", " ", "nan", "-inf", "1e309", "0x10", "1_000", "٣", "--", "1" * 5000, "-0", "1;2", "3.0.0", "\u200b5")
"""No number, or one that few would type."""
NUMERIC = {
    "plan": ("--grid", "--max-pixels", "--memory", "--refine", "--depth-strength", "--focus-disparity"),
    "screenshot": ("--view", "--focus", "--aperture", "--size", "--bits", "--picture-quality", "--disparity-scale"),
    "generate": ("--grid", "--memory", "--depth-strength"),
    "export": ("--row", "--frames", "--rate", "--eyes", "--size"),
}
WORDS = {
    "plan": ("--depth", "--quality", "--inpaint"),
    "screenshot": ("--backend", "--profile"),
    "generate": ("--format",),
    "export": ("--to", "--device", "--motion"),
}
NO_WORDS = ("", "\n", "../..", "[bold]x[/bold]", "a" * 5000, "%s", "\x1b[31m")


def _fifo(name: str) -> Callable[[Path], None]:
    return lambda folder: os.mkfifo(folder / name)


def _socket(name: str) -> Callable[[Path], None]:
    def prepare(folder: Path) -> None:
        with socket.socket(socket.AF_UNIX) as place:
            descriptor = os.open(folder, os.O_RDONLY)
            place.bind(f"/proc/self/fd/{descriptor}/{name}")
            os.close(descriptor)

    return prepare


def _holding(name: str, data: bytes) -> Callable[[Path], None]:
    return lambda folder: (folder / name).write_bytes(data) and None


def _link(name: str, target: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).symlink_to(target)


def _hard_link(name: str, target: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).hardlink_to(folder / target)


def _both(*prepare: Callable[[Path], None]) -> Callable[[Path], None]:
    def all_of_them(folder: Path) -> None:
        for each in prepare:
            each(folder)

    return all_of_them


Way = Callable[[str], tuple[str, Callable[[Path], None]]]
"""The path that leads to what is read in this way, and what makes it so."""
DEEP = b"[" * 100_000
NOT_FILES: dict[str, Callable[[str], Callable[[Path], None]]] = {
    "a pipe": _fifo,
    "a socket": _socket,
    "a link to a device": lambda name: _link(name, "/dev/zero"),
    "a link to a terminal": lambda name: _link(name, "/dev/tty"),
    "a loop": lambda name: _link(name, name),
    "a link to nothing": lambda name: _link(name, "gone/away"),
    "a link to this folder": lambda name: _link(name, "."),
    "a link to memory": lambda name: _link(name, "/proc/self/mem"),
    "an empty file": lambda name: _holding(name, b""),
    "zeros": lambda name: _holding(name, bytes(5000)),
    "high bytes": lambda name: _holding(name, b"\xff" * 5000),
    "a mark alone": lambda name: _holding(name, b"\xef\xbb\xbf"),
    "deep brackets": lambda name: _holding(name, DEEP),
    "one long line": lambda name: _holding(name, b"1 " * 700_000),
    "many lines": lambda name: _holding(name, b"1 1\n" * 200_000),
}
"""What lies where a file is to be read, by what makes it there."""

READ = (
    (("plan", "in.png"), "in.png"),
    (("screenshot", "in.jpg", "-o", "new.png"), "in.jpg"),
    (("plan", "photo.png", "--disparity", "in.pfm"), "in.pfm"),
    (("generate", "photo.png", "--grid", "2", "--out", "new", "--disparity", "in.npy"), "in.npy"),
    (("screenshot", "photo.png", "-o", "new.png", "--gloss", "in.toml"), "in.toml"),
    (("screenshot", "photo.png", "-o", "new.png", "--like", "in.png"), "in.png"),
    (("generate", "photo.png", "--out", "new", "--poses", "in.json"), "in.json"),
    (("generate", "photo.png", "--out", "new", "--poses", "in.npy"), "in.npy"),
    (("generate", "photo.png", "--out", "new", "--poses", "folder"), "folder/cameras.txt"),
    (("export", "photo.png", "--to", "gif", "-o", "new.gif", "--path", "in.txt"), "in.txt"),
    (("plan", "photo.png", "--depth-model", "folder"), "folder/config.json"),
    (("depth", "in_qs2x2a1.png", "-o", "new.pfm"), "in_qs2x2a1.png"),
    (("depth", "in.lif", "-o", "new.pfm"), "in.lif"),
    (("screenshot", "in_eslf.png", "-o", "new.png"), "in_eslf.png"),
    (("evaluate", "field", "--views", "1", "--out", "new", "--disparity", "in.pfm"), "in.pfm"),
    (("evaluate", "field", "--views", "1", "--out", "new", "--lpips", "folder"), "folder/alex.pth"),
)
"""Commands with every kind of file that is read."""

INPUTS = ("photo.png", "map.pfm", "gloss.toml", "env.png", "saved.png", "field/input_Cam004.png")
SHOT = (
    *("screenshot", "photo.png", "--disparity", "map.pfm", "--gloss", "gloss.toml", "--like", "saved.png"),
    *("--grid", "1"),
)
WRITERS: tuple[tuple[tuple[str, ...], tuple[str, ...]], ...] = (
    ((*SHOT, "--force", "-o"), INPUTS[:5]),
    (("export", "photo.png", "--disparity", "map.pfm", "--to", "anaglyph", "--gloss", "gloss.toml", "--grid", "1",
      "--force", "-o"), INPUTS[:4]),
    (("depth", "field", "--force", "-o"), INPUTS[5:]),
    (("generate", "photo.png", "--disparity", "map.pfm", "--gloss", "gloss.toml", "--grid", "1", "--force", "--out"),
     INPUTS[:4]),
    (("evaluate", "field", "--disparity", "map.pfm", "--views", "1", "--force", "--out"), (INPUTS[1], INPUTS[5])),
    (("export", "photo.png", "--disparity", "map.pfm", "--gloss", "gloss.toml", "--to", "nerfstudio", "--force", "-o"),
     INPUTS[:4]),
    (("export", "photo.png", "--disparity", "map.pfm", "--to", "disparity", "--grid", "1", "--force", "-o"),
     INPUTS[:2]),
)  # fmt: skip
"""What writes, all but where to, and what it reads."""


def _inputs(folder: Path) -> None:
    (folder / "env.png").write_bytes((folder / "photo.png").read_bytes())
    (folder / "gloss.toml").write_text('roughness = 0.5\nenvironment = "env.png"\n')


def _through(first: str, *prepare: Callable[[str], Callable[[Path], None]]) -> Way:
    """Onto `first`, with the ending of what is read; each of prepare is told that."""
    return lambda read: (
        first.replace("{read}", read) + ("" if "{read}" in first else Path(read).suffix),
        _both(_inputs, *(each(read) for each in prepare)),
    )


WAYS: dict[str, Way] = {
    "its name": _through("{read}"),
    "its whole path": _through("{folder}/{read}"),
    "a link": _through("way", lambda read: _link(f"way{Path(read).suffix}", read)),
    "a link to a link": _through(
        "far",
        lambda read: _link(f"way{Path(read).suffix}", read),
        lambda read: _link(f"far{Path(read).suffix}", f"way{Path(read).suffix}"),
    ),
    "a hard link": _through("hard", lambda read: _hard_link(f"hard{Path(read).suffix}", read)),
    "a detour": _through("folder/../{read}"),
    "a linked folder": _through("there/{read}", lambda read: _link("there", ".")),
}

ENVIRONMENTS: dict[str, dict[str, str | None]] = {
    "no threads": {"NUMBA_NUM_THREADS": "0"},
    "words for threads": {"NUMBA_NUM_THREADS": "two"},
    "a fraction of threads": {"NUMBA_NUM_THREADS": "1.5"},
    "endless threads": {"NUMBA_NUM_THREADS": "9" * 30},
    "an empty number of threads": {"NUMBA_NUM_THREADS": ""},
    "words for numba": {"NUMBA_DISABLE_JIT": "x", "NUMBA_OPT": "x", "NUMBA_DEBUG": "x"},
    "an unknown threading layer": {"NUMBA_THREADING_LAYER": "magic"},
    "words for OpenMP": {"OMP_NUM_THREADS": "x"},
    "words for OpenBLAS": {"OPENBLAS_NUM_THREADS": "x"},
    "a screen of no width": {"COLUMNS": "0"},
    "a screen of words": {"COLUMNS": "x", "LINES": "x"},
    "a terminal that nobody knows": {"TERM": "nonsense", "FORCE_COLOR": "1"},
    "a home of no text": {"HOME": "/\udcff"},
    "a relative home": {"HOME": "folder"},
    "a temporary folder that is a file": {"TMPDIR": "{folder}/text.txt"},
    "drivers nowhere": {"LIBGL_DRIVERS_PATH": "/nonexistent"},
    "an unknown renderer": {"GALLIUM_DRIVER": "magic"},
    "a cache that is a file": {"XDG_CACHE_HOME": "{folder}/text.txt", "NUMBA_CACHE_DIR": "{folder}/text.txt"},
}
ENDING_WELL = (
    ("plan", "photo.png", "--disparity", "map.pfm"),
    ("generate", "photo.png", "--disparity", "map.pfm", "--grid", "1", "--out", "new"),
    ("models",),
    ("export", "--help"),
)
OUTPUTS = ("new", "new.png", "new.gif", "new.pfm")
"""What cases may write where they end well; nothing else."""
MOST_TOLD = 1500
"""Characters of what a case says."""
LIMITS = ("--nofile=8", "--nofile=16", "--nofile=24", "--as=120000000", "--as=280000000", "--as=450000000",
          "--data=200000000", "--fsize=300", "--fsize=1000", "--stack=300000", "--cpu=600", "--memlock=0")  # fmt: skip


def cases() -> Iterator[Case]:
    """All, by combination."""
    for command, options in (*NUMERIC.items(), *WORDS.items()):
        values = NUMBERS if options == NUMERIC[command] else NO_WORDS
        for option, value in product(options, values):
            words = (command, "photo.png", *_without(OPENING[command], option), f"{option}={value}")
            yield Case(f"{command} {option}={value[:20]!r}", words)
    for (words, name), (kind, make) in product(READ, NOT_FILES.items()):
        yield Case(f"{' '.join(words)[:70]}: {name} is {kind}", words,
                   prepare=make(name))  # fmt: skip
    for (words, read), (way, place) in product(WRITERS, WAYS.items()):
        for each in read:
            where, prepare = place(each)
            yield Case(f"{words[0]} {' '.join(words[-6:-1])} onto {each} by {way}", (*words, where), prepare=prepare)
    for words, (around, given) in product(ENDING_WELL, ENVIRONMENTS.items()):
        yield Case(f"{words[0]} {words[-1]} with {around}", words, environment=given)
    for words, limit in product(ENDING_WELL[:2], LIMITS):
        quiet = {"PYTHONDONTWRITEBYTECODE": "1"}
        yield Case(f"{words[0]} under {limit}", words, limits=(limit,), environment=quiet)
    yield from _poses()


def _poses() -> Iterator[Case]:
    """Frames that are no cameras."""
    good = {"transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "w": 32, "h": 24, "fl_x": 50}
    endless = [[1e999] * 4] * 4
    bad: dict[str, object] = {"transform_matrix": endless, "w": -1, "h": 1e300, "fl_x": 0, "cx": "x", "cy": []}
    for name, value in (*bad.items(), *((name, None) for name in bad), *((name, {"a": 1}) for name in bad)):
        text = json.dumps({"frames": [{**good, name: value}]}).encode()
        words = ("generate", "photo.png", "--disparity", "map.pfm", "--out", "new", "--poses", "in.json")
        yield Case(f"a pose whose {name} is {value!r:.20}", words, prepare=_holding("in.json", text))


def _without(words: tuple[str, ...], option: str) -> tuple[str, ...]:
    kept = [pair for pair in zip(words[::2], words[1::2]) if pair[0] != option]
    return tuple(word for pair in kept for word in pair)


def troubles_of(case: Case, end: Ended) -> tuple[str, ...]:
    """What is wrong with how a case ended, in a word each."""
    lines = end.errors.splitlines()
    written = [name for name in end.changed if name.split("/")[0] in OUTPUTS and end.code == 0]
    wrong = {
        "traceback": "Traceback" in end.errors + end.output or "unexpected" in end.errors,
        "hang": end.code == KILLED,
        "exit code": end.code not in (0, 2, KILLED),
        "lines": end.code == 2 and (len(lines) != 1 or not lines[0].startswith("iibr: ")),
        "changed": len(written) < len(end.changed),
    }
    return tuple(name for name, is_so in wrong.items() if is_so)


def main() -> None:
    """Run them, and say what went wrong."""
    parser = parser_of(__doc__)
    parser.add_argument("--only", default="", help="cases whose names hold this")
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    chosen = [case for case in cases() if given.only in case.name]
    found: Counter[str] = Counter()
    codes: Counter[int] = Counter()
    start = time.perf_counter()
    with tempfile.TemporaryDirectory(prefix="iibr-hostile-") as place, ThreadPoolExecutor(given.workers) as pool:
        template = Path(place) / "template"
        make_template(template)

        def run(case: Case) -> tuple[Case, Ended]:
            return case, run_case(case, template, Path(tempfile.mkdtemp(dir=place)))

        for case, end in pool.map(run, chosen):
            codes[end.code] += 1
            troubles = troubles_of(case, end)
            found.update(troubles)
            if troubles:
                print(f"{case.name}: {', '.join(troubles)}: exit {end.code}, changed {end.changed}")
                print(end.errors[:MOST_TOLD])
                sys.stdout.flush()
    print(f"{len(chosen)} cases in {time.perf_counter() - start:.0f} s, exit codes {dict(codes)}")
    print(", ".join(f"{found[name]} {name}" for name in ("traceback", "exit code", "hang", "lines", "changed")))
    sys.exit(1 if found else 0)


if __name__ == "__main__":
    start("benchmarks.hostile", main)
