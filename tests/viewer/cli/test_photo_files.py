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


@pytest.mark.parametrize("name", ["Corfou_ou", "portrait_tb", "collage_2x1", "IMG_0001_TB"])
def test_a_photo_is_not_cut_for_its_name(monkeypatch: Monkey, capsys: Capture, tmp_path: Path, name: str) -> None:
    Image.fromarray(photo()).save(tmp_path / f"{name}.jpg", quality=95)
    assert run(monkeypatch, "plan", tmp_path / f"{name}.jpg") == 0
    out = capsys.readouterr().out
    assert f"{name}: 128x96 px, disparity from rough" in out
    assert "- Shown whole: its name ('_" in out


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


@pytest.mark.parametrize(
    ("name", "content", "line"),
    [
        ("a.svg", b"<svg xmlns='x'/>", "is a drawing (SVG); save it as PNG"),
        ("page.jpg", b"<!DOCTYPE html><html>404</html>", "is a web page, not a picture; download the picture itself"),
        ("a.dng", b"II*\0\x08\0\0\0" + bytes(60), "is a camera's RAW file; develop it and save it as TIFF or JPEG"),
        ("a.mp4", b"\0\0\0\x20ftypisom" + bytes(60), "is a video; save one of its frames as PNG or JPEG"),
        ("empty.jpg", b"", "the file is empty (0 bytes)"),
    ],
)
def test_other_files_are_refused_in_a_line_that_says_what_to_do(
    monkeypatch: Monkey, capsys: Capture, tmp_path: Path, name: str, content: bytes, line: str
) -> None:
    (tmp_path / name).write_bytes(content)
    assert run(monkeypatch, "plan", tmp_path / name) == 2
    assert capsys.readouterr().err == f"iibr: {tmp_path / name}: {line}\n"
