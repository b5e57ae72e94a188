"""Compare ways to make views: decibels, flying pixels and processor time, on any scenes and kinds of maps.

    python -m benchmarks compare [--ways iibr,warp] [--maps exact,soft] [--data DATA] [--drawn 2] [--by scene] ...

Ways are named by how they begin: `iibr`, `plain`, `iibr without` for all stages. Maps: exact; soft (blurred by 2 px);
resampled (from 224 pixels); phone (a third of the size, 8 bits, soft); network-like (drawn faults of a network's);
network (estimated by --depth-model), guess, plane: at the best scale and shift. PSNR is the mean over the views at the
corners and sides of the light field: whole views; what the photo sees; within 3 px of holes; in holes, which are those
of the exact map. Flying pixels stand out from their 5 x 5 median near holes, where the truth's do not, in 10,000.
Seconds of processor time, of all threads, are those of 9 x 9 views, set-up included.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import cv2
import numpy as np
from numpy.typing import NDArray

from benchmarks.report import markdown
from benchmarks.scenes import MAX_PIXELS, Scene, data_scenes, drawn_scene, with_map
from benchmarks.ways import Way, chosen_ways
from iibr_core.color import quantise_as_stored
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.evaluation.warp import reference_warp
from iibr_core.types import FloatImage, ImageSize, InputError, ViewOffset

MIN_FLYING_DIFFERENCE, MAX_CALM_DIFFERENCE = 0.12, 0.06
"""Least difference of a flying pixel from the median around it, and largest one of the truth's."""
TIMED_VIEWS = 4
"""Number of views that are timed: none is a corner, which set-up may have made."""
MAPLESS = "unchanged photo"
"""The way that does not look at the map."""

Mask = NDArray[np.bool_]


class Figures(NamedTuple):
    """PSNR in dB of whole views, of what the photo sees, at edges and in holes; flying pixels in 10,000; seconds."""

    whole: float
    visible: float
    edges: float
    holes: float
    flying: float
    seconds: float


class Result(NamedTuple):
    """Figures of one way on one scene with one kind of map."""

    scene: str
    kind: str
    way: str
    figures: Figures


def main(words: Sequence[str] | None = None) -> None:
    """Run the program."""
    options = command_line().parse_args(words)
    scenes = list(chosen_scenes(options))
    results = list(compare(scenes, chosen_ways(options.ways), options.maps.split(","), options.depth_model))
    print(f"{len(scenes)} scenes: {', '.join(scene.name for scene in scenes)}.\n")
    if options.against:
        print(changes_table(results, options.against))
    else:
        print(scene_table(results) if options.by == "scene" else mean_table(results))


