"""Contexts without a window: EGL, else OSMesa, a software renderer."""

from __future__ import annotations

from typing import Any, Literal

import moderngl

from iibr_core.types import InputError
from viewer.gpu.context import GLContext

Backend = Literal["auto", "egl", "osmesa"]


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
