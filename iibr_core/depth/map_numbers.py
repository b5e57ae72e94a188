"""Meaning of a map's numbers by their distribution: unknown values, and signs that they are distances.

Depth cameras write 0 or 65535 where they measured nothing, in scattered patches, and distances end anywhere; maps of
networks are spread over the whole range. A plane has an inverse depth that is linear in the picture, distances bend.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.guess import box_filter
from iibr_core.formats.maps.reader import BACKGROUND, MapFile
from iibr_core.types import FloatImage

BYTE = 255
SPREAD_SHARES = {"floats": 0.98, "integers": 0.9, "colours": 0.0}
"""Share of the greatest value, 1 for floats, that a map reaches if it was spread over a range: distances end lower."""
FULL_GAP = 0.005
"""Share of the greatest value below which numbers with a common step end that were not spread over the whole range."""
BYTE_STEPS = (256, 257)
"""Steps of 16-bit maps that were made of 8 bits."""
UNKNOWN_END = 65535
"""Number that some cameras' maps, also those stored in more bits, have where nothing was measured."""
MILLIMETRES, MAX_STEP = 1000.0, 64
"""Numbers a metre of a depth camera, and the largest step between them: 5 of TUM (5000 a metre)."""
END_GAP, ZERO_GAP, BYTE_ZERO_GAP = 0.05, 0.005, 0.03
"""Gaps beside a mark for unknown values: below the greatest number, as a share of it, and above 0, as one of the range;
a wider one in 8 bits.
"""
MIN_GAP_LEVELS = 4
"""Smallest ratio of such a gap to the usual one between two values."""
MIN_MARKED_SHARE = 0.001
"""Smallest share of the map that marks of a depth camera or a program cover."""
MIN_MEASURED_LEVELS = 64
"""Smallest number of different values of a depth camera's map; drawn layers have fewer."""
AREA_SHARE = 0.03
"""Share of the width, and of the picture, from which a region is an area such as sky, not a scattered hole."""
SAMPLES, RUN = 192, 9
"""Number of samples along the longer side of a map, and along a run in which straightness is judged."""
MIN_RUN_RATIO, MAX_STEP_SHARE, MIN_RUNS = 1.25, 0.3, 30
"""Smallest ratio of the ends of a run, largest share of it that one step takes, and smallest number of runs."""
BEND_NOISE, SURE_BEND = 0.01, 0.5
"""Bend that noise explains, as a share of a run's height, and the logarithm of a ratio of bends that is certain."""


@dataclass(frozen=True, eq=False)
class MapNumbers:
    """A map of unknown meaning.

    kind: how its numbers are stored, see `MapFile`. values: (H, W) float32, NaN where nothing is known whatever they
    mean. distances: the same in metres if they are distances, inf without a surface. is_normalised: whether they were
    spread over a range. is_measured: whether they look like a depth camera's. per_metre: how many make a metre.
    """

    kind: str
    values: FloatImage
    distances: FloatImage
    is_normalised: bool
    is_measured: bool = False
    per_metre: float = 1.0

    @cached_property
    def bend_evidence(self) -> float:
        """How clearly planes of the scene show distances: beyond 1, the values are distances, below -1 they are not."""
        return 0.0 if self.is_normalised else _bend_evidence(self.values)


def numbers_of(found: MapFile) -> MapNumbers:
    """Return the numbers of a map's file, judged by their distribution."""
    found = _unrotated(found)
    values, is_integer = found.values, found.numbers == "integers"
    if not np.isfinite(values).any():
        return MapNumbers(found.numbers, values, values, is_normalised=False)
    is_deep = is_integer and found.largest > BYTE
    end = np.float32((UNKNOWN_END if np.nanmax(values) == UNKNOWN_END else found.largest) if is_deep else BACKGROUND)
    is_zero = (values == 0) & (not is_integer) if found.is_zero is None else found.is_zero
    is_end = values >= end
    others = values[~is_zero & ~is_end & np.isfinite(values)]
    if not others.size:
        return MapNumbers(found.numbers, values, np.where(values > 0, values, np.float32(np.nan)), is_normalised=False)
    levels = np.unique(others)
    gap = MIN_GAP_LEVELS * np.median(np.diff(levels)) if len(levels) >= MIN_MEASURED_LEVELS else 0.0
    is_end &= not is_deep or end - levels[-1] > max(END_GAP * end, gap)
    low, high = np.percentile(others, (0.1, 99.5))
    is_zero &= low > max((ZERO_GAP if is_deep or not is_integer else BYTE_ZERO_GAP) * high, gap)
    unknown_zeros, unknown_ends = (mask & (not _fills_areas(mask)) for mask in (is_zero, is_end))
    known = np.where(unknown_zeros | unknown_ends, np.float32(np.nan), values)
    step = int(np.gcd.reduce(levels.astype(np.int64))) if is_deep else 1
    is_of_bytes = any(step % size == 0 for size in BYTE_STEPS)
    is_marked = bool(max(unknown_zeros.mean(), unknown_ends.mean()) >= MIN_MARKED_SHARE)
    is_measured = is_deep and is_marked and not is_of_bytes and len(levels) >= MIN_MEASURED_LEVELS
    is_scaled = 1 < step <= MAX_STEP and levels[-1] < (1 - FULL_GAP) * found.largest
    is_spread = not (is_deep and is_end.any()) and _is_spread(found, values)
    is_normalised = is_of_bytes or (is_spread and not is_measured and not is_scaled)
    per_metre = MILLIMETRES * (step if step <= MAX_STEP else 1) if is_integer else 1.0
    distances = np.where(is_end, np.float32(np.inf), known / np.float32(per_metre))
    distances[unknown_ends | ~(values > 0)] = np.nan
    return MapNumbers(found.numbers, known, distances, is_normalised, is_measured, per_metre)


