"""What training minimises (paper, section 3.3): colour, entropy of the weights, structure tensor of the EPIs.

Every loss is a scalar tensor, differentiable, in the dtype of its inputs. None hides bad numbers: a NaN or an infinity
in any input makes the loss NaN or infinite, and whoever trains must look before taking the step.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil
from typing import NamedTuple

import torch
from torch import Tensor

DERIVATIVE_SIGMA = 0.8
"""Gaussian under the derivatives (pixels along x, views along s): wide enough that no pixel is skipped, not wider."""
WINDOW_SIGMA = 2.0
"""Gaussian over the products of derivatives: the neighbourhood whose slope is compared; 9 views span +-2 sigma."""
TRUNCATE_SIGMAS = 3.0

LEAST_LIGHT = 1e-4

EpiShape = tuple[int, int, int]
"""(E, V, W): E EPIs of V views and W pixels."""


@dataclass(frozen=True)
class LossWeights:
    """The lambdas of the total loss; the paper's values."""

    color: float = 100.0
    entropy: float = 1.0
    epi: float = 0.1


class Losses(NamedTuple):
    """Scalar tensors: the weighted total and, without their lambdas, its terms."""

    total: Tensor
    color: Tensor
    entropy: Tensor
    epi: Tensor


def to_perceptual(light: Tensor) -> Tensor:
    """Linear light on a scale like sRGB's, on which pictures are judged; its slope is finite at 0."""
    return (light.clamp_min(0) + LEAST_LIGHT) ** (1 / 2.2)


def color_loss(rendered: Tensor, truth: Tensor) -> Tensor:
    """Squared distance of two colours, summed over the channels, averaged over the rays: ||c - c_true||^2.

    rendered, truth: (N, 3). Raises ValueError if the shapes differ or there is no ray.
    """
    _require_alike(rendered, truth)
    return (rendered - truth).square().sum(dim=-1).mean()


def entropy_loss(weights: Tensor) -> Tensor:
    """Entropy -sum w log w of each ray's weights (nats; 0 log 0 = 0), averaged over the rays: 0 .. log K.

    weights: (N, K), >= 0, each row with sum 1. Raises ValueError if there is no weight.
    """
    if weights.numel() == 0:
        raise ValueError(f"no weights to take the entropy of: shape {tuple(weights.shape)}")
    # The slope of w log w at 0 is infinite, and infinity times softmax's own slope there (0) would be NaN in every
    # gradient. Clamped inside the logarithm only, value and slope are those of -w log w at every w above `tiny`.
    logarithm = weights.clamp_min(torch.finfo(weights.dtype).tiny).log()
    return -(weights * logarithm).sum(dim=-1).mean()


def structure_tensor(epi: Tensor) -> Tensor:
    """Structure tensor J = G * (grad epi  grad epi^T) of EPIs (Wanner and Goldluecke, CVPR 2012, section 3).

    epi: (E, C, V, W), one row per view along s, or along t. Returns (E, 3, V, W): J_xx, J_xs, J_ss, summed over the
    channels, in colour squared per pixel squared. Where one surface of disparity d is seen,
    J_xs / J_xx = d. Derivatives are Gaussian derivatives (DERIVATIVE_SIGMA), exact for ramps; G is a Gaussian
    (WINDOW_SIGMA). Both end at 3 sigma; outside the EPI its border repeats. Sigmas in samples: pixels along x, views
    along s. One bad number spoils the whole EPI.
    """
    smooth, slope = _gaussian(DERIVATIVE_SIGMA, epi), _gaussian_derivative(DERIVATIVE_SIGMA, epi)
    x = _correlate(epi, along_s=smooth, along_x=slope)
    s = _correlate(epi, along_s=slope, along_x=smooth)
    products = torch.stack([(x * x).sum(dim=1), (x * s).sum(dim=1), (s * s).sum(dim=1)], dim=1)
    window = _gaussian(WINDOW_SIGMA, epi)
    return _correlate(products, along_s=window, along_x=window)


