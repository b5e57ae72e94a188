"""The panel's section for the scene: what its file says of it, where its depth is from, what the plan chose and why."""

from __future__ import annotations

from iibr_core.inpainting.registry import INPAINTERS
from iibr_core.types import GridShape
from viewer.model.actions import Action, OpenPath, SetInpainter
from viewer.model.dense_field import chosen_grid, denser_grids, with_views_between
from viewer.model.layout import Layout
from viewer.model.state.photo_facts import FactsRead
from viewer.model.state.scene import Scene, Source
from viewer.ui.widgets import combo, gap, label, last_part, quiet

HOLES_TIP = (
    "What fills the places that the photo never saw: background goes on smoothly from what lies behind, patch gives it"
    " texture from around. The views are made anew."
)
INPAINTER_TIPS = {
    "background": "Background goes on smoothly from what lies behind: quick, and nearest to true views.",
    "patch": "Background with texture from around: slower, and less smooth.",
}
MODEL_TIP = "A model of yours paints them: in seconds a view on a GPU, in minutes without one."
BETWEEN_TIP = (
    "Makes views between those on disk, of all that these see. First their disparity is found, where the files have"
    " none: that takes longest. Exports take them along."
)


def scene_section(scene: Scene, asked: Source | None, facts: FactsRead, layout: Layout) -> list[Action]:
    """Build the section; what can be changed in it: a photo's ways to fill holes, views between a light field's.

    asked: what was asked for last.
    """
    gap(layout, 2)
    of_file = facts.facts if facts.path == scene.source.path else ()
    for what, value in (*of_file, *_sizes(scene), ("Depth", scene.depth_source)):
        label(what, layout)
        quiet(value)
    gap(layout, 2)
    for reason in scene.plan.reasons if scene.plan else (_of_light_field(scene),):
        quiet(reason)
    if scene.given_grid is not None and denser_grids(scene.given_grid):
        return _views_between(scene, asked, scene.given_grid, layout)
    return _holes(scene, layout) if scene.plan is not None and scene.plan.has_disocclusion else []


def _holes(scene: Scene, layout: Layout) -> list[Action]:
    """The ways of inpainting that need no model, and the one that the photo was opened with."""
    chosen = scene.source.inpaint
    names = tuple(dict.fromkeys((*INPAINTERS, chosen)))
    label("Holes", layout, HOLES_TIP)
    entries = [(last_part(name), INPAINTER_TIPS.get(name, MODEL_TIP)) for name in names]
    picked = combo("holes", last_part(chosen), entries, layout, HOLES_TIP)
    return [] if picked is None else [SetInpainter(names[picked])]


def _views_between(scene: Scene, asked: Source | None, given: GridShape, layout: Layout) -> list[Action]:
    """The views on disk alone, or one of the denser grids; what was chosen is shown at once."""
    chosen = chosen_grid(scene, asked)
    label("Views", layout, BETWEEN_TIP)
    grids = (given, *denser_grids(given))
    entries = [(_grid_words(grid, given), _grid_tip(grid, given)) for grid in grids]
    picked = combo("views", _grid_words(chosen, given), entries, layout, BETWEEN_TIP)
    is_new = picked is not None and grids[picked] != chosen
    return [OpenPath(with_views_between(scene, grids[picked or 0]))] if is_new else []


def _grid_tip(grid: GridShape, given: GridShape) -> str:
    new = grid.rows * grid.columns - given.rows * given.columns
    return f"{new} views between those on disk are made." if new else "No views are made."


def _grid_words(grid: GridShape, given: GridShape) -> str:
    return f"{grid.columns} x {grid.rows}{', as on disk' if grid == given else ''}"


def _of_light_field(scene: Scene) -> str:
    given = scene.given_grid
    if given is None or given == scene.grid:
        return "A light field from disk: its views are shown as they are."
    return f"A light field of {given.columns} x {given.rows} views from disk; those between are made of all of them."


def _sizes(scene: Scene) -> tuple[tuple[str, str], ...]:
    width, height = scene.own_size or scene.size
    shown = "" if (width, height) == scene.size else f", looked at with {scene.width} x {scene.height}"
    return (("Size", f"{width} x {height}{shown}"), ("Colours", scene.color_space.name))
