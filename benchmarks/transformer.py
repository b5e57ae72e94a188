"""What each part of the ray transformer is worth, and how well its entropy tells disocclusions. Minutes on 2 cores.

    python -m benchmarks.transformer --data DATA --out docs/transformer.md [--scenes 200] [--steps 1000]

Every variant is trained anew on the same procedural scenes, for a fraction of the shipped weights' steps, and judged on
others and on the scenes of DATA, laid out as `iibr evaluate` takes them: one view is given, others judge.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from benchmarks import plucker
from benchmarks.provenance import made_by
from benchmarks.speed.variants import BenchScene, bench_scenes
from iibr_core.evaluation.datasets import find_scenes
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.generation.light_field import transformer_for
from iibr_core.generation.update_loop import complete_ray_set
from iibr_core.ray_transformer.model import RayTransformer
from iibr_core.rendering.ambiguous_rays import PLAIN, SHARE, AmbiguousRays
from iibr_core.rendering.candidates import find_candidates
from iibr_core.rendering.occlusion import entropy, occlusion_mask
from iibr_core.rendering.ray_set import RaySet
from iibr_core.rendering.view_synthesis import ViewSynthesis, rays_of_photo
from iibr_core.rendering.visibility_weights import visibility_weights
from iibr_core.training import degradation as faults
from iibr_core.training.batches import AS_RENDERED, RayChoice, ambiguous_rays_of_view, training_batch
from iibr_core.training.losses import LossWeights, color_loss, to_perceptual, total_loss
from iibr_core.training.scenes.random_scene import is_visible_from, random_scene, render
from iibr_core.training.trainer import Batch
from iibr_core.types import FloatImage, ImageSize, ViewOffset
from viewer.cli.train import ENTROPY_WEIGHT

HELD_OUT_SEED = 1_000_003
LAMBDAS = LossWeights(entropy=ENTROPY_WEIGHT)
HELD_OUT = 40
LEARNING_RATE = 3e-3
COORDINATES_ONLY = [SHARE, 7, 8, 9, 10, 12, 14]
"""The features of `hypothesis_features._describe_hypotheses` that know nothing of disparity."""
MASK_SIZE = ImageSize(160, 192)
MASK_SCENES = 24
THRESHOLDS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)

Weigh = Callable[[AmbiguousRays], FloatImage]


@dataclass(frozen=True)
class Ablation:
    """One row of the ablations."""

    name: str
    choice: RayChoice = AS_RENDERED
    lambdas: LossWeights = LAMBDAS


def without_disparity(rays: RaySet, ambiguous: AmbiguousRays) -> AmbiguousRays:
    """The features without those made of disparity."""
    features = np.zeros_like(ambiguous.features)
    features[..., COORDINATES_ONLY] = ambiguous.features[..., COORDINATES_ONLY]
    return replace(ambiguous, features=features)


def raw_coordinates(rays: RaySet, ambiguous: AmbiguousRays) -> AmbiguousRays:
    """The paper's features: Pluecker coordinates of target and source ray, and disparity; lengths in widths."""
    height, width = rays.size
    offsets = rays.arrays[0][np.where(ambiguous.mask, ambiguous.source % PLAIN, 0)]
    d = np.where(ambiguous.mask, ambiguous.disparity, 0)
    moved = np.array(ambiguous.offset) - offsets
    y, x = (ambiguous.pixel[:, i, None] for i in (0, 1))
    x, y = np.broadcast_to(x - width / 2, d.shape), np.broadcast_to(y - height / 2, d.shape)
    target = plucker.line_of_pixel(x, y, ambiguous.offset)
    eye = np.stack([offsets[..., 1], offsets[..., 0], np.zeros_like(d)], -1) * plucker.VIEW_STEP_PX
    pixel = np.stack([x + d * moved[..., 1], y + d * moved[..., 0], np.ones_like(d)], -1)
    source = plucker.line_of(eye, pixel - eye)
    scale = np.r_[1, 1, 1, np.full(3, 1 / width)]
    features = np.zeros_like(ambiguous.features)
    features[..., SHARE + 1 : SHARE + 14] = np.concatenate([target * scale, source * scale, d[..., None]], -1)
    return replace(ambiguous, features=features)


