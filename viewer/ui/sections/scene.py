"""The panel's section for the scene: what its file says of it, where its depth is from, what the plan chose and why."""

from __future__ import annotations

from viewer.model.actions import Action
from viewer.model.layout import Layout
from viewer.model.state.app_state import Scene
from viewer.model.state.photo_facts import FactsRead
from viewer.ui.widgets import gap, label, quiet


def scene_section(scene: Scene, facts: FactsRead, layout: Layout) -> list[Action]:
    """Build the section; nothing in it can be changed."""
    gap(layout, 2)
    of_file = facts.facts if facts.path == scene.source.path else ()
    for what, value in (*of_file, *_sizes(scene), ("Depth", scene.depth_source)):
        label(what, layout)
        quiet(value)
    gap(layout, 2)
    for reason in scene.plan.reasons if scene.plan else ("A light field from disk: its views are shown as they are.",):
        quiet(reason)
    return []


def _sizes(scene: Scene) -> tuple[tuple[str, str], ...]:
    width, height = scene.own_size or scene.size
    shown = "" if (width, height) == scene.size else f", looked at with {scene.width} x {scene.height}"
    return (("Size", f"{width} x {height}{shown}"), ("Colours", scene.color_space.name))
