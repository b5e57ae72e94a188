"""How much wrong disparity costs: each fault alone, at growing strength, against PSNR of the views.

    python -m benchmarks.tables.degradation [--scenes 4] [--data DATA]

Scenes are drawn like those that training learns from, by seeds of their own, with exact disparity; views at the corners
and side middles of a 9x9 grid are judged. DATA: light fields with true maps, judged beside them.
Writes docs/tables/degradation.md and its curves.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.refocus import read_views
from benchmarks.tables.report import FOLDER, markdown, write_report
from iibr_core.color import encoded_from_stored
from iibr_core.depth.edges.refine import refine
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.generation.outer_views import outer_views_of_grid
from iibr_core.generation.view_maker import ViewMaker, quantise_as_stored
from iibr_core.training import degradation as faults
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import FloatImage, GridShape, ImageSize, Quality, ViewOffset

SIZE, GRID = ImageSize(240, 320), GridShape(9, 9)
FIRST_SEED = 8000
DISPARITIES_PX = (0.5, 2.0)
QUALITIES: tuple[Quality, ...] = ("fast", "balanced")
REFINED = "balanced, refined"
METHODS = (*QUALITIES, REFINED)

Spoil = Callable[[FloatImage, np.random.Generator, float], FloatImage]


@dataclass(frozen=True)
class Fault:
    """A way of being wrong. strengths: growing; the first is none. axis: what they are, for people."""

    name: str
    axis: str
    strengths: tuple[float, ...]
    spoil: Spoil


@dataclass(frozen=True, eq=False)
class Known:
    """A view with its exact disparity, and others to judge by."""

    name: str
    photo: FloatImage
    disparity: FloatImage
    truths: dict[ViewOffset, FloatImage]


def _outliers(disparity: FloatImage, rng: np.random.Generator, share: float) -> FloatImage:
    """So large a share of pixels has any disparity that the map has somewhere."""
    wild = rng.uniform(disparity.min(), disparity.max(), disparity.shape).astype(np.float32)
    return np.where(rng.random(disparity.shape) < share, wild, disparity)


FAULTS = (
    Fault("noise", "px per view step", (0.0, 0.02, 0.05, 0.1, 0.2, 0.4), lambda d, rng, x: faults.add_noise(d, rng, x)),
    Fault("blur", "sigma, px", (0.0, 0.5, 1.0, 2.0, 4.0), lambda d, _, x: faults.blur(d, x)),
    Fault("scale", "factor - 1", (0.0, 0.02, 0.05, 0.1, 0.2), lambda d, _, x: faults.rescale(d, 1 + x, 0.0)),
    Fault("quantised", "step, px per view step", (0.0, 0.05, 0.1, 0.2, 0.5), lambda d, _, x: faults.quantise(d, x)),
    Fault("fewer pixels", "1 / size", (1.0, 2.0, 3.0, 4.0, 8.0), lambda d, _, x: faults.coarsen(d, int(x))),
    Fault("outliers", "share of pixels", (0.0, 0.001, 0.01, 0.05, 0.1), _outliers),
)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--scenes", type=int, default=4)
    parser.add_argument("--data", type=Path)
    options = parser.parse_args()
    scenes = [drawn(seed, outer_views_of_grid(GRID)) for seed in range(FIRST_SEED, FIRST_SEED + options.scenes)]
    sets = {f"{len(scenes)} drawn scenes": scenes} | {known.name: [known] for known in _read(options.data)}
    curves = {name: {fault.name: _curve(fault, scenes) for fault in FAULTS} for name, scenes in sets.items()}
    _plot(curves)
    parts = [
        f"PSNR in dB, mean over scenes and the 8 outer views of a {GRID.rows}x{GRID.columns} grid. Seeds from"
        f" {FIRST_SEED}; {SIZE} px; largest disparity {DISPARITIES_PX[0]} to {DISPARITIES_PX[1]} px per view step."
        " *refined*: the map drawn to the photo's edges first, as the program does it with maps that it is not told to"
        " take literally.",
        "![curves](degradation.png)",
    ]
    for fault in FAULTS:
        rows = [
            (name, method, *(f"{decibels:.2f}" for decibels in of_methods[method]))
            for name, of_faults in curves.items()
            for of_methods in (of_faults[fault.name],)
            for method in METHODS
        ]
        head = ("of", f"{fault.name}: {fault.axis}", *(f"{strength:g}" for strength in fault.strengths))
        parts.append(markdown(head, rows))
    write_report("degradation", "What wrong disparity costs", parts)


def drawn(seed: int, judged: Iterable[ViewOffset]) -> Known:
    """The scene of a seed, with its views at the offsets to be judged."""
    rng = np.random.default_rng(seed)
    scene = random_scene(rng, SIZE, float(np.exp(rng.uniform(*np.log(DISPARITIES_PX)))))
    photo, disparity = render(scene, SIZE, ViewOffset(0, 0))
    truths = {offset: render(scene, SIZE, offset)[0] for offset in judged}
    return Known(f"scene {seed}", quantise_as_stored(photo), disparity, truths)


def _read(data: Path | None) -> Iterator[Known]:
    for folder in () if data is None else sorted(path.parent for path in data.glob("*/gt_disp_u*.npy")):
        grid, flat = read_views(folder)
        views = flat.reshape(*grid, *flat.shape[1:])
        v, u = grid.centre
        at = {offset: views[v + int(offset.t), u + int(offset.s)] for offset in outer_views_of_grid(grid)}
        truths = {offset: encoded_from_stored(view) for offset, view in at.items()}
        disparity = np.load(next(iter(folder.glob("gt_disp_u*.npy")))).astype(np.float32)
        yield Known(folder.name, encoded_from_stored(views[v, u]), disparity, truths)


def _curve(fault: Fault, scenes: Sequence[Known]) -> dict[str, list[float]]:
    """Decibels at each strength, by method."""
    found: dict[str, list[float]] = {method: [] for method in METHODS}
    for strength in fault.strengths:
        figures = [_judge(known, fault.spoil(known.disparity, np.random.default_rng(1), strength)) for known in scenes]
        for method in METHODS:
            found[method].append(float(np.mean([of_scene[method] for of_scene in figures])))
    print(f"{fault.name}: {found}", flush=True)
    return found


def _judge(known: Known, disparity: FloatImage) -> dict[str, float]:
    as_given = {quality: _decibels(known, disparity, quality) for quality in QUALITIES}
    return {**as_given, REFINED: _decibels(known, refine(known.photo, disparity), "balanced")}


def _decibels(known: Known, disparity: FloatImage, quality: Quality) -> float:
    with ViewMaker(known.photo, disparity, known.truths, (quality,)) as maker:
        return float(
            np.mean([bounded_psnr(maker.view(quality, offset).colors, truth) for offset, truth in known.truths.items()])
        )


def _plot(curves: dict[str, dict[str, dict[str, list[float]]]]) -> None:
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context({"font.size": 8}):
        figure = Figure(figsize=(9, 5), layout="constrained")
        for axis, fault in zip(np.ravel(figure.subplots(2, 3, sharey=True)), FAULTS):
            for name, style in zip(curves, ("-", "--", ":")):
                for method, color in zip(METHODS, ("#64748b", "#c2410c", "#0e7490")):
                    decibels = curves[name][fault.name][method]
                    places = range(len(decibels))
                    axis.plot(places, decibels, style, color=color, marker=".", label=f"{method}, {name}")
            axis.set_xticks(range(len(fault.strengths)), [f"{strength:g}" for strength in fault.strengths])
            axis.set_title(f"{fault.name}: {fault.axis}")
            axis.grid(alpha=0.3)
        figure.supylabel("PSNR, dB")
        figure.legend(*axis.get_legend_handles_labels(), loc="outside lower center", ncols=3)
        figure.savefig(FOLDER / "degradation.png", dpi=110)


if __name__ == "__main__":
    main()
