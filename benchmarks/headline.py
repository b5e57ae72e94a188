"""The README's figures measured anew: short programs one after another, each with its command, commit and words.

    python -m benchmarks.headline --data DATA [--yardsticks BENCH] [--only NAME] [--out docs/figures.md]

DATA holds the scenes that `iibr evaluate` takes; BENCH holds judge_views.py. --only measures one again and leaves the
others in the report as they are, with the commits that they were made at.
"""

from __future__ import annotations

import re
import shlex
import subprocess
import sys
from pathlib import Path

from benchmarks.harness.report import DOCS, current_commit, parser_of, start
from iibr_core.formats.outputs import atomic_write

TIME_LIMIT_S = 3600.0
"""One that hangs must not take hours of figures with it."""
VIEW_JUDGE = "judge_views.py"
JUDGED_SCENES = ("antinous", "teddy", "moebius", "motorcycle")
SOFT_MAPS = ("antinous-blur1", "antinous-blur2", "antinous-blur4", "antinous-half")
AGREEING = ("hci_antinous", "mb2014_motorcycle_quarter")
AGAINST_WARP = "demo,antinous,teddy,moebius,motorcycle"
TITLE = """# Figures of the README

What the programs named here printed, on two cores of a shared machine, without a GPU.
"""
IIBR = str(Path(sys.executable).parent / "iibr")


def measurements(data: str, yardsticks: str | None) -> dict[str, list[str]]:
    """What to call Python with, by the heading of its section."""
    programs = {
        "against-warp": ["-m", "benchmarks.against_warp", "--data", data, "--only", AGAINST_WARP, "--repeats", "2"],
        "first-picture": ["-m", "benchmarks.full_size"],
        "window": ["-m", "benchmarks.window"],
        "cancelled": ["-m", "benchmarks.cancel", "--times", "10"],
        "agreement": ["-m", "benchmarks.agreement", *(f"{data}/{scene}" for scene in AGREEING), "--views", "8"],
        "path-traced-lens": ["-m", "benchmarks.agreement", "tests/data/thin_lens"],
        "field-disparity": ["-m", "benchmarks.multi_view_depth", "--data", data],
        "refocus": ["-m", "benchmarks.refocus", "--data", f"{data}/blender_shop_9x9"],
    }
    if yardsticks:
        judge = [f"{yardsticks}/{VIEW_JUDGE}", "--data", data, "--iibr", IIBR]
        programs["views"] = [*judge, *JUDGED_SCENES]
        programs["soft-maps"] = [*judge, *SOFT_MAPS]
        programs["soft-maps-refine-off"] = [*judge, *SOFT_MAPS, "--extra=--refine off"]
    return programs


def section(name: str, program: list[str], places: dict[str, str]) -> str:
    """Run a program and tell about it. places: what stands in the report for folders of this machine."""
    command = shlex.join(["python", *program])
    lines = "\n".join(output_lines(program))
    for folder, word in places.items():
        command, lines = command.replace(folder, word), lines.replace(folder, word)
    return f"## {name}\n\nMade by `{command}` at commit {current_commit()}.\n\n```\n{lines}\n```\n"


def parts_of(report: str) -> tuple[str, dict[str, str]]:
    """What a report says before its sections, and these by their headings."""
    head, *parts = (part.rstrip("\n") + "\n" for part in re.split(r"^(?=## )", report, flags=re.MULTILINE))
    return head, {part.partition("\n")[0].removeprefix("## "): part for part in parts}


def output_lines(arguments: list[str]) -> tuple[str, ...]:
    """The lines that Python prints when it is run with these arguments; its last word where it fails."""
    try:
        run = subprocess.run(
            [sys.executable, *arguments], capture_output=True, text=True, check=False, timeout=TIME_LIMIT_S
        )
    except subprocess.TimeoutExpired:
        return (f"failed: {' '.join(arguments)} did not end within {TIME_LIMIT_S:g} s",)
    lines = run.stdout.splitlines()
    if run.returncode:
        lines.append(f"failed: {(run.stderr.strip().splitlines() or ['no reason given'])[-1]}")
    return tuple(lines)


def main() -> None:
    parser = parser_of(__doc__, data={"type": str, "required": True}, out={"default": DOCS / "figures.md"})
    parser.add_argument("--yardsticks")
    parser.add_argument("--only", help="heading of a section")
    options = parser.parse_args()
    programs = measurements(options.data, options.yardsticks)
    if options.only and options.only not in programs:
        parser.error(f"--only {options.only}: there are {', '.join(programs)}")
    places = {str(Path(sys.executable).parent) + "/": "", options.data: "DATA", options.yardsticks or "BENCH": "BENCH"}
    opening, sections = parts_of(options.out.read_text("utf-8") if options.out.exists() else TITLE)
    for name in [options.only] if options.only else programs:
        print(name, file=sys.stderr, flush=True)
        sections[name] = section(name, programs[name], places)
        with atomic_write(options.out) as unfinished:
            unfinished.write_text("\n".join([opening, *sections.values()]), "utf-8")


if __name__ == "__main__":
    start("benchmarks.headline", main)