ABLATIONS = [
    Ablation("as shipped: K = 6"),
    Ablation("K = 3", RayChoice(hypotheses=3)),
    Ablation("K = 5", RayChoice(hypotheses=5)),
    Ablation("K = 9", RayChoice(hypotheses=9)),
    Ablation("without inpainting", RayChoice(inpainted=False)),
    Ablation("without disparity encoding", RayChoice(describe=without_disparity)),
    Ablation("raw Pluecker coordinates", RayChoice(describe=raw_coordinates)),
    Ablation("without entropy loss", lambdas=replace(LAMBDAS, entropy=0.0)),
    Ablation("with the paper's entropy loss (1)", lambdas=replace(LAMBDAS, entropy=1.0)),
    Ablation("without EPI loss", lambdas=replace(LAMBDAS, epi=0.0)),
]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="folder of evaluation scenes")
    parser.add_argument("--out", type=Path, required=True, help="Markdown file to write")
    parser.add_argument("--scenes", type=int, default=200, help="procedural scenes to train on")
    parser.add_argument("--steps", type=int, default=1000, help="training steps of each variant")
    options = parser.parse_args()
    truths = judges(options.data)
    lines = [
        "# The ray transformer, measured",
        "",
        f"{made_by('benchmarks.transformer')}.",
        "",
        *ablations(truths, options.scenes, options.steps),
        *masks(),
    ]
    options.out.write_text("\n".join(lines) + "\n")


def judges(data: Path) -> list[BenchScene]:
    """The scenes whose disparity is known to be true, with their true views."""
    known = [scene for scene in find_scenes(data) if any(map_.is_truth for map_ in scene.disparity.values())]
    return [bench_scenes(scene, DEFAULT_MAX_PIXELS, with_soft=False)[0] for scene in known]


def ablations(truths: Sequence[BenchScene], scenes: int, steps: int) -> list[str]:
    """The table of variants: gain over the closed form on held-out ambiguous rays, PSNR on ground truth."""
    cached: dict[RayChoice, tuple[list[Batch], list[Batch]]] = {}
    rows = [("closed form", 0.0, [scene_psnr(truth, None, AS_RENDERED) for truth in truths])]
    for variant in ABLATIONS:
        if variant.choice not in cached:
            cached.clear()  # variants of one choice stand together, but for the shipped one's
            cached[variant.choice] = batches_of(variant.choice, scenes)
        train_on, held_out = cached[variant.choice]
        model = train_ablation(train_on, variant.lambdas, steps)
        weigh = weigher(model)
        rows.append(
            (variant.name, held_out_gain(model, held_out), [scene_psnr(t, weigh, variant.choice) for t in truths])
        )
        print(rows[-1], flush=True)
    return [
        "## Ablations",
        "",
        "Held out: gain over the closed form, dB, mean over procedural scenes, ambiguous rays only. Others: full",
        "frame, PSNR in dB, mean over at most 12 views spread over the grid.",
        "",
        "| variant | held out | " + " | ".join(truth.name for truth in truths) + " |",
        "| --- |" + " --- |" * (1 + len(truths)),
        *(f"| {name} | {gain:+.2f} | " + " | ".join(f"{v:.2f}" for v in values) + " |" for name, gain, values in rows),
        "",
    ]


def batches_of(choice: RayChoice, scenes: int) -> tuple[list[Batch], list[Batch]]:
    """Batches to train on and batches held out."""
    train_on = [training_batch(step, 0, choice) for step in range(1, scenes + 1)]
    return train_on, [training_batch(step, HELD_OUT_SEED, choice) for step in range(HELD_OUT)]


def train_ablation(batches: Sequence[Batch], lambdas: LossWeights, steps: int) -> RayTransformer:
    """A model after `steps` steps on random ones of these batches."""
    torch.manual_seed(0)
    model = RayTransformer()
    optimizer = torch.optim.Adam(model.parameters(), LEARNING_RATE, betas=(0.9, 0.99))
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, steps)
    for index in torch.randint(len(batches), (steps,)).tolist():
        batch = batches[index]
        weights = model(batch.features, batch.mask)
        gained = replace(lambdas, color=lambdas.color * batch.color_gain)
        shown, truth = to_perceptual((weights[..., None] * batch.colors).sum(dim=1)), to_perceptual(batch.truth)
        optimizer.zero_grad()
        total_loss(shown, truth, weights, batch.epi_shape, gained).total.backward()
        optimizer.step()
        schedule.step()
    return model.eval()


@torch.no_grad()
def held_out_gain(model: RayTransformer, batches: Sequence[Batch]) -> float:
    """Mean over batches of the gain over the closed form, dB."""
    gains = []
    for batch in batches:
        closed = (batch.features[..., SHARE] + 1e-6) * batch.mask
        errors = [
            color_loss(to_perceptual((weights[..., None] * batch.colors).sum(dim=1)), to_perceptual(batch.truth))
            for weights in (closed / closed.sum(dim=1, keepdim=True), model(batch.features, batch.mask))
        ]
        gains.append(10 * float(torch.log10(errors[0] / errors[1])))
    return float(np.mean(gains))


