"""`--gloss`, as a user gives it: what is written with it, and that it costs nothing without."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.viewer.cli.test_cli import run

GLOSS = """
roughness = 0.5
reflectance = 0.5
[light]
direction = [0, 0, -1]
"""


@pytest.fixture
def gloss_path(tmp_path: Path) -> Path:
    path = tmp_path / "gloss.toml"
    path.write_text(GLOSS)
    return path


def views_of(folder: Path) -> np.ndarray:
    return np.stack([np.asarray(Image.open(path)) for path in sorted(folder.glob("input_Cam*.png"))]).astype(int)


def test_a_light_field_is_written_with_its_gloss(
    monkeypatch: pytest.MonkeyPatch, photo_path: Path, gloss_path: Path, tmp_path: Path
) -> None:
    plain, generated, exported = (tmp_path / name for name in ("plain", "generated", "exported"))
    assert run(monkeypatch, "generate", photo_path, "--grid", 3, "--out", plain) == 0
    assert run(monkeypatch, "generate", photo_path, "--grid", 3, "--out", generated, "--gloss", gloss_path) == 0
    words = ("export", photo_path, "--to", "hci", "--grid", 3, "-o", exported, "--gloss", gloss_path)
    assert run(monkeypatch, *words) == 0
    gained = views_of(generated) - views_of(plain)
    assert gained.min() >= 0
    assert (gained.mean(axis=(1, 2, 3)) > 5).all()
    assert np.array_equal(views_of(generated), views_of(exported))


def test_a_screenshot_shows_the_views_that_are_written(
    monkeypatch: pytest.MonkeyPatch, photo_path: Path, gloss_path: Path, tmp_path: Path
) -> None:
    generated, shot = tmp_path / "generated", tmp_path / "shot.png"
    assert run(monkeypatch, "generate", photo_path, "--grid", 3, "--out", generated, "--gloss", gloss_path) == 0
    words = ("--grid", 3, "--view", "1,0", "--gloss", gloss_path, "-o", shot)
    assert run(monkeypatch, "screenshot", photo_path, *words) == 0
    drawn = np.asarray(Image.open(shot)).astype(int)
    assert np.abs(drawn - views_of(generated)[5]).mean() < 2
    again = tmp_path / "again.png"
    assert run(monkeypatch, "screenshot", photo_path, "--grid", 3, "--like", shot, "-o", again) == 0
    assert np.array_equal(np.asarray(Image.open(again)), drawn)


def test_a_gloss_with_a_setting_of_earlier_programs_is_refused_in_one_line(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path, gloss_path: Path
) -> None:
    gloss_path.write_text('environment = "room.exr"')
    words = ("generate", photo_path, "--grid", 3, "--out", photo_path.parent / "new", "--gloss", gloss_path)
    assert run(monkeypatch, *words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "environment" in line
    assert not (photo_path.parent / "new").exists()


def test_views_from_disk_take_gloss_where_their_disparity_goes_below_zero(
    monkeypatch: pytest.MonkeyPatch, photo_path: Path, gloss_path: Path, tmp_path: Path
) -> None:
    field, plain, shiny = tmp_path / "field", tmp_path / "plain.png", tmp_path / "shiny.png"
    words = ("generate", photo_path, "--grid", 3, "--out", field, "--with-disparity")
    assert run(monkeypatch, *words) == 0
    assert run(monkeypatch, "screenshot", field, "-o", plain) == 0
    assert run(monkeypatch, "screenshot", field, "--gloss", gloss_path, "-o", shiny) == 0
    gained = np.asarray(Image.open(shiny)).astype(int) - np.asarray(Image.open(plain))
    assert gained.min() >= -2
    assert gained.mean() > 5
