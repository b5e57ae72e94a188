"""A still picture is summed up in rounds, each with its samples elsewhere in the lens and in the pixel. No GL."""

from __future__ import annotations

import math
from dataclasses import dataclass
from dataclasses import field as dataclass_field

from iibr_core.types import ViewOffset
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.refocus.lens import Lens
from viewer.gpu.refocus.view_sampling import ApertureSample

MAX_ROUNDS = 16
"""Times that a still picture is summed up over, each with its samples elsewhere, at most."""

ROUND_BLUR_PX = 1.5
"""So many rounds are drawn that neighbouring samples are no farther apart than this."""

STILL_SAMPLES = 600
"""More rounds than these samples need are not worth the wait."""

EDGE_ROUNDS = 5
"""Rounds that make the edges of a warped view smooth."""


@dataclass
class Summation:
    """A picture on its way to its best: rounds of samples, all drawn up to sample `at` of round `round`.

    places: in a square of side 1, how far the lattice of samples is moved in each round. samples, few: of this round,
    see `Passes.draw_aperture`. done: samples drawn in all rounds.
    """

    lens: Lens
    size_px: tuple[int, int]
    places: tuple[ViewOffset, ...]
    samples: list[ApertureSample] = dataclass_field(default_factory=list)
    few: dict[ViewOffset, float] = dataclass_field(default_factory=dict)
    round: int = 0
    at: int = 0
    done: int = 0

    @property
    def within_px(self) -> ViewOffset:
        """Where in a pixel this round asks which surface shows."""
        return self.places[self.round]

    @property
    def is_complete(self) -> bool:
        """Whether every round is drawn."""
        return self.round == len(self.places)


def rounds_of(lens: Lens, field: LightFieldTexture) -> int:
    """How often to sum up, until neighbouring samples are close and edges smooth."""
    count = 1
    if lens.aperture_share > 0 and lens.keeps_layers:
        affordable = STILL_SAMPLES // len(lens.samples(field.grid, field.present))
        count = min(math.ceil((lens.widest_blur_px / ROUND_BLUR_PX) ** 2), MAX_ROUNDS, affordable)
    is_warped = field.has_disparity.any() and (lens.has_dolly or not _is_stored(lens.eye, field))
    if lens.aperture_share < 1 and is_warped:
        count = max(count, EDGE_ROUNDS)
    return max(count, 1)


def _is_stored(eye: ViewOffset, field: LightFieldTexture) -> bool:
    row, column = float(eye.t + field.grid.centre[0]), float(eye.s + field.grid.centre[1])
    is_on_grid = 0 <= row < field.grid.rows and 0 <= column < field.grid.columns
    return is_on_grid and row.is_integer() and column.is_integer() and bool(field.present[int(row), int(column)])


def even_places(count: int) -> list[ViewOffset]:
    """Places in a square of side 1, one a round, evenly spread, the first in the middle (the R2 sequence)."""
    return [
        ViewOffset(*((k * step + 0.5) % 1.0 - 0.5 for step in (0.7548776662466927, 0.5698402909980532)))
        for k in range(count)
    ]
