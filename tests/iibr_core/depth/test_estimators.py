"""The families of depth estimators: their models, what is said of them, and how one is added."""

from __future__ import annotations

import dataclasses
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimators import estimate_cache
from iibr_core.depth.estimators.catalog import KNOWN_MODELS, USUAL_MODEL, known_model, model_to_use, state_of
from iibr_core.depth.estimators.estimate_depth import estimate_with
from iibr_core.depth.estimators.words import ModelState, words_about
from iibr_core.types import Photo
from tests.iibr_core.depth.onnx_graphs import weighing


def test_one_model_is_recommended_and_each_is_good_for_something() -> None:
    assert [model.name for model in KNOWN_MODELS if model.is_recommended] == [USUAL_MODEL]
    assert len({model.name for model in KNOWN_MODELS}) == len(KNOWN_MODELS)
    assert all(model.good_for and not model.good_for.endswith(".") for model in KNOWN_MODELS)


def test_the_catalogue_loads_nothing_that_runs_models() -> None:
    code = (
        "import sys, iibr_core.depth.estimators.catalog; "
        "print(sorted({'torch', 'transformers', 'onnxruntime', 'safetensors', 'numba', 'huggingface_hub'}"
        " & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.stdout.strip(), done.stderr) == ("[]", "")


def test_words_about_a_model() -> None:
    model = known_model(USUAL_MODEL)
    words = words_about(model, ModelState(is_here=False, needs="", seconds=None))
    assert words.good_for == "Good for any photo; the fastest. Recommended."
    assert (words.figures, words.place) == ("99 MB, Apache-2.0", "not here")
    assert words.needs == ""
    words = words_about(known_model("depth-pro"), ModelState(True, "the package torch first: pip install", 12.345))
    assert words.figures.endswith("(for research), 12.3 s a photo on this machine")
    assert words.place == "here"
    assert words.needs == "Needs the package torch first: pip install."
    assert "Recommended" not in words.good_for


def test_the_time_of_the_last_estimate_is_kept(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(estimate_cache, "cache_folder", lambda: tmp_path / "cache")
    usual = known_model(USUAL_MODEL)
    assert state_of(usual).seconds is None
    model = model_to_use(DepthChoice(model=str(weighing(tmp_path / "model.onnx", (1, 0, 0)))))
    assert model is not None
    photo = Photo(np.random.default_rng(0).random((40, 50, 3)).astype(np.float32), 50.0, "photo")
    estimate_with(dataclasses.replace(model, title=usual.title), photo)
    seconds = state_of(usual).seconds
    assert seconds is not None
    assert seconds >= 0
    estimate_cache.store_seconds("another", 3)
    estimate_with(dataclasses.replace(model, title=usual.title), photo)  # from the cache: no time is taken
    assert (state_of(usual).seconds, estimate_cache.seconds_of("another")) == (seconds, 3)


@pytest.mark.parametrize("text", ["", "[", "[1]", '{"a": "x"}', '{"a": -1}', '{"a": NaN}', "[" * 100_000])
def test_damaged_times_count_as_none(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, text: str) -> None:
    monkeypatch.setattr(estimate_cache, "cache_folder", lambda: tmp_path)
    (tmp_path / estimate_cache.TIMES).write_text(text)
    assert estimate_cache.seconds_of("a") is None
    estimate_cache.store_seconds("a", 2)
    assert estimate_cache.seconds_of("a") == 2
