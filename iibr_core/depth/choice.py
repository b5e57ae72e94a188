"""The user's choices about depth, and the origin of a depth map in words. Imports nothing heavy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

DepthKind = Literal["file", "embedded", "model", "rough", "flat"]
"""Kinds of sources, best first: a map beside the photo, a map inside it, a trained model, a guess, no depth."""

DepthStart = Literal["auto", "embedded", "model", "rough", "flat"]
"""First kind of source that is tried; "auto" begins with a file."""


@dataclass(frozen=True)
class DepthOrigin:
    """Origin of the depth of a scene.

    words: name for people ("scene.pfm", "the photo itself (Google GDepth)"). failures: a sentence on each source that
    was tried in vain. file: path of the map, None for other sources. near: end of the values that counts as near, ""
    if the source defines it. model: name or path of the model, "" for other sources.
    """

    kind: DepthKind
    words: str
    failures: tuple[str, ...] = ()
    file: str | None = None
    near: str = ""
    model: str = ""

    @property
    def is_poor(self) -> bool:
        """Return whether a depth map or a model would be better."""
        return self.kind in ("rough", "flat")

    @property
    def line(self) -> str:
        """Return the origin in one line."""
        return "No depth." if self.kind == "flat" else f"Depth: {self.words}."


@dataclass(frozen=True)
class DepthChoice:
    """The user's decisions about depth.

    file: a map that must be used. file_scale: factor from its values to px per view step; None: not given. inverts:
    near and far change places. is_metric: the map or the model gives distances. stretches: a map of another shape
    shows the whole photo. model: a folder or a name, None for one that is there. refine: whether
    disparity edges are drawn to the photo's. right: file of the right eye's photo, which must be used.
    """

    start: DepthStart = "auto"
    file: str | None = None
    file_scale: float | None = None
    inverts: bool = False
    is_metric: bool = False
    stretches: bool = False
    model: str | None = None
    refine: bool = True
    right: str | None = None

    @property
    def asks_for_model(self) -> bool:
        """Return whether the user insists on a model."""
        return self.start == "model" or self.model is not None
