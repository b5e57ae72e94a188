"""What each part of making views is worth: one switch at a time against the default, error beside processor time.

    python -m benchmarks.tables.ablations --data DATA [--weights FOLDER] [--scenes 3] [--out FILE.md]

Scenes are drawn like those that training learns from, by seeds of their own, with exact maps and with spoilt ones; and
those of DATA (folders as `iibr evaluate` takes them) that have true maps. With FOLDER ray transformers that lack one
thing each are compared instead, for docs/tables/trained.md; those that it does not hold yet are trained first, see
`benchmarks.tables.trained_variants`.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count
from pathlib import Path
from unittest.mock import patch

import numpy as np

from benchmarks.speed.measure import Cost, in_turns, median_ratio
from benchmarks.speed.variants import BenchScene, Variant, bench_scenes, evaluated_views, field_cost
from benchmarks.tables.degradation import GRID, SIZE, drawn
from benchmarks.tables.report import FOLDER, markdown, write_report
from benchmarks.tables.trained_variants import STEPS, TRAINED_VARIANTS, TrainedVariant, train_missing
from iibr_core.depth.edges.refine import refine
from iibr_core.evaluation.consistency import consistency
from iibr_core.evaluation.datasets import find_scenes, read_view
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.evaluation.reference_warp import reference_warp
from iibr_core.evaluation.trials import trials_of
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.generation.view_maker import ViewMaker
from iibr_core.training.degradation import degrade
from iibr_core.types import FloatImage, ViewOffset, ignore_progress

FIRST_SEED = 9000
MOST_VIEWS = 8
ROUNDS = 2
MATTERS_DB = 0.05
JUDGED = tuple(
    ViewOffset(t * share_t, s * share_s)
    for share_t, share_s in ((4.0, 4.0), (3.0, 1.0))
    for t in (-1, 1)
    for s in (-1, 1)
)
"""Views of drawn scenes: the corners of the grid, and four that no ray was added from."""
TRAINED_REPORT = FOLDER / "trained.md"
ABOUT_ROWS = (
    "First row: PSNR in dB, whole views / what the given view does not see (by a plain warp of the exact map). Others:"
    " what the switch changes; more is better. Default: balanced, refined; its numbers in brackets. Drawn scenes: seeds"
    f" from {FIRST_SEED}, {SIZE} px, {GRID.rows}x{GRID.columns} views, {len(JUDGED)} judged."
)
ABOUT_TRAINED = (
    f"Ray transformers, T, were trained by `benchmarks.tables.trained_variants`: {STEPS} steps each, as the shipped"
    " weights, all on the same scenes. *Trained again* lacks nothing: what a row differs from that one by less than it"
    " does from the default may be chance."
)


DEFAULT_VARIANT = Variant("balanced", "balanced")


@dataclass(frozen=True)
class Switch:
    """One part changed. variant: how fields are made. swaps: what else is put in place of names of the core."""

    name: str
    variant: Variant = DEFAULT_VARIANT
    swaps: Mapping[str, object] = field(default_factory=dict)

    @contextmanager
    def applied(self) -> Iterator[None]:
        """With the swaps in place."""
        with ExitStack() as until_done:
            for name, part in self.swaps.items():
                until_done.enter_context(patch(f"iibr_core.{name}", part))
            yield


DEFAULT = Switch("default")
NOTHING_SHARED = Switch(
    "every view fills its own holes", swaps={"generation.view_maker.render_outer_views": lambda *_, **__: iter(())}
)
SWITCHES = (
    DEFAULT,
    Switch("quality fast", replace(DEFAULT_VARIANT, quality="fast")),
    Switch("exact: T is asked for every ray", replace(DEFAULT_VARIANT, asks_every_ray=True)),
    *(Switch(f"{k} candidates a ray (5)", replace(DEFAULT_VARIANT, slots=k)) for k in (1, 3, 6)),
    *(Switch(f"{k} hypotheses for the transformer (6)", replace(DEFAULT_VARIANT, hypotheses=k)) for k in (3, 9)),
    Switch("no refinement of the map", replace(DEFAULT_VARIANT, refined=0.0)),
    NOTHING_SHARED,
)  # fmt: skip


def trained_switch(trained: TrainedVariant, folder: Path) -> Switch:
    """The default with another T, which is told as much of the rays as it was when it learnt."""
    variant = replace(DEFAULT_VARIANT, hypotheses=trained.choice.hypotheses)
    others = {} if trained.choice.inpainted else NOTHING_SHARED.swaps
    return Switch(trained.name, variant, {**others, **trained.swaps(folder)})


Judged = tuple[BenchScene, BenchScene]
"""A scene to make views of, and the same with its exact map, which tells what the given view does not see."""


@dataclass(frozen=True)
class Figures:
    """PSNR in dB of whole views, and of what the given view does not see (NaN where it sees everything)."""

    full_db: float
    hole_db: float


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--weights", type=Path)
    parser.add_argument("--scenes", type=int, default=3)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    exact = [_drawn(seed) for seed in range(FIRST_SEED, FIRST_SEED + options.scenes)]
    spoilt = [replace(scene, disparity=_spoil(scene.disparity, seed)) for seed, scene in enumerate(exact)]
    sets = {
        f"{len(exact)} drawn, exact maps": list(zip(exact, exact)),
        f"{len(exact)} drawn, spoilt maps": list(zip(spoilt, exact)),
        **{scene.name: [(scene, scene)] for scene in _read(options.data)},
    }
    if options.weights:
        train_missing(options.weights, STEPS)
        switches = [DEFAULT, *(trained_switch(trained, options.weights) for trained in TRAINED_VARIANTS)]
        found = _measure_all(switches, sets)
        again = {name: of_sets for name, of_sets in found.items() if name != DEFAULT.name}
        beside_again = f"Beside *{next(iter(again))}*: {unimportant_sentence(again)}"
        parts = [ABOUT_ROWS, markdown(("switch", *sets), table_rows(found)), beside_again, ABOUT_TRAINED]
        write_report(
            "ablations", "What each part of the ray transformer is worth", parts, options.out or TRAINED_REPORT
        )
        return
    found = _measure_all(SWITCHES, sets)
    time = (
        "Time: processor time of the whole field of the first drawn scene, its map spoilt, against the default's,"
        f" median of {ROUNDS} rounds."
    )
    rows = table_rows(found, time_ratios(spoilt[0], SWITCHES))
    parts = [
        f"{ABOUT_ROWS} {time}",
        markdown(("switch", *sets, "time"), rows),
        unimportant_sentence(found),
        _agreement_sentence(exact),
        f"What needs training stands in [{TRAINED_REPORT.name}]({TRAINED_REPORT.name}).",
    ]
    write_report("ablations", "What each part is worth", parts, options.out)


def _measure_all(switches: Sequence[Switch], sets: Mapping[str, Sequence[Judged]]) -> dict[str, dict[str, Figures]]:
    return {switch.name: {name: _mean_figures(switch, scenes) for name, scenes in sets.items()} for switch in switches}


def table_rows(
    found: Mapping[str, Mapping[str, Figures]], ratios: Mapping[str, float] | None = None
) -> Iterator[tuple[str, ...]]:
    """The default's decibels, which is the first; gains over it. ratios: of time, by switch, for a last column."""
    (first, default), *others = found.items()
    yield (
        first,
        *(f"{own.full_db:.2f} / {_word(own.hole_db, '.2f')}" for own in default.values()),
        *([] if ratios is None else ["1.00"]),
    )
    for name, of_sets in others:
        gains = [_gains(of_sets[of], default[of]) for of in default]
        cells = (f"{full:+.2f} / {_word(hole, '+.2f')}" for full, hole in gains)
        yield name, *cells, *([] if ratios is None else [f"{ratios[name]:.2f}"])


