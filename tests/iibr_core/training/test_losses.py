from math import ceil, exp, log

import numpy as np
import pytest
import torch

from iibr_core.training.losses import (
    DERIVATIVE_SIGMA,
    TRUNCATE_SIGMAS,
    WINDOW_SIGMA,
    LossWeights,
    color_loss,
    entropy_loss,
    epi_loss,
    epis_of_rays,
    structure_tensor,
    total_loss,
)


def random(*shape, seed=0, dtype=torch.float64):
    return torch.rand(shape, generator=torch.Generator().manual_seed(seed), dtype=dtype)


def random_weights(rays, candidates, seed=0):
    return torch.softmax(3 * random(rays, candidates, seed=seed), dim=1)


def slow_taps(sigma, derivative):
    reach = ceil(TRUNCATE_SIGMAS * sigma)
    taps = {i: exp(-(i**2) / (2 * sigma**2)) * (i if derivative else 1) for i in range(-reach, reach + 1)}
    total = sum(i * tap for i, tap in taps.items()) if derivative else sum(taps.values())
    return {i: tap / total for i, tap in taps.items()}


def slow_filter(image, taps_v, taps_w):
    views, width = image.shape
    result = np.zeros_like(image)
    for v in range(views):
        for w in range(width):
            for i, tap_v in taps_v.items():
                for j, tap_w in taps_w.items():
                    sample = image[min(max(v + i, 0), views - 1), min(max(w + j, 0), width - 1)]
                    result[v, w] += tap_v * tap_w * sample
    return result


def slow_structure_tensor(epi):
    """One EPI (C, V, W) -> (3, V, W)."""
    smooth, slope = slow_taps(DERIVATIVE_SIGMA, False), slow_taps(DERIVATIVE_SIGMA, True)
    window = slow_taps(WINDOW_SIGMA, False)
    result = np.zeros((3, *epi.shape[1:]))
    for channel in epi:
        x, s = slow_filter(channel, smooth, slope), slow_filter(channel, slope, smooth)
        result += np.stack([slow_filter(product, window, window) for product in (x * x, x * s, s * s)])
    return result


def test_color_loss_against_a_loop():
    one, other = random(7, 3, seed=1), random(7, 3, seed=2)
    slow = sum((one[n, c].item() - other[n, c].item()) ** 2 for n in range(7) for c in range(3)) / 7
    assert color_loss(one, other).item() == pytest.approx(slow, rel=1e-12)
    assert color_loss(one, one).item() == 0


def test_entropy_against_a_loop():
    weights = random_weights(6, 5)
    slow = sum(-w * log(w) for row in weights.tolist() for w in row) / 6
    assert entropy_loss(weights).item() == pytest.approx(slow, rel=1e-12)


@pytest.mark.parametrize("dtype", [torch.float64, torch.float32, torch.bfloat16, torch.float16])
def test_entropy_of_one_hot_and_uniform_weights(dtype):
    assert entropy_loss(torch.eye(5, dtype=dtype)).item() == 0
    for candidates in (1, 2, 5, 16):
        uniform = torch.full((4, candidates), 1 / candidates, dtype=dtype)
        assert entropy_loss(uniform).item() == pytest.approx(log(candidates), rel=4 * torch.finfo(dtype).eps)


def test_entropy_counts_an_empty_slot_as_nothing():
    weights = random_weights(6, 5)
    padded = torch.cat([weights, torch.zeros(6, 3, dtype=weights.dtype)], dim=1)
    assert entropy_loss(padded).item() == pytest.approx(entropy_loss(weights).item(), rel=1e-12)


def test_entropy_gradient_is_finite_through_a_softmax_that_underflows():
    logits = torch.tensor([[0.0, -1e4, float("-inf")], [500.0, -500.0, 0.0]], requires_grad=True)
    loss = entropy_loss(torch.softmax(logits, dim=1))
    loss.backward()
    assert loss.item() == 0
    assert torch.isfinite(logits.grad).all()


def test_structure_tensor_against_loops():
    epi = random(2, 3, 5, 11)
    fast = structure_tensor(epi).numpy()
    assert fast.shape == (2, 3, 5, 11)
    for index in range(2):
        assert np.allclose(fast[index], slow_structure_tensor(epi[index].numpy()), rtol=1e-12, atol=1e-14)


def test_structure_tensor_of_a_ramp_is_the_product_of_its_slopes():
    """Inside, where no border is seen; J_xs / J_xx is the disparity."""
    disparity, slope = -0.7, 0.03
    views, width = 27, 41
    s, x = torch.meshgrid(torch.arange(views).double(), torch.arange(width).double(), indexing="ij")
    epi = (slope * (x + disparity * s)).expand(1, 1, views, width)
    reach = ceil(TRUNCATE_SIGMAS * DERIVATIVE_SIGMA) + ceil(TRUNCATE_SIGMAS * WINDOW_SIGMA)
    inside = structure_tensor(epi)[0, :, reach:-reach, reach:-reach]
    expected = slope**2 * torch.tensor([1, disparity, disparity**2], dtype=torch.float64)
    assert torch.allclose(inside, expected[:, None, None].expand_as(inside), rtol=1e-10, atol=0)


def test_structure_tensor_is_symmetric_positive_and_swaps_with_the_axes():
    epi = random(3, 2, 9, 13)
    xx, xs, ss = structure_tensor(epi).unbind(dim=1)
    assert (xx >= 0).all()
    assert (ss >= 0).all()
    assert (xx * ss - xs**2 >= -1e-14).all()
    swapped = structure_tensor(epi.transpose(2, 3)).transpose(2, 3)
    assert torch.allclose(swapped, torch.stack([ss, xs, xx], dim=1), rtol=1e-12)


