"""Contexts without a window: on Linux EGL, else OSMesa, a software renderer; elsewhere the system's OpenGL."""

from __future__ import annotations

import sys
from typing import Any, Literal

import moderngl

from iibr_core.types import InputError
from viewer.gpu.context import GLContext

Backend = Literal["auto", "egl", "osmesa"]
Maker = Literal["egl", "osmesa", "system"]


def create_headless(backend: Backend = "auto") -> GLContext:
    """Return a GL 3.3 core context without a window, current: on Linux EGL, else OSMesa; elsewhere the system's.

    Raises InputError where none can be made, naming what was tried and the packages to install.
    """
    failures = []
    for name in usual_makers(sys.platform) if backend == "auto" else (backend,):
        try:
            return _create_osmesa() if name == "osmesa" else _create(name)
        except InputError as error:
            failures.append(str(error))
    raise InputError("no OpenGL 3.3 without a display: " + "; ".join(failures))


def usual_makers(platform: str) -> tuple[Maker, ...]:
    """Return the ways to try, in order, on a platform as `sys.platform` names it."""
    return ("egl", "osmesa") if platform.startswith("linux") else ("system",)


def _create(name: Maker) -> GLContext:
    settings: dict[str, Any] = {"backend": "egl"} if name == "egl" else {}
    remedy = "install libegl1 and libgl1-mesa-dri" if name == "egl" else "install the driver of the graphics card"
    try:
        ctx = moderngl.create_context(require=330, standalone=True, **settings)
    except Exception as error:  # the loader raises plain Exception, whatever went wrong
        reason = str(error).partition("\n")[0]
        raise InputError(f"{name}: {reason} ({remedy})") from error
    return GLContext(ctx, name)


def _create_osmesa() -> GLContext:
    from viewer.gpu.glfw_context import create_osmesa  # GLFW takes its time, and the usual way needs none of it

    return create_osmesa()