def unimportant_sentence(found: Mapping[str, Mapping[str, Figures]]) -> str:
    """Which rows change nothing worth a word, neither in whole views nor in holes, on any of the sets."""
    (_, default), *others = found.items()
    idle = [
        name
        for name, of_sets in others
        if not any(abs(gain) >= MATTERS_DB for of in default for gain in _gains(of_sets[of], default[of]))
    ]
    bound = f"less than {MATTERS_DB:g} dB on every set, in whole views and in holes"
    return f"What does not matter, {bound}: {'; '.join(idle)}." if idle else f"No row changes {bound}."


def _gains(own: Figures, default: Figures) -> tuple[float, float]:
    """Of whole views and of holes."""
    return own.full_db - default.full_db, own.hole_db - default.hole_db


def _word(decibels: float, form: str) -> str:
    return "–" if math.isnan(decibels) else f"{decibels:{form}}"


def _drawn(seed: int) -> BenchScene:
    known = drawn(seed, JUDGED)
    grid = tuple(GRID.offset(*at) for at in np.ndindex(*GRID))
    return BenchScene(known.name, known.photo, known.disparity, known.truths, grid)


def _spoil(disparity: FloatImage, seed: int) -> FloatImage:
    """As training spoils maps; it leaves some alone, those draws are passed over."""
    reach = max(map(max, JUDGED))
    draws = (degrade(disparity, np.random.default_rng((seed, k)), reach) for k in count())
    return next(map_ for map_ in draws if not np.array_equal(map_, disparity))


