"""Depth models by name: known ones, folders with several files, and copies of a user's files."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.models.catalog import (
    known_model,
    list_own_models,
    model_here,
    model_to_use,
    own_models_folder,
    register,
)
from iibr_core.depth.models.known import USUAL_MODEL
from iibr_core.types import InputError
from tests.iibr_core.depth.onnx_graphs import weighing
from tests.iibr_core.depth.test_onnx import with_external_weights


@pytest.fixture(autouse=True)
def folders_here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path / "hub"))


def files_below(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("name", [USUAL_MODEL, "depth-pro"])
def test_a_known_model_is_here_once_all_of_its_files_are(tmp_path: Path, name: str) -> None:
    """As this program downloaded them before, and as others do, which use links."""
    model = known_model(name)
    with pytest.raises(InputError, match=f"{name} is not on this machine"):
        model_to_use(DepthChoice("model", model=None if name == USUAL_MODEL else name))
    folder = tmp_path / "hub" / f"models--{model.repository.replace('/', '--')}" / "snapshots" / model.commit
    for file in model.files:
        assert model_here(model) is None
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / Path(file).name).write_text("{}")
        (folder / file).symlink_to(tmp_path / Path(file).name)
    found = model_to_use(DepthChoice("model", model=name))
    assert found is not None
    assert (found.title, found.folder, found.weights) == (model.title, folder, (folder / model.files[-1],))
    assert found.is_meaning_known


def test_a_folder_with_several_files_asks_which(tmp_path: Path) -> None:
    for name in ("a.onnx", "b.onnx"):
        weighing(tmp_path / name, (1, 0, 0))
    with pytest.raises(InputError, match="several ONNX files"):
        model_to_use(DepthChoice(model=str(tmp_path)))
    file = weighing(tmp_path / "model.onnx", (1, 0, 0))
    (tmp_path / "model.safetensors").touch()
    for kind, runner, weights in (
        ("depth_anything", "onnx", file),
        ("zoedepth", "transformers", tmp_path / "model.safetensors"),
    ):
        (tmp_path / "config.json").write_text(json.dumps({"model_type": kind}))
        found = model_to_use(DepthChoice(model=str(tmp_path)))
        assert found is not None
        assert (found.runner, found.weights) == (runner, (weights,)), "only ZoeDepth's weights say that it gives metres"


def test_a_copied_model_brings_its_numbers_and_settings_along(tmp_path: Path) -> None:
    file = with_external_weights(tmp_path / "rooms.onnx")
    (tmp_path / "config.json").write_text('{"depth_estimation_type": "metric"}')
    assert register(file).title == "the model rooms"
    file.unlink()
    assert list(list_own_models()) == ["rooms"]
    assert files_below(own_models_folder()) == {"rooms/rooms.onnx", "rooms/rooms.onnx_data", "rooms/config.json"}
    assert model_to_use(DepthChoice(model="rooms")) is not None


def test_a_name_that_is_taken_stays_with_its_model(tmp_path: Path) -> None:
    first, other = weighing(tmp_path / "a.onnx", (1, 0, 0)), tmp_path / "other"
    other.mkdir()
    before = register(first)
    assert register(first) == before
    with pytest.raises(InputError, match=r"another model has this name; rename .*a\.onnx"):
        register(weighing(other / "a.onnx", (0, 1, 0)))
    with pytest.raises(InputError, match="zoedepth is the name of a published model; rename the file"):
        register(weighing(other / "zoedepth.onnx", (0, 1, 0)))
