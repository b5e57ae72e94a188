"""Records of depth editing; `viewer.model.depth` and `viewer.model.selection` have the verbs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from iibr_core.depth.editing.edits import BRUSH_TOOLS, BrushTool, Patch

Tool = BrushTool | Literal["select"]
TOOLS: tuple[Tool, ...] = (*BRUSH_TOOLS, "select")
"""Tools for the picture: they paint, or select a surface."""


@dataclass(frozen=True)
class DepthSample:
    """A place whose depth was picked, (x, y) as shares of the photo's width and height, and the disparity there."""

    place: tuple[float, float]
    disparity: float


@dataclass(frozen=True)
class Brush:
    """The tool for the picture while it is on. radius, strength, tolerance, feather: see `Stroke`.

    sample: source of the depth that "level" and "fill" paint, None: the beginning of the stroke. brought_overlay:
    whether the depth overlay came with the brush, and goes with it.
    """

    tool: Tool = "nearer"
    radius: float = 0.03
    strength: float = 0.25
    tolerance: float = 1.0
    feather: float = 0.0
    is_on: bool = False
    sample: DepthSample | None = None
    brought_overlay: bool = False


@dataclass(frozen=True)
class Selection:
    """A surface that was clicked or painted. place: (x, y) as shares of the photo's width and height.

    patches: see `Stroke`. is_painted: whether only they count, not the surface at the place.
    range_px: (far, near) disparity of the surface, in px per view step; None until the surface was found.
    """

    place: tuple[float, float]
    patches: tuple[Patch, ...] = ()
    is_painted: bool = False
    range_px: tuple[float, float] | None = None
