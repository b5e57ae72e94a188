"""Records of what to open, of an open photo or light field, and of the progress of opening it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from iibr_core.depth.choice import DepthChoice, DepthOrigin, DepthStart
from iibr_core.depth.editing.edits import UNEDITED, DepthEdits, Levels
from iibr_core.generation.plan import ScenePlan
from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace, GridShape, Quality, ReportProgress, ViewUpdate

AS_USUAL = DepthChoice()


@dataclass(frozen=True)
class Source:
    """Path to open, and the user's decisions about it; None leaves a choice to the program.

    path: a photo or a light-field folder. focus_disparity: in the units of the given disparity. quality: where the ray
    transformer runs. inpaint: what fills the places that the photo never saw, see `load_inpainter`. is_literal:
    disparity counts as it is given, in px per step of the grid, instead of the plan's parallax. grid: of a photo's
    views. filled_grid: of a light field with views made between those on disk.
    """

    path: str
    depth: DepthChoice = AS_USUAL
    grid: GridShape | None = None
    focus_disparity: float | None = None
    max_pixels: int | None = None
    quality: Quality | None = None
    inpaint: str = DEFAULT_INPAINTER
    is_literal: bool = False
    filled_grid: GridShape | None = None


def source_beside(source: Source | None, path: str) -> Source:
    """Return the source of another file, with the decisions about this one, except those about its depth map or its
    views on disk.
    """
    return _with_depth(replace(source or Source(""), path=path, filled_grid=None), file=None)


def source_with_map(source: Source, path: str) -> Source:
    """The same photo with this map; one of another shape is stretched over it."""
    return _with_depth(source, file=path, start="auto", stretches=True)


def source_with_depth(source: Source, start: DepthStart, model: str | None = None) -> Source:
    """The same photo, its depth looked for from here on; model: a name or a folder."""
    return _with_depth(source, file=None, start=start, model=model or source.depth.model)


def _with_depth(source: Source, **changes: Any) -> Source:
    """Return the source with another map; decisions about the map before, and the focus in its units, are dropped."""
    forgotten = {"file_scale": None, "inverts": False, "is_metric": False, "stretches": False}
    return replace(source, depth=replace(source.depth, **(forgotten | changes)), focus_disparity=None)


@dataclass(frozen=True)
class Scene:
    """An open photo with its plan, or a light field from disk (plan None).

    depth_origin: where a photo's depth came from, None for light fields; depth_source: the same in a few words.
    has_view_disparity: whether every view comes with its own disparity. notes: what was done to what the files hold, a
    sentence each; problems: those of them that a notice tells. focal_px: in pixels of the picture, None where
    not known. subject_disparity_px: of what fills the picture's middle, for presets. settings: text of the settings the
    file was saved with by this program, "" without. levels: how the disparity is spread before it is edited, px per
    view step as given. depth_model: name or path of the one that gave its depth, None where none did. inverse_metres:
    (slope, offset) of 1 / distance over the disparity as given, None where distances are not known in metres.
    color_space: of its views. own_size: of the photo in its file, which a view may be smaller than; None for light
    fields. given_grid: of the views that are in a light field's files; None for photos. infinity_px: a photo's field
    disparity of what is infinitely far, as far as it is known. is_sketch: it is shown in small while it is read.
    found_span_px: from the farthest to the nearest field disparity before any of it was edited, None where it cannot be
    edited.
    """

    source: Source
    name: str
    width: int
    height: int
    grid: GridShape
    disparity_range_px: tuple[float, float]
    depth_source: str
    is_hdr: bool = False
    has_view_disparity: bool = True
    plan: ScenePlan | None = None
    notes: tuple[str, ...] = ()
    problems: tuple[str, ...] = ()
    focal_px: float | None = None
    subject_disparity_px: float = 0.0
    settings: str = ""
    depth_origin: DepthOrigin | None = None
    levels: Levels | None = None
    depth_model: str | None = None
    inverse_metres: tuple[float, float] | None = None
    color_space: ColorSpace = SRGB
    own_size: ScreenSize | None = None
    is_sketch: bool = False
    infinity_px: float = 0.0
    given_grid: GridShape | None = None
    found_span_px: float | None = None

    @property
    def is_guessed(self) -> bool:
        """Whether its depth is a guess, and stays one."""
        return self.depth_model is None and self.depth_origin is not None and self.depth_origin.kind == "rough"

    @property
    def has_model_depth(self) -> bool:
        """Whether a model estimated the depth that is shown."""
        return self.depth_origin is not None and self.depth_origin.kind == "model"

    @property
    def size(self) -> ScreenSize:
        """Return the size of a view on the screen."""
        return ScreenSize(self.width, self.height)

    @property
    def further_notes(self) -> tuple[str, ...]:
        """Return the notes without the panel's line about depth."""
        said = self.depth_origin.advising_line if self.depth_origin is not None else ""
        return tuple(note for note in self.notes if note != said)


@dataclass(frozen=True)
class Progress:
    """Progress of the worker: views done of total, in seconds; doing: the work in words, if it is not making views.

    drafts: of those done, so many will come again, with sharper edges. share: of all the work, what is done, 0..1.
    left_s: seconds that it still takes, about; None where that is not known.
    """

    done: int = 0
    total: int = 0
    seconds: float = 0.0
    doing: str = ""
    drafts: int = 0
    share: float = 0.0
    left_s: float | None = None

    @property
    def is_complete(self) -> bool:
        """Whether every view is there as it will stay."""
        return 0 < self.total == self.done and not self.drafts

    def report_to(self, report_progress: ReportProgress) -> None:
        """Share of all work that is done, as far as that is known."""
        report_progress(self.share, float(self.total > 0), self.doing)


@dataclass(frozen=True)
class DepthSettings:
    """Changes to the disparity that was found: the strength of refinement (see `DepthChoice.refine`), then edits."""

    refine: float = 1.0
    edits: DepthEdits = UNEDITED


AS_FOUND = DepthSettings()


@dataclass(frozen=True, eq=False)
class FilledField:
    """A light field with all views between those on disk. views: of all its places, the centre first."""

    scene: Scene
    views: tuple[ViewUpdate, ...]

    def is_of(self, source: Source) -> bool:
        """Whether opening this shows these views."""
        return is_same_field(self.scene.source, source) and self.scene.source.filled_grid == source.filled_grid


def is_same_field(one: Source, other: Source) -> bool:
    """Whether the views of both are the same, but for those between: a map of its own gives them another disparity."""
    same_map = one.depth.file == other.depth.file
    return one.path == other.path and same_map and one.inpaint == other.inpaint
