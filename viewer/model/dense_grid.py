"""Views between those of a light field from disk: which grids there are to choose from."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

from iibr_core.scenes.scene import Scene, Source, is_same_field
from iibr_core.types import GridShape
from viewer.model.state.jobs import STOPPING, JobProgress

HALVINGS = 3
MOST_ACROSS = 33
"""More views beside each other gain nothing to look at."""


def denser_grids(given: GridShape) -> tuple[GridShape, ...]:
    """Grids that have the given views among theirs, each with half the steps of the one before."""
    denser = (GridShape(*(1 + (views - 1) * 2**times for views in given)) for times in range(1, HALVINGS + 1))
    return tuple(grid for grid in denser if max(given) > 1 and max(grid) <= MOST_ACROSS)


def with_views_between(scene: Scene, grid: GridShape) -> Source:
    """The light field that is open, to be opened with this grid."""
    return replace(scene.source, filled_grid=None if grid == scene.given_grid else grid)


def chosen_grid(scene: Scene, asked: Source | None, jobs: Iterable[JobProgress]) -> GridShape:
    """Of a light field that is open: the grid that was chosen last, perhaps before its views are there.

    asked: what is to be opened. jobs: those under way.
    """
    fills = [job.fills for job in jobs if job.fills is not None and job.doing != STOPPING]
    chosen = next((fill for fill in reversed(fills) if is_same_field(fill, scene.source)), asked)
    if chosen is None or scene.given_grid is None or not is_same_field(chosen, scene.source):
        return scene.grid
    return chosen.filled_grid or scene.given_grid


def next_denser(scene: Scene) -> Source | None:
    """The same with the next denser grid, None where there is none, or the scene is a photo's."""
    grids = denser_grids(scene.given_grid) if scene.given_grid is not None else ()
    return next((with_views_between(scene, grid) for grid in grids if max(grid) > max(scene.grid)), None)
