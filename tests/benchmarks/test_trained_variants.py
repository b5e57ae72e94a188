"""Training variants of the ray transformer: training, the features of each, and views made with them."""

from __future__ import annotations

import pickle
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from benchmarks.harness.bench_scenes import BenchScene
from benchmarks.stages import make_views
from benchmarks.trained_variants import COORDINATES_ONLY, TRAINED_VARIANTS, train_missing, without_disparity
from iibr_core.rendering.hypotheses import FEATURES
from iibr_core.training.degradation import blur
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import ImageSize, ViewOffset

STEPS = 3
SIZE = ImageSize(72, 96)


@pytest.fixture(scope="module")
def weights(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("weights")
    train_missing(folder, STEPS)
    return folder


@pytest.fixture(scope="module")
def scene() -> BenchScene:
    drawn = random_scene(np.random.default_rng(3), SIZE, 4.0)
    photo, disparity = render(drawn, SIZE, ViewOffset(0.0, 0.0))
    corners = tuple(ViewOffset(t, s) for t in (-2.0, 2.0) for s in (-2.0, 2.0))
    return BenchScene("small", photo, blur(disparity, 1.0), dict.fromkeys(corners[:1], photo), corners)


def test_views_are_made_with_each_variant(weights: Path, scene: BenchScene) -> None:
    judged: tuple[Any, ...] = scene.photo, scene.disparity, None, scene.truth, scene.field
    (default,) = make_views(*judged).values()
    for variant in TRAINED_VARIANTS:
        make = pickle.loads(pickle.dumps(partial(variant.make, weights)))
        (view,) = make(*judged).values()
        assert np.isfinite(view).all()
        assert not np.array_equal(view, default), variant.name
    np.testing.assert_array_equal(next(iter(make_views(*judged).values())), default)


def test_existing_weights_are_not_trained_again(weights: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in weights.iterdir()}
    train_missing(weights, STEPS + 1)
    assert {path: path.stat().st_mtime_ns for path in weights.iterdir()} == before


def test_a_variant_without_disparity_sees_coordinates_only() -> None:
    features = torch.arange(1.0, FEATURES + 1).expand(2, 3, -1)
    selected = without_disparity(features)[0, 0]
    assert [int(i) for i in selected.nonzero()] == sorted(COORDINATES_ONLY)
    assert features[0, 0].count_nonzero() == FEATURES
