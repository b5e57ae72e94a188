"""Photos of unusual names and kinds on the command line: opened with a note, or refused in one line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.iibr_core.formats.test_hdr import PQ, encoded, write_heic, write_png
from tests.iibr_core.formats.test_side_by_side import LEFT, RIGHT, photo
from tests.viewer.cli.test_cli import run

Monkey = pytest.MonkeyPatch
Capture = pytest.CaptureFixture[str]


@pytest.mark.parametrize("name", ["a.jps", "a.right-left.jpg"])
def test_a_pair_is_matched_and_says_that_it_was_cut(
    monkeypatch: Monkey, capsys: Capture, tmp_path: Path, name: str
) -> None:
    Image.fromarray(np.hstack([RIGHT, LEFT])).save(tmp_path / name, "JPEG", quality=95)
    assert run(monkeypatch, "plan", tmp_path / name) == 0
    out = capsys.readouterr().out
    assert "80x60 px, disparity from the photo's two views (side-by-side stereo)" in out
    assert "- Taken for a stereo pair, side by side, because of its " in out


@pytest.mark.parametrize("name", ["pq.png", "pq.heic"])
def test_an_hdr_photo_is_drawn_as_an_ordinary_one(
    monkeypatch: Monkey, capsys: Capture, tmp_path: Path, name: str
) -> None:
    expected = photo(64, 80) // 2 + 60
    write = write_png if name == "pq.png" else write_heic
    linear = ((expected / 255 + 0.055) / 1.055) ** 2.4
    write(tmp_path / name, encoded(linear, PQ), PQ)
    out = tmp_path / "out.png"
    words = ("screenshot", tmp_path / name, "--depth", "flat", "--view", "0,0", "--size", "80x64", "-o", out)
    assert run(monkeypatch, *words) == 0
    assert "HDR photo (PQ): its highlights are compressed" in capsys.readouterr().err
    found = np.asarray(Image.open(out).convert("RGB")).astype(float)
    assert np.abs(found - expected).mean() < 6
