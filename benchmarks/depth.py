"""Measures what refinement of depth edges gains and costs, and how good the guess without a model is.

    python -m benchmarks.depth --data DATA [--out docs/depth.md]

DATA holds hci_antinous, the Middlebury pairs, and photos that hold depth of their own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.bench_scenes import FIELD, BenchScene, data_scenes, drawn_scene, photo_scene
from benchmarks.harness.reports import emit, head, holds, parser_of, row, start, title
from benchmarks.harness.timing import cost_of
from iibr_core.color import quantise_as_stored
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.edges.refine import refine
from iibr_core.depth.pictorial_cues import estimate_from_cues
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.evaluation.reference_warp import reference_warp
from iibr_core.method.photo_views import PhotoViews
from iibr_core.training.degradation import blur
from iibr_core.types import FloatImage, ImageSize, ViewOffset

HELD_OUT = range(6, 14)
"""Held-out drawn scenes: no parameter was chosen by them."""
DRAWN_SIZE, JUDGED = ImageSize(240, 320), (ViewOffset(-4.0, -4.0), ViewOffset(0.0, 4.0))
FAULTS: dict[str, Callable[[FloatImage], FloatImage]] = {
    "exact": lambda d: d,
    "edges blurred by 1 px": lambda d: blur(d, 1.0),
    "by 2 px": lambda d: blur(d, 2.0),
    "by 4 px": lambda d: blur(d, 4.0),
    "half resolution": lambda d: resize(resize(d, 0.5), 2.0),
}
ONE_MEGAPIXEL, MOST_S, REPEATS = ImageSize(1000, 1000), 0.5, 5
PAIRS = 400_000
LEAST_APART, LEAST_ORDERED, MOST_BELOW_RAMP = 0.1, 0.84, 0.02
SHIFT_PERCENTILES = (10, 30, 50, 70, 90)
"""Percentiles of the known disparity at which a guess and a plane are tried to stay still."""
SCALE_SHARES = (0.25, 0.5, 1.0)
"""Shares of the scale that fits the guess to the known disparity best."""
MOST_GUESSED_PIXELS = 500_000


def main() -> None:
    parser = parser_of(__doc__, "out", data={"required": True})
    options = parser.parse_args()
    emit(report(options.data), options.out)


def report(data: Path) -> Iterator[str]:
    yield title("Depth: refined edges, and the guess without a model", "benchmarks.depth")
    yield from refinement(data)
    yield from seconds()
    yield from guess_table(data)


def refinement(data: Path) -> Iterator[str]:
    """PSNR of the views of maps at fault: a plain warp, and the light field with its edges as they are and refined."""
    drawn = [drawn_scene(20_000 + seed, DRAWN_SIZE, 2.5, FIELD, JUDGED) for seed in HELD_OUT]
    sets = {f"{len(drawn)} drawn": drawn}
    for scene in data_scenes(data, with_soft=False):
        if scene.grid == FIELD:
            sets[scene.name] = [scene]
    yield f"## Refinement\n\nPSNR of views, dB; drawn scenes of {DRAWN_SIZE} that were held out.\n"
    yield head("disparity", *(f"{name}: {way}" for name in sets for way in ("plain warp", "`--refine off`", "on")))
    for fault, spoil in FAULTS.items():
        means = (
            np.mean([in_three_ways(scene, spoil(scene.disparity)) for scene in of], axis=0) for of in sets.values()
        )
        yield row(fault, *(f"{mean:.2f}" for mean in np.concatenate(list(means))))
    yield ""


def in_three_ways(scene: BenchScene, soft: FloatImage) -> tuple[float, float, float]:
    """Warped, made of the map, made of the refined map."""
    warped = [bounded_psnr(reference_warp(scene.photo, soft, at).colors, true) for at, true in scene.truth.items()]
    refined = refine(scene.photo, soft)
    return float(np.mean(warped)), views_psnr(scene, soft), views_psnr(scene, refined)


def views_psnr(scene: BenchScene, disparity: FloatImage) -> float:
    """Mean PSNR (dB) of a scene's judged views, made with another disparity."""
    views = PhotoViews(scene.photo, disparity, scene.field)
    return float(
        np.mean([bounded_psnr(quantise_as_stored(views.view(at).colors), true) for at, true in scene.truth.items()])
    )


def resize(values: FloatImage, factor: float) -> FloatImage:
    """(H, W) or (H, W, 3), bilinearly."""
    return np.asarray(cv2.resize(values, None, fx=factor, fy=factor, interpolation=cv2.INTER_LINEAR), np.float32)


