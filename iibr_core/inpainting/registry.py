"""The ways of inpainting, by the names that people type. Each is loaded when it is asked for; this file is light."""

from __future__ import annotations

import os
from pkgutil import resolve_name

from iibr_core.inpainting.inpainter import Inpainter, InpaintingAids
from iibr_core.types import InputError

INPAINTERS = {"background": "iibr_core.inpainting.background:background_inpainter"}
"""Name -> "module:function" of a factory without arguments."""

MODEL_INPAINTERS = {"diffusion": "iibr_core.inpainting.diffusion:diffusion_inpainter"}
"""Name -> "module:function" of a factory that is given a model's folder and `InpaintingAids`, and raises InputError
where the folder is of no use. It is typed as NAME:FOLDER.
"""

DEFAULT_INPAINTER = "background"
INPAINTER_FORMS = (*INPAINTERS, *(f"{name}:FOLDER" for name in MODEL_INPAINTERS))
"""How they are typed."""


def load_inpainter(typed: str, aids: InpaintingAids | None = None) -> Inpainter:
    """The way of inpainting that was typed. Raises InputError where there is none, or where it lacks what it needs.

    It is asked for every light field and every comparison.
    """
    require_inpainter(typed)
    name, _, folder = typed.partition(":")
    if name in MODEL_INPAINTERS:
        loaded: Inpainter = resolve_name(MODEL_INPAINTERS[name])(folder, aids or InpaintingAids())
    else:
        loaded = resolve_name(INPAINTERS[name])()
    return loaded


def require_inpainter(typed: str) -> None:
    """Raise InputError where this is no way of inpainting, or its model's folder is not there; nothing is loaded."""
    name, _, folder = typed.partition(":")
    if typed not in INPAINTERS and not (name in MODEL_INPAINTERS and folder):
        raise InputError(f"--inpaint {typed}: unknown inpainter; give {' or '.join(INPAINTER_FORMS)}")
    if name in MODEL_INPAINTERS and not os.path.isdir(os.path.expanduser(folder)):
        raise InputError(f"--inpaint {typed}: no such folder; give that of an inpainting pipeline")
