"""Measures what each stage between map and view is worth: left out alone, on six kinds of maps of many scenes.

    python -m benchmarks.stages --data DATA [--out docs/stages.md] [--drawn 10] [--only STAGE,...]

Kinds: exact; measured, by matching views (of DATA: as they come); soft, blurred by 1, 2 or 4 px; resampled, from a half
or a third of the size or dilated; a phone's, of a third of the size, 8 bits, dilated or not, soft; a network's, small,
soft here more and there less, its edges off by up to 8 px, thin things missing, corners round. Gaps are what a
plain warp of the given map leaves open within the frame, edges what lies within 3 px of them; flying pixels stand out
from their 5 x 5 median within 12 px of gaps, where the truth's do not, in 10,000; texture is the gradient energy of
wide gaps against the truth's. A stage earns its place by 0.05 dB on whole views or 0.1 at edges on the mean of a kind,
if it loses no more than 0.05 on whole views on the mean of any.
"""

from __future__ import annotations

import functools
import math
import multiprocessing
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.bench_scenes import FIELD
from benchmarks.harness.reports import emit, head, holds, is_wanted, parser_of, row, start, title
from iibr_core.color import quantise_as_stored, stored_from_encoded
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.edges.map_alignment import lies_at_corners
from iibr_core.depth.edges.refine import refine
from iibr_core.depth.multi_view.estimate_disparity import estimate_disparity
from iibr_core.evaluation.datasets import find_scenes, read_view
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.evaluation.reference_warp import reference_warp
from iibr_core.evaluation.trials import trial_input, trials_of
from iibr_core.formats.maps.resample import resample_map
from iibr_core.method.photo_views import PhotoViews
from iibr_core.stages import ALL_STAGES, STAGE_NAMES, Stages, stages_without
from iibr_core.training.degradation import blur, quantise
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import FloatImage, ImageSize, ViewOffset

NETWORK = "a network's"
KINDS = ("exact", "measured", "soft", "resampled", "a phone's", NETWORK)
SIZE, FIRST_SEED, DISPARITIES_PX = ImageSize(240, 320), 41_000, (0.5, 4.0)
JUDGED = [ViewOffset(t * v, s * u) for v, u in ((4, 4), (3, 1)) for t in (-1, 1) for s in (-1, 1)]
MOST_PIXELS, MOST_JUDGED = 180_000, 6
"""Largest size of a real scene, and how many of its views are judged."""
EDGE_PX, AROUND_PX, WIDE_PX = 3, 12, 50
STANDS_OUT, CALM = 0.12, 0.06
LEAST_WHOLE_DB, LEAST_EDGE_DB, MOST_LOST_DB = 0.05, 0.1, 0.05

Mask = NDArray[np.bool_]
Views = dict[ViewOffset, FloatImage]
Way = Callable[[FloatImage, FloatImage, Mask | None, Views, Sequence[ViewOffset]], Views]
"""A function that makes views, see `make_views`."""
Judged = tuple[str, dict[str, NDArray[np.float64]]]
"""A kind of map; by what was left out, the figures of a cell."""


def main() -> None:
    parser = parser_of(__doc__, "out", "only", data={"required": True})
    parser.add_argument("--drawn", type=int, default=10)
    options = parser.parse_args()
    names = [name for name in STAGE_NAMES if is_wanted(name, options.only)]
    ways = {name: functools.partial(make_views, stages=stages_without([name])) for name in names}
    emit(report(judge(options.data, options.drawn, ways)), options.out)


def judge(data: Path, drawn_scenes: int, ways: Mapping[str, Way]) -> list[Judged]:
    """Every map of every scene, by the default ("nothing") and by other ways of making views."""
    every = {"nothing": make_views, **ways}
    jobs = [functools.partial(_judge_drawn, seed, every) for seed in range(FIRST_SEED, FIRST_SEED + drawn_scenes)]
    jobs += [functools.partial(_judge_real, data, place, every) for place in range(len(list(find_scenes(data))))]
    with ProcessPoolExecutor(mp_context=multiprocessing.get_context("spawn")) as pool:
        return [of_map for of_scene in pool.map(_call, jobs) for of_map in of_scene]


