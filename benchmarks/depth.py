"""What refinement of depth edges gains, what it costs, and how good the guess without a model is.

    python -m benchmarks.depth --data DATA [--out docs/depth.md]

DATA holds hci_antinous and the Middlebury pairs. What refinement gains on them stands in docs/figures.md.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.report import emit, head, parser_of, row, start, title
from benchmarks.harness.scenes import bench_scenes
from benchmarks.harness.timing import cost_of
from iibr_core.color import encoded_from_stored
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.edges.refine import refine
from iibr_core.depth.pictorial_cues import estimate_from_cues
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation.datasets import find_scenes
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_literal
from iibr_core.training.degradation import blur
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import Disparity, FloatImage, GridShape, ImageSize, Photo, ViewOffset

HELD_OUT = range(6, 14)
"""Procedural scenes that no choice was made by."""
FAULTS: dict[str, Callable[[FloatImage], FloatImage]] = {
    "exact": lambda d: d,
    "blurred by 1 px": lambda d: blur(d, 1.0),
    "by 2 px": lambda d: blur(d, 2.0),
    "by 4 px": lambda d: blur(d, 4.0),
}
ONE_MEGAPIXEL = ImageSize(1000, 1000)
REPEATS = 5
PAIRS = 400_000
LEAST_APART, LEAST_ORDERED, MOST_BELOW_RAMP = 0.1, 0.84, 0.02
SHIFT_PERCENTILES = (10, 30, 50, 70, 90)
"""Of the known disparity, where a guess and a plane are tried to stay still."""
SCALE_SHARES = (0.25, 0.5, 1.0)
"""Of the scale that fits the guess to the known disparity best."""
MOST_GUESSED_PIXELS = 500_000


def main() -> None:
    parser = parser_of(__doc__, "out", data={"required": True})
    options = parser.parse_args()
    emit(report(options.data), options.out)


def report(data: Path) -> Iterator[str]:
    yield title("Depth: refined edges, and the guess without a model", "benchmarks.depth")
    yield "## Refinement\n\nOf soft maps of antinous: [figures](figures.md).\n"
    yield from procedural()
    yield from seconds()
    yield from guess_table(data)


def procedural() -> Iterator[str]:
    """Scenes that nothing was chosen by: mean PSNR of two views each."""
    size, offsets = ImageSize(240, 320), (ViewOffset(-4.0, -4.0), ViewOffset(0.0, 4.0))
    rows: dict[str, list[tuple[float, float]]] = {name: [] for name in FAULTS}
    for seed in HELD_OUT:
        scene = random_scene(np.random.default_rng(20_000 + seed), size, 2.5)
        colors, disparity = render(scene, size, ViewOffset(0.0, 0.0))
        truth = {offset: render(scene, size, offset)[0] for offset in offsets}
        for name, spoil in FAULTS.items():
            soft = spoil(disparity)
            rows[name].append((views_psnr(colors, soft, truth, 9), views_psnr(colors, refine(colors, soft), truth, 9)))
    yield f"PSNR of views of {len(HELD_OUT)} procedural scenes of {size} that no choice was made by:\n"
    yield head("disparity", "`--refine off`", "on")
    for name, pairs in rows.items():
        yield row(name, *(f"{mean:.2f}" for mean in np.mean(pairs, axis=0)))
    yield ""


def views_psnr(colors: FloatImage, disparity: FloatImage, truth: Mapping[ViewOffset, FloatImage], side: int) -> float:
    """Mean PSNR (dB) of the views at some offsets, generated as part of a grid of side x side views."""
    grid = GridShape(side, side)
    photo, given = Photo(colors, float(colors.shape[1]), "scene"), Disparity(disparity, "scene")
    wanted = {}
    for update in generate(photo, given, plan_literal(photo, given, grid)):
        offset = grid.offset(update.row, update.column)
        if offset in truth:
            wanted[offset] = encoded_from_stored(update.colors)
        if len(wanted) == len(truth):
            break
    return float(np.mean([bounded_psnr(wanted[offset], truth[offset]) for offset in truth]))


def seconds() -> Iterator[str]:
    """CPU seconds of all threads tell the same on a busy machine; the clock does not."""
    scene = random_scene(np.random.default_rng(4), ONE_MEGAPIXEL, 2.5)
    colors, disparity = render(scene, ONE_MEGAPIXEL, ViewOffset(0.0, 0.0))
    yield "Time of 1 MP, the least of several; CPU seconds are those of all threads together:\n"
    yield head("what", "s", "CPU s", "figure", "holds")
    for sigma in (0.0, 1.0, 2.0, 4.0, 8.0):
        soft = blur(disparity, sigma)
        wall, cpu = least_seconds(lambda soft=soft: refine(colors, soft))
        what = f"refining edges blurred by {sigma:g} px"
        yield row(what, f"{wall:.2f}", f"{cpu:.2f}", "<= 0.5", yes(min(wall, cpu) <= 0.5))
    wall, cpu = least_seconds(lambda: estimate_from_cues(Photo(colors, 1000.0, "scene")))
    yield row("the guess without a model", f"{wall:.2f}", f"{cpu:.2f}", "", "")
    yield ""


def least_seconds(work: Callable[[], object]) -> tuple[float, float]:
    """By the clock, and of CPU time."""
    costs = [cost_of(work) for _ in range(REPEATS)]
    return min(cost.wall_s for cost in costs), min(cost.cpu_s for cost in costs)


def guess_table(data: Path) -> Iterator[str]:
    """The guess beside a ramp and one plane, on scenes whose disparity is known."""
    yield from ("## The guess without a model", "")
    yield f"Ordered: of pairs of points that differ by more than {LEAST_APART:.0%} of the range of disparities, those"
    yield "whose nearer point is guessed nearer; ramp: by their height in the picture alone. PSNR: of views made from"
    yield "the guess, and from one plane, both at the scale (not 0) and shift that suit them best."
    yield ""
    yield "| scene | ordered: guess | ramp | PSNR dB: guess | one plane | holds |"
    yield "| --- | --- | --- | --- | --- | --- |"
    all_shares = []
    for name, pixels, known, truth in known_depths(data):
        guess = refine(pixels, estimate_from_cues(Photo(pixels, float(pixels.shape[1]), name)).values)
        shares = [share_ordered(values, known) for values in (guess, np.indices(known.shape)[0])]
        all_shares.append(shares)
        holds = shares[0] >= shares[1] - MOST_BELOW_RAMP
        cells = [f"{share:.3f}" for share in shares]
        if truth:
            ratios = best_psnr(pixels, guess, known, truth)
            holds &= ratios[0] >= ratios[1]
            cells += [f"{ratio:.2f}" for ratio in ratios]
        yield f"| {name} | {' | '.join([*cells, '', ''][:4])} | {yes(holds)} |"
    guess_share, ramp_share = np.mean(all_shares, axis=0)
    yield f"| mean | {guess_share:.3f} | {ramp_share:.3f} | | | {yes(guess_share >= LEAST_ORDERED)} |"


def known_depths(data: Path) -> Iterator[tuple[str, FloatImage, FloatImage, Mapping[ViewOffset, FloatImage]]]:
    """Name, photo, its disparity and true views, none of photos that hold their own depth."""
    for scene in find_scenes(data):
        one = bench_scenes(scene, DEFAULT_MAX_PIXELS, with_soft=False)[0]
        yield scene.name, one.photo, one.disparity, one.truth
    for path in sorted(path for path in data.glob("*/*") if path.suffix in (".jpg", ".heic")):
        found = open_with_depth(path, DepthChoice(start="embedded", refine=0.0), MOST_GUESSED_PIXELS)
        if found.origin.kind == "embedded":
            yield path.parent.name, found.photo.pixels, found.disparity.values, {}


def share_ordered(guess: NDArray[Any], known: FloatImage) -> float:
    """Of random pairs of points that are far enough apart in depth, those that a guess (H, W) orders as known (H, W)
    does; equal ones count half.
    """
    places = np.random.default_rng(0).integers(0, known.size, (2, PAIRS))
    low, high = np.percentile(known, (1, 99))
    apart, guessed = (values.ravel()[places[0]] - values.ravel()[places[1]] for values in (known, guess))
    counts = np.abs(apart) > LEAST_APART * (high - low)
    return float(np.mean(0.5 + 0.5 * np.sign(apart[counts]) * np.sign(guessed[counts])))


def best_psnr(
    pixels: FloatImage, guess: FloatImage, known: FloatImage, truth: Mapping[ViewOffset, FloatImage]
) -> tuple[float, float]:
    """PSNR (dB) of views made from a guess and from one plane, each at the best of several scales and shifts."""
    side = 2 * round(max(abs(part) for at in truth for part in at)) + 1
    middle = np.median(guess)
    scale = max(float(np.cov(guess.ravel(), known.ravel())[0, 1] / guess.var()), 0.0)
    best = dict.fromkeys((0.0, *SCALE_SHARES), -np.inf)
    for share in best:
        for shift in np.percentile(known, SHIFT_PERCENTILES):
            candidate = ((guess - middle) * scale * share + shift).astype(np.float32)
            best[share] = max(best[share], views_psnr(pixels, candidate, truth, side))
    return max(best[share] for share in SCALE_SHARES), best[0.0]


def yes(holds: bool) -> str:
    return "yes" if holds else "**no**"


if __name__ == "__main__":
    start("benchmarks.depth", main)
