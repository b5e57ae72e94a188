"""The histogram of disparity (far left, near right) in the overlay's colours, with the clips to drag and the focus."""

from __future__ import annotations

from dataclasses import replace

from imgui_bundle import imgui

from iibr_core.depth.editing.edits import DepthEdits, Levels, invert_tone_curve, tone_curve
from iibr_core.scenes.lens_limits import clamp
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from viewer.model import depth
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.colormap import map_color
from viewer.ui.style import Palette, corners, pack_color, palette_of
from viewer.ui.widgets import scale, tooltip

HEIGHT = 56.0
"""Height of the bars in window units at usual size."""
HANDLE_WIDTH = 12.0
BELOW = 4.0
"""Length of a handle below the bars, in window units at usual size."""
CLIPPED_OPACITY = 0.3
TIP = (
    "Share of the picture at each depth: far at the left, near at the right. The line is the focus; the handles limit"
    " the depth."
)


def depth_histogram(state: AppState, scene: Scene) -> list[Action]:
    """Build the histogram. Places are before clips and gamma, colours after."""
    levels, edits = scene.levels, state.depth.edits
    if levels is None:
        return []
    corner, margin, height = imgui.get_cursor_screen_pos(), HANDLE_WIDTH * scale() / 2, HEIGHT * scale()
    rect = Rect(corner.x + margin, corner.y, imgui.get_content_region_avail().x - 2 * margin, height)
    _draw_bars(levels, edits, rect)
    focus = focus_share(state, scene, levels)
    palette = palette_of(state.preferences.theme)
    if focus is not None:
        _draw_line(rect, focus, pack_color(palette.accent), 1.5 * scale())
    far, has_ended = _handle("far_clip", edits.far_clip, rect, palette)
    near, near_has_ended = _handle("near_clip", edits.near_clip, rect, palette)
    has_ended |= near_has_ended
    imgui.set_cursor_screen_pos(corner)
    imgui.dummy(imgui.ImVec2(rect.width + 2 * margin, height + BELOW * scale()))
    tooltip(TIP)
    edited = replace(edits, far_clip=far, near_clip=near)
    return [do(depth.set_tone, edited, has_ended)] if edited != edits or has_ended else []


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


def _draw_line(rect: Rect, share: float, color: int, width: float) -> None:
    """Draw a line over the bars."""
    x, draw = rect.x + share * rect.width, imgui.get_window_draw_list()
    draw.add_line(imgui.ImVec2(x, rect.y), imgui.ImVec2(x, rect.y + rect.height), color, width)


def _handle(name: str, value: float, rect: Rect, palette: Palette) -> tuple[float, bool]:
    """Build a line over the bars with a grip; return its value, and whether a drag has ended."""
    side, below = HANDLE_WIDTH * scale() / 2, BELOW * scale()
    x, bottom = rect.x + value * rect.width, rect.y + rect.height
    imgui.set_cursor_screen_pos(imgui.ImVec2(x - side, rect.y))
    imgui.set_next_item_allow_overlap()
    imgui.invisible_button(f"handle {name}", imgui.ImVec2(2 * side, rect.height + below))
    is_held, is_released = imgui.is_item_active(), bool(imgui.is_item_deactivated())
    color = pack_color(palette.accent if is_held or imgui.is_item_hovered() else palette.text)
    _draw_line(rect, value, color, scale())
    ends = imgui.ImVec2(x - side, bottom + below), imgui.ImVec2(x + side, bottom + below)
    imgui.get_window_draw_list().add_triangle_filled(imgui.ImVec2(x, bottom - 3 * scale()), *ends, color)
    if is_held or is_released:
        value = clamp((imgui.get_io().mouse_pos.x - rect.x) / rect.width, 0.0, 1.0)
    return value, is_released
