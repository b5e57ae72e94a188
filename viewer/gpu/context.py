"""OpenGL 3.3 core contexts: of a window, or without one (EGL, else OSMesa, a software renderer).

The bundle is imported before glfw on purpose: it brings the GLFW library that both must share, for two copies do not
know of each other.
"""

from __future__ import annotations

import ctypes
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any, Literal

import imgui_bundle  # noqa: F401  (before glfw, see above)
import moderngl

from iibr_core.types import InputError

import glfw  # isort: skip

Backend = Literal["auto", "egl", "osmesa"]
SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "swiftshader", "swr", "software", "basic render")


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


class GLContext:
    """A GL context and its limits.

    ctx: the moderngl context. backend: "window", "egl" or "osmesa". renderer: the driver's name for itself.
    max_layers, max_texture_size: limits of texture arrays, in layers and pixels.
    """

    def __init__(self, ctx: moderngl.Context, backend: str, own_window: Any = None) -> None:
        self.ctx: Any = ctx
        self.backend = backend
        self.renderer: str = ctx.info["GL_RENDERER"]
        self.max_layers: int = ctx.info["GL_MAX_ARRAY_TEXTURE_LAYERS"]
        self.max_texture_size: int = ctx.info["GL_MAX_TEXTURE_SIZE"]
        self._own_window = own_window

    @property
    def is_software(self) -> bool:
        """Whether the processor draws."""
        return any(name in self.renderer.lower() for name in SOFTWARE_RENDERERS)

    @property
    def frame_budget_s(self) -> float:
        """How long a picture may take while the user drags."""
        return 0.033 if self.is_software else 0.016

    @property
    def seconds_per_fetch(self) -> float:
        """First guess at what reading a texel costs a pixel; what is measured then replaces it."""
        return 3e-9 if self.is_software else 4e-11

    def clear_screen(self, red: float = 0.0, green: float = 0.0, blue: float = 0.0) -> None:
        """Fill the window with one colour and leave it bound for drawing."""
        self.ctx.screen.use()
        self.ctx.screen.clear(red, green, blue, 1.0)

    def release(self) -> None:
        """Free the context; a second call does nothing. A window given to `create_for_window` stays the caller's."""
        if self.ctx is None:
            return
        self.ctx.release()
        self.ctx = None
        if self._own_window is not None:
            _close_null_window(self._own_window)
            self._own_window = None


def create_headless(backend: Backend = "auto") -> GLContext:
    """A GL 3.3 core context without a display, current on return: EGL, else OSMesa.

    Raises InputError where none can be made, naming what was tried and the packages to install.
    """
    makers = {"egl": _create_egl, "osmesa": _create_osmesa}
    failures = []
    for name in makers if backend == "auto" else (backend,):
        try:
            return makers[name]()
        except InputError as error:
            failures.append(str(error))
    raise InputError("no OpenGL 3.3 without a display: " + "; ".join(failures))


def create_for_window(window: Any = None) -> GLContext:
    """The GL context of a GLFW window made for OpenGL 3.3 core (None: of the current one), made current.

    The window stays the caller's. Raises InputError where the driver offers less than OpenGL 3.3.
    """
    window = window or glfw.get_current_context()
    glfw.make_context_current(window)
    try:
        ctx = _context_of(window)
    except (ValueError, moderngl.Error) as error:
        raise InputError(f"this display's driver offers no OpenGL 3.3 ({error}): try `iibr screenshot`") from error
    return GLContext(ctx, "window")


def _context_of(window: Any) -> moderngl.Context:
    settings: dict[str, Any] = {"context": GlfwLoader(window)}
    return moderngl.create_context(require=330, **settings)


def _create_egl() -> GLContext:
    try:
        settings: dict[str, Any] = {"backend": "egl"}
        ctx = moderngl.create_context(require=330, standalone=True, **settings)
    except Exception as error:  # the loader raises plain Exception, whatever went wrong
        reason = str(error).partition("\n")[0]
        raise InputError(f"egl: {reason} (install libegl1 and libgl1-mesa-dri)") from error
    return GLContext(ctx, "egl")


_null_windows = 0


def _create_osmesa() -> GLContext:
    window = _open_null_window()
    if window is None:
        raise InputError("osmesa: libOSMesa not found or too old (install libosmesa6)")
    glfw.make_context_current(window)
    try:
        ctx = _context_of(window)
    except (ValueError, moderngl.Error) as error:
        _close_null_window(window)
        raise InputError(f"osmesa: {error}") from error
    return GLContext(ctx, "osmesa", window)


def _open_null_window() -> Any | None:
    """An OSMesa window of GLFW's null platform (of the running platform, where GLFW is in use); None where it fails."""
    global _null_windows
    with _quiet_glfw():
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


@contextmanager
def _quiet_glfw() -> Iterator[None]:
    """GLFW reports failures as warnings; here a failure is an answer."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        yield
