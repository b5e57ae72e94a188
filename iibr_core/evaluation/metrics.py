"""How far a picture is from the true one: PSNR, SSIM, FLIP, LPIPS, of sRGB-encoded colours in 0..1, as is usual.

All take (image, truth), (H, W, 3), and a mask (H, W) of the pixels that count, None for all; NaN where none does.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage, InputError

if TYPE_CHECKING:
    from torch import nn

Mask = NDArray[np.bool_]

LEAST_SQUARE = 1e-10
"""Mean squared errors count as at least this: equal pictures have 100 dB."""
SSIM_SIGMA = 1.5
SSIM_LEAST_PX = 11
ALEXNET = {"slice1": (0,), "slice2": (3,), "slice3": (6,), "slice4": (8,), "slice5": (10,)}
"""Where LPIPS keeps the layers of AlexNet."""


def psnr(image: FloatImage, truth: FloatImage, mask: Mask | None = None) -> float:
    """Peak signal-to-noise ratio in dB, at most 100."""
    error = np.square(image.astype(np.float64) - truth)
    error = error if mask is None else error[mask]
    return 10 * math.log10(1 / max(float(error.mean()), LEAST_SQUARE)) if error.size else math.nan


def ssim(image: FloatImage, truth: FloatImage, mask: Mask | None = None) -> float:
    """Structural similarity (Wang et al. 2004): Gaussian window of sigma 1.5, mean over channels. NaN below 11 px."""
    if min(truth.shape[:2]) < SSIM_LEAST_PX:
        return math.nan
    from skimage.metrics import structural_similarity

    mean, of_pixels = structural_similarity(
        image,
        truth,
        channel_axis=2,
        data_range=1,
        gaussian_weights=True,
        sigma=SSIM_SIGMA,
        use_sample_covariance=False,
        full=True,
    )
    if mask is None:
        return float(mean)
    return float(of_pixels[mask].mean()) if mask.any() else math.nan


def flip_map(image: FloatImage, truth: FloatImage) -> FloatImage:
    """FLIP (Andersson et al. 2020) of each pixel (H, W), 0 = no difference to be seen, 67 pixels per degree."""
    from flip_evaluator import evaluate

    of_pixels, _, _ = evaluate(
        np.ascontiguousarray(truth, np.float32), np.ascontiguousarray(image, np.float32), "LDR", True, False
    )
    return np.asarray(of_pixels, np.float32).reshape(truth.shape[:2])


def flip_picture(image: FloatImage, truth: FloatImage) -> FloatImage:
    """`flip_map` in the colours of its authors (magma), (H, W, 3): black where nothing differs."""
    from flip_evaluator import evaluate

    shown, _, _ = evaluate(
        np.ascontiguousarray(truth, np.float32), np.ascontiguousarray(image, np.float32), "LDR", True, True
    )
    return np.asarray(shown, np.float32)


def flip(image: FloatImage, truth: FloatImage, mask: Mask | None = None) -> float:
    """Mean of `flip_map`."""
    of_pixels = flip_map(image, truth)
    of_pixels = of_pixels if mask is None else of_pixels[mask]
    return float(of_pixels.mean(dtype=np.float64)) if of_pixels.size else math.nan


class Lpips:
    """LPIPS (Zhang et al. 2018) on AlexNet, from a local file of torchvision's weights; 0 = alike."""

    def __init__(self, backbone: Path) -> None:
        """Raises InputError where the file is no AlexNet, or the package `lpips` is not there."""
        self._net = _lpips_net(backbone)

    def __call__(self, image: FloatImage, truth: FloatImage, mask: Mask | None = None) -> float:
        """Mean distance; NaN where the pictures are too small for the network (below 64 px)."""
        import torch

        if min(truth.shape[:2]) < 64 or (mask is not None and not mask.any()):
            return math.nan
        shown = image if mask is None else np.where(mask[..., None], image, truth)
        pair = [torch.from_numpy(np.ascontiguousarray(p.transpose(2, 0, 1)))[None] * 2 - 1 for p in (shown, truth)]
        with torch.no_grad():
            return float(self._net(*pair))


def _lpips_net(backbone: Path) -> nn.Module:
    import pickle
    import warnings

    import torch

    if not backbone.is_file():
        raise InputError(f"{backbone}: no such file; --lpips wants torchvision's AlexNet weights (alexnet-owt-*.pth)")
    try:
        from lpips import LPIPS
    except ImportError as error:
        raise InputError("--lpips needs the packages lpips and torchvision; pip install 'iibr[lpips]'") from error
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of its torchvision's older spelling
        net = LPIPS(net="alex", pnet_rand=True, verbose=False).eval()
    try:
        stored = torch.load(backbone, map_location="cpu", weights_only=True)
        layers = {
            f"{part}.{k}.{kind}": stored[f"features.{k}.{kind}"]
            for part, numbers in ALEXNET.items()
            for k in numbers
            for kind in ("weight", "bias")
        }
        net.net.load_state_dict(layers)
    except (OSError, RuntimeError, KeyError, TypeError, EOFError, ValueError, pickle.UnpicklingError) as error:
        reason = re.split(r"[\n.]", str(error).strip())[0] or type(error).__name__
        raise InputError(f"{backbone}: is no AlexNet of torchvision ({reason}); give alexnet-owt-*.pth") from error
    return net
