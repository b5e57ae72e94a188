"""Training variants of the ray transformer: what each sees, that it is asked so, and that stopping changes nothing."""

from __future__ import annotations

import pickle
from functools import partial
from pathlib import Path

import numpy as np
import pytest
import torch

from benchmarks import plucker, trained_variants
from benchmarks.harness.bench_scenes import BenchScene
from benchmarks.stages import make_views
from benchmarks.trained_variants import (
    COORDINATES_ONLY,
    TRAINED_VARIANTS,
    all_features,
    raw_coordinates,
    train_missing,
    with_raw_coordinates,
    without_disparity,
)
from iibr_core.formats.weights import read_weights
from iibr_core.method.ambiguous_rays import FEATURES, PLAIN_SOURCE, SHARE
from iibr_core.method.rays import rays_of_photo
from iibr_core.training.batches import ambiguous_rays_of_view, training_batch
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


def test_every_variant_is_trained_and_asked_in_its_own_way(weights: Path, scene: BenchScene) -> None:
    judged = scene.photo, scene.disparity, None, scene.truth, scene.field
    default, seen = make_views(*judged), []
    for variant in TRAINED_VARIANTS:
        make = pickle.loads(pickle.dumps(partial(variant.make, weights)))
        seen += make(*judged).values()
    after = make_views(*judged)
    assert all(np.isfinite(view).all() for view in seen)
    assert all(not np.array_equal(one, next(iter(default.values()))) for one in seen)
    np.testing.assert_array_equal(next(iter(after.values())), next(iter(default.values())))


def test_training_goes_on_as_if_it_had_not_been_stopped(
    weights: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def stopped(step: int, *rest: object) -> object:
        if step == STEPS:
            raise KeyboardInterrupt
        return training_batch(step, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(trained_variants, "CHECKPOINT_EVERY", 1)
    monkeypatch.setattr(trained_variants, "TRAINED_VARIANTS", TRAINED_VARIANTS[:2])
    with monkeypatch.context() as patch:
        patch.setattr(trained_variants, "training_batch", stopped)
        with pytest.raises(KeyboardInterrupt):
            train_missing(tmp_path, STEPS)
    assert not list(tmp_path.glob("t-trained-again.safetensors"))
    train_missing(tmp_path, STEPS)
    for variant in TRAINED_VARIANTS[:2]:
        one, other = (read_weights(variant.weights_in(folder))[0] for folder in (weights, tmp_path))
        assert one.keys() == other.keys()
        assert all(np.array_equal(one[name], other[name]) for name in one)


def test_what_is_there_is_left_alone(weights: Path) -> None:
    before = {path: path.stat().st_mtime_ns for path in weights.iterdir()}
    train_missing(weights, STEPS + 1)
    assert {path: path.stat().st_mtime_ns for path in weights.iterdir()} == before


def test_raw_coordinates_are_lines_of_target_and_source(scene: BenchScene) -> None:
    rays, offset = rays_of_photo(scene.photo, scene.disparity, 2.0, 1), ViewOffset(-2.0, 2.0)
    ambiguous = ambiguous_rays_of_view(rays, offset, (0, SIZE.height), False)
    described = with_raw_coordinates(rays, ambiguous)
    raw = described.features[..., FEATURES:]
    y, x = ambiguous.pixel[0] - np.array(SIZE) / 2
    d = ambiguous.disparity[0, 0]
    scale = np.r_[1, 1, 1, np.full(3, 1 / SIZE.width)]
    assert ambiguous.source[0, 0] % PLAIN_SOURCE < 2  # the photo's own ray: its camera stands in the origin
    there = np.array([x + d * offset.s, y + d * offset.t, 1.0])
    np.testing.assert_allclose(raw[0, 0, :6], plucker.line_of_pixel(x, y, offset) * scale, atol=1e-4)
    np.testing.assert_allclose(raw[0, 0, 6:12], plucker.line_of(np.zeros(3), there) * scale, atol=1e-4)
    np.testing.assert_allclose(raw[..., 12], np.where(ambiguous.mask, ambiguous.disparity, 0), atol=1e-6)


def test_each_sees_its_own_share_of_what_is_described() -> None:
    described = torch.arange(1.0, FEATURES + 14).expand(2, 3, -1)
    np.testing.assert_array_equal(all_features(described), described[..., :FEATURES])
    blind = without_disparity(described)[0, 0]
    assert [int(i) for i in blind.nonzero()] == sorted(COORDINATES_ONLY)
    raw = raw_coordinates(described)[0, 0]
    np.testing.assert_array_equal(raw[SHARE + 1 : SHARE + 14], described[0, 0, FEATURES:])
    assert raw.count_nonzero() == 13
    assert described[0, 0, 0] == 1, "what others see is left alone"
