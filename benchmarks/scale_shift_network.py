"""A small network that says scale and shift of relative disparity, as in the paper, and the two ways to train it."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from benchmarks.scale_shift_scenes import SPLIT, Scenes

EPOCHS, BATCH, RATE = 16, 32, 2e-3


class Network(nn.Module):
    """Photo and relative map (N, C, H, W) of any size to log2 alpha and beta / alpha (N, 2), near the mean at first."""

    def __init__(self, channels: int, truth: Tensor) -> None:
        super().__init__()
        widths = (channels, 16, 32, 48, 64)
        layers: list[nn.Module] = []
        for before, after in pairwise(widths):
            layers += [nn.Conv2d(before, after, 3, 2, 1), nn.GroupNorm(4, after), nn.ReLU()]
        self.features = nn.Sequential(*layers)
        self.head = nn.Linear(widths[-1], 2)
        nn.init.zeros_(self.head.weight)
        nn.init.zeros_(self.head.bias)
        self.mean, self.spread = truth.mean(dim=0), truth.std(dim=0)

    def forward(self, pictures: Tensor) -> Tensor:
        """(N, C, H, W) to (N, 2)."""
        pooled = self.features(pictures - 0.5).mean(dim=(2, 3))
        return self.mean + self.spread * self.head(pooled)


Loss = Callable[[Network, Tensor, Scenes], Tensor]


def direct(network: Network, said: Tensor, scenes: Scenes) -> Tensor:
    """Squared error of both numbers, in standard deviations."""
    return ((said - scenes.truth) / network.spread).square().mean()


def color(network: Network, said: Tensor, scenes: Scenes) -> Tensor:
    """Difference between the photo and the other view looked up along the disparity said, at three resolutions.

    Points of the photo that the other view does not show count too, as in any photometric loss.
    """
    alpha = torch.exp2(said[:, 0].clamp(-4, 8))[:, None, None]
    disparity = alpha * (scenes.pictures[:, 3] + said[:, 1, None, None]) / 100
    total = said.new_zeros(())
    for shrink in (1, 2, 4):
        photo, view = (functional.avg_pool2d(p, shrink) for p in (scenes.pictures[:, :3], scenes.views))
        across = 2 * functional.avg_pool2d(disparity[:, None], shrink)[:, 0]
        n, _, height, width = photo.shape
        grid = functional.affine_grid(torch.eye(2, 3).expand(n, 2, 3), [n, 3, height, width], align_corners=False)
        places = torch.stack([grid[..., 0] - across, grid[..., 1]], dim=3)
        found = functional.grid_sample(view, places, padding_mode="border", align_corners=False)
        total = total + (found - photo).abs().mean()
    return total


def trained(scenes: Scenes, loss: Loss, stereo: bool = False, seed: int = 0) -> Callable[[Scenes], Tensor]:
    """What the network says after the epoch that was best on scenes apart. stereo: it sees the other view too."""

    def seen(given: Scenes) -> Tensor:
        return torch.cat([given.pictures, given.views], dim=1) if stereo else given.pictures

    torch.manual_seed(seed)
    count, end = (int(share * len(scenes.truth)) for share in SPLIT)
    apart = scenes.part(slice(count, end))
    network = Network(7 if stereo else 4, scenes.truth[:count])
    adam = torch.optim.AdamW(network.parameters(), RATE, (0.9, 0.99), weight_decay=0.01)
    schedule = torch.optim.lr_scheduler.OneCycleLR(adam, RATE, EPOCHS * -(-count // BATCH))
    best, kept = np.inf, network.state_dict()
    for _ in range(EPOCHS):
        for chosen in torch.randperm(count).split(BATCH):
            batch = scenes.part(chosen)
            adam.zero_grad()
            loss(network, network(seen(batch)), batch).backward()
            adam.step()
            schedule.step()
        with torch.no_grad():
            error = float(loss(network, network(seen(apart)), apart))
        if error < best:
            best, kept = error, {name: values.clone() for name, values in network.state_dict().items()}
    network.load_state_dict(kept)
    return lambda given: network(seen(given)).detach()