def epi_loss(rendered_epi: Tensor, truth_epi: Tensor) -> Tensor:
    """Mean absolute difference of two EPI batches' structure tensors, over J_xx, J_xs, J_ss and every sample.

    rendered_epi, truth_epi: (E, C, V, W). Raises ValueError if the shapes differ or are empty.
    """
    _require_alike(rendered_epi, truth_epi)
    return (structure_tensor(rendered_epi) - structure_tensor(truth_epi)).abs().mean()


def total_loss(
    rendered: Tensor,
    truth: Tensor,
    weights: Tensor,
    epi_shape: EpiShape | None = None,
    lambdas: LossWeights | None = None,
) -> Losses:
    """All losses of a batch of rays, and their weighted sum.

    rendered, truth: (N, 3); weights: (N, K). epi_shape: the first E * V * W rays form EPIs, in this order; None: no
    ray does, and the EPI loss is 0. Raises ValueError if there are fewer rays than that, or shapes do not fit.
    """
    lambdas = lambdas or LossWeights()
    color, entropy = color_loss(rendered, truth), entropy_loss(weights)
    epi = torch.zeros_like(color)
    if epi_shape is not None:
        epi = epi_loss(epis_of_rays(rendered, epi_shape), epis_of_rays(truth, epi_shape))
    total = lambdas.color * color + lambdas.entropy * entropy + lambdas.epi * epi
    return Losses(total, color, entropy, epi)


def epis_of_rays(colors: Tensor, epi_shape: EpiShape) -> Tensor:
    """EPIs (E, 3, V, W) of the first E * V * W rays of colours (N, 3). Raises ValueError if there are fewer."""
    count, views, width = epi_shape
    rays = count * views * width
    if len(colors) < rays:
        raise ValueError(f"EPIs of shape {tuple(epi_shape)} need {rays} rays, the batch has {len(colors)}")
    return colors[:rays].reshape(count, views, width, 3).permute(0, 3, 1, 2)


def _require_alike(one: Tensor, other: Tensor) -> None:
    """Shapes that differ would broadcast without a word; the mean over nothing would be NaN."""
    if one.shape != other.shape or one.numel() == 0:
        raise ValueError(f"shapes {tuple(one.shape)} and {tuple(other.shape)} must be equal and not empty")


def _offsets(sigma: float, like: Tensor) -> Tensor:
    reach = ceil(TRUNCATE_SIGMAS * sigma)
    return torch.arange(-reach, reach + 1, dtype=like.dtype, device=like.device)


def _gaussian(sigma: float, like: Tensor) -> Tensor:
    """Taps with sum 1."""
    taps = torch.exp(-0.5 * (_offsets(sigma, like) / sigma) ** 2)
    return taps / taps.sum()


def _gaussian_derivative(sigma: float, like: Tensor) -> Tensor:
    """Taps that give exactly the slope of a ramp."""
    offsets = _offsets(sigma, like)
    taps = offsets * torch.exp(-0.5 * (offsets / sigma) ** 2)
    return taps / (taps * offsets).sum()


def _correlate(images: Tensor, along_s: Tensor, along_x: Tensor) -> Tensor:
    """Images (..., V, W) correlated with taps along V and along W; the border repeats.

    As products with banded matrices: at these sizes faster than convolutions of one channel.
    """
    views, width = images.shape[-2:]
    return _filter_matrix(along_s, views) @ images @ _filter_matrix(along_x, width).T


def _filter_matrix(taps: Tensor, size: int) -> Tensor:
    """(size, size): row i holds the taps around i; those beyond the ends add to the ends."""
    reach = len(taps) // 2
    centres = torch.arange(size, device=taps.device)[:, None]
    columns = (centres + torch.arange(-reach, reach + 1, device=taps.device)).clamp(0, size - 1)
    return taps.new_zeros(size, size).scatter_add_(1, columns, taps.expand(size, -1))
