"""ONNX files of one's own that are copied, and found by name."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimators.catalog import model_to_use, register
from iibr_core.depth.estimators.estimate_depth import estimate_with
from iibr_core.depth.estimators.own_models import list_own_models, own_models_folder
from iibr_core.types import InputError, Photo
from tests.iibr_core.depth.onnx_graphs import of_channels, published, weighing
from tests.iibr_core.depth.test_onnx_file import with_external_weights


@pytest.fixture(autouse=True)
def folders_here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))


def files_below(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_a_copied_model_is_found_by_name_when_the_file_has_gone(tmp_path: Path) -> None:
    """With its settings, metres in this case."""
    file = of_channels(tmp_path / "rooms.onnx", farness=True)
    (tmp_path / "config.json").write_text('{"depth_estimation_type": "metric"}')
    assert list_own_models() == {}
    assert register(file).title == "the model rooms"
    file.unlink()
    assert list(list_own_models()) == ["rooms"]
    model = model_to_use(DepthChoice(model="rooms"))
    assert model is not None
    pixels = np.random.default_rng(0).random((40, 50, 3)).astype(np.float32)
    assert estimate_with(model, Photo(pixels, 50.0, "photo")).meaning == "metres"


def test_files_of_weights_come_along(tmp_path: Path) -> None:
    register(with_external_weights(tmp_path / "large.onnx"))
    assert files_below(own_models_folder()) == {"large/large.onnx", "large/large.onnx.data"}


@pytest.mark.parametrize("given", ["", "onnx/model.onnx"])
def test_a_file_called_model_is_named_after_its_folder(tmp_path: Path, given: str) -> None:
    """Also where it lies in a folder `onnx` below, as the hub lays files out."""
    for name, content in published(tmp_path / "depth-thing").items():
        (tmp_path / "depth-thing" / name).write_bytes(content)
    register(tmp_path / "depth-thing" / given)
    assert files_below(own_models_folder()) == {
        f"depth-thing/{name}" for name in ("depth-thing.onnx", "config.json", "preprocessor_config.json")
    }


def test_a_name_that_is_taken_stays_with_its_model(tmp_path: Path) -> None:
    first, other = weighing(tmp_path / "a.onnx", (1, 0, 0)), tmp_path / "other"
    other.mkdir()
    before = register(first)
    assert register(first) == before
    with pytest.raises(InputError, match=r"another model has this name; rename .*a\.onnx"):
        register(weighing(other / "a.onnx", (0, 1, 0)))
    with pytest.raises(InputError, match="zoedepth is the name of a published model; rename the file"):
        register(weighing(other / "zoedepth.onnx", (0, 1, 0)))
    assert list(list_own_models()) == ["a"]


def test_unknown_names_are_answered_with_those_that_there_are(tmp_path: Path) -> None:
    register(weighing(tmp_path / "mine.onnx", (1, 0, 0)))
    with pytest.raises(InputError, match=r"min: no depth model of this name is known; there are .*zoedepth.*mine"):
        model_to_use(DepthChoice(model="min"))