def weigher(model: RayTransformer) -> Weigh:
    """The model as ViewSynthesis calls it."""

    @torch.no_grad()
    def weigh(ambiguous: AmbiguousRays) -> FloatImage:
        if not len(ambiguous.pixel):
            return ambiguous.mask.astype(np.float32)
        weights: FloatImage = model(torch.from_numpy(ambiguous.features), torch.from_numpy(ambiguous.mask)).numpy()
        return weights

    return weigh


def scene_psnr(truth: BenchScene, weigh: Weigh | None, choice: RayChoice) -> float:
    """Mean PSNR of the views of a scene, rendered as `generate` does, with these weights and rays."""
    offsets = [ViewOffset(float(t * truth.reach), float(s * truth.reach)) for t in (-1, 1) for s in (-1, 1)]
    rays = rays_of_photo(truth.photo, truth.disparity, truth.reach, len(offsets))
    if choice.inpainted:
        complete_ray_set(rays, offsets)
    described = None if weigh is None else lambda ambiguous: weigh(choice.describe(rays, ambiguous))
    with ViewSynthesis(transformer=described, hypotheses=choice.hypotheses) as synthesis:
        views = ((synthesis.render(rays, at).colors, image) for at, image in truth.truth.items())
        return float(np.mean([bounded_psnr(colors, image) for colors, image in views]))


def masks() -> list[str]:
    """Precision and recall of disocclusion, by the entropy of the closed form's weights and by that of T's."""
    lines = [
        "## Entropy as the occlusion mask",
        "",
        f"{MASK_SCENES} held-out procedural scenes, corner views, rays of the photo alone. Truth: what the photo",
        "does not see. T: its normalised entropy where T runs, the closed form's elsewhere. Precision / recall.",
        "",
        "| threshold | exact maps: closed form | T | degraded maps: closed form | T |",
        "| --- | --- | --- | --- | --- |",
    ]
    measured = [mask_rays(degraded) for degraded in (False, True)]
    for threshold in THRESHOLDS:
        cells = [
            precision_recall(by > threshold, hidden)
            for closed, learned, _, hidden in measured
            for by in (closed, learned)
        ]
        lines.append(f"| {threshold} | " + " | ".join(cells) + " |")
    used = [precision_recall(mask, hidden) for _, _, mask, hidden in measured]
    return [*lines, f"| in use (occlusion.py) | {used[0]} | | {used[1]} | |", ""]


def precision_recall(found: NDArray[np.bool_], true: NDArray[np.bool_]) -> str:
    """As percentages."""
    hits = float((found & true).sum())
    return f"{hits / max(found.sum(), 1):.0%} / {hits / max(true.sum(), 1):.0%}"


def mask_rays(degraded: bool) -> list[NDArray[np.float32]]:
    """Over all rays: closed form's entropy, T's, the mask in use, whether the photo does not see what is there."""
    rng = np.random.default_rng(HELD_OUT_SEED)
    weigh = transformer_for("balanced")
    assert weigh is not None
    parts = []
    for _ in range(MASK_SCENES):
        scene = random_scene(rng, MASK_SIZE, 2.0)
        colors, exact = render(scene, MASK_SIZE, ViewOffset(0.0, 0.0))
        given = faults.add_noise(faults.blur(exact, 1.0), rng, 0.05) if degraded else exact
        rays = rays_of_photo(colors, given, 4, 0)
        offset = ViewOffset(*(float(v) for v in rng.choice([-4, 4], 2)))
        weights = visibility_weights(find_candidates(rays, offset, (0, MASK_SIZE[0])))
        closed = entropy(weights)
        ambiguous = ambiguous_rays_of_view(rays, offset, (0, MASK_SIZE[0]), False)
        learned = closed.copy()
        learned[ambiguous.pixel[:, 0], ambiguous.pixel[:, 1]] = normalised_entropy(weigh(ambiguous), ambiguous.mask)
        y, x = np.indices(MASK_SIZE)
        true = render(scene, MASK_SIZE, offset)[1]
        source_x, source_y = x + true * offset.s, y + true * offset.t
        inside = (source_x >= 0) & (source_x < MASK_SIZE[1]) & (source_y >= 0) & (source_y < MASK_SIZE[0])
        seen = is_visible_from(scene, x.ravel(), y.ravel(), true.ravel(), offset).reshape(MASK_SIZE)
        parts.append((closed, learned, occlusion_mask(weights), ~(inside & seen)))
    return [np.concatenate(part) for part in zip(*parts)]


def normalised_entropy(weights: FloatImage, mask: NDArray[np.bool_]) -> FloatImage:
    """(N,) of weights (N, K): 0 where one hypothesis has all, 1 where those in use share alike."""
    with np.errstate(divide="ignore", invalid="ignore"):
        nats = -np.where(weights > 0, weights * np.log(weights), 0).sum(axis=1)
    return (nats / np.log(np.maximum(mask.sum(axis=1), 2))).astype(np.float32)


if __name__ == "__main__":
    main()
