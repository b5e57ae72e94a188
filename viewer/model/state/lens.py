"""Records of the lens besides `Optics`: tilt handles, the gloss brush, and names of presets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from iibr_core.gloss.settings import Gloss, GlossSurface

PresetName = Literal["portrait", "macro", "everything sharp"]
PRESETS: tuple[PresetName, ...] = ("portrait", "macro", "everything sharp")

FIRST_GLOSS = Gloss(GlossSurface(farthest=0.5))
"""Gloss that the panel's switch begins with: the nearer half of the scene."""


@dataclass(frozen=True)
class TiltHandles:
    """Two places that the sharp plane runs through, (x, y) from -1 to 1 across the picture, y down.

    taken: index of the handle that is being dragged.
    """

    first: tuple[float, float] = (-0.5, 0.4)
    second: tuple[float, float] = (0.5, -0.4)
    taken: int | None = None


@dataclass(frozen=True)
class GlossBrush:
    """The brush that marks the glossy surface, or erases a part of it, while it is on. radius: see `GlossStroke`."""

    radius: float = 0.04
    erases: bool = False
    is_on: bool = False
