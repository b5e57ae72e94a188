"""OpenGL contexts by way of GLFW: of a window, and of OSMesa through GLFW's null platform.

The bundle is imported before glfw on purpose: it brings the GLFW library that both must share, for two copies do not
know of each other.
"""

from __future__ import annotations

import ctypes
import warnings
from functools import partial
from typing import Any

import imgui_bundle  # noqa: F401  (before glfw, see above)
import moderngl

from iibr_core.types import InputError
from viewer.gpu.context import GLContext

import glfw  # isort: skip


class GlfwLoader:
    """Tells moderngl where a GLFW window's GL functions are: GLX, EGL, OSMesa, Cocoa and WGL alike."""

    def __init__(self, window: Any) -> None:
        self.window = window

    def load_opengl_function(self, name: str) -> int:
        """Address of a GL function, 0 where the driver lacks it."""
        return ctypes.cast(glfw.get_proc_address(name), ctypes.c_void_p).value or 0

    load = load_opengl_function

    def __enter__(self) -> GlfwLoader:
        glfw.make_context_current(self.window)
        return self

    def __exit__(self, *_exception: object) -> None:
        """Leave the context current: the next one entered replaces it."""

    def release(self) -> None:
        """The context dies with its window."""


def create_for_window(window: Any) -> GLContext:
    """The GL context of a GLFW window made for OpenGL 3.3 core, made current.

    The window stays the caller's. Raises InputError where the driver offers less than OpenGL 3.3.
    """
    glfw.make_context_current(window)
    try:
        ctx = _context_of(window)
    except (ValueError, moderngl.Error) as error:
        raise InputError(f"this display's driver offers no OpenGL 3.3 ({error}): try `iibr screenshot`") from error
    return GLContext(ctx, "window")


def _context_of(window: Any) -> moderngl.Context:
    settings: dict[str, Any] = {"context": GlfwLoader(window)}
    return moderngl.create_context(require=330, **settings)


_null_windows = 0


def create_osmesa() -> GLContext:
    """A context of a software renderer, current on return. Raises InputError where there is none."""
    window = _open_null_window()
    if window is None:
        raise InputError("osmesa: libOSMesa not found or too old (install libosmesa6)")
    glfw.make_context_current(window)
    try:
        ctx = _context_of(window)
    except (ValueError, moderngl.Error) as error:
        _close_null_window(window)
        raise InputError(f"osmesa: {error}") from error
    return GLContext(ctx, "osmesa", partial(_close_null_window, window))


def _open_null_window() -> Any | None:
    """An OSMesa window of GLFW's null platform (of the running platform, where GLFW is in use); None where it fails."""
    global _null_windows
    with warnings.catch_warnings(action="ignore"):  # GLFW reports failures as warnings; here one is an answer
        glfw.init_hint(glfw.PLATFORM, glfw.PLATFORM_NULL)
        ready = glfw.init()
        glfw.init_hint(glfw.PLATFORM, glfw.ANY_PLATFORM)
        if not ready:
            return None
        glfw.default_window_hints()
        glfw.window_hint(glfw.CONTEXT_CREATION_API, glfw.OSMESA_CONTEXT_API)
        glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, 3)
        glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, 3)
        glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
        glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
        window = glfw.create_window(16, 16, "iibr", None, None)
        glfw.default_window_hints()
        _null_windows += 1
        if not window:
            _close_null_window(None)
            return None
    return window


def _close_null_window(window: Any | None) -> None:
    """Destroy it; after the last one the null platform goes too, so that a real display can be opened later."""
    global _null_windows
    if window is not None:
        glfw.destroy_window(window)
    _null_windows -= 1
    if _null_windows == 0 and glfw.get_platform() == glfw.PLATFORM_NULL:
        glfw.terminate()
