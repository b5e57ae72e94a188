"""OpenGL 3.3 core contexts: what they can do, and those without a window (EGL, else OSMesa, a software renderer)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import moderngl

from iibr_core.types import InputError

Backend = Literal["auto", "egl", "osmesa"]
SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "swiftshader", "swr", "software", "basic render")


class GLContext:
    """A GL context and its limits.

    ctx: the moderngl context. backend: "window", "egl" or "osmesa". close: frees what it lives in, after it.
    renderer: the driver's name for itself.
    max_layers, max_texture_size: limits of texture arrays, in layers and pixels.
    """

    def __init__(self, ctx: moderngl.Context, backend: str, close: Callable[[], None] | None = None) -> None:
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
        """Free the context; a second call does nothing."""
        if self.ctx is None:
            return
        self.ctx.release()
        self.ctx = None
        if self._close is not None:
            self._close()


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


def _create_egl() -> GLContext:
    try:
        settings: dict[str, Any] = {"backend": "egl"}
        ctx = moderngl.create_context(require=330, standalone=True, **settings)
    except Exception as error:  # the loader raises plain Exception, whatever went wrong
        reason = str(error).partition("\n")[0]
        raise InputError(f"egl: {reason} (install libegl1 and libgl1-mesa-dri)") from error
    return GLContext(ctx, "egl")


def _create_osmesa() -> GLContext:
    from viewer.gpu.glfw_context import create_osmesa  # GLFW takes its time, and the usual way needs none of it

    return create_osmesa()
