"""The panel's section for the scene: what its file says of it, where its depth is from, what the plan chose
and why, and what reading it changed.
"""

from __future__ import annotations

from iibr_core.scenes.scene import Scene
from iibr_core.types import GridShape
from viewer.model.action import ask, do
from viewer.model.actions import Action
from viewer.model.dense_grid import chosen_grid, denser_grids, with_views_between
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.filling import FillTask
from viewer.ui.widgets import combo, gap, label, quiet

BETWEEN_TIP = (
    "Makes more views between those on disk, so that the picture moves more smoothly. That may take long; exports have"
    " them, too."
)


def scene_section(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the section; what can be changed in it: views between those of a light field."""
    facts = state.facts
    gap(layout, 2)
    of_file = facts.facts if facts.path == scene.source.path else ()
    for what, value in (*of_file, *_sizes(scene), ("Depth", scene.depth_source)):
        label(what, layout)
        quiet(value)
    gap(layout, 2)
    for reason in scene.plan.reasons if scene.plan else (_of_light_field(scene),):
        quiet(reason)
    for note in scene.notes:
        quiet(note)
    if scene.given_grid is not None and denser_grids(scene.given_grid):
        return _views_between(scene, chosen_grid(scene, state.source, state.jobs), scene.given_grid, layout)
    return []


def _views_between(scene: Scene, chosen: GridShape, given: GridShape, layout: Layout) -> list[Action]:
    """The views on disk alone, or one of the denser grids; what was chosen is shown at once."""
    label("Views", layout, BETWEEN_TIP)
    grids = (given, *denser_grids(given))
    entries = [(_grid_words(grid, given), _grid_tip(grid, given)) for grid in grids]
    picked = combo("views", _grid_words(chosen, given), entries, layout, BETWEEN_TIP)
    is_new = picked is not None and grids[picked] != chosen
    return [do(ask, FillTask(with_views_between(scene, grids[picked or 0])))] if is_new else []


def _grid_tip(grid: GridShape, given: GridShape) -> str:
    new = grid.rows * grid.columns - given.rows * given.columns
    return f"{new} views between those on disk are made." if new else "The views on disk, and no others."


def _grid_words(grid: GridShape, given: GridShape) -> str:
    return f"{grid.columns} x {grid.rows}{', as on disk' if grid == given else ''}"


def _of_light_field(scene: Scene) -> str:
    given = scene.given_grid
    if given is None or given == scene.grid:
        return "A light field from disk: its views are shown as they are."
    return f"A light field of {given.columns} x {given.rows} views from disk; those between are made of all of them."


def _sizes(scene: Scene) -> tuple[tuple[str, str], ...]:
    width, height = scene.own_size or scene.size
    shown = "" if (width, height) == scene.size else f", shown at {scene.width} x {scene.height}"
    return (("Size", f"{width} x {height}{shown}"), ("Colours", scene.color_space.name))
