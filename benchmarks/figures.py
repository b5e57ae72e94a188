"""Writes every table and picture of README and docs/ again, at one commit: `make figures [DATA=DIR] [ONLY=WORDS]`.

    python -m benchmarks.figures [--data DATA] [--only WORDS] [--list] [--check]

FIGURES lists which program makes what, what it needs and about how long it takes on two cores; figures that this
machine cannot make are named and stay. A page is made whole, or between its marks, `<!-- NAME -->` and
`<!-- /NAME -->`, and what people wrote around them stays. The tables of README and docs/accuracy.md are copied from the
other pages. --list: shows FIGURES. --check: only names the pages that are older than what shapes their figures.
"""

from __future__ import annotations

import re
import shlex
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

from benchmarks.harness.pages import put_between
from benchmarks.harness.readme import write_readme
from benchmarks.harness.reports import DOCS, git, is_wanted, made_by, markdown, parser_of, start
from iibr_core.formats.outputs import write_file

ROOT = DOCS.parent
SHAPING = ("iibr_core", "viewer", "shaders", "web", "assets", "benchmarks")
"""Folders that decide figures."""
COMMIT = re.compile(r"\bat commit ([0-9a-f]{7,40})\b")
STAMP = re.compile(r"Made by `[^`]+`(?: at commit \w+(?: \(with changes\))?)?(?:, on \d+ cores)?")
TIME_LIMIT_S = 7200.0
"""Longest time of one program: one that hangs must not stop the others."""


@dataclass(frozen=True)
class Figure:
    """places: pages and pictures below docs/, PAGE#MARK for a part. command: its words; DATA is the folder of scenes,
    OUT one that it writes the places to; without OUT it prints them. minutes: on two cores. needs: of NEEDS.
    """

    places: tuple[str, ...]
    command: str
    minutes: float
    needs: tuple[str, ...] = ()

    @property
    def words(self) -> list[str]:
        """The command as a person would type it, in words."""
        words = shlex.split(self.command)
        return words if words[0] == "iibr" else ["python", *(["-m"] if words[0].startswith("bench") else []), *words]


NEEDS = {
    "DATA": "scenes as `iibr evaluate` takes them: DATA=DIR",
    "X": "Linux with Xvfb and xdotool",
    "chromium": "Linux with Chromium",
    "torch": "torch: pip install '.[train]'",
}
EVALUATED = (
    "blender_shop_9x9", "hci_antinous", "mb2003_teddy_quarter", "mb2005_moebius_third", "mb2014_motorcycle_quarter",
    "fence", "shelf",
)  # fmt: skip
"""Scenes of DATA and tests/data/thin_lens with a page each."""
GALLERY = "moving.gif", "near.jpg", "far.jpg", "rgbd.jpg", "anaglyph.jpg", "crossed.jpg", "epi.png"
METHOD = "epi", "candidates", "weights", "occlusion", "inpainting", "ray_set"
FIGURES = (
    Figure(
        ("evaluation/report.md", *(f"evaluation/{scene}.md" for scene in EVALUATED)),
        "benchmarks.scene_pages --data DATA --out OUT",
        6,
        ("DATA",),
    ),
    Figure(("speed.md", "speed.svg"), "benchmarks.speed --data DATA --repeats 2 --out OUT", 15, ("DATA",)),
    Figure(("peers.md", "peers.svg"), "benchmarks.peers --data DATA --out OUT", 12, ("DATA",)),
    Figure(("depth.md",), "benchmarks.depth --data DATA", 4, ("DATA",)),
    Figure(("stages.md",), "benchmarks.stages --data DATA", 20, ("DATA",)),
    Figure(("free_views.md#poses",), "benchmarks.free_views --scenes 8 --size 384x288 --seed 7", 2),
    Figure(("figures.md#against-warp",), "benchmarks.against_warp --data DATA --repeats 2", 4, ("DATA",)),
    Figure(("figures.md#window",), "benchmarks.window", 1, ("X",)),
    Figure(("figures.md#estimate",), "benchmarks.estimate", 2, ("X", "torch")),
    Figure(("figures.md#cancelled",), "benchmarks.cancel --times 10", 2),
    Figure(("figures.md#field-disparity",), "benchmarks.disparity --data DATA", 2, ("DATA",)),
    Figure(("refocus.md#pictures",), "benchmarks.refocus --data DATA --apertures 6 --max-pixels 150000", 40, ("DATA",)),
    Figure(("web.md#pages",), "benchmarks.web --data DATA", 15, ("DATA", "chromium")),
    Figure(tuple(f"method/{name}.png" for name in METHOD), "benchmarks.method_figures --out OUT", 1),
    Figure(("edges_fork.png", "edges_handlebar.png"), "docs/make_edges.py OUT", 0.5),
    Figure(tuple(f"gallery/{name}" for name in GALLERY), "docs/make_gallery.py OUT", 3),
    Figure(("screenshot.png", "inspection.png"), "docs/make_screenshots.py OUT", 0.5),
)


