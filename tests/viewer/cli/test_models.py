"""`iibr models`, the options about depth, and what commands and worker say about where depth comes from."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from iibr_core.depth.estimators.catalog import KNOWN_MODELS, known_model
from iibr_core.depth.estimators.download import VERIFIED, require_unchanged
from iibr_core.formats.images.write import write_image
from iibr_core.types import InputError
from tests.iibr_core.depth.onnx_graphs import of_channels
from tests.local_hub import Hub, local_hub
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
        assert "s a photo" not in line
        below = lines[lines.index(line) + 1].strip()
        assert below.startswith(f"Good for {model.good_for}.")
        assert ("Recommended." in below) == model.is_recommended
    assert "Needs the package depth_anything_3 first: pip install depth-anything-3." in done.stdout
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


MODEL = known_model("depth-pro")
PUBLISHED = {
    "config.json": b'{"model_type": "dpt"}',
    "model.safetensors": bytes(100),
    "pytorch_model.bin": b"runs code",
}


@pytest.fixture
def hub() -> Iterator[Hub]:
    with local_hub(MODEL.commit, PUBLISHED) as hub:
        yield hub


def test_a_download_is_one_commit_without_pickles_and_is_known_again(tmp_path: Path, hub: Hub) -> None:
    done = run_models(tmp_path, "get", MODEL.name, "--yes", endpoint=hub.address)
    assert done.returncode == 0, done.stderr
    assert MODEL.commit in done.stdout
    folder = next(path for path in tmp_path.rglob(MODEL.commit) if path.parent.name == "snapshots")
    assert {path.name for path in folder.iterdir()} == {"config.json", "model.safetensors", VERIFIED}
    require_unchanged(folder)
    (known,) = (line for line in run_models(tmp_path).stdout.splitlines() if line.startswith(MODEL.name))
    assert "not here" not in known
    (folder / "model.safetensors").resolve().write_bytes(bytes(99) + b"x")
    with pytest.raises(InputError, match=r"model\.safetensors changed since it was downloaded"):
        require_unchanged(folder)


def test_what_another_program_downloaded_is_verified_before_it_is_used(tmp_path: Path, hub: Hub) -> None:
    assert run_models(tmp_path, "get", MODEL.name, "--yes", endpoint=hub.address).returncode == 0
    (folder,) = (path for path in tmp_path.rglob(MODEL.commit) if path.parent.name == "snapshots")
    (folder / VERIFIED).unlink()
    (folder / "model.safetensors").resolve().write_bytes(bytes(99) + b"x")
    assert run_models(tmp_path, "get", MODEL.name, "--yes", endpoint=hub.address).returncode == 2
    assert not (folder / "model.safetensors").exists()


@pytest.mark.parametrize(
    ("commit", "stated", "says"),
    [
        ("f" * 40, PUBLISHED, "answers with commit f"),
        (MODEL.commit, {"../../../mine.json": b"{}"}, "no hash of ../../../mine.json"),
    ],
)
def test_a_hub_that_lies_gets_nothing_done(
    tmp_path: Path, hub: Hub, commit: str, stated: dict[str, bytes], says: str
) -> None:
    (tmp_path / "mine.json").write_text("mine")
    hub.commit, hub.stated = commit, stated
    done = run_models(tmp_path, "get", MODEL.name, "--yes", endpoint=hub.address)
    assert done.returncode == 2
    assert says in done.stderr.splitlines()[-1]
    assert not list(tmp_path.rglob("*.safetensors"))
    assert (tmp_path / "mine.json").read_text() == "mine"


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
