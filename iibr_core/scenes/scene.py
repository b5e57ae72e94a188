"""Records of what to open, of an open photo or light field, and of the progress of opening it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from iibr_core.depth.choice import DepthChoice, DepthOrigin, DepthStart
from iibr_core.depth.editing.edits import UNEDITED, DepthEdits, Levels
from iibr_core.formats.light_fields.order import UNKNOWN, Arrangement
from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace, Disparity, FloatImage, GridShape, ImageSize, Photo, ViewOffset, ViewUpdate

if TYPE_CHECKING:
    from iibr_core.beyond.hidden_surfaces import HiddenSurface
    from iibr_core.depth.editing.canvas import DepthCanvas

AS_USUAL = DepthChoice()
READING = "reading views"
MAKING = "making views"
"""Words for the work on views."""


@dataclass(frozen=True)
class Source:
    """Path to open, and the user's decisions about it; None leaves a choice to the program.

    path: a photo or a light-field folder. focus_disparity: plane that does not move, in the units of the given
    disparity. inpaint: way of filling hidden surfaces, see `load_inpainter`. is_literal: whether the given disparity
    is px per step of the grid, instead of the plan's parallax. grid: views of a photo. arrangement: order of the views
    of a light field.
    """

    path: str
    depth: DepthChoice = AS_USUAL
    grid: GridShape | None = None
    focus_disparity: float | None = None
    max_pixels: int | None = None
    inpaint: str = DEFAULT_INPAINTER
    is_literal: bool = False
    arrangement: Arrangement = UNKNOWN


def source_beside(source: Source | None, path: str) -> Source:
    """Return the source of another file, with the decisions about this one but its depth map."""
    return _with_depth(replace(source or Source(""), path=path, arrangement=UNKNOWN), file=None)


def source_with_map(source: Source, path: str) -> Source:
    """Return the same photo with this map, stretched if it has another shape."""
    return _with_depth(source, file=path, start="auto", stretches=True)


def source_with_depth(source: Source, start: DepthStart, model: str | None = None) -> Source:
    """Return the same photo with another start of the search for depth. model: a name or a folder."""
    return _with_depth(source, file=None, start=start, model=model or source.depth.model)


def _with_depth(source: Source, **changes: Any) -> Source:
    """Return the source with another map; decisions about the map before, and the focus in its units, are dropped."""
    forgotten = {"file_scale": None, "inverts": False, "is_metric": False, "stretches": False}
    return replace(source, depth=replace(source.depth, **(forgotten | changes)), focus_disparity=None)


@dataclass(frozen=True)
class Scene:
    """An open photo with its plan, or a light field from disk (plan None).

    depth_origin: origin of a photo's depth, None for light fields; depth_source: the same in a few words.
    has_view_disparity: whether every view has a disparity. notes: changes that reading made, one sentence each;
    problems: the notes for a notice. focal_px: focal length in pixels of the picture, None if it is not known.
    subject_disparity_px: disparity of the subject in the picture's middle, for presets. settings: text of the settings
    that this program saved in the file, "" without. levels: histogram of the disparity before inversion, clips and
    gamma, px per view step as given. depth_model: name or path of the model that estimated the depth, None without.
    inverse_metres: (slope, offset) of 1 / distance over the disparity as given, None if distances are not known in
    metres. color_space: of its views. own_size: size of the photo in its file, which may exceed that of a view; None
    for light fields.
    infinity_px: field disparity of infinitely far points, None where a light field does not state it. is_sketch:
    whether it is a small picture that is shown while the photo is read. found_span_px: range of the field disparity
    before edits, None if it cannot be edited. arrangement: order of the views of a light field, as far as it was found.
    row_step: distance between its rows, in distances between columns. missing_views: number of places of the grid that
    have no view, as in a star.
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
    infinity_px: float | None = None
    found_span_px: float | None = None
    arrangement: Arrangement = UNKNOWN
    row_step: float = 1.0
    missing_views: int = 0

    @property
    def view_count(self) -> int:
        """Number of views."""
        return self.grid.rows * self.grid.columns - self.missing_views

    @property
    def is_guessed(self) -> bool:
        """Whether its depth is a guess and no model replaced it."""
        return self.depth_model is None and self.depth_origin is not None and self.depth_origin.kind == "rough"

    @property
    def has_model_depth(self) -> bool:
        """Whether a model estimated the depth that is shown."""
        return self.depth_origin is not None and self.depth_origin.kind == "model"

    @property
    def size(self) -> ScreenSize:
        """Return the size of a view on the screen."""
        return ScreenSize(self.width, self.height)

    def in_columns(self, at: ViewOffset) -> ViewOffset:
        """Return a viewpoint in distances between columns, as disparity counts, from one in steps of the grid."""
        return ViewOffset(self.row_step * at.t, at.s)

    def viewpoint(self, row: int, column: int) -> ViewOffset:
        """Return the viewpoint of a view from the centre view, in distances between columns."""
        return self.in_columns(self.grid.offset(row, column))


