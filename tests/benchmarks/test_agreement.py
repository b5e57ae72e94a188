"""Agreement of views and refocus, as the program prints them."""

from __future__ import annotations

import re
import sys
from pathlib import Path

import pytest

from benchmarks.agreement import main
from tests.iibr_core.known_scenes import write_grid


def test_a_scene_is_a_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    write_grid(tmp_path / "square", 5)
    monkeypatch.setattr(sys, "argv", ["agreement", str(tmp_path), "--views", "12"])
    main()
    line = capsys.readouterr().out
    found = re.fullmatch(r"square +holes \S+ \(\d+ px\), surfaces (.+) \| refocus near (.+), middle .+, far .+\n", line)
    assert found, line
    surfaces, near = map(float, found.groups())
    assert surfaces < 1
    assert near > 45
