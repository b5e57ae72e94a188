"""Rows of the depth section for the brush, and for the surface that was selected."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from iibr_core.depth.editing.edits import DEPTH_TOOLS, FEATHER_LIMITS, RADIUS_LIMITS, TOLERANCE_LIMITS
from viewer.model import depth, selection
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.commands import BRUSH_WORDS
from viewer.model.depth import Brush, Tool
from viewer.ui.widgets import button, choices, edit, in_row, percent_slider

TOOL_TIPS: dict[Tool, str] = {
    "nearer": "Drag over the picture to bring it nearer. Strokes end at the photo's edges.",
    "farther": "Drag over the picture to push it farther away. Strokes end at the photo's edges.",
    "smooth": "Drag over the picture to smooth its depth, along the photo's edges.",
    "level": "Drag over the picture to give it one depth, up to the photo's edges.",
    "fill": "Click a surface to give it one depth, up to edges of the photo and of depth.",
    "select": "Click a subject, or paint it. Drag to add to it, Ctrl+drag to erase. Then move it, or keep it sharp.",
}
TOOLS = {tool: (BRUSH_WORDS[tool], f"{tip} B or Esc puts the tool away.") for tool, tip in TOOL_TIPS.items()}
TOOLS_A_ROW = 3
SIZE_TIP = "Width of the brush as a share of the photo's width (wheel over the picture)."
STRENGTH_TIP = "Change of depth by one stroke. Level and Bucket always give the whole depth."
TOLERANCE_TIP = "Contrast that ends a surface: higher values select more (wheel over the picture)."
FEATHER_TIP = "Width over which a move of the selected surface fades out beside it, where no depth edge lies."
SAMPLE_TIP = "Level and Bucket paint the depth where you press. Ctrl+click picks another depth; this forgets it."
SURFACE_BUTTONS = (
    ("Nearer##surface", "Bring the selected surface nearer by a tenth of the depth.", do(selection.move, True)),
    ("Farther##surface", "Push the selected surface back by a tenth of the depth.", do(selection.move, False)),
    (
        "Keep sharp",
        "Focus on the selected surface, and widen the focus until all of it is sharp.",
        do(selection.keep_sharp),
    ),
)


def brush_rows(state: AppState) -> list[Action]:
    """Build a button for each tool and the settings of the brush. Pressing the lit tool puts it away."""
    brush = state.brush
    imgui.text("Brush")
    tool = choices(TOOLS, [brush.tool] if brush.is_on else [], TOOLS_A_ROW)
    edited = _settings(brush)
    if tool is not None:
        edited = replace(edited, tool=tool, is_on=not (brush.is_on and brush.tool == tool))
    return edit(depth.set_brush, brush, edited)


def _settings(brush: Brush) -> Brush:
    """Build the settings; return the edited brush."""
    paints, is_depth_tool = brush.is_on and brush.tool != "select", brush.tool in DEPTH_TOOLS
    selects, floods = brush.is_on and brush.tool == "select", brush.is_on and brush.tool in ("fill", "select")
    edited = replace(
        brush,
        radius=percent_slider("Size", brush.radius, SIZE_TIP, brush.is_on, RADIUS_LIMITS, "%.1f %%", True),
        strength=percent_slider("Strength", brush.strength, STRENGTH_TIP, paints and not is_depth_tool),
        tolerance=percent_slider(
            "Tolerance", brush.tolerance, TOLERANCE_TIP, floods, TOLERANCE_LIMITS, is_logarithmic=True
        ),
        feather=percent_slider("Feather", brush.feather, FEATHER_TIP, selects, FEATHER_LIMITS, "%.1f %%"),
    )
    has_sample = paints and is_depth_tool and brush.sample is not None
    return replace(edited, sample=None) if button("Clear the picked depth", SAMPLE_TIP, has_sample) else edited


def selection_rows(state: AppState) -> list[Action]:
    """Build the buttons for the selected surface."""
    imgui.text("Selected surface")
    is_found = state.selection is not None and state.selection.range_px is not None
    actions: list[Action] = []
    for (words, tip, action), width in in_row(SURFACE_BUTTONS):
        if button(words, tip, is_found, width):
            actions.append(action)
    _scroll_here_when_taken(state.brush.is_on)
    return actions


def _scroll_here_when_taken(is_in_hand: bool) -> None:
    """Scroll to the brush when it is taken by its key."""
    before, key = imgui.get_state_storage(), imgui.get_id("brush in hand")
    if is_in_hand and not before.get_bool(key) and not imgui.is_item_visible():
        imgui.set_scroll_here_y(1.0)
    before.set_bool(key, is_in_hand)
