"""OpenGL 3.3 core contexts: of a GLFW window, and without a window by EGL, OSMesa or the system."""

from __future__ import annotations

import ctypes
import sys
import warnings
from collections.abc import Callable
from functools import partial
from typing import Any, Literal

import moderngl

from iibr_core.types import InputError

Backend = Literal["auto", "egl", "osmesa"]
SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "swiftshader", "swr", "software", "basic render")


class GLContext:
    """A GL context and its limits.

    ctx: the moderngl context. backend: "window", "egl", "osmesa" or "system". renderer, version: as the driver
    reports them. max_texture_size: largest side of a texture in pixels.
    """

    def __init__(self, ctx: moderngl.Context, backend: str, close: Callable[[], None] = lambda: None) -> None:
        """close: called once the context is released; frees the window in which it lives."""
        self.ctx: Any = ctx
        self.backend = backend
        self.renderer: str = ctx.info["GL_RENDERER"]
        self.version: str = ctx.info["GL_VERSION"]
        self.max_texture_size: int = ctx.info["GL_MAX_TEXTURE_SIZE"]
        self._close = close

    @property
    def is_software(self) -> bool:
        """Whether the processor draws."""
        return any(name in self.renderer.lower() for name in SOFTWARE_RENDERERS)

    @property
    def frame_budget_s(self) -> float:
        """Time for a picture while the user drags, in seconds."""
        return 0.033 if self.is_software else 0.016

    @property
    def seconds_per_fetch(self) -> float:
        """First guess at the time of reading a texel for a pixel; measured times replace it."""
        return 3e-9 if self.is_software else 4e-11

    def release(self) -> None:
        """Free the context; a second call does nothing."""
        if self.ctx is not None:
            self.ctx.release()
            self.ctx = None
            self._close()


def create_headless(backend: Backend = "auto") -> GLContext:
    """Return a context without a window, made current: on Linux EGL, else OSMesa; elsewhere the system's.

    Raises InputError if there is none, with what was tried and the packages to install.
    """
    failures = []
    for name in usual_backends(sys.platform) if backend == "auto" else (backend,):
        try:
            return _create_osmesa() if name == "osmesa" else _create(name)
        except InputError as error:
            failures.append(str(error))
    raise InputError("no OpenGL 3.3 without a display: " + "; ".join(failures))


def usual_backends(platform: str) -> tuple[str, ...]:
    """Return the backends to try, in order, on a platform as `sys.platform` names it."""
    return ("egl", "osmesa") if platform.startswith("linux") else ("system",)


def _create(name: str) -> GLContext:
    settings: dict[str, Any] = {"backend": "egl"} if name == "egl" else {}
    remedy = "libegl1, libgl1 and libgl1-mesa-dri" if name == "egl" else "the driver of the graphics card"
    try:
        return GLContext(moderngl.create_context(require=330, standalone=True, **settings), name)
    except Exception as error:  # the loader raises plain Exception for every failure
        reason = str(error).partition("\n")[0]
        raise InputError(f"{name}: {reason} (install {remedy})") from error


def create_for_window(window: Any) -> GLContext:
    """Return the GL context of a GLFW window made for OpenGL 3.3 core, made current; the caller keeps the window.

    Raises InputError if the driver offers less than OpenGL 3.3.
    """
    try:
        return GLContext(_context_of(window), "window")
    except (ValueError, moderngl.Error) as error:
        raise InputError(f"this display's driver offers no OpenGL 3.3 ({error}): try `iibr screenshot`") from error


def _create_osmesa() -> GLContext:
    """Return a context of the software renderer OSMesa on GLFW's null platform."""
    try:
        with warnings.catch_warnings(action="ignore"):  # GLFW reports failures as warnings
            window = _null_window()
    except ImportError as error:  # its library asks for others, which a machine without a desktop lacks
        raise InputError(f"osmesa: {error}") from error
    try:
        if window is None:
            raise ValueError("libOSMesa not found or too old (install libosmesa6)")
        return GLContext(_context_of(window), "osmesa", partial(_close_null_window, window))
    except (ValueError, moderngl.Error) as error:
        _close_null_window(window)
        raise InputError(f"osmesa: {error}") from error


def _null_window() -> Any | None:
    """Return an OSMesa window of GLFW's null platform, or of the platform in use; None if there is none."""
    glfw = _glfw()
    glfw.init_hint(glfw.PLATFORM, glfw.PLATFORM_NULL)
    is_ready = glfw.init()
    glfw.init_hint(glfw.PLATFORM, glfw.ANY_PLATFORM)
    if not is_ready:
        return None
    glfw.default_window_hints()
    for hint, value in (
        (glfw.CONTEXT_CREATION_API, glfw.OSMESA_CONTEXT_API),
        (glfw.CONTEXT_VERSION_MAJOR, 3),
        (glfw.CONTEXT_VERSION_MINOR, 3),
        (glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE),
        (glfw.VISIBLE, glfw.FALSE),
    ):
        glfw.window_hint(hint, value)
    window = glfw.create_window(16, 16, "iibr", None, None)
    glfw.default_window_hints()
    return window or None


def _close_null_window(window: Any | None) -> None:
    """Destroy the window and end the null platform, so that a real display can be opened later."""
    glfw = _glfw()
    if window is not None:
        glfw.destroy_window(window)
    if glfw.get_platform() == glfw.PLATFORM_NULL:
        glfw.terminate()


def _context_of(window: Any) -> moderngl.Context:
    settings: dict[str, Any] = {"context": GlfwLoader(window)}
    return moderngl.create_context(require=330, **settings)


class GlfwLoader:
    """Finds the GL functions of a GLFW window for moderngl: for GLX, EGL, OSMesa, Cocoa and WGL alike."""

    def __init__(self, window: Any) -> None:
        """Make its context current."""
        self._glfw, self._window = _glfw(), window
        self._glfw.make_context_current(window)

    def load_opengl_function(self, name: str) -> int:
        """Return the address of a GL function, 0 if the driver lacks it."""
        return ctypes.cast(self._glfw.get_proc_address(name), ctypes.c_void_p).value or 0

    load = load_opengl_function

    def __enter__(self) -> GlfwLoader:
        self._glfw.make_context_current(self._window)
        return self

    def __exit__(self, *_exception: object) -> None:
        """Leave the context current: the next context that is entered replaces it."""

    def release(self) -> None:
        """Do nothing: the context ends with its window."""


def _glfw() -> Any:
    """Return glfw. It loads slowly, and EGL does not need it.

    imgui_bundle comes first because it brings the GLFW library that both must share: two copies of the library do not
    know each other's windows.
    """
    import imgui_bundle  # noqa: F401, I001  (before glfw, see above)
    import glfw

    return glfw
