"""Writes the report of `iibr evaluate` with a page for each scene, as docs/evaluation has it.

    python -m benchmarks.scene_pages --data DATA --out OUT

Judges 24 views of each scene of DATA and of tests/data/thin_lens. Writes OUT/report.md (the summary) and OUT/SCENE.md.
"""

from __future__ import annotations

import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from pathlib import Path

from benchmarks.harness.reports import DOCS, made_by, parser_of, start
from iibr_core.formats.outputs import write_file
from iibr_core.types import InputError

THIN_LENS = DOCS.parent / "tests" / "data" / "thin_lens"
VIEWS = 24


def main() -> None:
    options = parser_of(__doc__, "data", "out").parse_args()
    if options.data is None or options.out is None:
        raise InputError("give --data and --out")
    with tempfile.TemporaryDirectory() as folder:
        words = ["evaluate", options.data, THIN_LENS, "--views", VIEWS, "--out", folder, "--force"]
        run = subprocess.run([sys.executable, "-P", "-m", "viewer", *map(str, words)], check=False)
        if run.returncode:
            raise InputError(f"iibr evaluate ended with {run.returncode}")
        report = Path(folder, "report.md").read_text("utf-8")
    options.out.mkdir(parents=True, exist_ok=True)
    said = made_by(["python", "-m", "benchmarks.scene_pages", *sys.argv[1:]])
    for name, text in pages_of(report, said):
        with write_file(options.out / name) as unfinished:
            unfinished.write_text(text, "utf-8")
        print(f"{name}: {text.count(chr(10))} lines")


def pages_of(report: str, made: str) -> Iterator[tuple[str, str]]:
    """File name and text of each page. A section belongs to the scene that its heading names before the colon.

    made: a sentence that names the command, without its full stop.
    """
    summary, *sections = re.split(r"^(?=## )", report, flags=re.MULTILINE)
    scenes: dict[str, list[str]] = {}
    for section in sections:
        name = section.removeprefix("## ").split(":")[0]
        scenes.setdefault(name, []).append(section.strip())
    links = "\n".join(f"* [{name}]({name}.md)" for name in scenes)
    yield "report.md", f"{summary.strip()}\n\n## Scenes\n\n{links}\n"
    for name, parts in scenes.items():
        head = f"# {name}\n\n{made}. [The summary](report.md) explains the tables."
        yield f"{name}.md", "\n\n".join((head, *parts)) + "\n"


if __name__ == "__main__":
    start("benchmarks.scene_pages", main)
