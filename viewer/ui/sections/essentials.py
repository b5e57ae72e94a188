"""Rows that the panel always shows for an open picture: presets, aperture, focus, depth strength, loops."""

from __future__ import annotations

from imgui_bundle import imgui

from iibr_core.exports.loops import LoopKind
from iibr_core.scenes.lens_limits import aperture_limit
from iibr_core.scenes.scene import Scene
from viewer.model import lens, viewpoint
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.lens import DEPTH_STRENGTH_LIMIT
from viewer.model.presets import PresetName, active_preset
from viewer.ui.sections.lens_section import aperture_slider, focus_slider
from viewer.ui.widgets import choices, label, slider

PRESETS: dict[PresetName, tuple[str, str]] = {
    "portrait": ("Portrait", "A sharp subject before a soft background. The subject is what you clicked last."),
    "macro": ("Macro", "The nearest object is sharp, and all behind it is soft."),
    "everything sharp": ("Everything sharp", "No blur: as sharp as the photo."),
}
LOOPS: dict[LoopKind, tuple[str, str]] = {
    "circle": ("Circle", "Moves the viewpoint in a circle. Press again to stop."),
    "eight": ("Eight", "Moves the viewpoint along a lying eight. Press again to stop."),
    "swing": ("Swing", "Swings the viewpoint from left to right and back. Press again to stop."),
}
STRENGTH_TIP = "Depth of the scene: more depth moves and blurs near and far objects more. Release to apply."


def essentials(state: AppState, scene: Scene) -> list[Action]:
    """Build the rows. A single view has no focus, aperture or loop."""
    has_views = bool(aperture_limit(scene))
    actions: list[Action] = []
    if has_views:
        preset = choices(PRESETS, [active_preset(state, scene)])
        actions += [do(lens.apply_preset, preset)] if preset else []
        actions += aperture_slider(state, scene) + focus_slider(state, scene)
    if scene.plan is not None:
        actions += _depth_strength(state)
    if has_views:
        label("Move")
        loop = choices(LOOPS, [state.motion.kind])
        actions += [do(viewpoint.set_loop, None if loop == state.motion.kind else loop)] if loop else []
    return actions


def _depth_strength(state: AppState) -> list[Action]:
    """Build the slider. The end of an edit makes a new light field."""
    limits = (0.0, DEPTH_STRENGTH_LIMIT)
    strength = slider("Depth strength", state.depth_strength, limits, "× %.2f", STRENGTH_TIP)
    is_finished = imgui.is_item_deactivated_after_edit()
    if strength == state.depth_strength and not is_finished:
        return []
    return [do(lens.set_depth_strength, strength, is_finished)]
