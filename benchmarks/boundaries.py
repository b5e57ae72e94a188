"""Boundary F1 of maps: whether relative steps of depth lie where the true map has them, at any scale.

Source: Bochkovskii et al., Depth Pro, ICLR 2025, section 4.2: neighbours whose distances differ by more than a ratio
are an edge; precision and recall are means over the four directions, F1 is a mean over ratios from 1.05 to 1.25,
weighted by the ratio. Maps without a scale count as if the farthest true point were 20 times as far as the nearest.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from statistics import mean
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.report import markdown
from benchmarks.scenes import Scene, with_map
from iibr_core.depth.edges.refine import refine
from iibr_core.types import FloatImage

RATIOS = np.linspace(1.05, 1.25, 10)
FARTHEST = 20.0
"""Distance of the farthest true point, in those of the nearest."""


class BoundaryResult(NamedTuple):
    """F1 of a kind of map of a scene, as given and refined."""

    kind: str
    given: float
    refined: float


def judge_boundaries(
    scenes: Iterable[Scene], kinds: Sequence[str], model: Path | None = None
) -> Iterator[BoundaryResult]:
    """Yield the boundary F1 of every kind of map of every scene. Raises InputError for an unknown kind."""
    for scene in scenes:
        for kind in kinds:
            given = with_map(scene, kind, model)
            refined = refine(given.photo, given.disparity, is_enlarged=given.is_enlarged)
            scores = (boundary_f1(values, scene.disparity) for values in (given.disparity, refined))
            yield BoundaryResult(kind, *scores)


def boundary_f1(disparity: FloatImage, truth: FloatImage) -> float:
    """Return the boundary F1 of a map (H, W) against the true one, both in px per view step, 0..1."""
    low, high = float(truth.min()), float(truth.max())
    infinity = low - (high - low) / (FARTHEST - 1)
    maps = [np.maximum(each.astype(np.float64) - infinity, 1e-3 * (high - low) + 1e-9) for each in (disparity, truth)]
    scores = [_f1(_edges(maps[0], ratio), _edges(maps[1], ratio)) for ratio in RATIOS]
    return float(np.average(scores, weights=RATIOS))


def boundary_table(results: Iterable[BoundaryResult]) -> str:
    """Return a table of means over scenes, a row for each kind of map."""
    by_kind: dict[str, list[BoundaryResult]] = {}
    for result in results:
        by_kind.setdefault(result.kind, []).append(result)
    rows = []
    for kind, found in by_kind.items():
        given, refined = mean(each.given for each in found), mean(each.refined for each in found)
        rows.append((kind, f"{given:.3f}", f"{refined:.3f}", f"{refined / given:.2f}" if given else "-"))
    return markdown(("map", "boundary F1 as given", "refined", "refined over given"), rows)


def _edges(inverse: FloatImage, ratio: float) -> list[NDArray[np.bool_]]:
    """Return where the nearer of two neighbours is nearer by more than a ratio: right, left, below, above."""
    across, down = inverse[:, 1:] / inverse[:, :-1], inverse[1:] / inverse[:-1]
    return [across > ratio, across < 1 / ratio, down > ratio, down < 1 / ratio]


def _f1(found: Sequence[NDArray[np.bool_]], true: Sequence[NDArray[np.bool_]]) -> float:
    both = [np.count_nonzero(a & b) for a, b in zip(found, true)]
    precision = mean(n / max(np.count_nonzero(a), 1) for n, a in zip(both, found))
    recall = mean(n / max(np.count_nonzero(b), 1) for n, b in zip(both, true))
    return 2 * precision * recall / (precision + recall) if precision + recall else 0.0
