"""What an estimate costs: a graph that weighs colours stands in for the model."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from benchmarks.estimate import estimate, turns_while_estimating
from iibr_core.depth.models import cache as estimate_cache
from iibr_core.formats.images.write import write_image
from iibr_core.types import InputError
from tests.iibr_core.depth.onnx_graphs import weighing


@pytest.fixture
def photo(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """With a cache of its own: the user's is not read or filled."""
    monkeypatch.setattr(estimate_cache, "cache_folder", lambda: tmp_path / "cache")
    pixels = np.random.default_rng(0).integers(0, 256, (48, 64, 3), np.uint8)
    write_image(tmp_path / "photo.png", pixels)
    return tmp_path / "photo.png"


def test_loading_and_running_are_told_apart(photo: Path) -> None:
    load, run, added = estimate(weighing(photo.with_name("model.onnx"), (1, 0, 0)), photo)
    assert min(load.wall_s, run.wall_s) > 0
    assert min(load.cpu_s, run.cpu_s) >= 0
    assert np.isnan(added) or added >= 0


@pytest.mark.usefixtures("no_egl_context")
def test_turns_are_counted_until_the_depth_is_the_models(photo: Path) -> None:
    turns = turns_while_estimating(photo, weighing(photo.with_name("model.onnx"), (1, 0, 0)))
    assert len(turns) > 2
    assert min(turns) >= 0
    assert list((photo.parent / "cache").glob("*.npz")), "the model was asked"


@pytest.mark.usefixtures("no_egl_context")
def test_a_model_that_fails_ends_it(photo: Path) -> None:
    broken = photo.with_name("broken.onnx")
    broken.write_text("no model")
    with pytest.raises(InputError, match=r"broken\.onnx"):
        turns_while_estimating(photo, broken)
