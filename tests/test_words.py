"""Words that only this program used for what the field has names for: none comes back."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROOMS = "iibr_core", "viewer", "benchmarks", "docs", "shaders", "web", "tests"
KINDS = {".py", ".md", ".glsl", ".frag", ".js"}
OWN_WORDS = re.compile(
    r"\b(crumbs?|specks?|rims?|rim_\w+|exemplars?|fellows?|beyond_frame|joined_\w+|settled_\w+|stand_in|free_?look|heeds"
    r"|made up|told apart|struck off|widen_fronts|soft_outlines|leaving_surfaces"
    r"|WITNESS\w*|SAY|STIRRED_PX|DOUBTED_PX|RELUCTANCE|class Relief)\b"
)


def test_the_fields_words_are_used() -> None:
    files = [path for room in ROOMS for path in (ROOT / room).rglob("*") if path.suffix in KINDS]
    names = sorted(path.relative_to(ROOT).as_posix() for path in files)
    assert len(names) > 500
    found = [
        f"{name}:{number}: {line.strip()}"
        for name in names
        if name not in ("tests/test_words.py", "tests/viewer/test_texts.py")
        for number, line in enumerate((ROOT / name).read_text("utf-8").splitlines(), 1)
        if OWN_WORDS.search(line)
    ]
    assert found == []
