"""`iibr depth` of photos: sources of the map."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.images.write import write_image
from tests.iibr_core.depth.onnx_graphs import of_channels
from tests.iibr_core.known_scenes import WALL
from tests.viewer.cli.test_cli import run
from tests.viewer.cli.test_view_files import write_pair

Monkey = pytest.MonkeyPatch
Capture = pytest.CaptureFixture[str]


@pytest.fixture
def red_below(tmp_path: Path, monkeypatch: Monkey) -> Path:
    """A photo that is redder further down; nothing on this machine is known of it."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    path = tmp_path / "photo.png"
    write_image(path, np.tile(np.linspace(0.2, 0.9, 60, dtype=np.float32)[:, None, None], (1, 80, 3)))
    return path


@pytest.mark.parametrize(
    ("options", "is_nearer_below"),
    [
        ([], True),
        (["--depth", "rough", "--invert-depth"], False),
        (["--depth-model", "red.onnx"], True),
        (["--depth-model", "red.onnx", "--metric"], False),
    ],
)
def test_a_photo_without_depth_gets_a_guess_or_a_models(
    monkeypatch: Monkey, red_below: Path, options: list[str], is_nearer_below: bool
) -> None:
    of_channels(red_below.parent / "red.onnx")
    monkeypatch.chdir(red_below.parent)
    assert run(monkeypatch, "depth", red_below, *options, "-o", "map.npy") == 0
    disparity = np.load("map.npy")
    assert disparity.shape == (60, 80)
    assert (np.median(disparity[-12:]) > np.median(disparity[:12])) == is_nearer_below


def test_a_pair_is_estimated_by_the_model_that_is_named(monkeypatch: Monkey, red_below: Path, capsys: Capture) -> None:
    pair, out = write_pair(red_below.parent / "a_2x1.png"), red_below.parent / "map.npy"
    assert run(monkeypatch, "depth", pair, "-o", out) == 0
    assert np.median(np.load(out)) == pytest.approx(3 * WALL, abs=0.5)
    file = of_channels(red_below.parent / "red.onnx")
    assert run(monkeypatch, "depth", pair, "--depth-model", file, "--force", "-o", out) == 0
    assert "estimated by the model red.onnx" in capsys.readouterr().err
