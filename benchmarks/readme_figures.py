"""Whether every figure of the README stands in a report of docs/, and every report says what it was made of.

    python -m benchmarks.readme_figures

A figure of the README is a number of its table rows and paragraphs under "Speed and accuracy" that is measured in dB,
seconds, shares or bytes, or stands alone in a cell of a table. All figures of one row, or of one paragraph, have to be
found together under one heading of one report, rounded as the README rounds them.

A report names the commit that made it. Where a room of the core that shapes figures has changed since then, a
paragraph of the report that begins with "Since then" has to name that room and say what differs.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

from benchmarks.harness.report import WITH_CHANGES

ROOT = Path(__file__).resolve().parent.parent
HEADING = "## Speed and accuracy"
ROOMS = {
    "depth": "iibr_core/depth",
    "generation": "iibr_core/generation",
    "inpainting": "iibr_core/inpainting",
    "ray_transformer": "iibr_core/ray_transformer",
    "rendering": "iibr_core/rendering",
    "shaders": "shaders",
    "weights": "assets/weights",
}
"""What decides figures, and where it lies."""
COMMIT = re.compile(r"\bcommit ([0-9a-f]{7,40})\b")
UNIT = r"\s?(?:dB|ms|s|%|GiB|MiB|GB|times)(?![\w²])"
NUMBER = r"(?<![\w.,=])[+-]?\d+(?:\.\d+)?(?![\w.]*\d)"
FIGURE = re.compile(rf"({NUMBER})(?={UNIT}|,? (?:to|or|and) {NUMBER}{UNIT}|(?:, {NUMBER})+{UNIT})")
ALONE = re.compile(rf"\s*({NUMBER})\s*$")


@dataclass(frozen=True)
class Figures:
    """line: of the README, as it stands there. values: its figures as written, "+0.13" and all."""

    line: str
    values: tuple[str, ...]


def figures_of(readme: str) -> Iterator[Figures]:
    """Rows and paragraphs of the README's section that have figures. Raises ValueError where the section is missing."""
    section = readme.partition(HEADING + "\n")[2].partition("\n## ")[0]
    if not section:
        raise ValueError(f"README.md: has no section {HEADING!r}")
    for block in re.sub(r"```.*?```", "", section, flags=re.DOTALL).split("\n\n"):
        rows = block.splitlines() if block.lstrip().startswith("|") else [" ".join(block.split())]
        for row in rows:
            values = tuple(_figures_of_row(row))
            if values:
                yield Figures(row, values)


def _figures_of_row(row: str) -> Iterator[str]:
    for cell in row.split("|"):
        alone = ALONE.match(cell)
        yield from [alone[1]] if alone else FIGURE.findall(cell)


def sections_of(report: str) -> Iterator[tuple[str, tuple[float, ...]]]:
    """Every heading of a report, and the numbers that stand below it, before the next."""
    parts = re.split(r"^(#+ .*)$", report, flags=re.MULTILINE)
    for heading, text in pairwise(parts):
        if heading.startswith("#"):
            yield heading.lstrip("# "), tuple(float(n) for n in re.findall(r"(?<![\w.])[+-]?\d+(?:\.\d+)?", text))


def stands_in(figure: str, numbers: tuple[float, ...]) -> bool:
    """Whether one of the numbers, rounded as the figure is, is the figure. Its sign counts."""
    half = 0.5 * 10.0 ** -len(figure.partition(".")[2])
    return any(abs(number - float(figure)) <= half * (1 + 1e-9) for number in numbers)


def figures_without_report(readme: str, reports: dict[str, str]) -> list[Figures]:
    """Rows that no report has whole, with the figures that the best one lacks. reports: their text, by name."""
    sections = [numbers for text in reports.values() for _, numbers in sections_of(text)]
    missing = []
    for figures in figures_of(readme):
        lacking = [tuple(v for v in figures.values if not stands_in(v, numbers)) for numbers in sections]
        least = min(lacking, key=len, default=figures.values)
        if least:
            missing.append(Figures(figures.line, least))
    return missing


def rooms_changed_since(commit: str) -> set[str] | None:
    """Names of ROOMS whose files differ from the commit's; None where it is no ancestor of what is checked out."""
    if _git("merge-base", "--is-ancestor", commit, "HEAD").returncode:
        return None
    changed = _git("diff", "--name-only", commit, "HEAD", "--", *ROOMS.values()).stdout.splitlines()
    return {name for name, folder in ROOMS.items() if any(path.startswith(folder + "/") for path in changed)}


def faults_of_report(name: str, report: str) -> Iterator[str]:
    """What a report leaves out about its making, a line each."""
    commits = set(COMMIT.findall(report))
    if not commits:
        yield f"{name}: names no commit that it was made at"
    if WITH_CHANGES in report:
        yield f"{name}: was made with changes that no commit has"
    said = " ".join(p for p in report.split("\n\n") if p.startswith("Since then"))
    for commit in sorted(commits):
        changed = rooms_changed_since(commit)
        if changed is None:
            yield f"{name}: commit {commit} is no ancestor of this one"
        for room in sorted(room for room in changed or () if not re.search(rf"\b{room}\b", said)):
            yield f'{name}: {room} changed since commit {commit}, and no paragraph "Since then" says what differs'


def read_reports() -> dict[str, str]:
    """The reports of docs/, by their path from the root: what says that a command made it."""
    texts = {str(path.relative_to(ROOT)): path.read_text("utf-8") for path in sorted(ROOT.glob("docs/**/*.md"))}
    return {name: text for name, text in texts.items() if COMMIT.search(text) or "Made by" in text}


def has_history() -> bool:
    """Whether commits can be asked for: not in a folder without git's, or with the newest only."""
    return _git("rev-parse", "--is-shallow-repository").stdout.strip() == "false"


def _git(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)


def main() -> None:
    reports = read_reports()
    readme = (ROOT / "README.md").read_text("utf-8")
    faults = [
        f"README.md: {f.line}\n    no report has {', '.join(f.values)}" for f in figures_without_report(readme, reports)
    ]
    faults += [fault for name, text in reports.items() for fault in faults_of_report(name, text)]
    print("\n".join(faults) or f"{len(list(figures_of(readme)))} rows and paragraphs of the README: all figures found")
    sys.exit(bool(faults))


if __name__ == "__main__":
    main()
