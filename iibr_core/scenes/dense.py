"""A light field from disk with views made between its own."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass

from iibr_core.beyond.between_views import GivenView, densify, read_given_views, require_steps
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.light_fields.views import grid_of
from iibr_core.inpainting.registry import load_inpainter
from iibr_core.types import GridShape, ViewOffset, ViewUpdate


@dataclass(frozen=True, eq=False)
class DenseField:
    """A light field with views between its own.

    given: the views that it has, the middle one first. steps: number of steps from one of them to the next. views: all
    views, as they are made.
    """

    given: Sequence[GivenView]
    steps: int
    views: Generator[ViewUpdate]


def read_dense(
    field: MultiView,
    grid: GridShape,
    inpaint: str,
    nearest_to: Callable[[], ViewOffset] = lambda: ViewOffset(0.0, 0.0),
) -> DenseField:
    """Read the views of a light field, and begin to make views between them.

    Raises InputError if the views have no places on the grid.
    """
    sparse = grid_of(field)
    steps, inpainter = require_steps(sparse, grid, field.name), load_inpainter(inpaint)
    given = read_given_views(field)
    return DenseField(given, steps, densify(given, sparse, grid, inpainter, nearest_to))
