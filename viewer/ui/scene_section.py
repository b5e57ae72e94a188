"""The panel's section for the scene: its depth, what the plan chose and why."""

from __future__ import annotations

from imgui_bundle import imgui

from viewer.actions import Action, SetDepthStrength
from viewer.layout import Layout
from viewer.limits import DEPTH_STRENGTH_LIMIT
from viewer.state import AppState, Scene
from viewer.ui.widgets import gap, quiet, slider

NO_DEPTH = "none"
DEPTH_TIP = "Multiplies the parallax the plan chose. The views are made anew when you let go."


def scene_section(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the section. Depth strength tells when the edit ends, because it costs a new light field."""
    actions: list[Action] = []
    if scene.plan and scene.depth_source != NO_DEPTH:
        limits = (0.0, DEPTH_STRENGTH_LIMIT)
        strength = slider("Parallax", state.depth_strength, limits, "× %.2f", layout, DEPTH_TIP)
        is_finished = imgui.is_item_deactivated_after_edit()
        if strength is not None or is_finished:
            actions.append(SetDepthStrength(state.depth_strength if strength is None else strength, is_finished))
    quiet(f"Depth: {scene.depth_source}")
    gap(layout, 2)
    for reason in scene.plan.reasons if scene.plan else ():
        quiet(reason)
    return actions
