"""The panel's section for the scene: what the plan chose and why."""

from __future__ import annotations

from viewer.model.actions import Action
from viewer.model.layout import Layout
from viewer.model.state.app_state import Scene
from viewer.ui.widgets import gap, quiet


def scene_section(scene: Scene, layout: Layout) -> list[Action]:
    """Build the section; nothing in it can be changed."""
    gap(layout, 2)
    for reason in scene.plan.reasons if scene.plan else ("A light field from disk: its views are shown as they are.",):
        quiet(reason)
    return []
