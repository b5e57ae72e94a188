"""Ray transformers that lack one thing each, trained as long as the shipped one: 20 minutes of one core in all.

    python -m benchmarks.trained_variants FOLDER --data DATA [--out docs/trained.md] [--drawn 4] [--steps 2500]

Weights that FOLDER has are left alone, a training that was stopped goes on. All are judged as `benchmarks.stages`
judges, beside the shipped one; what a variant leaves out of its batches is left out there, too.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import torch

from benchmarks import plucker
from benchmarks.harness.reports import emit, parser_of, start
from benchmarks.stages import Views, judge, make_views, report
from iibr_core.formats.weights import save_weights
from iibr_core.method.ambiguous_rays import (
    COVERAGE,
    FEATURES,
    INPAINTED,
    LANDS,
    PARALLAX,
    PLAIN,
    PLAIN_SOURCE,
    SHARE,
    UNCOVERED,
    AmbiguousRays,
    UndecidedRays,
    describe_rays,
)
from iibr_core.method.ray_transformer import TrainedWeights
from iibr_core.method.rays import RaySet
from iibr_core.stages import Stages
from iibr_core.training.batches import AS_RENDERED, RayChoice, training_batch
from iibr_core.training.losses import LossWeights
from iibr_core.training.model import RayTransformer
from iibr_core.training.run_files import checkpoint_path
from iibr_core.training.trainer import TrainConfig, TrainingRun
from viewer.cli.train import ENTROPY_WEIGHT

STEPS, SEED, LEARNING_RATE = 2500, 0, 3e-3
"""Of the shipped weights."""
CHECKPOINT_EVERY = 250
LAMBDAS = LossWeights(entropy=ENTROPY_WEIGHT)
COORDINATES_ONLY = [SHARE, LANDS, INPAINTED, PARALLAX, COVERAGE, UNCOVERED, PLAIN]
"""The features of `hypotheses._describe` that know nothing of disparity."""


def with_raw_coordinates(rays: RaySet, ambiguous: AmbiguousRays) -> AmbiguousRays:
    """Behind the features, the paper's: Pluecker coordinates of target and source ray, and disparity; in widths."""
    height, width = rays.view_size
    offsets = rays.arrays.offsets[np.where(ambiguous.mask, ambiguous.source % PLAIN_SOURCE, 0)]
    d = np.where(ambiguous.mask, ambiguous.disparity, 0)
    moved = np.array(ambiguous.offset) - offsets
    y, x = (ambiguous.pixel[:, i, None] - margin for i, margin in enumerate((rays.margins.top, rays.margins.left)))
    x, y = np.broadcast_to(x - width / 2, d.shape), np.broadcast_to(y - height / 2, d.shape)
    target = plucker.line_of_pixel(x, y, ambiguous.offset)
    eye = np.stack([offsets[..., 1], offsets[..., 0], np.zeros_like(d)], -1) * plucker.VIEW_STEP_PX
    pixel = np.stack([x + d * moved[..., 1], y + d * moved[..., 0], np.ones_like(d)], -1)
    source = plucker.line_of(eye, pixel - eye)
    scale = np.r_[1, 1, 1, np.full(3, 1 / width)]
    raw = np.concatenate([target * scale, source * scale, d[..., None]], -1, dtype=np.float32)
    return replace(ambiguous, features=np.concatenate([ambiguous.features, raw], -1))


Describe = Callable[[Any], Any]
"""What T sees (N, K, FEATURES) of the features and the raw coordinates behind them: arrays or tensors."""


def all_features(described: Any) -> Any:
    """Those of the shipped T."""
    return described[..., :FEATURES]


def without_disparity(described: Any) -> Any:
    """The features without those made of disparity."""
    features = all_features(described) + 0
    features[..., [i for i in range(FEATURES) if i not in COORDINATES_ONLY]] = 0
    return features


def raw_coordinates(described: Any) -> Any:
    """The paper's features alone."""
    features, raw = all_features(described) * 0, described[..., FEATURES:]
    features[..., SHARE + 1 : SHARE + 1 + raw.shape[-1]] = raw
    return features


