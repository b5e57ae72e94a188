"""Reads the mouse from ImGui."""

from __future__ import annotations

import math
import time

from viewer.app.pointer import DRAG_THRESHOLD, NO_POINTER, Pointer

PANEL_CLICK_S, PANEL_REACH = 0.6, 8.0
"""Time and distance (window units) within which a second press belongs to the panel of the first, which may be gone."""


def read_pointer(before: Pointer = NO_POINTER) -> Pointer:
    """Return the mouse in this ImGui frame. before: the mouse in the previous frame."""
    from imgui_bundle import imgui

    io = imgui.get_io()
    moved = imgui.get_mouse_drag_delta(imgui.MouseButton_.left, 0.0)
    # ImGui leaves out the frame of the release, which may hold all of a quick drag.
    drag_distance = max(float(io.mouse_drag_max_distance_sqr[0]) ** 0.5, math.hypot(moved.x, moved.y))
    was_drag = before.is_down and not io.mouse_clicked[0] and before.drag_distance > DRAG_THRESHOLD
    ctrl_keys = imgui.Key.left_ctrl, imgui.Key.right_ctrl, imgui.Key.left_super, imgui.Key.right_super
    middle = imgui.MouseButton_.middle
    now_s, is_pressed, is_over_panel = time.perf_counter(), bool(io.mouse_clicked[0]), bool(io.want_capture_mouse)
    if is_pressed:
        x, y, pressed_s = before.panel_press
        is_close = math.hypot(io.mouse_pos.x - x, io.mouse_pos.y - y) < PANEL_REACH
        is_over_panel |= is_close and now_s - pressed_s < PANEL_CLICK_S
    is_held = is_pressed or bool(io.mouse_down[0] or io.mouse_released[0])
    holds_panel = is_over_panel if is_pressed else before.holds_panel and is_held
    # In the frame of the press, the step led to the place of the press.
    step = imgui.ImVec2(0.0, 0.0) if io.mouse_clicked[middle] else io.mouse_delta
    return Pointer(
        x=io.mouse_pos.x,
        y=io.mouse_pos.y,
        step_x=step.x,
        step_y=step.y,
        drag_distance=drag_distance,
        becomes_drag=drag_distance > DRAG_THRESHOLD and not was_drag,
        pressed_x=io.mouse_pos.x - moved.x,
        pressed_y=io.mouse_pos.y - moved.y,
        is_down=bool(io.mouse_down[0]),
        is_pressed=bool(io.mouse_clicked[0]),
        is_released=bool(io.mouse_released[0]),
        clicks=int(io.mouse_clicked_last_count[0]),
        wheel=io.mouse_wheel,
        is_over_panel=is_over_panel or holds_panel,
        holds_panel=holds_panel,
        panel_press=(io.mouse_pos.x, io.mouse_pos.y, now_s) if is_pressed and is_over_panel else before.panel_press,
        # The wheel may have turned in the frame in which Ctrl was released.
        holds_ctrl=any(imgui.is_key_down(key) or imgui.is_key_released(key) for key in ctrl_keys),
        pulls=imgui.is_mouse_down(middle) or imgui.is_mouse_released(middle),
    )
