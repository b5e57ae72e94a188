"""The ImGui context with its native OpenGL backend, in a window or without one.

A frame is built (`begin`, the panels, `end`) and then drawn (`draw`). `end` returns a digest of the frame, so that the
loop draws it only if it differs from the last one.
"""

from __future__ import annotations

import ctypes
import hashlib
from typing import Any

from imgui_bundle import imgui

from viewer.model.layout import Layout
from viewer.ui.style import Look, apply_style, load_fonts

DOUBLE_CLICK_S, SINGLE_CLICK_AFTER_S = 0.3, 0.2
"""Longest time between the clicks of a double click, and time after it until a single click counts, in seconds."""


class UiHost:
    """Owner of the ImGui context. The GL context must be current when it is made, drawn and released."""

    def __init__(self, look: Look, window: Any = None) -> None:
        self._context = imgui.create_context()
        imgui.get_io().set_ini_filename(None)
        load_fonts()
        apply_style(look)
        self._look = look
        self._has_window = window is not None
        if window is not None:
            imgui.backends.glfw_init_for_opengl(ctypes.cast(window, ctypes.c_void_p).value or 0, True)
        imgui.backends.opengl3_init("#version 330")

    def begin(self, layout: Layout, look: Look, behind_s: float = 0.0) -> None:
        """Start a frame of this look. Without a window, its size and time step are set here.

        behind_s: delay of the last frames, which a double click may take longer.
        """
        if look != self._look:
            apply_style(look)
            self._look = look
        imgui.backends.opengl3_new_frame()
        io = imgui.get_io()
        if self._has_window:
            imgui.backends.glfw_new_frame()
        else:
            io.display_size = imgui.ImVec2(layout.window.width, layout.window.height)
            io.display_framebuffer_scale = imgui.ImVec2(layout.pixel_ratio, layout.pixel_ratio)
            io.delta_time = 1 / 60
        io.mouse_double_click_time = DOUBLE_CLICK_S + behind_s
        io.mouse_single_click_delay = io.mouse_double_click_time + SINGLE_CLICK_AFTER_S
        imgui.new_frame()

    def end(self) -> bytes:
        """Finish the frame and return a digest of everything it would draw."""
        imgui.render()
        digest = hashlib.blake2b(digest_size=16)
        for commands in imgui.get_draw_data().cmd_lists:
            digest.update(_bytes_of(commands.vtx_buffer, imgui.VERTEX_SIZE))
            digest.update(_bytes_of(commands.idx_buffer, imgui.INDEX_SIZE))
        return digest.digest()

    def draw(self) -> None:
        """Draw the finished frame into the bound framebuffer."""
        imgui.backends.opengl3_render_draw_data(imgui.get_draw_data())

    def release(self) -> None:
        """Free everything."""
        imgui.backends.opengl3_shutdown()
        if self._has_window:
            imgui.backends.glfw_shutdown()
        imgui.destroy_context(self._context)


def _bytes_of(vector: Any, element_bytes: int) -> bytes:
    count = vector.size()
    return ctypes.string_at(vector.data_address(), count * element_bytes) if count else b""