@dataclass(frozen=True)
class TrainedVariant:
    """How T is trained. choice: the rays it learns from. describe: what it sees of them."""

    name: str
    choice: RayChoice = AS_RENDERED
    lambdas: LossWeights = LAMBDAS
    describe: Describe = all_features

    def weights_in(self, folder: Path) -> Path:
        """The file of its weights."""
        return folder / f"{re.sub(r'[^a-z0-9]+', '-', self.name.lower()).strip('-')}.safetensors"

    def swaps(self, folder: Path) -> Mapping[str, object]:
        """What stands in place of names of the core, so that this T is asked, in its own way."""
        weights = TrainedWeights(self.weights_in(folder))

        def describe(rays: RaySet, undecided: UndecidedRays) -> AmbiguousRays:
            described = with_raw_coordinates(rays, describe_rays(rays, undecided))
            return replace(described, features=np.ascontiguousarray(self.describe(described.features)))

        return {
            "generation.view_maker.transformer_for": lambda quality: weights,
            "rendering.view_synthesis.describe_rays": describe,
        }

    def make(self, folder: Path, *scene: Any) -> Views:
        """Views by this T, asked in its own way. scene: as `benchmarks.stages.make_views` takes it."""
        stages = Stages(share_inpainted=self.choice.inpainted)
        with ExitStack() as until_done:
            for name, part in self.swaps(folder).items():
                until_done.enter_context(patch(f"iibr_core.{name}", part))
            return make_views(*scene, stages=stages, hypotheses=self.choice.hypotheses)


TRAINED_VARIANTS = (
    TrainedVariant("T trained again"),
    TrainedVariant("T without disparity encoding", describe=without_disparity),
    TrainedVariant("T from raw Pluecker coordinates", describe=raw_coordinates),
    TrainedVariant("T without entropy loss", lambdas=replace(LAMBDAS, entropy=0.0)),
    TrainedVariant("T with the paper's entropy loss (1, not 0.01)", lambdas=replace(LAMBDAS, entropy=1.0)),
    TrainedVariant("T without EPI loss", lambdas=replace(LAMBDAS, epi=0.0)),
    TrainedVariant("T without inpainted rays", RayChoice(inpainted=False)),
    TrainedVariant("T of 3 hypotheses (6)", RayChoice(hypotheses=3)),
)


def train_missing(folder: Path, steps: int) -> None:
    """Train what the folder lacks. Variants that learn from the same rays share the work of making them."""
    folder.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)  # batches are too small for more
    by_choice: dict[RayChoice, list[TrainedVariant]] = {}
    for variant in TRAINED_VARIANTS:
        if not variant.weights_in(folder).exists():
            by_choice.setdefault(variant.choice, []).append(variant)
    for choice, variants in by_choice.items():
        _train_together(choice, variants, folder, steps)


def _train_together(choice: RayChoice, variants: Sequence[TrainedVariant], folder: Path, steps: int) -> None:
    """As `iibr train` does, from the checkpoints where there are any."""
    runs = []
    for variant in variants:
        config = TrainConfig(steps, SEED, LEARNING_RATE, cosine_decay=True, lambdas=variant.lambdas, device="cpu")
        torch.manual_seed(SEED)
        run = TrainingRun(RayTransformer(), config, checkpoint_path(variant.weights_in(folder)))
        if run.checkpoint.exists():
            run.restore()
        runs.append(run)
    for step in range(min(run.step for run in runs) + 1, steps + 1):
        batch = training_batch(step, SEED, replace(choice, describe=with_raw_coordinates))
        for variant, run in zip(variants, runs):
            if run.step < step:
                run.take_step(replace(batch, features=variant.describe(batch.features)))
                if step % CHECKPOINT_EVERY == 0 or step == steps:
                    run.save()
        if step % CHECKPOINT_EVERY == 0:
            print(f"step {step}: {', '.join(variant.name for variant in variants)}", flush=True)
    for variant, run in zip(variants, runs):
        save_weights(run.model, variant.weights_in(folder), {})


def main() -> None:
    parser = parser_of(__doc__, "out", data={"required": True})
    parser.add_argument("folder", type=Path)
    parser.add_argument("--steps", type=int, default=STEPS)
    parser.add_argument("--drawn", type=int, default=4)
    options = parser.parse_args()
    train_missing(options.folder, options.steps)
    ways = {variant.name: partial(variant.make, options.folder) for variant in TRAINED_VARIANTS}
    words, found = "What each part of the ray transformer is worth", judge(options.data, options.drawn, ways)
    emit(report(words, "benchmarks.trained_variants", found, has_verdict=False), options.out)


if __name__ == "__main__":
    start("benchmarks.trained_variants", main)
