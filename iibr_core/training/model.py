"""The ray transformer T: the weights of the hypotheses of target rays, from ray coordinates and disparity alone.

Cross-attention of the target ray over its hypotheses (paper, section 3.2), additive: the query comes from the ray and
all its hypotheses pooled, so their order does not matter; keys from each hypothesis. T starts as the closed form, whose
share is the prior, and learns where to depart from it. This is T for training; `inference` runs it without torch.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

from iibr_core.method.ambiguous_rays import FEATURES, SHARE
from iibr_core.method.ray_transformer import MIN_PRIOR, WIDTH


class RayTransformer(nn.Module):
    """Weights (N, K) from features (N, K, FEATURES) and a mask (N, K) of hypotheses in use; every row sums to 1."""

    def __init__(self, width: int = WIDTH) -> None:
        super().__init__()
        self.embed = nn.Sequential(nn.Linear(FEATURES, width), nn.ReLU(), nn.Linear(width, width), nn.ReLU())
        self.key = nn.Linear(width, width)
        self.query = nn.Linear(2 * width, width, bias=False)
        self.score = nn.Linear(width, 1, bias=False)
        nn.init.zeros_(self.score.weight)  # start as the closed form

    def forward(self, features: Tensor, mask: Tensor) -> Tensor:
        """Softmax over the scores of the hypotheses in use; unused ones get 0."""
        embedded = self.embed(features) * mask[..., None]
        mean = embedded.sum(dim=1) / mask.sum(dim=1, keepdim=True).clamp_min(1)
        query = self.query(torch.cat([mean, embedded.amax(dim=1)], dim=-1))
        score = self.score(torch.relu(self.key(embedded) + query[:, None]))[..., 0]
        prior = torch.log(features[..., SHARE].clamp(0, 1) + MIN_PRIOR)
        return torch.softmax((score + prior).masked_fill(~mask, -torch.inf), dim=-1).masked_fill(~mask, 0.0)
