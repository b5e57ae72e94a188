"""Losses of the ray transformer (paper, section 3.3): colour L_c, entropy of the weights L_w, slopes of the EPIs L_epi.

Colours are (N, 3) on the scale of `to_perceptual`; weights are (N, K), and each row sums to 1.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import torch
from torch import Tensor

from iibr_core.training.epi_loss import epi_loss

DARKEST_LIGHT = 1e-4
"""Added to linear light, so that the slope of the gamma curve is finite at black."""

EpiShape = tuple[int, int, int]
"""Numbers of EPIs, of views and of pixels (E, V, W)."""


@dataclass(frozen=True)
class LossWeights:
    """The lambdas of the total loss, as the paper has them."""

    color: float = 100.0
    entropy: float = 1.0
    epi: float = 0.1


class Losses(NamedTuple):
    """The weighted total and its terms without their lambdas: scalars."""

    total: Tensor
    color: Tensor
    entropy: Tensor
    epi: Tensor


def to_perceptual(light: Tensor) -> Tensor:
    """Return linear light on a scale close to sRGB's curve, on which errors are judged."""
    return (light.clamp_min(0) + DARKEST_LIGHT) ** (1 / 2.2)


def color_loss(rendered: Tensor, truth: Tensor) -> Tensor:
    """Return L_c = ||c - c_true||^2, averaged over the rays."""
    return (rendered - truth).square().sum(dim=-1).mean()


def entropy_loss(weights: Tensor) -> Tensor:
    """Return L_w = -sum w log w in nats, averaged over the rays."""
    # The slope of w log w at 0 is infinite, and infinity times softmax's slope there (0) would be NaN in every
    # gradient. The logarithm alone is clamped, so value and slope stay exact at every other w.
    logarithm = weights.clamp_min(torch.finfo(weights.dtype).tiny).log()
    return -(weights * logarithm).sum(dim=-1).mean()


def total_loss(
    rendered: Tensor, truth: Tensor, weights: Tensor, epi_shape: EpiShape | None, lambdas: LossWeights
) -> Losses:
    """Return all losses of a batch. epi_shape: shape of the EPIs that the first rays form; without it, L_epi is 0."""
    color, entropy = color_loss(rendered, truth), entropy_loss(weights)
    epi = torch.zeros_like(color)
    if epi_shape:
        epi = epi_loss(epis_of_rays(rendered, epi_shape), epis_of_rays(truth, epi_shape))
    total = lambdas.color * color + lambdas.entropy * entropy + lambdas.epi * epi
    return Losses(total, color, entropy, epi)


def epis_of_rays(colors: Tensor, epi_shape: EpiShape) -> Tensor:
    """Return the EPIs (E, 3, V, W) of the first E * V * W rays."""
    count, views, width = epi_shape
    return colors[: count * views * width].reshape(count, views, width, 3).permute(0, 3, 1, 2)
