"""Where a photo's depth came from, in words for people, and where to begin looking for it. Light: no heavy imports."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

DepthKind = Literal["file", "embedded", "model", "rough", "flat"]
"""Where depth can come from, best first: a map beside the photo, the photo's own, a trained model, an estimate without
one, none.
"""

DepthStart = Literal["auto", "embedded", "model", "rough", "flat"]
"""With what kind the search begins; "auto" is with a file. What fails is followed by the next, but for a model."""

BETTER_WAYS = (
    "Better: give a depth map with --disparity FILE, or a trained model with --depth-model "
    "(`iibr models` lists what is there)."
)


@dataclass(frozen=True)
class DepthOrigin:
    """Where the depth of a scene came from.

    words: a name for it ("scene.pfm", "the photo itself (Google GDepth)"). failures: what was tried before and why it
    was not used, a sentence each. advice: how to get better depth, "" where there is none to give. file: path of the
    map, where it came from one. near: which end of its values was taken as near, "" where nothing says it.
    """

    kind: DepthKind
    words: str
    failures: tuple[str, ...] = ()
    advice: str = ""
    file: str | None = None
    near: str = ""

    @property
    def line(self) -> str:
        """The same in one line."""
        return f"Depth: {self.words}."

    @property
    def advising_line(self) -> str:
        """The same with the advice; "" where there is none to give."""
        return f"{self.line} {self.advice}" if self.advice else ""


@dataclass(frozen=True)
class DepthChoice:
    """What the user decided about depth.

    start: where the search begins. file: a map that must be used (a bad one is an error). file_scale: multiplies its
    values, which are then px per view step; None: as the file has them. inverts: near and far change places, whatever
    was found. is_metric: the map or the model gives distances. stretches: a map of another shape shows the whole photo.
    model: a folder or a known model's name, None for the usual one if it is there. refine: whether disparity edges
    are drawn to the photo's.
    """

    start: DepthStart = "auto"
    file: str | None = None
    file_scale: float | None = None
    inverts: bool = False
    is_metric: bool = False
    stretches: bool = False
    model: str | None = None
    refine: bool = True

    @property
    def asks_for_model(self) -> bool:
        """Whether nothing will do in its place where it cannot be used."""
        return self.start == "model" or self.model is not None
