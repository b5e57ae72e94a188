"""Files that hold several views, opened by every command that takes a scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.scenes import light_fields
from iibr_core.types import GridShape, ViewOffset
from tests.iibr_core.known_scenes import FOREGROUND, WALL, disparity_of_square, view_of_square, view_of_wall, write_grid
from tests.viewer.cli.test_cli import run

Monkey = pytest.MonkeyPatch
Capture = pytest.CaptureFixture[str]


def write_pair(path: Path, apart: float = 3.0) -> Path:
    """A wall for two eyes side by side, at WALL px for each of `apart` steps between them."""
    eyes = [view_of_wall(ViewOffset(0, s), size=(64, 80)) for s in (0.0, apart)]
    Image.fromarray(np.rint(np.hstack(eyes) * 255).astype(np.uint8)).save(path)
    return path


def test_a_quilt_of_ours_is_a_light_field_again(
    monkeypatch: Monkey, capsys: Capture, photo_path: Path, tmp_path: Path
) -> None:
    assert run(monkeypatch, "export", photo_path, "--to", "quilt", "-o", tmp_path / "a.png", "--grid", 3) == 0
    quilt = Path(capsys.readouterr().out.strip())
    assert open_light_field(quilt).grid == GridShape(1, 48)
    out = tmp_path / "views"
    assert run(monkeypatch, "export", quilt, "--to", "hci", "-o", out) == 0
    assert len(list(out.glob("input_Cam*.png"))) == 48
    whole, first = np.asarray(Image.open(quilt).convert("RGB")), np.asarray(Image.open(out / "input_Cam000.png"))
    height, width = first.shape[:2]
    assert np.array_equal(whole[-height:, :width], first)


def test_options_about_photos_are_refused_for_a_quilt(
    monkeypatch: Monkey, capsys: Capture, photo_path: Path, tmp_path: Path
) -> None:
    quilt = tmp_path / "a_qs2x2a1.png"
    quilt.write_bytes(photo_path.read_bytes())
    words = ("export", quilt, "--to", "hci", "-o", tmp_path / "new", "--grid", 3)
    assert run(monkeypatch, *words) == 2
    assert "--grid: " in capsys.readouterr().err


def test_a_stereo_photo_has_the_depth_of_its_two_views(monkeypatch: Monkey, capsys: Capture, tmp_path: Path) -> None:
    pair = write_pair(tmp_path / "wall_SBS.png")
    out = tmp_path / "field"
    assert run(monkeypatch, "generate", pair, "--grid", 3, "--out", out, "--literal", "--with-disparity") == 0
    assert "two views (side-by-side stereo)" in capsys.readouterr().err
    values = read_pfm(out / "disp_Cam004.pfm")
    assert values.shape == (64, 80)
    assert np.median(values) == pytest.approx(3 * WALL, abs=0.1)


def test_depth_of_a_pair_is_the_left_views(monkeypatch: Monkey, capsys: Capture, tmp_path: Path) -> None:
    out = tmp_path / "a.pfm"
    eyes = [np.rint(view_of_square(ViewOffset(0, s)) * 255).astype(np.uint8) for s in (0.0, 2.0)]
    Image.fromarray(np.hstack(eyes)).save(tmp_path / "square_SBS.png")
    assert run(monkeypatch, "depth", tmp_path / "square_SBS.png", "-o", out) == 0
    error = np.abs(read_pfm(out) / 2 - disparity_of_square())[4:-4, 4:-4]
    assert np.mean(error < 0.2 * (FOREGROUND - WALL)) > 0.7


def test_metres_reach_exports(monkeypatch: Monkey, tmp_path: Path) -> None:
    pixels = np.rint(view_of_square(ViewOffset(0, 0)) * 255).astype(np.uint8)
    Image.fromarray(pixels).save(tmp_path / "square.png")
    metres = np.where(disparity_of_square() > WALL, 1.5, 6.0).astype(np.float32)
    np.save(tmp_path / "square_depth.npy", metres)
    out = tmp_path / "out_depth.npy"
    assert run(monkeypatch, "export", tmp_path / "square.png", "--metric", "--to", "depth", "-o", out) == 0
    found = np.load(out)
    assert np.mean(np.abs(found - metres) < 0.1) > 0.9


def test_depth_asks_for_memory_before_it_takes_it(monkeypatch: Monkey, capsys: Capture, tmp_path: Path) -> None:
    field = write_grid(tmp_path / "field")
    monkeypatch.setattr(light_fields, "sweep_bytes", lambda *_: 2**40)
    assert run(monkeypatch, "depth", field, "-o", tmp_path / "a.pfm") == 2
    assert "finding its disparity takes" in capsys.readouterr().err
    assert not (tmp_path / "a.pfm").exists()
