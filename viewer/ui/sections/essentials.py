"""Rows that the panel always shows for an open picture: presets, aperture, focus, depth strength, loops."""

from __future__ import annotations

from imgui_bundle import imgui

from iibr_core.exports.loops import LOOPS, LoopKind
from iibr_core.scenes.lens_limits import aperture_limit
from iibr_core.scenes.scene import Scene
from viewer.model import lens, viewpoint
from viewer.model.action import Action, do
from viewer.model.layout import Layout
from viewer.model.lens import DEPTH_STRENGTH_LIMIT
from viewer.model.presets import active_preset
from viewer.model.state.app_state import AppState
from viewer.model.state.lens import PRESETS, PresetName
from viewer.ui.sections.lens_section import aperture_slider, focus_slider
from viewer.ui.widgets import choice, in_row, label, slider

PRESET_TIPS: dict[PresetName, str] = {
    "portrait": "A sharp subject before a soft background. The subject is what you clicked last.",
    "macro": "The nearest object is sharp, and all behind it is soft.",
    "everything sharp": "No blur: as sharp as the photo.",
}
STRENGTH_TIP = "Depth of the scene: more depth moves and blurs near and far objects more. Release to apply."
MOVE_WORDS: dict[LoopKind, str] = {"circle": "Circle", "eight": "Eight", "swing": "Swing"}
MOVE_TIPS: dict[LoopKind, str] = {
    "circle": "Moves the viewpoint in a circle. Press again to stop.",
    "eight": "Moves the viewpoint along a lying eight. Press again to stop.",
    "swing": "Swings the viewpoint from left to right and back. Press again to stop.",
}


def essentials(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the rows. A single view has no focus, aperture or loop."""
    has_views = bool(aperture_limit(scene.grid))
    actions: list[Action] = []
    if has_views:
        actions += (
            _presets(active_preset(state, scene), layout)
            + aperture_slider(state, scene, layout)
            + focus_slider(state, scene, layout)
        )
    if scene.plan is not None:
        actions += _depth_strength(state, layout)
    return actions + (_move(state, layout) if has_views else [])


def _presets(active: PresetName | None, layout: Layout) -> list[Action]:
    """Build three buttons as wide as their words need; the active preset is lit."""
    actions: list[Action] = []
    spacing = 4 * layout.ui_scale
    words = [name.capitalize() for name in PRESETS]
    room = imgui.get_content_region_avail().x - spacing * (len(words) - 1)
    lengths = [imgui.calc_text_size(word).x for word in words]
    padding = (room - sum(lengths)) / len(words)
    for i, (name, word, length) in enumerate(zip(PRESETS, words, lengths)):
        if i:
            imgui.same_line(0, spacing)
        if choice(word, name == active, layout, (length + padding, 0), PRESET_TIPS[name]):
            actions.append(do(lens.apply_preset, name))
    return actions


def _depth_strength(state: AppState, layout: Layout) -> list[Action]:
    """Build the slider. The end of an edit makes a new light field."""
    limits = (0.0, DEPTH_STRENGTH_LIMIT)
    strength = slider("Depth strength", state.depth_strength, limits, "× %.2f", layout, STRENGTH_TIP)
    is_finished = imgui.is_item_deactivated_after_edit()
    if strength is None and not is_finished:
        return []
    return [do(lens.set_depth_strength, state.depth_strength if strength is None else strength, is_finished)]


def _move(state: AppState, layout: Layout) -> list[Action]:
    """Build a button per loop; the running loop is lit, and pressing it again stops it."""
    actions: list[Action] = []
    label("Move", layout)
    for kind, width in in_row(LOOPS, layout):
        is_chosen = state.motion.kind == kind
        if choice(MOVE_WORDS[kind], is_chosen, layout, (width, 0), MOVE_TIPS[kind]):
            actions.append(do(viewpoint.set_loop, None if is_chosen else kind))
    return actions
