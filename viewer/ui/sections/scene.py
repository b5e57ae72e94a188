"""The panel's section for the scene: what its file says of it, where its depth is from, what the plan chose and why."""

from __future__ import annotations

from imgui_bundle import imgui

from iibr_core.inpainting.registry import INPAINTERS
from viewer.model.actions import Action, SetInpainter
from viewer.model.layout import Layout
from viewer.model.state.photo_facts import FactsRead
from viewer.model.state.scene import Scene
from viewer.ui.widgets import gap, label, last_part, quiet, tooltip

HOLES_TIP = (
    "What fills the places that the photo never saw: background goes on smoothly from what lies behind, patch gives it"
    " texture from around. The views are made anew."
)


def scene_section(scene: Scene, facts: FactsRead, layout: Layout) -> list[Action]:
    """Build the section; all that can be changed in it is what fills holes."""
    gap(layout, 2)
    of_file = facts.facts if facts.path == scene.source.path else ()
    for what, value in (*of_file, *_sizes(scene), ("Depth", scene.depth_source)):
        label(what, layout)
        quiet(value)
    gap(layout, 2)
    for reason in scene.plan.reasons if scene.plan else ("A light field from disk: its views are shown as they are.",):
        quiet(reason)
    return _holes(scene, layout) if scene.plan is not None and scene.plan.has_disocclusion else []


def _holes(scene: Scene, layout: Layout) -> list[Action]:
    """The ways of inpainting that need no model, and the one that the photo was opened with."""
    actions: list[Action] = []
    chosen = scene.source.inpaint
    label("Holes", layout, HOLES_TIP)
    if imgui.begin_combo("##holes", last_part(chosen)):
        for name in dict.fromkeys((*INPAINTERS, chosen)):
            if imgui.selectable(last_part(name), name == chosen)[0]:
                actions.append(SetInpainter(name))
        imgui.end_combo()
    tooltip(HOLES_TIP, layout)
    return actions


def _sizes(scene: Scene) -> tuple[tuple[str, str], ...]:
    width, height = scene.own_size or scene.size
    shown = "" if (width, height) == scene.size else f", looked at with {scene.width} x {scene.height}"
    return (("Size", f"{width} x {height}{shown}"), ("Colours", scene.color_space.name))