def report(found: Sequence[Judged]) -> Iterator[str]:
    """Yield one row for each stage: what changes without it, the mean of each kind."""
    counts = {kind: sum(one[0] == kind for one in found) for kind in KINDS}
    maps = ", ".join(f"{count} {kind}" for kind, count in counts.items())
    yield title("What each stage is worth", "benchmarks.stages", f"Maps: {maps}.")
    yield (__doc__ or "").split("\n\n")[2]
    yield "Each cell: whole views, edges, gaps (dB); flying pixels; texture; processor time, as a share. Negative"
    yield "decibels: what is left out gains so much. The first row holds the figures themselves, seconds last.\n"
    yield head("left out", *(kind for kind in KINDS if counts[kind]), "earns its place")
    for name in found[0][1]:
        means = {kind: _mean_change(found, kind, name) for kind in KINDS if counts[kind]}
        stays = "" if name == "nothing" else holds(earns(means.values()))
        yield row(name, *map(_cell, means.values()), stays)


def earns(means: Iterable[NDArray[np.float64]]) -> bool:
    """Whether a stage stays. means: what changes without it, by kind: decibels of whole views, at edges, ..."""
    of_kinds = list(means)
    gains = any(mean[0] <= -LEAST_WHOLE_DB or mean[1] <= -LEAST_EDGE_DB for mean in of_kinds)
    return gains and not any(mean[0] > MOST_LOST_DB for mean in of_kinds)


def _call(job: Callable[[], list[Judged]]) -> list[Judged]:
    return job()


def _mean_change(found: Sequence[Judged], kind: str, stage: str) -> NDArray[np.float64]:
    rows = [(of_stage[stage], of_stage["nothing"]) for of_kind, of_stage in found if of_kind == kind]
    if stage == "nothing":
        return _mean_known([own for own, _ in rows])
    changes = [np.append(own[:5] - whole[:5], own[5] / whole[5] - 1) for own, whole in rows]
    return _mean_known(changes)


def _mean_known(rows: Sequence[Sequence[float] | NDArray[np.float64]]) -> NDArray[np.float64]:
    """By column; NaN where a column is."""
    values = np.array(rows, np.float64)
    counts = np.isfinite(values).sum(axis=0)
    return np.where(counts > 0, np.nansum(values, axis=0) / np.maximum(counts, 1), np.nan)


def _cell(mean: NDArray[np.float64]) -> str:
    whole, edges, gaps, flying, texture, seconds = mean
    return f"{whole:+.2f}, {edges:+.2f}, {gaps:+.2f}; {flying:+.1f}; {texture:+.2f}; {seconds:+.2f}"


def _judge_drawn(seed: int, ways: Mapping[str, Way]) -> list[Judged]:
    rng = np.random.default_rng(seed)
    scene = random_scene(rng, SIZE, float(np.exp(rng.uniform(*np.log(DISPARITIES_PX)))))
    photo, exact = render(scene, SIZE, ViewOffset(0, 0))
    truth = {offset: render(scene, SIZE, offset)[0] for offset in JUDGED}
    offsets = [ViewOffset(0, 0), ViewOffset(0, 1), ViewOffset(0, -1)]
    views = [stored_from_encoded(render(scene, SIZE, offset)[0], False) for offset in offsets]
    measured = estimate_disparity(views, offsets, 0, (float(exact.min()) - 0.2, float(exact.max()) + 0.2))
    maps = {"exact": exact, "measured": measured.astype(np.float32), **_worse(exact, seed)}
    field = [FIELD.offset(row, column) for row, column in np.ndindex(*FIELD)]
    maps[NETWORK] = at_photo_size(photo, network_map(exact, seed))
    return [
        (kind, _figures(photo, exact, values, None, truth, field, _ways_for(kind, ways)))
        for kind, values in maps.items()
    ]