def main() -> None:
    parser = parser_of(__doc__, "data", "only")
    parser.add_argument("--list", action="store_true")
    parser.add_argument("--check", action="store_true")
    options = parser.parse_args()
    wanted = [one for one in FIGURES if is_wanted(" ".join((*one.places, one.command)), options.only)]
    if options.list:
        rows = ((", ".join(one.places), f"`{one.command}`", ", ".join(one.needs), one.minutes) for one in wanted)
        print(markdown(("docs/", "command", "needs", "minutes"), rows))
    elif options.check:
        faults = list(stale_pages())
        print("\n".join(faults) or "every page is as new as what shapes its figures")
        sys.exit(bool(faults))
    else:
        sys.exit(make_all(wanted, options.data and options.data.resolve()))


def make_all(wanted: list[Figure], data: Path | None) -> bool:
    """Make the figures one after the other, print how it went, and return whether one failed."""
    failed = False
    for figure in wanted:
        name, lacking = ", ".join(figure.places), [NEEDS[need] for need in figure.needs if not has(need, data)]
        if lacking:
            print(f"{name}: left as it is; needs {', and '.join(lacking)}", flush=True)
            continue
        print(f"{name}: {figure.command} ...", flush=True)
        begun = time.monotonic()
        fault = make(figure, data)
        failed |= bool(fault)
        minutes = (time.monotonic() - begun) / 60
        print(f"{name}: {fault or f'made in {minutes:.1f} minutes'}", flush=True)
    for fault in write_readme(ROOT):
        print(fault)
    return failed


def has(need: str, data: Path | None) -> bool:
    """Return whether this machine has what a figure needs."""
    return {
        "DATA": data is not None,
        "X": shutil.which("Xvfb") is not None and shutil.which("xdotool") is not None,
        "chromium": sys.platform == "linux" and shutil.which("chromium") is not None,
        "torch": find_spec("torch") is not None,
    }[need]


def make(figure: Figure, data: Path | None) -> str:
    """Run the program and write its results; return why that failed, "" if it did not."""
    with tempfile.TemporaryDirectory() as out:
        folders = {"DATA": str(data), "OUT": out, "python": sys.executable, "iibr": f"{sys.executable}\0-m\0viewer"}
        filled = (re.sub(r"^(DATA|OUT|python$|iibr$)", lambda m: folders[m[0]], word) for word in figure.words)
        words = "\0".join(filled).split("\0")
        try:
            run = subprocess.run(words, cwd=ROOT, stdout=subprocess.PIPE, text=True, timeout=TIME_LIMIT_S, check=False)
        except subprocess.TimeoutExpired:
            return f"failed: did not end within {TIME_LIMIT_S:g} s"
        if run.returncode:
            return f"failed: ended with {run.returncode}"
        for place in figure.places:
            made = Path(out, Path(place).name)
            if "OUT" not in figure.command:
                write_page(place, figure, run.stdout)
            elif made.suffix == ".md":
                write_page(place, figure, made.read_text("utf-8"))
            else:
                with write_file(DOCS / place) as unfinished:
                    shutil.copyfile(made, unfinished)
    return ""


def write_page(place: str, figure: Figure, text: str) -> None:
    """Write a page, or its part, with the command that made it."""
    name, _, mark = place.partition("#")
    said = made_by(figure.words)
    stamped, count = STAMP.subn(said, text.strip(), count=1)
    text = stamped if count else f"{said}.\n\n{stamped}"
    if mark:
        text = put_between((DOCS / name).read_text("utf-8"), mark, text)
    with write_file(DOCS / name) as unfinished:
        unfinished.write_text(text.rstrip("\n") + "\n", "utf-8")


def pages() -> Iterator[str]:
    """Yield the pages that FIGURES makes, each once."""
    yield from dict.fromkeys(place.partition("#")[0] for one in FIGURES for place in one.places if ".md" in place)


def stale_pages() -> Iterator[str]:
    """Yield a line for each page that names no commit, or one since which something that shapes figures changed."""
    for page in pages():
        for commit in dict.fromkeys(COMMIT.findall((DOCS / page).read_text("utf-8"))) or [""]:
            later = git("rev-list", "--count", f"{commit}..HEAD", "--", *(f":/{folder}" for folder in SHAPING))
            if later != "0" or not commit:
                age = f"at {commit}, {later} commits behind" if later else f"at {commit}, which this history lacks"
                yield f"docs/{page}: {age if commit else 'says no commit'}"
    yield from write_readme(ROOT, only_check=True)


if __name__ == "__main__":
    start("benchmarks.figures", main)
