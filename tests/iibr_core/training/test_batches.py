import numpy as np
import pytest
import torch

from iibr_core.method.ambiguous_rays import FEATURES, HYPOTHESES
from iibr_core.method.ray_transformer import TrainedWeights
from iibr_core.training import batches
from iibr_core.training.batches import training_batch
from iibr_core.training.losses import LossWeights, color_loss, to_perceptual
from iibr_core.training.model import RayTransformer
from iibr_core.training.trainer import TrainConfig, train
from iibr_core.types import ImageSize


@pytest.fixture(scope="module", autouse=True)
def small_scenes():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(batches, "SIZE", ImageSize(48, 72))
        patch.setattr(batches, "RAYS_PER_VIEW", 300)
        yield


def test_a_batch_repeats_and_differs_from_others():
    one, same, other = training_batch(3, seed=1), training_batch(3, seed=1), training_batch(4, seed=1)
    assert torch.equal(one.features, same.features)
    assert torch.equal(one.truth, same.truth)
    assert one.features.shape != other.features.shape or not torch.equal(one.features, other.features)


@pytest.mark.parametrize("step", range(1, 7))
def test_batches_are_finite_and_whole(step):
    batch = training_batch(step, seed=0)
    rays = len(batch.truth)
    assert batch.features.shape == (rays, HYPOTHESES, FEATURES)
    assert all(torch.isfinite(t).all() for t in (batch.features, batch.colors, batch.truth))
    assert batch.mask.any(dim=1).all()
    assert batch.epi_shape is None or np.prod(batch.epi_shape) <= rays


def test_truth_lies_within_reach_of_the_hypotheses():
    """Some hypothesis comes far closer to the truth than chance: rays, colours and truth belong together."""
    batch = training_batch(2, seed=5)
    distance = (batch.colors - batch.truth[:, None]).abs().sum(dim=-1).masked_fill(~batch.mask, torch.inf)
    by_chance = (batch.colors - batch.truth.roll(37, 0)[:, None]).abs().sum(dim=-1).masked_fill(~batch.mask, torch.inf)
    assert distance.min(dim=1).values.median() < 0.3 * by_chance.min(dim=1).values.median()


def test_training_lowers_the_loss_of_the_real_model(tmp_path):
    torch.manual_seed(0)
    model = RayTransformer()
    few = [training_batch(k, seed=0) for k in range(1, 6)]

    def loss():
        with torch.no_grad():
            rendered = [(model(b.features, b.mask)[..., None] * b.colors).sum(dim=1) for b in few]
        losses = [color_loss(to_perceptual(r), to_perceptual(b.truth)).item() for r, b in zip(rendered, few)]
        return np.mean([b.color_gain * loss for b, loss in zip(few, losses)])

    before = loss()
    out = tmp_path / "t.safetensors"
    config = TrainConfig(steps=100, learning_rate=3e-3, lambdas=LossWeights(entropy=0.05), device="cpu")
    train(model, lambda step: few[step % len(few)], config, out)
    assert loss() < 0.97 * before
    assert TrainedWeights(out) is not None
