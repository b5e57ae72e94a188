"""What asking the ray transformer gains, and how well its entropy tells disocclusions. Minutes on 2 cores.

python -m benchmarks.transformer [--scenes 36] [--out docs/transformer.md]
"""

from __future__ import annotations

import argparse
from itertools import pairwise
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.provenance import made_by
from iibr_core.depth.edges.refine import refine
from iibr_core.evaluation.metrics import psnr
from iibr_core.generation.cost_model import estimate_costs, measure_parallax
from iibr_core.generation.light_field import transformer_for
from iibr_core.generation.view_maker import ViewMaker
from iibr_core.rendering.candidates import find_candidates
from iibr_core.rendering.occlusion import LEAST_COVERED, covered_share, entropy
from iibr_core.rendering.view_synthesis import rays_of_photo
from iibr_core.rendering.visibility_weights import visibility_weights
from iibr_core.training import degradation as faults
from iibr_core.training.batches import ambiguous_rays_of_view
from iibr_core.training.scenes.random_scene import is_visible_from, random_scene, render
from iibr_core.types import FloatImage, GridShape, ImageSize, Quality, ViewOffset

SIZE = ImageSize(240, 320)
FIRST_SEED = 7000
PARALLAX_PX = (4.0, 40.0)
JUDGED = ((1.0, 1.0), (0.0, 1.0), (-0.5, -1.0))
"""Views, as shares of the way to the last."""
RATIOS = (1.0, 1.25, 1.5, 2.0, np.inf)
QUALITIES: tuple[Quality, Quality] = ("fast", "balanced")
MASK_SEED = 1_000_003
MASK_SIZE = ImageSize(160, 192)
MASK_SCENES = 24
THRESHOLDS = (0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=36, help="drawn scenes for what it gains")
    parser.add_argument("--out", type=Path, default=Path("docs/transformer.md"), help="Markdown file to write")
    options = parser.parse_args()
    lines = ["# The ray transformer, measured", "", f"{made_by('benchmarks.transformer')}.", ""]
    lines += ["What each of its parts is worth stands among the [ablations](tables/ablations.md).", ""]
    options.out.write_text("\n".join([*lines, *gains(options.scenes), *masks()]).rstrip("\n") + "\n")


def gains(scenes: int) -> list[str]:
    """The table of what asking T gains: whole views of drawn scenes, by what it costs."""
    found = np.array([gain_and_ratio(FIRST_SEED + k) for k in range(scenes)])
    lines = [
        "## What it gains beside what it costs",
        "",
        f"{scenes} scenes that training draws, with seeds of their own, {SIZE} px, half of them with spoilt maps,",
        "refined as usual. Gain: whole views, balanced less fast. Time: as the plan predicts it.",
        "",
        "| balanced takes, times fast | scenes | mean gain, dB | least | most |",
        "| --- | --- | --- | --- | --- |",
    ]
    for low, high in pairwise(RATIOS):
        in_bin = found[(found[:, 1] >= low) & (found[:, 1] < high), 0]
        if len(in_bin):
            times = f"{low:g} to {high:g}" if np.isfinite(high) else f"{low:g} and more"
            words = f"{in_bin.mean():+.2f} | {in_bin.min():+.2f} | {in_bin.max():+.2f}"
            lines.append(f"| {times} | {len(in_bin)} | {words} |")
    return [*lines, ""]


def gain_and_ratio(seed: int) -> tuple[float, float]:
    """Of one scene: what balanced gains over fast, dB, and how many times as long it takes."""
    rng = np.random.default_rng(seed)
    reach = int(rng.choice([1, 2, 4]))
    largest = float(np.exp(rng.uniform(*np.log(PARALLAX_PX)))) / reach
    scene = random_scene(rng, SIZE, largest)
    photo, disparity = render(scene, SIZE, ViewOffset(0.0, 0.0))
    if seed % 2:
        disparity = faults.degrade(disparity, rng, reach)
    disparity = refine(photo, disparity)
    judged = [ViewOffset(t * reach, s * reach) for t, s in JUDGED]
    corners = [ViewOffset(-float(reach), -float(reach)), ViewOffset(float(reach), float(reach))]
    with ViewMaker(photo, disparity, [*judged, *corners], QUALITIES) as maker:
        truth = [render(scene, SIZE, at)[0] for at in judged]
        errors = [
            [psnr(maker.view(quality, at).colors, true) for at, true in zip(judged, truth)] for quality in QUALITIES
        ]
    costs = estimate_costs(measure_parallax(disparity, reach), GridShape(2 * reach + 1, 2 * reach + 1))
    return float(np.mean(errors[1]) - np.mean(errors[0])), costs.balanced.seconds / costs.fast.seconds


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
    return [*lines, f"| in use: less than {LEAST_COVERED:g} covered | {used[0]} | | {used[1]} | |", ""]


def precision_recall(found: NDArray[np.bool_], true: NDArray[np.bool_]) -> str:
    """As percentages."""
    hits = float((found & true).sum())
    return f"{hits / max(found.sum(), 1):.0%} / {hits / max(true.sum(), 1):.0%}"


def mask_rays(degraded: bool) -> list[NDArray[np.float32]]:
    """Over all rays: closed form's entropy, T's, the mask in use, whether the photo does not see what is there."""
    rng = np.random.default_rng(MASK_SEED)
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
        parts.append((closed, learned, covered_share(weights) < LEAST_COVERED, ~(inside & seen)))
    return [np.concatenate(part) for part in zip(*parts)]


def normalised_entropy(weights: FloatImage, mask: NDArray[np.bool_]) -> FloatImage:
    """(N,) of weights (N, K): 0 where one hypothesis has all, 1 where those in use share alike."""
    with np.errstate(divide="ignore", invalid="ignore"):
        nats = -np.where(weights > 0, weights * np.log(weights), 0).sum(axis=1)
    return (nats / np.log(np.maximum(mask.sum(axis=1), 2))).astype(np.float32)


if __name__ == "__main__":
    main()
