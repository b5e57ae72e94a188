import numpy as np
import pytest
import torch

from iibr_core.method.ambiguous_rays import FEATURES, HYPOTHESES
from iibr_core.training import batches
from iibr_core.training.batches import training_batch
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


@pytest.mark.parametrize("step", range(1, 4))
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
