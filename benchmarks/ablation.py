"""Measure the parts of the ray transformer (the paper's ablation): variants are trained alike, views compared.

    python -m benchmarks ablation [--data DATA] [--steps 500] [--folder FOLDER]

Trained again: as the shipped weights are, but for these steps, and the base of all others. Without disparity
encoding: coverage, share and distance of the hypotheses alone. Closed form: no transformer. Without inpainting
shared by all views: each view fills its own holes. Weights that FOLDER already has are not trained again.
"""

from __future__ import annotations

import re
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import torch

from benchmarks.compare import changes_table, chosen_scenes, command_line, compare
from benchmarks.scenes import Scene
from benchmarks.ways import MakeView
from iibr_core.depth.edges.refine import refine
from iibr_core.formats.weights import save_weights
from iibr_core.method.ambiguous_rays import COVERAGE, INPAINTED, LANDS, PARALLAX, PLAIN, SHARE, UNCOVERED, AmbiguousRays
from iibr_core.method.farthest_views import farthest_views, outer_views, outpainting_margins
from iibr_core.method.ray_transformer import TrainedWeights
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer, finish
from iibr_core.runtime.work import report_progress
from iibr_core.training.batches import training_batch
from iibr_core.training.losses import LossWeights
from iibr_core.training.model import RayTransformer
from iibr_core.training.trainer import TrainConfig, TrainingRun
from iibr_core.types import FloatImage
from viewer.cli.messages import show_progress
from viewer.cli.train import ENTROPY_WEIGHT

SEED, LEARNING_RATE = 0, 3e-3
LAMBDAS = LossWeights(entropy=ENTROPY_WEIGHT)
COORDINATES_ONLY = [SHARE, LANDS, INPAINTED, PARALLAX, COVERAGE, UNCOVERED, PLAIN]
"""Indices of the features that do not depend on disparity."""


def without_disparity(features: Any) -> Any:
    """Return features whose parts made of disparity are 0."""
    kept = features * 0
    kept[..., COORDINATES_ONLY] = features[..., COORDINATES_ONLY]
    return kept


@dataclass(frozen=True)
class Variant:
    """Name of a transformer, weights of its losses, and the function that selects its features."""

    name: str
    lambdas: LossWeights = LAMBDAS
    select: Callable[[Any], Any] = lambda features: features

    def weights_in(self, folder: Path) -> Path:
        """Return the path of its weights."""
        return folder / f"{'-'.join(re.findall('[a-z0-9]+', self.name.lower()))}.safetensors"


BASE = "trained again"
VARIANTS = (
    Variant(BASE),
    Variant("without disparity encoding", select=without_disparity),
    Variant("without entropy loss", replace(LAMBDAS, entropy=0.0)),
    Variant("with the paper's entropy loss (1, not 0.01)", replace(LAMBDAS, entropy=1.0)),
    Variant("without EPI loss", replace(LAMBDAS, epi=0.0)),
)


def main(words: Sequence[str] | None = None) -> None:
    """Train the missing variants and print the table."""
    parser = command_line()
    parser.description = __doc__
    parser.add_argument("--steps", type=int, default=500, help="steps of each training; the shipped weights took 2500")
    parser.add_argument("--folder", type=Path, help="where weights are kept")
    options = parser.parse_args(words)
    scenes = list(chosen_scenes(options))
    with tempfile.TemporaryDirectory() as temporary:
        folder = options.folder or Path(temporary)
        with show_progress("training"):
            train_missing(folder, options.steps)
        ways = {v.name: partial(views_by, v, TrainedWeights(v.weights_in(folder))) for v in VARIANTS}
        ways["closed form"] = partial(views_by, None, None)
        ways["without inpainting shared by all views"] = partial(ways[BASE], shares=False)
        results = list(compare(scenes, ways, options.maps.split(","), options.depth_model))
    print(
        f"{len(scenes)} scenes, {options.steps} steps of training: whole views, edges, holes (dB); time as a factor.\n"
    )
    print(changes_table(results, BASE))


def train_missing(folder: Path, steps: int) -> None:
    """Train the variants whose weights the folder lacks, all on the same batches."""
    folder.mkdir(parents=True, exist_ok=True)
    torch.set_num_threads(1)  # batches are too small for more
    runs = {}
    for variant in VARIANTS:
        if not variant.weights_in(folder).exists():
            torch.manual_seed(SEED)
            runs[variant] = TrainingRun(RayTransformer(), TrainConfig(steps, SEED, LEARNING_RATE, variant.lambdas))
    for step in range(1, steps + 1 if runs else 1):
        report_progress(step, steps, "training")
        batch = training_batch(step, SEED)
        for variant, run in runs.items():
            run.take_step(replace(batch, features=variant.select(batch.features)))
    for variant, run in runs.items():
        save_weights(run.model, variant.weights_in(folder))


def views_by(variant: Variant | None, weights: TrainedWeights | None, scene: Scene, shares: bool = True) -> MakeView:
    """Return views decided by a transformer, None for the closed form. shares: all views show what one inpainted."""

    def transformer(ambiguous: AmbiguousRays) -> FloatImage:
        return weights(ambiguous._replace(features=variant.select(ambiguous.features)))

    disparity, outer = refine(scene.photo, scene.disparity), outer_views(scene.field)
    margins = outpainting_margins(disparity, outer)
    rays = rays_of_photo(scene.photo, disparity, farthest_views(outer), len(outer), margins)
    renderer = Renderer(transformer if weights else None)
    for _ in update(rays, outer if shares else (), renderer):
        pass
    return lambda at: finish(rays, at, renderer.render(rays, at), None).colors


if __name__ == "__main__":
    main()
