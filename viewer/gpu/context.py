"""An OpenGL 3.3 core context and what it can do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import moderngl

SOFTWARE_RENDERERS = ("llvmpipe", "softpipe", "swrast", "swiftshader", "swr", "software", "basic render")


class GLContext:
    """A GL context and its limits.

    ctx: the moderngl context. backend: "window", "egl", "osmesa" or "system". close: frees what it lives in, after it.
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

    def release(self) -> None:
        """Free the context; a second call does nothing."""
        if self.ctx is None:
            return
        self.ctx.release()
        self.ctx = None
        if self._close is not None:
            self._close()