def _read(data: Path) -> Iterator[BenchScene]:
    """The scenes of a folder that have a true map, with a few of their views, spread over all."""
    for scene in find_scenes(data):
        if any(known.is_truth for known in scene.disparity.values()):
            (made,) = bench_scenes(scene, DEFAULT_MAX_PIXELS, with_soft=False)
            trial = trials_of(scene, "auto", MOST_VIEWS)[0]
            truth = {trial.offset(k): read_view(scene.views[k], DEFAULT_MAX_PIXELS) for k in trial.judged}
            yield replace(made, truth=truth)


def _mean_figures(switch: Switch, scenes: Sequence[Judged]) -> Figures:
    figures = [measure(switch, scene, truth) for scene, truth in scenes]
    mean = Figures(_mean(one.full_db for one in figures), _mean(one.hole_db for one in figures))
    print(f"{switch.name}, {scenes[0][0].name}: {mean}", flush=True)
    return mean


def measure(switch: Switch, scene: BenchScene, truth: BenchScene) -> Figures:
    """Means over the judged views of a scene. truth: the same with its exact map."""
    with switch.applied():
        made = evaluated_views(switch.variant, scene)
    full, hole = [], []
    for at, image in made.items():
        full.append(bounded_psnr(image, truth.truth[at]))
        unseen = reference_warp(truth.photo, truth.disparity, at).hole
        hole.append(bounded_psnr(image, truth.truth[at], unseen))
    return Figures(_mean(full), _mean(hole))


def time_ratios(scene: BenchScene, switches: Sequence[Switch]) -> dict[str, float]:
    """By switch: processor time of a scene's whole field, against the default's."""

    def cost(switch: Switch) -> Cost:
        with switch.applied():
            return field_cost(switch.variant, scene)

    costs = in_turns({switch.name: partial(cost, switch) for switch in switches}, ROUNDS, ignore_progress)
    return {name: median_ratio(own, costs[DEFAULT.name]) for name, own in costs.items()}


def _mean(values: Iterable[float]) -> float:
    """Of what is known; NaN of nothing."""
    known = [value for value in values if not math.isnan(value)]
    return float(np.mean(known)) if known else math.nan


def _agreement_sentence(scenes: Sequence[BenchScene]) -> str:
    """What sharing rays is for, and PSNR cannot tell."""
    shared, own = (_mean(_disagreement(switch, scene) for scene in scenes) for switch in (DEFAULT, NOTHING_SHARED))
    return (
        "Sharing what was filled is there for views that agree, which PSNR does not see: on the drawn scenes with exact"
        f" maps, what was filled differs between two views by {shared:.1f}/255 (rms); where every view fills its own"
        f" holes, by {own:.1f}/255."
    )


def _disagreement(switch: Switch, scene: BenchScene) -> float:
    quality, values = switch.variant.quality, refine(scene.photo, scene.disparity)
    with switch.applied(), ViewMaker(scene.photo, values, scene.field, (quality,)) as maker:
        return consistency(lambda at: maker.view(quality, at), scene.field, scene.photo, values).hole_rms


if __name__ == "__main__":
    main()
