"""What asking the transformer gains, beside what it costs: the figures by which the plan chooses the quality.

    python -m benchmarks.quality_gain [--scenes 36]

On scenes that training draws, with seeds of their own, half of them with spoilt maps, refined as usual. Gain: PSNR of
balanced less fast, whole views. Time: balanced over fast, as the plan predicts it.
"""

from __future__ import annotations

import argparse
from itertools import pairwise

import numpy as np

from iibr_core.depth.refine import refine
from iibr_core.evaluation.metrics import psnr
from iibr_core.generation.cost_model import estimate_costs, measure_parallax
from iibr_core.generation.view_maker import ViewMaker
from iibr_core.training.degradation import degrade
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import GridShape, ImageSize, Quality, ViewOffset

SIZE = ImageSize(240, 320)
FIRST_SEED = 7000
PARALLAX_PX = (4.0, 40.0)
JUDGED = ((1.0, 1.0), (0.0, 1.0), (-0.5, -1.0))
"""Views, as shares of the way to the last."""
RATIOS = (1.0, 1.25, 1.5, 2.0, np.inf)
QUALITIES: tuple[Quality, Quality] = ("fast", "balanced")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=36)
    found = np.array([gain_and_ratio(FIRST_SEED + k) for k in range(parser.parse_args().scenes)])
    print("| balanced takes, times fast | scenes | mean gain, dB | least | most |\n| --- | --- | --- | --- | --- |")
    for low, high in pairwise(RATIOS):
        gains = found[(found[:, 1] >= low) & (found[:, 1] < high), 0]
        if len(gains):
            words = f"{gains.mean():+.2f} | {gains.min():+.2f} | {gains.max():+.2f}"
            print(f"| {low:g} to {high:g} | {len(gains)} | {words} |")


def gain_and_ratio(seed: int) -> tuple[float, float]:
    """Of one scene: what balanced gains over fast, dB, and how many times as long it takes."""
    rng = np.random.default_rng(seed)
    reach = int(rng.choice([1, 2, 4]))
    largest = float(np.exp(rng.uniform(*np.log(PARALLAX_PX)))) / reach
    scene = random_scene(rng, SIZE, largest)
    photo, disparity = render(scene, SIZE, ViewOffset(0.0, 0.0))
    if seed % 2:
        disparity = degrade(disparity, rng, reach)
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


if __name__ == "__main__":
    main()
