"""The panel's section for the scene: facts of its file, its depth, the plan and its reasons, and notes."""

from __future__ import annotations

from iibr_core.scenes.scene import Scene
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.ui.widgets import gap, label, quiet


def scene_section(state: AppState, scene: Scene, layout: Layout) -> None:
    """Build the section."""
    facts = state.facts
    gap(layout, 2)
    of_file = facts.facts if facts.path == scene.source.path else ()
    for what, value in (*of_file, *_sizes(scene), ("Depth", scene.depth_source)):
        label(what, layout)
        quiet(value)
    gap(layout, 2)
    for reason in scene.plan.reasons if scene.plan else ("A light field from disk: its views are shown as they are.",):
        quiet(reason)
    for note in scene.notes:
        quiet(note)


def _sizes(scene: Scene) -> tuple[tuple[str, str], ...]:
    width, height = scene.own_size or scene.size
    shown = "" if (width, height) == scene.size else f", shown at {scene.width} x {scene.height}"
    return (("Size", f"{width} x {height}{shown}"), ("Colours", scene.color_space.name))
