"""OpenGL contexts from GLFW: of a window, and of OSMesa on GLFW's null platform.

imgui_bundle is imported before glfw because it brings the GLFW library that both must share: two copies of the library
do not know each other's windows.
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

OSMESA_HINTS = {
    glfw.CONTEXT_CREATION_API: glfw.OSMESA_CONTEXT_API,
    glfw.CONTEXT_VERSION_MAJOR: 3,
    glfw.CONTEXT_VERSION_MINOR: 3,
    glfw.OPENGL_PROFILE: glfw.OPENGL_CORE_PROFILE,
    glfw.VISIBLE: glfw.FALSE,
}


class GlfwLoader:
    """Finds the GL functions of a GLFW window for moderngl: for GLX, EGL, OSMesa, Cocoa and WGL alike."""

    def __init__(self, window: Any) -> None:
        self.window = window

    def load_opengl_function(self, name: str) -> int:
        """Return the address of a GL function, 0 if the driver lacks it."""
        return ctypes.cast(glfw.get_proc_address(name), ctypes.c_void_p).value or 0

    load = load_opengl_function

    def __enter__(self) -> GlfwLoader:
        glfw.make_context_current(self.window)
        return self

    def __exit__(self, *_exception: object) -> None:
        """Leave the context current: the next context that is entered replaces it."""

    def release(self) -> None:
        """Do nothing: the context ends with its window."""


def create_for_window(window: Any) -> GLContext:
    """Return the GL context of a GLFW window made for OpenGL 3.3 core, made current; the caller keeps the window.

    Raises InputError if the driver offers less than OpenGL 3.3.
    """
    try:
        return GLContext(_context_of(window), "window")
    except (ValueError, moderngl.Error) as error:
        raise InputError(f"this display's driver offers no OpenGL 3.3 ({error}): try `iibr screenshot`") from error


def create_osmesa() -> GLContext:
    """Return a context of the software renderer OSMesa, made current. Raises InputError if there is none."""
    with warnings.catch_warnings(action="ignore"):  # GLFW reports failures as warnings
        window = _null_window()
    try:
        if window is None:
            raise InputError("osmesa: libOSMesa not found or too old (install libosmesa6)")
        return GLContext(_context_of(window), "osmesa", partial(_close_null_window, window))
    except (InputError, ValueError, moderngl.Error) as error:
        _close_null_window(window)
        raise error if isinstance(error, InputError) else InputError(f"osmesa: {error}") from error


def _context_of(window: Any) -> moderngl.Context:
    glfw.make_context_current(window)
    settings: dict[str, Any] = {"context": GlfwLoader(window)}
    return moderngl.create_context(require=330, **settings)


def _null_window() -> Any | None:
    """Return an OSMesa window of GLFW's null platform, or of the platform in use; None if there is none."""
    glfw.init_hint(glfw.PLATFORM, glfw.PLATFORM_NULL)
    is_ready = glfw.init()
    glfw.init_hint(glfw.PLATFORM, glfw.ANY_PLATFORM)
    if not is_ready:
        return None
    glfw.default_window_hints()
    for hint, value in OSMESA_HINTS.items():
        glfw.window_hint(hint, value)
    window = glfw.create_window(16, 16, "iibr", None, None)
    glfw.default_window_hints()
    return window or None


def _close_null_window(window: Any | None) -> None:
    """Destroy the window and end the null platform, so that a real display can be opened later."""
    if window is not None:
        glfw.destroy_window(window)
    if glfw.get_platform() == glfw.PLATFORM_NULL:
        glfw.terminate()
