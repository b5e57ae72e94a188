"""Reads the mouse from ImGui."""

from __future__ import annotations

import math

from viewer.app.pointer import DRAG_THRESHOLD, NO_POINTER, Pointer


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
        is_over_panel=io.want_capture_mouse,
        # The wheel may have turned in the frame in which Ctrl was released.
        holds_ctrl=any(imgui.is_key_down(key) or imgui.is_key_released(key) for key in ctrl_keys),
        pulls=imgui.is_mouse_down(middle) or imgui.is_mouse_released(middle),
    )
