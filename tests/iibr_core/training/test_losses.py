from math import ceil, exp, log

import numpy as np
import pytest
import torch
from scipy.ndimage import correlate1d

from iibr_core.method.ambiguous_rays import FEATURES, HYPOTHESES
from iibr_core.training import batches
from iibr_core.training.batches import training_batch
from iibr_core.training.epi_loss import DERIVATIVE_SIGMA, TRUNCATE_SIGMAS, WINDOW_SIGMA, epi_loss
from iibr_core.training.losses import LossWeights, color_loss, entropy_loss, total_loss
from iibr_core.types import ImageSize


def random(*shape, seed=0):
    return torch.rand(shape, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def random_weights(rays, candidates, seed=0):
    return torch.softmax(3 * random(rays, candidates, seed=seed), dim=1)


def slow_taps(sigma, derivative):
    reach = ceil(TRUNCATE_SIGMAS * sigma)
    taps = {i: exp(-(i**2) / (2 * sigma**2)) * (i if derivative else 1) for i in range(-reach, reach + 1)}
    total = sum(i * tap for i, tap in taps.items()) if derivative else sum(taps.values())
    return [tap / total for tap in taps.values()]


def slow_filter(image, taps_v, taps_w):
    return correlate1d(correlate1d(image, taps_v, 0, mode="nearest"), taps_w, 1, mode="nearest")


def slow_structure_tensor(epi):
    """One EPI (C, V, W) -> (3, V, W)."""
    smooth, slope = slow_taps(DERIVATIVE_SIGMA, False), slow_taps(DERIVATIVE_SIGMA, True)
    window = slow_taps(WINDOW_SIGMA, False)
    result = np.zeros((3, *epi.shape[1:]))
    for channel in epi:
        x, s = slow_filter(channel, smooth, slope), slow_filter(channel, slope, smooth)
        result += np.stack([slow_filter(product, window, window) for product in (x * x, x * s, s * s)])
    return result


def test_entropy_against_a_loop_and_at_its_limits():
    weights = random_weights(6, 5)
    slow = sum(-w * log(w) for row in weights.tolist() for w in row) / 6
    assert entropy_loss(weights).item() == pytest.approx(slow, rel=1e-12)
    assert entropy_loss(torch.eye(5)).item() == 0
    assert entropy_loss(torch.full((4, 5), 0.2)).item() == pytest.approx(log(5), rel=1e-6)
    logits = torch.tensor([[0.0, -1e4, float("-inf")], [500.0, -500.0, 0.0]], requires_grad=True)
    entropy_loss(torch.softmax(logits, dim=1)).backward()
    assert torch.isfinite(logits.grad).all()


def test_epi_loss_against_loops():
    one, other = random(2, 3, 4, 7, seed=1), random(2, 3, 4, 7, seed=2)
    slow = [np.abs(slow_structure_tensor(a.numpy()) - slow_structure_tensor(b.numpy())) for a, b in zip(one, other)]
    assert epi_loss(one, other).item() == pytest.approx(np.mean(slow), rel=1e-12)
    assert epi_loss(one, one).item() == 0


def test_total_is_the_weighted_sum_over_the_first_rays_as_epis():
    rendered, truth, weights = random(50, 3, seed=1), random(50, 3, seed=2), random_weights(50, 4)
    losses = total_loss(rendered, truth, weights, (2, 3, 7), LossWeights(5, 7, 11))
    epis = [np.zeros((2, 3, 3, 7)), np.zeros((2, 3, 3, 7))]
    for which, colors in enumerate((rendered, truth)):
        for ray in range(2 * 3 * 7):
            epi, rest = divmod(ray, 3 * 7)
            epis[which][epi, :, rest // 7, rest % 7] = colors[ray]
    assert losses.epi == epi_loss(*map(torch.from_numpy, epis))
    expected = 5 * color_loss(rendered, truth) + 7 * entropy_loss(weights) + 11 * losses.epi
    assert losses.total.item() == pytest.approx(expected.item(), rel=1e-12)
    assert total_loss(rendered, truth, weights, None, LossWeights()).epi == 0


@pytest.fixture(scope="module", autouse=True)
def small_scenes():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(batches, "SIZE", ImageSize(48, 72))
        patch.setattr(batches, "RAYS_PER_VIEW", 300)
        yield


def test_a_batch_is_whole_repeats_and_differs_from_others():
    one, same, other = training_batch(3, seed=1), training_batch(3, seed=1), training_batch(4, seed=1)
    assert torch.equal(one.features, same.features)
    assert torch.equal(one.truth, same.truth)
    assert one.features.shape != other.features.shape or not torch.equal(one.features, other.features)
    for batch in (one, other):
        assert batch.features.shape == (len(batch.truth), HYPOTHESES, FEATURES)
        assert all(torch.isfinite(part).all() for part in (batch.features, batch.colors, batch.truth))
        assert batch.mask.any(dim=1).all()
        assert batch.epi_shape is None or np.prod(batch.epi_shape) <= len(batch.truth)


def test_truth_lies_within_reach_of_the_hypotheses():
    """Some hypothesis comes far closer to the truth than chance: rays, colours and truth belong together."""
    batch = training_batch(2, seed=5)
    distance = (batch.colors - batch.truth[:, None]).abs().sum(dim=-1).masked_fill(~batch.mask, torch.inf)
    by_chance = (batch.colors - batch.truth.roll(37, 0)[:, None]).abs().sum(dim=-1).masked_fill(~batch.mask, torch.inf)
    assert distance.min(dim=1).values.median() < 0.3 * by_chance.min(dim=1).values.median()