def seconds() -> Iterator[str]:
    """Yield times by the clock, and in CPU seconds of all threads, which other programs disturb less."""
    scene = drawn_scene(4, ONE_MEGAPIXEL, 2.5)
    colors, disparity = scene.photo, scene.disparity
    yield "Time for 1 MP, minimum of several runs; CPU seconds are the sum over threads:\n"
    yield head("what", "s", "CPU s", "figure", "holds")
    for sigma in (0.0, 1.0, 2.0, 4.0, 8.0):
        yield refining_row(f"refining edges blurred by {sigma:g} px", colors, blur(disparity, sigma))
    demo, demo_map = one_megapixel_demo()
    yield refining_row("refining the demo photo's, blurred by 2 px", demo, blur(demo_map, 2.0))
    wall, cpu = least_seconds(lambda: estimate_from_cues(scene.given[0]))
    yield row("the guess without a model", f"{wall:.2f}", f"{cpu:.2f}", "", "") + "\n"


def refining_row(what: str, colors: FloatImage, soft: FloatImage) -> str:
    """Seconds of refining a map."""
    wall, cpu = least_seconds(lambda: refine(colors, soft))
    return row(what, f"{wall:.2f}", f"{cpu:.2f}", f"<= {MOST_S}", holds(min(wall, cpu) <= MOST_S))


def one_megapixel_demo() -> tuple[FloatImage, FloatImage]:
    """The demo photo and its map, enlarged."""
    demo = photo_scene(choice=DepthChoice(refine=False))
    assert demo is not None
    factor = (ONE_MEGAPIXEL.height * ONE_MEGAPIXEL.width / demo.disparity.size) ** 0.5
    return resize(demo.photo, factor), resize(demo.disparity, factor)


def least_seconds(work: Callable[[], object]) -> tuple[float, float]:
    """By the clock, and of CPU time."""
    costs = [cost_of(work) for _ in range(REPEATS)]
    return min(cost.wall_s for cost in costs), min(cost.cpu_s for cost in costs)


def guess_table(data: Path) -> Iterator[str]:
    """The guess beside a ramp and one plane, on scenes whose disparity is known."""
    yield f"""## The guess without a model

Ordered: share of the point pairs with the nearer point guessed nearer, among pairs whose disparities differ by more
than {LEAST_APART:.0%} of the range. Ramp: the same for height in the picture alone. PSNR: of views made from the
guess and from one plane, each at its best scale (not 0) and shift.
"""
    yield head("scene", "ordered: guess", "ramp", "PSNR dB: guess", "one plane", "holds")
    all_shares = []
    for scene in known_depths(data):
        photo, known = scene.photo, scene.disparity
        guess = refine(photo, estimate_from_cues(scene.given[0]).values)
        shares = [share_ordered(values, known) for values in (guess, np.indices(known.shape)[0])]
        all_shares.append(shares)
        is_good, ratios = shares[0] >= shares[1] - MOST_BELOW_RAMP, ["", ""]
        if scene.truth:
            ours, plane = best_psnr(scene, guess)
            is_good, ratios = is_good and ours >= plane, [f"{ours:.2f}", f"{plane:.2f}"]
        yield row(scene.name, *(f"{share:.3f}" for share in shares), *ratios, holds(bool(is_good)))
    mean = np.mean(all_shares, axis=0)
    yield row("mean", *(f"{share:.3f}" for share in mean), "", "", holds(bool(mean[0] >= LEAST_ORDERED)))


def known_depths(data: Path) -> Iterator[BenchScene]:
    """Scenes with true views, and photos that hold their own depth, without."""
    yield from data_scenes(data, with_soft=False)
    for path in sorted(path for path in data.glob("*/*") if path.suffix in (".jpg", ".heic")):
        found = open_with_depth(path, DepthChoice(start="embedded", refine=False), MOST_GUESSED_PIXELS)
        if found.origin.kind == "embedded":
            yield BenchScene(path.parent.name, found.photo.pixels, found.disparity.values, {}, ())


def share_ordered(guess: NDArray[Any], known: FloatImage) -> float:
    """Return the share of random pairs of points, far enough apart in depth, that a guess (H, W) orders as the known
    map (H, W) does; equal ones count half.
    """
    places = np.random.default_rng(0).integers(0, known.size, (2, PAIRS))
    low, high = np.percentile(known, (1, 99))
    apart, guessed = (values.ravel()[places[0]] - values.ravel()[places[1]] for values in (known, guess))
    counts = np.abs(apart) > LEAST_APART * (high - low)
    return float(np.mean(0.5 + 0.5 * np.sign(apart[counts]) * np.sign(guessed[counts])))


def best_psnr(scene: BenchScene, guess: FloatImage) -> tuple[float, float]:
    """PSNR (dB) of views made from a guess and from one plane, each at the best of several scales and shifts."""
    known, middle = scene.disparity, np.median(guess)
    scale = max(float(np.cov(guess.ravel(), known.ravel())[0, 1] / guess.var()), 0.0)
    best = dict.fromkeys((0.0, *SCALE_SHARES), -np.inf)
    for share in best:
        for shift in np.percentile(known, SHIFT_PERCENTILES):
            candidate = ((guess - middle) * scale * share + shift).astype(np.float32)
            best[share] = max(best[share], views_psnr(scene, candidate))
    return max(best[share] for share in SCALE_SHARES), best[0.0]


if __name__ == "__main__":
    start("benchmarks.depth", main)