def _judge_real(data: Path, place: int, ways: Mapping[str, Way]) -> list[Judged]:
    scene = list(find_scenes(data))[place]
    trial = trials_of(scene, "auto", MOST_JUDGED)[0]
    given = trial_input(trial, "auto", DepthChoice(), MOST_PIXELS)
    truth = {trial.offset(k): read_view(scene.views[k], MOST_PIXELS) for k in trial.judged}
    own, known = given.maps[0], "exact" if given.maps[0].unknown is None else "measured"
    worse = {**_worse(own.values, place), NETWORK: at_photo_size(given.photo, network_map(own.values, place))}
    maps = {known: (own.values, own.unknown), **{kind: (v, None) for kind, v in worse.items()}}
    return [
        (kind, _figures(given.photo, own.values, values, unknown, truth, list(truth), _ways_for(kind, ways)))
        for kind, (values, unknown) in maps.items()
    ]


def _worse(exact: FloatImage, seed: int) -> dict[str, FloatImage]:
    """Return maps of the kinds that are made of a better map, by kind; each scene has another fault of a kind."""
    step = float(np.ptp(exact)) / 255
    dilated = cv2.dilate(exact, np.ones((3, 3)))
    resampled = (
        lambda: _through(exact, 2, cv2.INTER_LINEAR),
        lambda: _through(exact, 2, cv2.INTER_CUBIC),
        lambda: _through(exact, 3, cv2.INTER_NEAREST),
        lambda: dilated,
        lambda: cv2.dilate(exact, np.ones((5, 5))),
        lambda: _through(exact, 2, cv2.INTER_NEAREST),
    )
    phone = blur(quantise(_through(dilated if seed % 2 else exact, 3, cv2.INTER_LINEAR), step), 1.0)
    made = {"soft": blur(exact, (1.0, 2.0, 4.0)[seed % 3]), "resampled": resampled[seed % 6](), "a phone's": phone}
    return {kind: np.ascontiguousarray(values, np.float32) for kind, values in made.items()}


