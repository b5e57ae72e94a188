"""Rows of the depth section for the brush, and for the surface that was selected."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from iibr_core.depth.editing.edits import DEPTH_TOOLS, RADIUS_LIMITS, TOLERANCE_LIMITS
from viewer.model import depth, selection
from viewer.model.action import Action, do
from viewer.model.commands import BRUSH_WORDS
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.model.state.depth import TOOLS, Brush, Tool
from viewer.ui.widgets import button, choice, in_row, percent_slider, slider

TOOL_TIPS: dict[Tool, str] = {
    "nearer": "Drag over the picture to bring it nearer. Strokes end at the photo's edges.",
    "farther": "Drag over the picture to push it farther away. Strokes end at the photo's edges.",
    "smooth": "Drag over the picture to smooth its depth, along the photo's edges.",
    "level": "Drag over the picture to give it one depth, up to the photo's edges.",
    "fill": "Click a surface to give it one depth, up to edges of the photo and of depth.",
    "select": "Click a subject to select its surface. Then move it nearer or farther, or keep it sharp.",
}
PUT_AWAY = " B or Esc puts the tool away."
SIZE_TIP = "Width of the brush as a share of the photo's width (wheel over the picture)."
STRENGTH_TIP = "Change of depth by one stroke. Level and Bucket always give the whole depth."
TOLERANCE_TIP = "Contrast that ends a surface: higher values select more (wheel over the picture)."
SAMPLE_TIP = "Level and Bucket paint the depth where you press. Ctrl+click picks another depth; this forgets it."
FORWARD_TIP = "Bring the selected surface nearer by a tenth of the depth."
BACK_TIP = "Push the selected surface back by a tenth of the depth."
SHARP_TIP = "Focus on the selected surface, and widen the focus until all of it is sharp."
TOOLS_A_ROW = 3


def brush_rows(state: AppState, layout: Layout) -> list[Action]:
    """Build a button for each tool and the settings of the brush. Pressing the lit tool puts it away."""
    brush = state.brush
    actions: list[Action] = []
    imgui.text("Brush")
    for tool, width in in_row(TOOLS, layout, TOOLS_A_ROW):
        is_in_hand = brush.is_on and brush.tool == tool
        if choice(BRUSH_WORDS[tool], is_in_hand, layout, (width, 0), TOOL_TIPS[tool] + PUT_AWAY):
            actions.append(do(depth.set_brush, replace(brush, tool=tool, is_on=not is_in_hand)))
    actions += [do(depth.set_brush, changed) for changed in _settings(brush, layout)]
    return actions


def _settings(brush: Brush, layout: Layout) -> list[Brush]:
    """Build the settings; return the brushes that they ask for."""
    paints, is_depth_tool = brush.is_on and brush.tool != "select", brush.tool in DEPTH_TOOLS
    changed: list[Brush] = []
    limits = 100 * RADIUS_LIMITS[0], 100 * RADIUS_LIMITS[1]
    size = slider("Size", 100 * brush.radius, limits, "%.1f %%", layout, SIZE_TIP, True, paints)
    changed += [] if size is None else [replace(brush, radius=size / 100)]
    strength = percent_slider("Strength", brush.strength, layout, STRENGTH_TIP, paints and not is_depth_tool)
    changed += [] if strength is None else [replace(brush, strength=strength)]
    floods, limits = (
        brush.is_on and brush.tool in ("fill", "select"),
        (100 * TOLERANCE_LIMITS[0], 100 * TOLERANCE_LIMITS[1]),
    )
    share = slider("Tolerance", 100 * brush.tolerance, limits, "%.0f %%", layout, TOLERANCE_TIP, True, floods)
    changed += [] if share is None else [replace(brush, tolerance=share / 100)]
    has_sample = paints and is_depth_tool and brush.sample is not None
    if button("Forget the picked depth", layout, SAMPLE_TIP, has_sample):
        changed.append(replace(brush, sample=None))
    return changed


def selection_rows(state: AppState, layout: Layout) -> list[Action]:
    """Build the buttons for the selected surface."""
    imgui.text("Selected surface")
    is_found = state.selection is not None and state.selection.range_px is not None
    buttons = (
        ("Nearer##surface", FORWARD_TIP, do(selection.move, is_forward=True)),
        ("Farther##surface", BACK_TIP, do(selection.move, is_forward=False)),
        ("Keep sharp", SHARP_TIP, do(selection.keep_sharp)),
    )
    actions: list[Action] = []
    for (word, tip, action), width in in_row(buttons, layout):
        if button(word, layout, tip, is_found, width):
            actions.append(action)
    _scroll_here_when_taken(state.brush.is_on)
    return actions


def _scroll_here_when_taken(is_in_hand: bool) -> None:
    """Scroll to the brush when it is taken by its key."""
    before, key = imgui.get_state_storage(), imgui.get_id("brush in hand")
    if is_in_hand and not before.get_bool(key) and not imgui.is_item_visible():
        imgui.set_scroll_here_y(1.0)
    before.set_bool(key, is_in_hand)
