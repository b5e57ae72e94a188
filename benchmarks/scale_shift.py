"""Whether a small network can tell scale and shift of relative disparity from a photo (the paper's alpha and beta).

    python -m benchmarks.scale_shift [--data DATA] [--scenes 2400] [--out docs/scale_shift.md]

true disparity = alpha * relative + beta, with the relative map in 0 .. 1 between its 1st and 99th percentile. All
disparities are those of the outermost view (radius view steps times px per view step), in % of the picture's width.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from benchmarks.scale_shift_network import color, direct, trained
from benchmarks.scale_shift_scenes import REAL, SIZE, SPLIT, Scenes, procedural_scenes, real_scene, same_picture

COLUMNS = "who", "alpha, rms log2", "R2", "beta, rms % of width", "R2 of beta / alpha", "spread"
Says = Callable[[Scenes], Tensor]
"""log2 alpha and beta / alpha (N, 2) of each scene."""

METHOD = """
# Scale and shift of relative disparity, measured

Made by `python -m benchmarks.scale_shift --data DATA`.

The paper refines an estimator's disparity F as D = alpha * F + beta, alpha and beta "predicted by a simple
convolutional neural network"; what it sees and a loss of its own are not given: it trains along with the transformer
through the colour loss and that on the EPIs' slopes. It trains on one set of light fields (Pov-ray), and on those it is
tuned to: scale and shift are there what one rig and one way of placing the zero plane make of a scene. Here the photo
comes without its cameras: the distance between the views is ours to choose, and so is the plane that stays still.

So: does a photo with its relative map tell alpha and beta? Procedural scenes as the transformer trains on, {width} px
wide, {count} of them, {judged} held out; true maps between their 1st and 99th percentile, mildly blurred and noisy, are
the relative ones. The network (47 k weights) sees photo and map and says log2 alpha and beta / alpha. Disparities are
those of the outermost view to one side, in % of the picture's width. R2: share of the variance explained, to about
0.02; 0 is what the mean explains. Spread: standard deviation of the log2 alpha said.
"""
WHO = """
*The rule*: what the product does with relative depth (`depth/align.py`). *Cameras unknown*: who knows all of the scene,
but of the cameras' distance and zero plane only the mean; no picture can tell more. *Sees the other view*: the same
network, given the outermost view too, from which alpha and beta can be seen: that it learns them shows that network,
data and time suffice. *Cameras alike*: the same pictures, every light field with the mean distance and zero plane.
"""
CONCLUSION = """
## What follows

No network is shipped; relative depth goes on getting the parallax that viewing plans for (`plan.TOTAL_PARALLAX`), and
the depth slider and the focus change it.

* The picture does not hold the answer. Cameras farther apart, or another plane that stays still, give the same photo
  and the same relative map. What remains is how much of its scene's depth a picture happens to show: worth 0.07 of 1.12
  in log2 alpha to who knows it, and the network finds 0.01 to 0.02 of that. The same network learns alpha and beta well
  where it sees the other view: the limit is the question, not the network.
* With cameras alike, errors are about three times smaller, of the mean as of the network: that is the narrow draw of
  cameras, a prior of the generator, no knowledge of the photo. Of what is left the network explains 29 %: how much of
  the generator's range of depths the picture shows. That does not help on the real scenes.
* On the real scenes (four are few) the networks say their mean, direct regression with noise that makes it worse; the
  colour loss says 8 % for every scene (less than the mean, as all that is far off costs the same and small values are
  the safest bet). These constants come nearer to the true alpha than the rule because both the generator and stereo
  pairs have large parallax. The rule does not estimate cameras: it chooses a parallax pleasant to look at.
* The viewer would not show the difference: its plan takes any disparity to the same range with its median still
  (`plan_for_viewing`), so alpha and beta cancel. They count where disparity is taken literally, as by `iibr generate`.
  Who knows the true ones gives the disparity itself (`--disparity`).
* The transformer does not need it either: it trains with scale and shift errors (`training/degrade.py`).
* Not tried: real light fields from many known rigs, as there are none here. What can be learnt from those is how people
  place their cameras, a prior too.