def _unrotated(found: MapFile) -> MapFile:
    """Return a map of 16 bits as stored before its bits were rotated by 3, as SUN RGB-D does."""
    if found.numbers != "integers" or found.largest != UNKNOWN_END:
        return found
    stored = np.nan_to_num(found.values).astype(np.int64)
    # 8.2 m and more are rotated to numbers whose last three bits are small and not 0.
    last_bits = (stored & 7)[stored > 0]
    is_rotated = last_bits.size > MIN_MEASURED_LEVELS and 0 < last_bits.max() <= 3
    return replace(found, values=((stored >> 3) | (stored & 7) << 13).astype(np.float32)) if is_rotated else found


def _is_spread(found: MapFile, values: FloatImage) -> bool:
    """Return whether values were spread over a fixed range: 8 bits, a whole range of integers, 0..1, colours."""
    if found.numbers == "integers" and found.largest <= BYTE:
        return True
    known, least = values[np.isfinite(values)], SPREAD_SHARES[found.numbers] * found.largest
    return bool(known.size and known.min() >= 0 and least <= known.max() <= found.largest)


def _fills_areas(mask: NDArray[np.bool_]) -> bool:
    """Return whether most of a mask (H, W) forms large areas, such as sky.

    Sensors and matching leave out scattered patches, and lines along edges.
    """
    if mask.mean() < AREA_SHARE:
        return False
    # Opening: only areas that hold a whole square survive.
    radius = max(1, round(AREA_SHARE * mask.shape[1] / 2))
    inner = box_filter(mask.astype(np.float32), radius) > 1 - 1e-4
    areas = mask & (box_filter(inner.astype(np.float32), radius) > 1e-6)
    return bool(areas.mean() >= AREA_SHARE and 2 * areas.sum() >= mask.sum())


def _bend_evidence(values: FloatImage) -> float:
    """Return how much straighter 1 / values are than values (H, W), along runs of pixels without an edge."""
    step = max(1, round(max(values.shape) / SAMPLES))
    sampled = np.where(values > 0, values, np.float32(np.nan))[::step, ::step].astype(np.float64)
    share, ratios = np.linspace(0, 1, RUN), []
    for rows in (sampled, sampled.T):
        for gap in {max(1, rows.shape[1] // 6 // RUN), max(1, rows.shape[1] // 3 // RUN)}:
            starts = np.arange(max(rows.shape[1] - gap * (RUN - 1), 0))
            runs = rows[:, starts[:, None] + gap * np.arange(RUN)].reshape(-1, RUN)
            runs = runs[np.isfinite(runs).all(axis=1)]
            height = runs[:, -1:] - runs[:, :1]
            steps = np.diff(runs, axis=1) * np.sign(height)
            is_plane = ((steps >= 0) & (steps <= MAX_STEP_SHARE * np.abs(height))).all(axis=1)
            runs = runs[(height[:, 0] != 0) & is_plane & (runs.max(axis=1) > MIN_RUN_RATIO * runs.min(axis=1))]
            bends = [_bend(form, share) + BEND_NOISE for form in (runs, 1 / runs)]
            ratios.append(np.log(bends[0] / bends[1]))
    joined = np.concatenate(ratios)
    return float(np.median(joined)) / SURE_BEND if joined.size >= MIN_RUNS else 0.0


def _bend(runs: NDArray[np.float64], share: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the mean distance of runs (N, RUN) from the line between their ends, as a share of its height."""
    height = runs[:, -1:] - runs[:, :1]
    return np.asarray(np.abs(runs - runs[:, :1] - height * share).mean(axis=1) / np.abs(height[:, 0]))
