"""The histogram of disparity (far left, near right) in the overlay's colours, with the clips to drag and the focus."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from iibr_core.depth.editing.edits import DepthEdits, Levels, invert_tone_curve, tone_curve
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from viewer.model import depth
from viewer.model.action import Action, do
from viewer.model.colormap import map_color
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState
from viewer.ui.style import corners, pack_color, palette_of
from viewer.ui.widgets import tooltip

HEIGHT = 56.0
"""Height of the bars in window units at usual size."""
HANDLE_WIDTH = 12.0
CLIPPED_OPACITY = 0.3
TIP = (
    "Share of the picture at each depth: far at the left, near at the right. The line is the focus; the handles limit"
    " the depth."
)


def depth_histogram(state: AppState, scene: Scene, layout: Layout) -> list[Action]:
    """Build the histogram. Places are before clips and gamma, colours after."""
    levels = scene.levels
    if levels is None:
        return []
    scale, corner = layout.ui_scale, imgui.get_cursor_screen_pos()
    margin = HANDLE_WIDTH * scale / 2
    rect = Rect(corner.x + margin, corner.y, imgui.get_content_region_avail().x - 2 * margin, HEIGHT * scale)
    _draw_bars(levels, state.depth.edits, rect)
    _draw_focus(state, scene, levels, rect, scale)
    edits, actions = state.depth.edits, list[Action]()
    far, is_finished = _handle("far_clip", edits.far_clip, rect, state, scale)
    if far is not None:
        actions.append(do(depth.set_tone, replace(edits, far_clip=far), is_finished))
    near, is_finished = _handle("near_clip", edits.near_clip, rect, state, scale)
    if near is not None:
        actions.append(do(depth.set_tone, replace(edits, near_clip=near), is_finished))
    imgui.set_cursor_screen_pos(corner)
    imgui.dummy(imgui.ImVec2(rect.width + 2 * margin, rect.height + 4 * scale))
    tooltip(TIP, layout)
    return actions


def bar_heights(levels: Levels, is_inverted: bool) -> list[float]:
    """Return the height of each bar, 0..1, far first: the square root, so that a flat wall does not hide the rest."""
    counts = levels.counts[::-1] if is_inverted else levels.counts
    highest = max(counts, default=0) or 1
    return [(count / highest) ** 0.5 for count in counts]


def focus_share(state: AppState, scene: Scene, levels: Levels) -> float | None:
    """Return the place of the focus in the histogram, 0..1; None if it lies outside."""
    plan = scene.plan
    if plan is None or not plan.disparity_scale:
        return None
    given = state.optics.focus_disparity / plan.disparity_scale + plan.disparity_zero
    share = invert_tone_curve((given - levels.low) / (levels.high - levels.low), state.depth.edits)
    return share if 0 <= share <= 1 else None


def _draw_bars(levels: Levels, edits: DepthEdits, rect: Rect) -> None:
    draw, (left, top, width, height) = imgui.get_window_draw_list(), rect
    ground, rounding = imgui.get_color_u32(imgui.Col_.frame_bg), imgui.get_style().frame_rounding
    draw.add_rect_filled(*corners(rect), ground, rounding)
    heights = bar_heights(levels, edits.is_inverted)
    step = width / len(heights)
    tone = replace(edits, is_inverted=False)
    for i, share in enumerate(heights):
        place = (i + 0.5) / len(heights)
        is_clipped = not edits.far_clip <= place <= edits.near_clip
        color = pack_color((*map_color(tone_curve(place, tone)), 1.0), CLIPPED_OPACITY if is_clipped else 1.0)
        corner = imgui.ImVec2(left + i * step, top + height * (1 - share))
        draw.add_rect_filled(corner, imgui.ImVec2(left + (i + 1) * step, top + height), color)


def _draw_focus(state: AppState, scene: Scene, levels: Levels, rect: Rect, scale: float) -> None:
    share = focus_share(state, scene, levels)
    if share is not None:
        x, color = rect.x + share * rect.width, pack_color(palette_of(state.preferences.theme).accent)
        draw = imgui.get_window_draw_list()
        draw.add_line(imgui.ImVec2(x, rect.y), imgui.ImVec2(x, rect.y + rect.height), color, 1.5 * scale)


def _handle(name: str, value: float, rect: Rect, state: AppState, scale: float) -> tuple[float | None, bool]:
    """Build a line over the bars with a grip; return its new value if it is dragged, and whether it was let go."""
    palette, (left, top, width, height) = palette_of(state.preferences.theme), rect
    x, grip = left + value * width, HANDLE_WIDTH * scale
    imgui.set_cursor_screen_pos(imgui.ImVec2(x - grip / 2, top))
    imgui.set_next_item_allow_overlap()
    imgui.invisible_button(f"handle {name}", imgui.ImVec2(grip, height + 4 * scale))
    is_held, is_released = imgui.is_item_active(), imgui.is_item_deactivated()
    color = pack_color(palette.accent if is_held or imgui.is_item_hovered() else palette.text)
    draw, bottom = imgui.get_window_draw_list(), top + height
    draw.add_line(imgui.ImVec2(x, top), imgui.ImVec2(x, bottom), color, scale)
    side, tip = grip / 2, imgui.ImVec2(x, bottom - 3 * scale)
    low = imgui.ImVec2(x - side, bottom + 4 * scale), imgui.ImVec2(x + side, bottom + 4 * scale)
    draw.add_triangle_filled(tip, *low, color)
    if not (is_held or is_released):
        return None, False
    return min(max((imgui.get_io().mouse_pos.x - left) / width, 0.0), 1.0), bool(is_released)
