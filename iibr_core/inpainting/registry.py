"""The ways of inpainting, and the names by which people choose them. A way is imported when it is chosen."""

from __future__ import annotations

import os
from collections.abc import Callable
from pkgutil import resolve_name

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage, InputError, ViewOffset

EstimateDepth = Callable[[FloatImage], FloatImage]
"""Function that returns inverse depth (H, W), up to scale and offset, of colours (H, W, 3). It may raise InputError."""


Inpainter = Callable[[FloatImage, FloatImage, NDArray[np.bool_], FloatImage, ViewOffset, int], None]
"""Function of (colors, disparity, hole, photo_disparity, offset, threads) that fills the holes of one view in place.

It writes finite colors (H, W, 3), sRGB-encoded, and disparity (H, W), px per view step, where hole (H, W) is True. All
other pixels stay; values that were in the holes before mean nothing. photo_disparity (H, W): the centre view's, which
shows what the photo could not see. offset: position of this view. threads: largest number of threads; the result does
not depend on it. Several threads may call the same inpainter for different views.
"""

INPAINTERS = {"background": "iibr_core.inpainting.background:fill_background"}
"""Place of each inpainter, "module:name"."""

MODEL_INPAINTERS = {"diffusion": "iibr_core.inpainting.diffusion:DiffusionInpainter"}
"""Place of a function of a model's folder and `EstimateDepth`, None without it, that returns an inpainter.

It raises InputError for a folder without a suitable model. People write NAME:FOLDER.
"""

DEFAULT_INPAINTER = "background"
INPAINTER_FORMS = (*INPAINTERS, *(f"{name}:FOLDER" for name in MODEL_INPAINTERS))
"""Forms in which people choose a way of inpainting."""


def load_inpainter(choice: str, estimate_depth: EstimateDepth | None = None) -> Inpainter:
    """Return the chosen inpainter. estimate_depth: the model that found the photo's depth.

    Raises InputError if there is no such inpainter, or its folder or a package is missing.
    """
    require_inpainter(choice)
    name, _, folder = choice.partition(":")
    inpainter: Inpainter = (
        resolve_name(MODEL_INPAINTERS[name])(folder, estimate_depth) if folder else resolve_name(INPAINTERS[name])
    )
    return inpainter


def require_inpainter(choice: str) -> None:
    """Raise InputError if there is no such inpainter or no such folder. Nothing is loaded."""
    name, _, folder = choice.partition(":")
    if choice not in INPAINTERS and not (name in MODEL_INPAINTERS and folder):
        raise InputError(f"{choice}: unknown inpainter; give {' or '.join(INPAINTER_FORMS)}")
    if folder and not os.path.isdir(os.path.expanduser(folder)):
        raise InputError(f"{choice}: no such folder; give that of an inpainting pipeline")
