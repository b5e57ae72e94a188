"""A light field from disk with views made between its own."""

from __future__ import annotations

from collections.abc import Callable, Generator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from iibr_core.inpainting.registry import load_inpainter
from iibr_core.types import GridShape, ReportProgress, ViewOffset, ViewUpdate, ignore_progress

if TYPE_CHECKING:
    from iibr_core.formats.light_fields.multi_view_scene import MultiView
    from iibr_core.generation.dense_field import GivenView
    from iibr_core.generation.given_views import DenseFieldWork


@dataclass(frozen=True, eq=False)
class DenseField:
    """A light field with views between its own. given: those that it has, the middle one first. steps: from one of them
    to the next. views: all, as they are made. work: of reading and making them.
    """

    given: Sequence[GivenView]
    steps: int
    views: Generator[ViewUpdate]
    work: DenseFieldWork


def read_dense(
    field: MultiView,
    grid: GridShape,
    inpaint: str,
    report_progress: ReportProgress = ignore_progress,
    nearest_to: Callable[[], ViewOffset] = lambda: ViewOffset(0.0, 0.0),
) -> DenseField:
    """Read the views of a light field, and begin to make views between them. report_progress: gets the work's share.

    Raises InputError where the views find no places on the grid.
    """
    from iibr_core.formats.light_fields.views import grid_of
    from iibr_core.generation.dense_field import densify, require_steps
    from iibr_core.generation.given_views import DenseFieldWork, read_given_views

    own = grid_of(field)
    steps, inpainter, work = require_steps(own, grid, field.name), load_inpainter(inpaint), DenseFieldWork(own, grid)

    def report(done: float, total: float, doing: str) -> None:
        report_progress(*work.reading(done, total), doing)

    given = read_given_views(field, report)
    return DenseField(given, steps, densify(given, own, grid, inpainter, nearest_to), work)
