"""Loss on the slopes of epipolar-plane images, L_epi (paper, section 3.3): structure tensors are compared.

EPIs are (E, C, V, W): V views along s (or t) and W pixels along x. Sigmas are in views and pixels.
"""

from __future__ import annotations

from math import ceil

import torch
from torch import Tensor
from torch.nn import functional

DERIVATIVE_SIGMA = 0.8
"""Gaussian of the derivatives: the narrowest that skips no pixel."""
WINDOW_SIGMA = 2.0
"""Gaussian over products of derivatives: the neighbourhood whose slope is compared, of about 9 views."""
TRUNCATE_SIGMAS = 3.5


def epi_loss(rendered: Tensor, truth: Tensor) -> Tensor:
    """Return the mean absolute difference of the structure tensors of EPIs."""
    return (structure_tensor(rendered) - structure_tensor(truth)).abs().mean()


def structure_tensor(epi: Tensor) -> Tensor:
    """Return the structure tensor J = G * (grad epi  grad epi^T) (Wanner and Goldluecke, CVPR 2012, section 3).

    Returns J_xx, J_xs, J_ss (E, 3, V, W), summed over the channels. J_xs / J_xx is the disparity where only one surface
    is visible.
    """
    smooth, slope = gaussian(DERIVATIVE_SIGMA), _gaussian_derivative(DERIVATIVE_SIGMA)
    x = correlate(epi, smooth, slope)
    s = correlate(epi, slope, smooth)
    products = torch.stack([(x * x).sum(dim=1), (x * s).sum(dim=1), (s * s).sum(dim=1)], dim=1)
    window = gaussian(WINDOW_SIGMA)
    return correlate(products, window, window)


def gaussian(sigma: float) -> Tensor:
    """Return the taps of a Gaussian; their sum is 1."""
    taps = torch.exp(-0.5 * (_positions(sigma) / sigma) ** 2)
    return taps / taps.sum()


def correlate(images: Tensor, down: Tensor, across: Tensor) -> Tensor:
    """Return images (..., H, W) correlated with taps along H and along W; border pixels continue beyond the border."""
    top, left = len(down) // 2, len(across) // 2
    planes = images.reshape(-1, 1, *images.shape[-2:])
    padded = functional.pad(planes, (left, left, top, top), mode="replicate")
    rows = functional.conv2d(padded, down.to(images)[None, None, :, None])
    return functional.conv2d(rows, across.to(images)[None, None, None, :]).reshape(images.shape)


def _gaussian_derivative(sigma: float) -> Tensor:
    """Return taps that give exactly the slope of a ramp."""
    taps = _positions(sigma) * gaussian(sigma)
    return taps / (taps * _positions(sigma)).sum()


def _positions(sigma: float) -> Tensor:
    reach = ceil(TRUNCATE_SIGMAS * sigma)
    return torch.arange(-reach, reach + 1, dtype=torch.float64)