def network_map(exact: FloatImage, seed: int) -> FloatImage:
    """A map (h, w), smaller than the exact one (H, W), with the faults of a network's; each seed has others."""
    rng, (height, width) = np.random.default_rng(seed), exact.shape
    # Thin things missing and corners round; then edges off, by up to about two standard deviations.
    disc = cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (2 * (seed % 2) + 3,) * 2)
    values = cv2.morphologyEx(cv2.morphologyEx(exact, cv2.MORPH_OPEN, disc), cv2.MORPH_CLOSE, disc)
    off_px = width * (0.002, 0.004, 0.007)[seed % 3]
    rows, columns = np.indices(exact.shape, np.float32)
    down, right = (off_px * _waves(rng, exact.shape, width / 16) for _ in range(2))
    values = cv2.remap(values, columns + right, rows + down, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    times = (2.0, 3.0, 1.5)[seed % 3]
    small = cv2.resize(values, (round(width / times), round(height / times)), interpolation=cv2.INTER_AREA)
    least = (0.5, 0.8, 1.2)[seed // 3 % 3]
    share = 1 / (1 + np.exp(-3 * _waves(rng, small.shape, small.shape[1] / 8)))
    small = share * blur(small, least) + (1 - share) * blur(small, 2 * least + 0.6)
    small = quantise(small, float(np.ptp(exact)) / 255) if seed % 2 else small
    return np.ascontiguousarray(small, np.float32)


def _waves(rng: np.random.Generator, shape: tuple[int, ...], length_px: float) -> FloatImage:
    """Smooth noise (H, W) of standard deviation 1."""
    noise = cv2.GaussianBlur(rng.normal(size=shape), (0, 0), length_px)
    return np.asarray(noise / noise.std(), np.float32)


def at_photo_size(photo: FloatImage, small: FloatImage) -> FloatImage:
    """A map as the search for depth enlarges it."""
    return resample_map(small, ImageSize(*photo.shape[:2]), lies_at_corners(photo, small))


def _ways_for(kind: str, ways: Mapping[str, Way]) -> Mapping[str, Way]:
    if kind != NETWORK:
        return ways
    return {name: functools.partial(way, is_enlarged=True) for name, way in ways.items()}


def _through(values: FloatImage, factor: int, filter_: int) -> FloatImage:
    """Made smaller and larger again."""
    height, width = values.shape
    smaller = cv2.INTER_NEAREST if filter_ == cv2.INTER_NEAREST else cv2.INTER_AREA
    small = cv2.resize(values, (width // factor, height // factor), interpolation=smaller)
    return np.asarray(cv2.resize(small, (width, height), interpolation=filter_), np.float32)


def _figures(
    photo: FloatImage,
    better: FloatImage,
    given: FloatImage,
    unknown: Mask | None,
    truth: Views,
    field: Sequence[ViewOffset],
    ways: Mapping[str, Way],
) -> dict[str, NDArray[np.float64]]:
    """Return the figures by the stage left out. better: the map that decides where gaps are, whatever was given."""
    holes = {offset: reference_warp(photo, better, offset).hole for offset in truth}
    make_views(photo, given, unknown, truth, field)  # compiles
    found = {}
    for name, make in ways.items():
        begun = time.process_time()
        made = make(photo, given, unknown, truth, field)
        seconds = time.process_time() - begun
        found[name] = np.append(_mean_known([judge_view(made[at], truth[at], holes[at]) for at in truth]), seconds)
    return found


def make_views(
    photo: FloatImage,
    given: FloatImage,
    unknown: Mask | None,
    truth: Views,
    field: Sequence[ViewOffset],
    stages: Stages = ALL_STAGES,
    is_enlarged: bool = False,
) -> Views:
    """Return the judged views as a field stores them.

    field: offsets of all its views. is_enlarged: whether the map was smaller than the photo.
    """
    disparity = refine(photo, given, unknown, stages=stages, is_enlarged=is_enlarged)
    views = PhotoViews(photo, disparity, field, stages)
    return {offset: quantise_as_stored(views.view(offset).colors) for offset in truth}


def judge_view(made: FloatImage, truth: FloatImage, hole: Mask) -> list[float]:
    """Whole, edges, gaps, flying pixels, texture; NaN where there is nothing to judge."""
    labels = cv2.connectedComponents(hole.astype(np.uint8))[1]
    at_frame = np.unique(np.concatenate([labels[0], labels[-1], labels[:, 0], labels[:, -1]]))
    beyond = np.isin(labels, at_frame[at_frame > 0])
    gap, edge = hole & ~beyond, _grown(hole, EDGE_PX) & ~hole
    around = _grown(gap, AROUND_PX) & ~_grown(beyond, 2)
    wide = cv2.morphologyEx(gap.astype(np.uint8), cv2.MORPH_OPEN, np.ones((3, 3))) > 0
    flies = around & (_off_median(made) > STANDS_OUT) & (_off_median(truth) < CALM)
    has_texture = wide.sum() > WIDE_PX
    return [
        bounded_psnr(made, truth),
        bounded_psnr(made, truth, edge),
        bounded_psnr(made, truth, gap),
        1e4 * flies.sum() / around.sum() if around.any() else math.nan,
        _gradient(made)[wide].mean() / max(_gradient(truth)[wide].mean(), 1e-6) if has_texture else math.nan,
    ]


def _grown(mask: Mask, pixels: int) -> Mask:
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((2 * pixels + 1,) * 2, np.uint8)) > 0)


def _off_median(picture: FloatImage) -> FloatImage:
    stored = np.round(255 * np.clip(picture, 0, 1)).astype(np.uint8)
    return np.abs(stored.astype(np.float32) - cv2.medianBlur(stored, 5)).max(axis=2) / np.float32(255)


def _gradient(picture: FloatImage) -> FloatImage:
    grey = cv2.cvtColor(np.ascontiguousarray(picture, np.float32), cv2.COLOR_RGB2GRAY)
    return np.hypot(np.diff(grey, axis=1, append=grey[:, -1:]), np.diff(grey, axis=0, append=grey[-1:]))


if __name__ == "__main__":
    start("benchmarks.stages", main)