def command_line() -> argparse.ArgumentParser:
    """Return the options of this program."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--ways", default="iibr,plain warp", help="beginnings of their names, by commas")
    parser.add_argument("--maps", default="exact", help="kinds of maps, by commas")
    parser.add_argument("--data", type=Path, help="folder of a scene, or of scenes, with views and a map")
    parser.add_argument("--only", default="", help="scenes of DATA whose names contain one of these words")
    parser.add_argument("--drawn", type=int, help="number of drawn scenes; 2 without DATA, else 0")
    parser.add_argument("--max-pixels", type=int, default=MAX_PIXELS, help="largest size of a photo of DATA")
    parser.add_argument("--depth-model", type=Path, help="ONNX file of the network of `--maps network`")
    parser.add_argument("--by", choices=["mean", "scene"], default="mean", help="rows of the table")
    parser.add_argument("--against", metavar="WAY", help="show the changes from this way instead")
    return parser


def chosen_scenes(options: argparse.Namespace) -> Iterator[Scene]:
    """Yield the scenes that the command line names. Raises InputError if there are none."""
    count = (0 if options.data else 2) if options.drawn is None else options.drawn
    scenes = list(data_scenes(options.data, options.only, options.max_pixels)) if options.data else []
    if not count and not scenes:
        raise InputError(f"{options.data}: no scene with views and a disparity map, such as gt_disp_u00_v00.npy")
    yield from (drawn_scene(seed, largest_px=0.5 + seed % 4) for seed in range(count))
    yield from scenes


def compare(
    scenes: Iterable[Scene], ways: Mapping[str, Way], kinds: Sequence[str], model: Path | None = None
) -> Iterator[Result]:
    """Yield the figures of every way on every kind of map of every scene. Raises InputError for an unknown kind."""
    for make in ways.values():
        _make_views(make, drawn_scene(0, ImageSize(48, 64), sides=[(1, 1)]))  # compiles
    for scene in scenes:
        holes = {at: reference_warp(scene.photo, scene.disparity, at).hole for at in scene.truth}
        for kind in kinds:
            given = with_map(scene, kind, model)
            for name, make in ways.items():
                if name != MAPLESS or kind == kinds[0]:
                    views, seconds = _make_views(make, given)
                    judged = [judge_view(views[at], truth, holes[at]) for at, truth in scene.truth.items()]
                    yield Result(scene.name, kind, name, Figures(*_known_means(judged), seconds))


def _make_views(make: Way, scene: Scene) -> tuple[dict[ViewOffset, FloatImage], float]:
    """Return the judged views as a light field stores them, and the seconds for 81 views."""
    began = time.process_time()
    view = make(scene)
    ready = time.process_time()
    for k in range(1, 2 * TIMED_VIEWS, 2):
        _stored(view(scene.field[k * len(scene.field) // (2 * TIMED_VIEWS)]))
    seconds = ready - began + (time.process_time() - ready) / TIMED_VIEWS * 81
    return {at: _stored(view(at)) for at in scene.truth}, seconds


def _stored(view: FloatImage) -> FloatImage:
    return quantise_as_stored(np.clip(view, 0, 1))


def judge_view(view: FloatImage, truth: FloatImage, hole: Mask) -> tuple[float, ...]:
    """Return the figures of a view (H, W, 3), seconds apart; NaN for a part without pixels."""
    around = _grown(hole, 12)
    flying = around & (_off_median(view) > MIN_FLYING_DIFFERENCE) & (_off_median(truth) < MAX_CALM_DIFFERENCE)
    parts = None, ~_grown(hole, 1), _grown(hole, 3) & ~hole, hole
    share = 1e4 * flying.sum() / around.sum() if around.any() else np.nan
    return (*(bounded_psnr(view, truth, part) for part in parts), float(share))


def _grown(mask: Mask, pixels: int) -> Mask:
    return np.asarray(cv2.dilate(mask.astype(np.uint8), np.ones((2 * pixels + 1,) * 2, np.uint8)) > 0)


def _off_median(picture: FloatImage) -> FloatImage:
    stored = np.round(255 * np.clip(picture, 0, 1)).astype(np.uint8)
    return np.abs(stored.astype(np.float32) - cv2.medianBlur(stored, 5)).max(axis=2) / np.float32(255)


def _known_means(rows: Sequence[Sequence[float]]) -> list[float]:
    """Return the mean of each column over its finite values, NaN if there are none."""
    means: list[float] = np.ma.masked_invalid(rows).mean(axis=0).filled(np.nan).tolist()
    return means


def means(results: Sequence[Result]) -> dict[tuple[str, str], Figures]:
    """Return the means over scenes by kind of map and way."""
    cells: dict[tuple[str, str], list[Figures]] = {}
    for result in results:
        cells.setdefault((result.kind, result.way), []).append(result.figures)
    return {cell: Figures(*_known_means(found)) for cell, found in cells.items()}


def mean_table(results: Sequence[Result]) -> str:
    """Return a table with a row for each kind of map and way."""
    names = "map", "way", "whole, dB", "visible", "edges", "holes", "flying pixels", "seconds"
    rows = (
        (kind, way, *(f"{value:.2f}" for value in found[:4]), f"{found.flying:.1f}", f"{found.seconds:.2f}")
        for (kind, way), found in means(results).items()
    )
    return markdown(names, rows)


def scene_table(results: Sequence[Result]) -> str:
    """Return a table of the PSNR of whole views with a row for each scene, and one of means."""
    columns = means(results)
    names = ("scene", *(way if way == MAPLESS else f"{way}: {kind}" for kind, way in columns))
    rows: dict[str, list[str]] = {}
    for result in results:
        rows.setdefault(result.scene, []).append(f"{result.figures.whole:.2f}")
    rows["mean"] = [f"{figures.whole:.2f}" for figures in columns.values()]
    return markdown(names, ((scene, *cells) for scene, cells in rows.items()))


def changes_table(results: Sequence[Result], against: str) -> str:
    """Return a table of the changes from one way: whole views, edges and holes in dB; time as a factor.

    Raises InputError if that way was not measured.
    """
    found = means(results)
    kinds = list(dict.fromkeys(kind for kind, _ in found))
    if (kinds[0], against) not in found:
        raise InputError(f"--against {against}: is none of the ways that were measured")
    rows: dict[str, list[str]] = {}
    for (kind, way), figures in found.items():
        if way not in (against, MAPLESS):
            base = found[kind, against]
            changes = ", ".join(f"{figures[k] - base[k]:+.2f}" for k in (0, 2, 3))
            rows.setdefault(way, []).append(f"{changes}; x {figures.seconds / base.seconds:.2f}")
    return markdown([f"against {against}", *kinds], ((way, *cells) for way, cells in rows.items()))


if __name__ == "__main__":
    main()
