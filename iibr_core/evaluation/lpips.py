"""LPIPS (Zhang et al. 2018) on AlexNet, from local files: the network of torchvision, the weights of its layers' errors
of LPIPS 0.1. Ours: the lpips package (same figures, to the last digit) and torchmetrics both need torchvision.
"""

from __future__ import annotations

import math
import pickle
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from iibr_core.formats.files import is_file, is_folder
from iibr_core.types import FloatImage, InputError

LAYERS = (0, 3, 6, 8, 10)
"""Numbers of AlexNet's convolutions in torchvision's file; a pooling before the second and the third."""
POOLED = (3, 6)
FIRST_STRIDE, MOST_PADDING = 4, 2
"""The others go a pixel at a time; padding keeps the size, but for the first."""
SHIFT, SCALE = (-0.030, -0.088, -0.188), (0.458, 0.448, 0.450)
LEAST_PX = 64
FILES = "torchvision's alexnet-owt-*.pth and LPIPS's alex.pth"


class Lpips:
    """Mean distance of two pictures, 0 = alike."""

    def __init__(self, folder: Path) -> None:
        """folder: holds FILES. Raises InputError, naming the file, where one is missing or something else."""
        if not is_folder(folder):
            raise InputError(f"{folder}: is not a folder; --lpips wants one with {FILES}")
        backbone = next(iter(sorted(folder.glob("alexnet*.pth"))), folder / "alexnet-owt-7be5be79.pth")
        kinds = ("weight", "bias")
        names = [f"features.{number}.{kind}" for number in LAYERS for kind in kinds]
        stored = _tensors(backbone, names)
        self._convolutions = [(stored[2 * k], stored[2 * k + 1]) for k in range(len(LAYERS))]
        self._shares = _tensors(folder / "alex.pth", [f"lin{k}.model.1.weight" for k in range(len(LAYERS))])
        weights = stored[::2]
        fits = all(tensor.ndim == 4 for tensor in (*weights, *self._shares))
        if not fits or [weight.shape[0] for weight in weights] != [share.shape[1] for share in self._shares]:
            both = f"{backbone.name} and alex.pth"
            raise InputError(f"{folder}: {both} belong to different networks; --lpips wants a folder with {FILES}")

    def __call__(self, image: FloatImage, truth: FloatImage) -> float:
        """Of (H, W, 3), sRGB-encoded in 0..1; NaN where they are too small for the network (below LEAST_PX)."""
        if min(truth.shape[:2]) < LEAST_PX:
            return math.nan
        with torch.no_grad():
            pairs = zip(self._features(image), self._features(truth), self._shares)
            return float(sum(functional.conv2d((one - two) ** 2, share).mean() for one, two, share in pairs))

    def _features(self, image: FloatImage) -> list[Tensor]:
        """What each layer sees, of unit length in every place."""
        shift, scale = (torch.tensor(values).view(1, 3, 1, 1) for values in (SHIFT, SCALE))
        x = (torch.from_numpy(np.ascontiguousarray(image.transpose(2, 0, 1)))[None] * 2 - 1 - shift) / scale
        found = []
        for number, (weight, bias) in zip(LAYERS, self._convolutions):
            if number in POOLED:
                x = functional.max_pool2d(x, 3, 2)
            stride, padding = FIRST_STRIDE if number == 0 else 1, min(weight.shape[-1] // 2, MOST_PADDING)
            x = functional.relu(functional.conv2d(x, weight, bias, stride, padding))
            found.append(x / (x.square().sum(dim=1, keepdim=True).sqrt() + 1e-10))
        return found


def _tensors(path: Path, names: list[str]) -> list[Tensor]:
    if not is_file(path):
        raise InputError(f"{path}: no such file; --lpips wants a folder with {FILES}")
    try:
        stored = torch.load(path, map_location="cpu", weights_only=True)
        return [stored[name].float() for name in names]
    except (OSError, RuntimeError, KeyError, TypeError, AttributeError, EOFError, pickle.UnpicklingError) as error:
        reason = str(error).strip().partition("\n")[0][:100] or type(error).__name__
        raise InputError(f"{path}: cannot be read ({reason}); --lpips wants a folder with {FILES}") from error
