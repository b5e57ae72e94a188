"""The ways of inpainting, by the names that people type. Each is loaded when it is asked for; this file is light."""

from __future__ import annotations

from collections.abc import Callable
from pkgutil import resolve_name

from iibr_core.inpainting.protocol import Inpainter
from iibr_core.types import InputError

INPAINTERS = {
    "background": "iibr_core.inpainting.background:background_inpainter",
    "patch": "iibr_core.inpainting.patch:patch_inpainter",
}
"""Name -> "module:function" of a factory without arguments, which raises InputError where it lacks what it needs.

A factory is asked for every light field and every comparison: one that reads weights keeps them.
"""

DEFAULT_INPAINTER = "background"


def load_inpainter(name: str) -> Inpainter:
    """The way of inpainting with this name. Raises InputError where there is none, or where it lacks what it needs."""
    if name not in INPAINTERS:
        raise InputError(f"--inpaint {name}: is no way of inpainting; give {' or '.join(INPAINTERS)}")
    factory: Callable[[], Inpainter] = resolve_name(INPAINTERS[name])
    return factory()
