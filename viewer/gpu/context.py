"""OpenGL 3.3 core contexts: without a window here, of windows and of OSMesa in `glfw_context`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, Literal

import moderngl

from iibr_core.types import InputError

Backend = Literal["auto", "egl", "osmesa"]
SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "swiftshader", "swr", "software", "basic render")


class GLContext:
    """A GL context and its limits.

    ctx: the moderngl context. backend: "window", "egl", "osmesa" or "system". renderer: name that the driver reports.
    max_layers, max_texture_size: limits of texture arrays, in layers and pixels.
    """

    def __init__(self, ctx: moderngl.Context, backend: str, close: Callable[[], None] = lambda: None) -> None:
        """close: called once the context is released; frees the window in which it lives."""
        self.ctx: Any = ctx
        self.backend = backend
        self.renderer: str = ctx.info["GL_RENDERER"]
        self.max_layers: int = ctx.info["GL_MAX_ARRAY_TEXTURE_LAYERS"]
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
    remedy = "install libegl1 and libgl1-mesa-dri" if name == "egl" else "install the driver of the graphics card"
    try:
        ctx = moderngl.create_context(require=330, standalone=True, **settings)
    except Exception as error:  # the loader raises plain Exception for every failure
        reason = str(error).partition("\n")[0]
        raise InputError(f"{name}: {reason} ({remedy})") from error
    return GLContext(ctx, name)


def _create_osmesa() -> GLContext:
    from viewer.gpu.glfw_context import create_osmesa  # GLFW loads slowly, and EGL does not need it

    return create_osmesa()
