import numpy as np
import pytest
import torch

from iibr_core.formats.weights import save_weights
from iibr_core.method.ambiguous_rays import (
    FEATURES,
    HYPOTHESES,
    SHARE,
    AmbiguousRays,
)
from iibr_core.method.ray_transformer import MIN_PRIOR, TrainedWeights
from iibr_core.training.model import RayTransformer
from iibr_core.types import InputError, ViewOffset

OFFSETS = [ViewOffset(0.0, 4.0), ViewOffset(-3.0, -2.0)]


def random_ambiguous(rays=200, seed=0):
    """Return ambiguous rays of which the transformer asks features and number alone."""
    random = np.random.default_rng(seed)
    number = random.integers(1, HYPOTHESES + 1, rays).astype(np.uint8)
    features = random.uniform(-3, 3, (rays, HYPOTHESES, FEATURES)).astype(np.float32)
    pixel, nothing = np.zeros((rays, 2), np.int64), np.zeros((rays, HYPOTHESES), np.float32)
    return AmbiguousRays(OFFSETS[0], pixel, number, nothing, nothing.astype(np.uint8), features)


@pytest.fixture
def model():
    torch.manual_seed(0)
    model = RayTransformer().eval()
    for parameter in model.parameters():
        torch.nn.init.normal_(parameter, std=0.3)
    return model


@pytest.fixture
def compiled(model, tmp_path):
    save_weights(model, tmp_path / "weights.safetensors")
    return TrainedWeights(tmp_path / "weights.safetensors")


def weights_of(model, ambiguous, order=slice(None)):
    with torch.no_grad():
        return model(torch.from_numpy(ambiguous.features[:, order]), torch.from_numpy(ambiguous.mask[:, order])).numpy()


@pytest.mark.parametrize("rays", [1, 63, 64, 200])
def test_compiled_weights_are_those_of_the_model_and_sum_to_one(model, compiled, tmp_path, rays):
    ambiguous = random_ambiguous(rays)
    save_weights(RayTransformer(width=8), tmp_path / "narrow.safetensors")
    with pytest.raises(InputError, match="narrow"):
        TrainedWeights(tmp_path / "narrow.safetensors")
    weights = compiled(ambiguous)
    assert weights == pytest.approx(weights_of(model, ambiguous), abs=1e-5)
    for factor in (1e30, -1.0):
        with torch.no_grad():
            model.score.weight *= factor
        save_weights(model, tmp_path / "huge.safetensors")
        for found in (weights, TrainedWeights(tmp_path / "huge.safetensors")(ambiguous)):
            assert found.sum(axis=1) == pytest.approx(1, abs=1e-5)
            assert (found[~ambiguous.mask] == 0).all()
            assert found.min() >= 0


def test_training_starts_as_the_closed_form():
    ambiguous = random_ambiguous()
    prior = (np.clip(ambiguous.features[..., SHARE], 0, 1) + MIN_PRIOR) * ambiguous.mask
    expected = prior / prior.sum(axis=1, keepdims=True)
    assert weights_of(RayTransformer().eval(), ambiguous) == pytest.approx(expected, abs=1e-6)


def test_weights_of_a_ray_do_not_depend_on_the_others_nor_on_the_order_of_hypotheses(model, compiled):
    ambiguous, order = random_ambiguous(), np.array([3, 0, 4, 1, 5, 2])
    assert (compiled(ambiguous)[37:] == compiled(ambiguous.chosen(np.arange(37, 200)))).all()
    assert weights_of(model, ambiguous, order) == pytest.approx(weights_of(model, ambiguous)[:, order], abs=1e-5)