"""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, help="folder with the real scenes; without it they are left out")
    parser.add_argument("--scenes", type=int, default=2400)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    torch.set_num_threads(1)
    lines = []
    for line in report(options.data, options.scenes):
        lines.append(line)
        print(line, flush=True)
    if options.out:
        options.out.write_text("\n".join(lines) + "\n", encoding="utf-8")


def report(data: Path | None, count: int) -> Iterator[str]:
    scenes = procedural_scenes(count)
    split, end = (int(share * len(scenes.truth)) for share in SPLIT)
    yield METHOD.strip().format(width=SIZE[1], count=len(scenes.truth), judged=len(scenes.truth) - end)
    yield from ("", "## Procedural scenes, held out", "", *same_picture(), "")
    alike = scenes._replace(truth=scenes.known)
    mean, mean_alike = scenes.truth[:split].mean(dim=0), alike.truth[:split].mean(dim=0)
    network, other_seed, by_color = trained(scenes, direct), trained(scenes, direct, seed=1), trained(scenes, color)
    network_alike = trained(alike, direct)
    judged, judged_alike = scenes.part(slice(end, None)), alike.part(slice(end, None))
    yield from (f"| {' | '.join(COLUMNS)} |", "|" + " --- |" * len(COLUMNS))
    yield figures("the mean of training", judged, lambda given: mean.expand_as(given.truth))
    yield figures("the rule", judged, lambda given: given.rule)
    yield figures("network, direct regression", judged, network)
    yield figures("network, another seed", judged, other_seed)
    yield figures("network, colour loss", judged, by_color)
    yield figures("cameras unknown", judged, lambda given: given.known)
    yield figures("sees the other view, direct", judged, trained(scenes, direct, stereo=True))
    yield figures("sees the other view, colour loss", judged, trained(scenes, color, stereo=True))
    yield figures("cameras alike: the mean", judged_alike, lambda given: mean_alike.expand_as(given.truth))
    yield figures("cameras alike: network, direct", judged_alike, network_alike)
    yield WHO.rstrip()
    if data is not None:
        says: dict[str, Says] = {"the mean": lambda given: mean.expand_as(given.truth), "the rule": lambda g: g.rule}
        says |= {"network": network, "another seed": other_seed, "colour loss": by_color}
        yield from real_scenes(data, says | {"cameras alike": network_alike})
    yield CONCLUSION.rstrip()


def figures(name: str, scenes: Scenes, say: Says) -> str:
    """A row of the table."""
    said = say(scenes)
    error = (said - scenes.truth).square().mean(dim=0)
    explained = 1 - error / scenes.truth.var(dim=0, unbiased=False)
    beta = (beta_of(said) - beta_of(scenes.truth)).square().mean().sqrt()
    spread = said[:, 0].std()
    alpha = f"{error[0].sqrt():.2f} | {explained[0]:z.2f}"
    return f"| {name} | {alpha} | {beta:.1f} | {explained[1]:z.2f} | {spread:.2f} |"


def beta_of(said: Tensor) -> Tensor:
    return torch.exp2(said[:, 0]) * said[:, 1]


def real_scenes(data: Path, says: dict[str, Says]) -> Iterator[str]:
    yield from ("", "## Real scenes", "", "Errors: alpha said, log2 of said / true, and beta said, % of width.", "")
    yield from (f"| scene | true alpha, beta, % | {' | '.join(says)} |", "|" + " --- |" * (len(says) + 2))
    errors: dict[str, list[float]] = {name: [] for name in says}
    for name in REAL:
        scene = real_scene(data, name)
        cells = [f"{2 ** float(scene.truth[0, 0]):.1f}, {float(beta_of(scene.truth)):.1f}"]
        for who, say in says.items():
            said = say(scene)
            errors[who].append(float(said[0, 0] - scene.truth[0, 0]))
            cells.append(f"{errors[who][-1]:+.2f}, {float(beta_of(said) - beta_of(scene.truth)):+.1f}")
        yield f"| {name} | {' | '.join(cells)} |"
    rms = (f"{np.sqrt(np.mean(np.square(values))):.2f}" for values in errors.values())
    yield f"| alpha, rms log2 | | {' | '.join(rms)} |"


if __name__ == "__main__":
    main()