@dataclass(frozen=True)
class Progress:
    """Progress of opening a scene.

    done: number of final views, of `total`. seconds: time that making them has taken. doing: the present work in words,
    "" while views are made. share: share of the present work that is done, 0..1. left_s: prediction of the remaining
    seconds, None if there is none.
    """

    done: int = 0
    total: int = 0
    seconds: float = 0.0
    doing: str = ""
    share: float = 0.0
    left_s: float | None = None

    @property
    def is_complete(self) -> bool:
        """Whether every view is there and final."""
        return 0 < self.total == self.done


@dataclass(frozen=True)
class DepthSettings:
    """Changes to the disparity that was found: whether it is refined (see `DepthChoice.refine`), then edits."""

    refine: bool = True
    edits: DepthEdits = UNEDITED


AS_FOUND = DepthSettings()


@dataclass(frozen=True, eq=False)
class LoadedPhoto:
    """A photo as read and its disparity, kept so that another plan does not read them again.

    disparity: result of `depth_settings`: `found` is refined to `refined`, which is edited. origin: source of `found`.
    settings: text of the settings that this program saved in the photo, "" without. model: name or path of the depth
    model that estimated its depth, None without. levels: histogram of the disparity with strokes, before inversion,
    clips and gamma. canvas: the worker's edits; only the worker uses it. own_size: size of the photo in its file,
    upright. stamp: see `stamp_of`.
    """

    photo: Photo
    disparity: Disparity
    origin: DepthOrigin
    settings: str
    model: str | None
    depth_settings: DepthSettings
    found: Disparity
    refined: Disparity
    levels: Levels
    canvas: DepthCanvas
    own_size: ImageSize
    stamp: tuple[int, ...]

    def without_history(self) -> LoadedPhoto:
        """Return the same photo with a new canvas: a canvas that was painted on keeps maps for undo."""
        return replace(self, canvas=self.canvas.renewed())


class WantedPhoto(NamedTuple):
    """A photo whose views are planned with this depth strength."""

    source: Source
    depth_strength: float


@dataclass(frozen=True, eq=False)
class SceneRequest:
    """A scene to be opened, with all inputs.

    loaded: the photo, if it was read before. depth_settings: refinement and edits of depth, None for those of the
    source. takes_drafts: whether a light field without disparity comes before its disparity is known, too. plan: the
    plan of the loaded photo, if it was made before.
    asks_model: whether a model estimates depth if there is one; otherwise it is guessed.
    """

    generation: int
    source: Source
    depth_strength: float = 1.0
    loaded: LoadedPhoto | None = None
    depth_settings: DepthSettings | None = None
    takes_drafts: bool = True
    plan: ScenePlan | None = None
    asks_model: bool = True


@dataclass(frozen=True, eq=False)
class SceneReady:
    """A scene that was read and planned. centre: its centre view, which is there before any other."""

    generation: int
    scene: Scene
    loaded: LoadedPhoto | None
    centre: ViewUpdate


@dataclass(frozen=True, eq=False)
class ViewReady:
    """One more view of a scene, and the progress of opening it.

    hidden: the surface behind the centre view's, once the views that show it are there.
    """

    generation: int
    view: ViewUpdate
    progress: Progress
    hidden: HiddenSurface | None = None


def still_disparity(source: Source, before_strokes: FloatImage) -> float:
    """Return the disparity (as given) of the plane that does not move, which strokes do not change."""
    return float(np.median(before_strokes)) if source.focus_disparity is None else source.focus_disparity