@pytest.mark.parametrize("shape", [(1, 1), (1, 12), (9, 1), (2, 3)])
def test_structure_tensor_of_the_smallest_epis(shape):
    tensor = structure_tensor(random(2, 3, *shape))
    assert torch.isfinite(tensor).all()
    if shape[1] == 1:
        assert (tensor[:, :2].abs() < 1e-15).all(), "no derivative along x where there is one pixel"
    if shape[0] == 1:
        assert (tensor[:, 1:].abs() < 1e-15).all(), "no derivative along s where there is one view"
    assert (structure_tensor(torch.full((1, 1, *shape), 0.5)).abs() < 1e-12).all()


def test_epi_loss_against_loops_and_at_equality():
    one, other = random(2, 3, 4, 7, seed=1), random(2, 3, 4, 7, seed=2)
    slow = np.mean(
        [np.abs(slow_structure_tensor(a.numpy()) - slow_structure_tensor(b.numpy())) for a, b in zip(one, other)]
    )
    assert epi_loss(one, other).item() == pytest.approx(slow, rel=1e-12)
    assert epi_loss(one, one).item() == 0


def test_epi_loss_sees_slope_and_not_brightness():
    truth = random(1, 3, 9, 21)
    assert epi_loss(truth + 0.2, truth).item() == pytest.approx(0, abs=1e-14)
    sheared = torch.stack([truth[:, :, v].roll(v, dims=-1) for v in range(9)], dim=2)
    assert epi_loss(sheared, truth).item() > 1e-3


def test_total_is_the_weighted_sum_over_the_first_rays_as_epis():
    rendered, truth, weights = random(50, 3, seed=1), random(50, 3, seed=2), random_weights(50, 4)
    losses = total_loss(rendered, truth, weights, (2, 3, 7), LossWeights(5, 7, 11))
    assert losses.color == color_loss(rendered, truth)
    assert losses.entropy == entropy_loss(weights)
    epis = [np.zeros((2, 3, 3, 7)), np.zeros((2, 3, 3, 7))]
    for which, colors in enumerate((rendered, truth)):
        for ray in range(2 * 3 * 7):
            epi, rest = divmod(ray, 3 * 7)
            epis[which][epi, :, rest // 7, rest % 7] = colors[ray]
    assert losses.epi == epi_loss(*map(torch.from_numpy, epis))
    expected = 5 * losses.color + 7 * losses.entropy + 11 * losses.epi
    assert losses.total.item() == pytest.approx(expected.item(), rel=1e-12)


def test_total_without_epis_has_no_epi_loss_and_starts_from_the_papers_lambdas():
    rendered, truth, weights = random(5, 3, seed=1), random(5, 3, seed=2), random_weights(5, 4)
    losses = total_loss(rendered, truth, weights)
    assert losses.epi == 0
    assert losses.total.item() == pytest.approx((100 * losses.color + losses.entropy).item(), rel=1e-12)
    assert LossWeights() == LossWeights(color=100, entropy=1, epi=0.1)


def test_gradients():
    truth, weights = random(24, 3, seed=2), random_weights(24, 4)
    rendered = random(24, 3, seed=1).requires_grad_()
    weights.requires_grad_()
    assert torch.autograd.gradcheck(color_loss, (rendered, truth))
    assert torch.autograd.gradcheck(entropy_loss, (weights,))
    epi = random(1, 2, 4, 5, seed=3).requires_grad_()
    assert torch.autograd.gradcheck(structure_tensor, (epi,))
    assert torch.autograd.gradcheck(epi_loss, (epi, random(1, 2, 4, 5, seed=4)))
    assert torch.autograd.gradcheck(lambda c, w: total_loss(c, truth, w, (1, 4, 6)).total, (rendered, weights))


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), float("-inf")])
def test_bad_numbers_show_in_the_loss(bad):
    colors, weights = random(12, 3), random_weights(12, 4)
    bad_colors, bad_weights = colors.clone(), weights.clone()
    bad_colors[3, 1], bad_weights[3, 1] = bad, bad
    assert not torch.isfinite(color_loss(bad_colors, colors))
    assert not torch.isfinite(color_loss(colors, bad_colors))
    assert not torch.isfinite(entropy_loss(bad_weights))
    assert not torch.isfinite(epi_loss(epis_of_rays(bad_colors, (1, 3, 4)), epis_of_rays(colors, (1, 3, 4))))
    assert not torch.isfinite(total_loss(bad_colors, colors, weights, (1, 3, 4)).total)


def test_shapes_that_would_broadcast_or_hold_nothing_are_refused():
    with pytest.raises(ValueError, match="equal"):
        color_loss(random(4, 3), random(4, 1))
    with pytest.raises(ValueError, match="not empty"):
        color_loss(random(0, 3), random(0, 3))
    with pytest.raises(ValueError, match="no weights"):
        entropy_loss(random(0, 5))
    with pytest.raises(ValueError, match="equal"):
        epi_loss(random(1, 3, 4, 5), random(1, 1, 4, 5))
    with pytest.raises(ValueError, match="need 13 rays, the batch has 12"):
        total_loss(random(12, 3), random(12, 3), random_weights(12, 4), (1, 1, 13))
