"""Train ray transformers that lack one part each, and compare views made with them: 20 minutes of one core in all.

    python -m benchmarks.trained_variants FOLDER --data DATA [--out docs/trained.md] [--drawn 4] [--steps 2500]

Weights that FOLDER already has are not trained again. Views are judged as `benchmarks.stages` judges them.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import torch

from benchmarks.harness.reports import emit, parser_of, start
from benchmarks.stages import Views, judge, make_views, report
from iibr_core.formats.weights import save_weights
from iibr_core.ray_transformer.inference import TrainedWeights
from iibr_core.ray_transformer.model import RayTransformer
from iibr_core.rendering.hypotheses import COVERAGE, INPAINTED, LANDS, PARALLAX, PLAIN, SHARE, UNCOVERED, AmbiguousRays
from iibr_core.training.batches import training_batch
from iibr_core.training.losses import LossWeights
from iibr_core.training.trainer import TrainConfig, TrainingRun
from iibr_core.types import FloatImage
from viewer.cli.train import ENTROPY_WEIGHT

STEPS, SEED, LEARNING_RATE = 2500, 0, 3e-3
LAMBDAS = LossWeights(entropy=ENTROPY_WEIGHT)
COORDINATES_ONLY = [SHARE, LANDS, INPAINTED, PARALLAX, COVERAGE, UNCOVERED, PLAIN]
"""Features that do not depend on disparity."""


def all_features(features: Any) -> Any:
    """Return features (N, K, FEATURES), arrays or tensors, as they are."""
    return features


def without_disparity(features: Any) -> Any:
    """Return features whose parts made of disparity are 0."""
    kept = features * 0
    kept[..., COORDINATES_ONLY] = features[..., COORDINATES_ONLY]
    return kept


@dataclass(frozen=True)
class TrainedVariant:
    """Name of a transformer, the lambdas of its training, and the function that selects its features."""

    name: str
    lambdas: LossWeights = LAMBDAS
    select: Callable[[Any], Any] = all_features

    def weights_in(self, folder: Path) -> Path:
        """Return the path of its weights."""
        return folder / f"{re.sub(r'[^a-z0-9]+', '-', self.name.lower()).strip('-')}.safetensors"

    def make(self, folder: Path, *scene: Any) -> Views:
        """Return views made with this transformer. scene: arguments of `benchmarks.stages.make_views`."""
        weights = TrainedWeights(self.weights_in(folder))

        def transformer(ambiguous: AmbiguousRays) -> FloatImage:
            return weights(replace(ambiguous, features=self.select(ambiguous.features)))

        with patch("iibr_core.generation.view_maker.transformer_for", lambda quality: transformer):
            return make_views(*scene)


TRAINED_VARIANTS = (
    TrainedVariant("T trained again"),
    TrainedVariant("T without disparity encoding", select=without_disparity),
    TrainedVariant("T without entropy loss", replace(LAMBDAS, entropy=0.0)),
    TrainedVariant("T with the paper's entropy loss (1, not 0.01)", replace(LAMBDAS, entropy=1.0)),
    TrainedVariant("T without EPI loss", replace(LAMBDAS, epi=0.0)),
)


def train_missing(folder: Path, steps: int) -> None:
    """Train the variants whose weights the folder lacks, all on the same batches."""
    folder.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)  # batches are too small for more
    runs = {}
    for variant in TRAINED_VARIANTS:
        if not variant.weights_in(folder).exists():
            torch.manual_seed(SEED)
            config = TrainConfig(steps, SEED, LEARNING_RATE, variant.lambdas)
            runs[variant] = TrainingRun(RayTransformer(), config)
    for step in range(1, steps + 1 if runs else 1):
        batch = training_batch(step, SEED)
        for variant, run in runs.items():
            run.take_step(replace(batch, features=variant.select(batch.features)))
    for variant, run in runs.items():
        save_weights(run.model, variant.weights_in(folder))


def main() -> None:
    parser = parser_of(__doc__, "out", data={"required": True})
    parser.add_argument("folder", type=Path)
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--drawn", type=int, default=4)
    options = parser.parse_args()
    train_missing(options.folder, options.steps)
    ways = {variant.name: partial(variant.make, options.folder) for variant in TRAINED_VARIANTS}
    title, figures = "What each part of the ray transformer is worth", judge(options.data, options.drawn, ways)
    emit(report(title, "benchmarks.trained_variants", figures, has_verdict=False), options.out)


if __name__ == "__main__":
    start("benchmarks.trained_variants", main)
