"""`iibr models`, the options about depth, and what commands and worker say about where depth comes from."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from iibr_core.depth.models.known import KNOWN_MODELS
from iibr_core.formats.images.write import write_image
from tests.iibr_core.depth.onnx_graphs import of_channels
from tests.viewer.cli.test_cli import run
from tests.viewer.conftest import write_scene


def run_models(
    home: Path, *words: str, typed: str = "", endpoint: str = "http://127.0.0.1:9"
) -> subprocess.CompletedProcess[str]:
    """`iibr models`, with nobody who listens at the hub's usual address."""
    return run_iibr(home, "models", *words, typed=typed, endpoint=endpoint)


def run_iibr(
    home: Path, *words: object, typed: str = "", endpoint: str = "http://127.0.0.1:9"
) -> subprocess.CompletedProcess[str]:
    """Any command in a process of its own: the hub library reads its address once."""
    folders = dict.fromkeys(("HF_HOME", "XDG_CACHE_HOME", "XDG_DATA_HOME"), str(home))
    environment = {**os.environ, "HF_ENDPOINT": endpoint, **folders}
    return subprocess.run(
        [sys.executable, "-P", "-m", "viewer", *map(str, words)],
        env=environment,
        input=typed,
        capture_output=True,
        text=True,
        check=False,
    )


def test_the_list_names_every_model_with_size_and_licence(tmp_path: Path) -> None:
    done = run_models(tmp_path)
    assert done.returncode == 0
    *lines, getting, using = done.stdout.splitlines()
    for model, line in zip(KNOWN_MODELS, (line for line in lines if not line.startswith(" ")), strict=True):
        assert line.startswith(model.name + " ")
        assert f"{model.megabytes:,} MB" in line
        assert model.licence in line
        assert "not here" in line
        below = lines[lines.index(line) + 1].strip()
        assert below.startswith(f"Good for {model.good_for}.")
        assert ("Recommended." in below) == model.is_recommended
    assert "iibr models get" in getting
    assert "--depth-model NAME" in using


def test_a_file_of_ones_own_is_copied_listed_and_found_by_name(tmp_path: Path) -> None:
    home, photo, out = tmp_path / "home", tmp_path / "photo.png", tmp_path / "map.npy"
    file = of_channels(tmp_path / "metres.onnx", farness=True)
    done = run_models(home, "get", str(file))
    assert (done.returncode, done.stderr) == (0, "")
    assert done.stdout.splitlines()[-1] == "Use it: iibr view PHOTO --depth-model metres"
    file.unlink()
    assert any(line.startswith("metres ") and "your own" in line for line in run_models(home).stdout.splitlines())
    write_image(photo, np.tile(np.linspace(0.2, 0.9, 60, dtype=np.float32)[:, None, None], (1, 80, 3)))
    used = run_iibr(home, "export", photo, "--to", "disparity", "--depth-model", "metres", "--metric", "-o", out)
    assert used.returncode == 0, used.stderr
    disparity = np.load(out)
    assert disparity[-9].mean() > disparity[9].mean(), "300 less red are the metres"


def test_without_a_network_get_is_one_line(tmp_path: Path) -> None:
    done = run_models(tmp_path, "get", "depth-anything-v2-small", "--yes")
    assert done.returncode == 2
    about, error = done.stderr.splitlines()
    assert "99 MB" in about
    assert "Apache-2.0" in about
    assert error.startswith("iibr: onnx-community/depth-anything-v2-small cannot be downloaded")
    assert "network" in error
    assert not list(tmp_path.rglob("*.safetensors"))


def test_nothing_is_fetched_unless_the_user_says_yes(tmp_path: Path) -> None:
    done = run_models(tmp_path, "get", "depth-pro", typed="\n")
    assert done.returncode == 1
    assert "Nothing was downloaded" in done.stderr
    assert "cannot be downloaded" not in done.stderr


def test_an_unknown_model_is_one_line_with_those_known(tmp_path: Path) -> None:
    done = run_models(tmp_path, "get", "depth-nothing")
    assert done.returncode == 2
    (line,) = done.stderr.splitlines()
    assert all(model.name in line for model in KNOWN_MODELS)


def test_generate_says_where_depth_came_from(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    photo = write_scene(tmp_path)
    words = ("generate", photo, "--grid", 1, "--out")
    assert run(monkeypatch, *words, tmp_path / "a") == 0
    assert "note: Depth: scene_disparity.npy." in capsys.readouterr().err
    assert run(monkeypatch, *words, tmp_path / "b", "--depth", "rough", "--refine", "off") == 0
    said = capsys.readouterr().err
    assert said.count("Depth: rough") == 1
    assert "iibr models" in said
    # A bad model that was asked for is an error, and nothing is made.
    (model := tmp_path / "model").mkdir()
    assert run(monkeypatch, *words, tmp_path / "c", "--depth", "model", "--depth-model", model) == 2
    (line,) = filter(None, capsys.readouterr().err.splitlines())
    assert "config.json" in line
    assert not (tmp_path / "c").exists()


def test_a_bad_map_beside_the_photo_is_told_and_done_without(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    photo = write_scene(tmp_path)
    np.save(tmp_path / "scene_disparity.npy", np.full((5, 5), np.nan))
    assert run(monkeypatch, "generate", photo, "--grid", 1, "--out", tmp_path / "a") == 0
    assert "The map beside the photo was not used" in capsys.readouterr().err
