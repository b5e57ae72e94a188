"""The ray transformer T: the weights of the hypotheses of target rays, from ray coordinates and disparity alone.

Cross-attention of the target ray over its hypotheses (paper, section 3.2): the query comes from the ray and all its
hypotheses pooled, so their order does not matter; keys from each hypothesis. T starts as the closed form, whose share
is the prior, and learns where to depart from it.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch
from torch import Tensor, nn

from iibr_core.contested import FEATURES, SHARE, Contested
from iibr_core.formats.weights_file import load_weights
from iibr_core.types import FloatImage

WIDTH = 32
LEAST_PRIOR = 0.02
"""What the closed form gives nothing may still win."""
RAYS_A_BATCH = 4096
"""Few enough that a batch stays in the cache."""


class RayTransformer(nn.Module):
    """Weights (N, K) from features (N, K, FEATURES) and a mask (N, K) of hypotheses in use; every row sums to 1."""

    def __init__(self, width: int = WIDTH) -> None:
        super().__init__()
        self.embed = nn.Sequential(nn.Linear(FEATURES, width), nn.ReLU(), nn.Linear(width, width), nn.ReLU())
        self.key = nn.Linear(width, width)
        self.query = nn.Linear(2 * width, width)
        last = nn.Linear(width, 1)
        nn.init.zeros_(last.weight)  # start as the closed form
        nn.init.zeros_(last.bias)
        self.score = nn.Sequential(nn.Linear(2 * width, width), nn.ReLU(), last)

    def forward(self, features: Tensor, mask: Tensor) -> Tensor:
        """Softmax over the scores of the hypotheses in use; unused ones get 0."""
        embedded = self.embed(features) * mask[..., None]
        mean = embedded.sum(dim=1) / mask.sum(dim=1, keepdim=True).clamp_min(1)
        pooled = torch.cat([mean, embedded.amax(dim=1)], dim=-1)
        query = self.query(pooled)[:, None].expand(-1, features.shape[1], -1)
        score = self.score(torch.cat([self.key(embedded), query], dim=-1))[..., 0]
        prior = torch.log(features[..., SHARE].clamp(0, 1) + LEAST_PRIOR)
        scores = (score + prior).masked_fill(~mask, -torch.inf)
        return torch.softmax(scores, dim=-1).masked_fill(~mask, 0.0)


class TrainedTransformer:
    """A RayTransformer with weights from a file, called with contested rays. Safe to call from several threads."""

    def __init__(self, path: Path) -> None:
        """Raises InputError for a file that is not such weights."""
        self._model = RayTransformer().eval()
        load_weights(path, self._model)

    def __call__(self, contested: Contested) -> FloatImage:
        """Weights (N, K)."""
        weights = np.zeros(contested.mask.shape, np.float32)
        with torch.inference_mode():
            for first in range(0, len(weights), RAYS_A_BATCH):
                batch = slice(first, first + RAYS_A_BATCH)
                features, mask = torch.from_numpy(contested.features[batch]), torch.from_numpy(contested.mask[batch])
                weights[batch] = self._model(features, mask).numpy()
        return weights
