"""LPIPS (Zhang et al. 2018) on AlexNet, with weights from local files.

The files are torchvision's AlexNet and the layer weights of LPIPS 0.1. The lpips package gives the same figures, but
needs torchvision.
"""

from __future__ import annotations

import math
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from iibr_core.formats.files import require_file
from iibr_core.types import FloatImage, InputError

FILES = "torchvision's alexnet-owt-7be5be79.pth and LPIPS's alex.pth"


class Lpips:
    """Mean distance of two pictures, 0 for equal ones."""

    def __init__(self, folder: Path) -> None:
        """Read the weights from a folder that holds FILES. Raises InputError."""
        first, second = nn.Conv2d(3, 64, 11, 4, 2), nn.Conv2d(64, 192, 5, padding=2)
        others = [nn.Conv2d(*channels, 3, padding=1) for channels in ((192, 384), (384, 256), (256, 256))]
        layers: list[nn.Module] = [first, nn.ReLU(), nn.MaxPool2d(3, 2), second, nn.ReLU(), nn.MaxPool2d(3, 2)]
        for convolution in others:
            layers += [convolution, nn.ReLU()]
        self._network = nn.Sequential(*layers)
        self._shares = nn.ModuleList(nn.Conv2d(n, 1, 1, bias=False) for n in (64, 192, 384, 256, 256))
        backbones = sorted(folder.glob("alexnet*.pth"))
        _load(self._network, backbones[0] if backbones else folder / "alexnet-owt-7be5be79.pth", "features.{}".format)
        _load(self._shares, folder / "alex.pth", lambda key: f"lin{key.replace('.', '.model.1.')}")

    def __call__(self, image: FloatImage, truth: FloatImage) -> float:
        """Return the distance of pictures (H, W, 3), sRGB-encoded in 0..1; NaN for those too small for the network."""
        if min(truth.shape[:2]) < 64:
            return math.nan
        with torch.no_grad():
            x = torch.from_numpy(np.stack([image, truth]).transpose(0, 3, 1, 2).astype(np.float32))
            shift, scale = torch.tensor([[-0.030, -0.088, -0.188], [0.458, 0.448, 0.450]]).view(2, 1, 3, 1, 1)
            x, distance, shares = (x * 2 - 1 - shift) / scale, 0.0, iter(self._shares)
            for layer in self._network:
                x = layer(x)
                if isinstance(layer, nn.ReLU):
                    one, two = x / (x.square().sum(dim=1, keepdim=True).sqrt() + 1e-10)
                    distance += float(next(shares)((one - two) ** 2).mean())
            return distance


def _load(module: nn.Module, path: Path, stored_name: Callable[[str], str]) -> None:
    """Load the weights of a module. stored_name: gives their names in the file."""
    require_file(path)
    try:
        stored: dict[str, Tensor] = torch.load(path, map_location="cpu", weights_only=True)
        module.load_state_dict({key: stored[stored_name(key)] for key in module.state_dict()})
    except (OSError, RuntimeError, KeyError, TypeError, AttributeError, EOFError, pickle.UnpicklingError) as error:
        reason = str(error).strip().partition("\n")[0][:100] or type(error).__name__
        raise InputError(f"{path}: cannot be read ({reason}); LPIPS needs a folder with {FILES}") from error
