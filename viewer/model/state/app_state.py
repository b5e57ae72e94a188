"""The viewer's whole state, frozen. Everything the screen shows is a function of it.

Comparing two records decides what an edit costs: a new `generation` restarts the worker, a new `Picture` draws anew.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any, Literal

from iibr_core.depth.choice import DepthChoice, DepthOrigin, DepthStart
from iibr_core.depth.editing.edits import UNEDITED, DepthEdits, Levels, Stroke
from iibr_core.formats.images.picture_kinds import AS_USUAL as USUAL_FORM
from iibr_core.formats.images.picture_kinds import PictureFormat
from iibr_core.generation.plan import ScenePlan
from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.types import SRGB, ColorSpace, GridShape, Quality, ViewOffset
from viewer.model.free_camera import FreeCamera, Poses
from viewer.model.layout import WHOLE, Rect, ScreenSize
from viewer.model.state.depth_editing import Brush, DepthSettings
from viewer.model.state.exporting import CancelExportTask, Exporting, ExportPrompt, ExportTask
from viewer.model.state.folder import FolderOrder, ListFolderTask, PhotoFolder
from viewer.model.state.inspection import Inspection
from viewer.model.state.model_download import CancelGetTask, Downloading, GetModelTask, ListModelsTask, ModelsPrompt
from viewer.model.state.optics import CENTRE, GlossBrush, Optics
from viewer.model.state.photo_facts import NO_FACTS, FactsRead, ReadFactsTask
from viewer.model.state.saving import CancelSaveTask, CopyTask, PasteTask, Saving, WriteSidecarTask
from viewer.model.zoom import Zoom

AS_FOUND = DepthSettings()
AS_USUAL = DepthChoice()


@dataclass(frozen=True)
class Source:
    """What to open and what the user decided about it; None leaves the choice to the program.

    path: a photo or a light-field folder. focus_disparity: in the units of the given disparity. quality: where the ray
    transformer runs. inpaint: what fills the places that the photo never saw, a name among `INPAINTERS`. is_literal:
    disparity counts as it is given, in px per step of the grid, instead of the plan's parallax.
    """

    path: str
    depth: DepthChoice = AS_USUAL
    grid: GridShape | None = None
    focus_disparity: float | None = None
    max_pixels: int | None = None
    quality: Quality | None = None
    inpaint: str = DEFAULT_INPAINTER
    is_literal: bool = False


def source_beside(source: Source | None, path: str) -> Source:
    """To open another file: what was decided about the one before counts, but for what belongs to its depth map."""
    return _with_depth(replace(source or Source(""), path=path), file=None)


def source_with_map(source: Source, path: str) -> Source:
    """The same photo with this disparity map."""
    return _with_depth(source, file=path, start="auto")


def source_with_depth(source: Source, start: DepthStart, model: str | None = None) -> Source:
    """The same photo, its depth looked for from here on; model: a name or a folder."""
    return _with_depth(source, file=None, start=start, model=model or source.depth.model)


def _with_depth(source: Source, **changes: Any) -> Source:
    """What was said in the units of the map before, its scale and the focus, counts no longer."""
    return replace(source, depth=replace(source.depth, file_scale=1.0, **changes), focus_disparity=None)


@dataclass(frozen=True)
class Scene:
    """What is open: a photo with its plan, or a light field from disk (plan None).

    depth_origin: where a photo's depth came from, None for light fields; depth_source: the same in a few words.
    has_view_disparity: whether every view comes with its own disparity. focal_px: in pixels of the picture, None where
    not known. subject_disparity_px: of what fills the picture's middle, for presets. settings: text of the settings the
    file was saved with by this program, "" without. levels: how the disparity is spread before it is edited, px per
    view step as given. depth_models: names of those on this machine. inverse_metres: (slope, offset) of 1 / distance
    over the disparity as given, None where distances are not known in metres. color_space: of its views. own_size: of
    the photo in its file, which a view may be smaller than; None for light fields. infinity_px: a photo's field
    disparity of what is infinitely far, as far as it is known. is_sketch: it is shown in small while it is read.
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
    focal_px: float | None = None
    subject_disparity_px: float = 0.0
    settings: str = ""
    depth_origin: DepthOrigin | None = None
    levels: Levels | None = None
    depth_models: tuple[str, ...] = ()
    inverse_metres: tuple[float, float] | None = None
    color_space: ColorSpace = SRGB
    own_size: ScreenSize | None = None
    is_sketch: bool = False
    infinity_px: float = 0.0

    @property
    def size(self) -> ScreenSize:
        """Of a view, as it is drawn."""
        return ScreenSize(self.width, self.height)


@dataclass(frozen=True)
class Progress:
    """How far the worker is: views done of total, in seconds; doing says what in words when no views are counted.

    drafts: of those done, so many will come again, with sharper edges.
    """

    done: int = 0
    total: int = 0
    seconds: float = 0.0
    doing: str = ""
    drafts: int = 0

    @property
    def share(self) -> float:
        """How much of the work is done, 0..1. A draft is about half of a view's."""
        return (self.done - 0.5 * self.drafts) / self.total if self.total else 0.0

    @property
    def is_complete(self) -> bool:
        """Whether every view is there as it will stay."""
        return 0 < self.total == self.done and not self.drafts


@dataclass(frozen=True)
class SavedSettings:
    """What a saved picture was taken with. source: what was decided, without paths. size_px: (width, height).

    depth_edits: of the photo's disparity. unknown_fields: names of what was saved too, but is not known here.
    """

    optics: Optics
    depth_strength: float
    source: Source
    size_px: ScreenSize
    depth_edits: DepthEdits = UNEDITED
    unknown_fields: tuple[str, ...] = ()


SHORT_NOTICE_S, LONG_NOTICE_S = 12.0, 60.0


@dataclass(frozen=True)
class Notice:
    """A message the user can dismiss, or wait for it to go. offer: settings that a button beside it takes over.

    commands: names of commands that do what it advises, a button each.
    """

    text: str
    is_error: bool = False
    offer: SavedSettings | None = None
    commands: tuple[str, ...] = ()

    @property
    def seconds(self) -> float:
        """How long it stays: long enough to be read, and to reach for what it offers."""
        return LONG_NOTICE_S if self.is_error or self.offer is not None or self.commands else SHORT_NOTICE_S


LoopKind = Literal["circle", "eight", "swing"]
LOOPS: tuple[LoopKind, ...] = ("circle", "eight", "swing")


@dataclass(frozen=True)
class Motion:
    """A viewpoint that moves by itself; `viewer.model.reducers.camera_motion` says along which path.

    kind: None at rest. turns: of the path since it began at the viewpoint `start` (and its dolly). ticked_s: clock of
    the last step, None before the first. speed, in turns per second, and is_paused outlast a change of kind.
    """

    kind: LoopKind | Literal["home"] | None = None
    turns: float = 0.0
    ticked_s: float | None = None
    start: ViewOffset = CENTRE
    start_dolly: float = 0.0
    speed: float = 0.25
    is_paused: bool = False

    @property
    def is_running(self) -> bool:
        """Whether the picture changes without anybody touching it."""
        return self.kind is not None and not self.is_paused


@dataclass(frozen=True)
class Edit:
    """What undo brings back."""

    optics: Optics
    depth_strength: float
    depth: DepthSettings = AS_FOUND


@dataclass(frozen=True)
class History:
    """Edits to go back to (the latest last) and forth to (the nearest first), in the units of the open scene.

    last: the kind of the latest edit. gesture: that kind too while it is under way, "" after: more of the same belongs
    to it until the pointer goes down or up.
    """

    past: tuple[Edit, ...] = ()
    future: tuple[Edit, ...] = ()
    last: str = ""
    gesture: str = ""


@dataclass(frozen=True)
class Hover:
    """Where the pointer is in the picture: pixels of it, and the disparity seen there (None where not known)."""

    x_px: float
    y_px: float
    disparity: float | None


@dataclass(frozen=True)
class TiltHandles:
    """Two places that the sharp plane is laid through, (x, y) from -1 to 1 across the picture, y down.

    taken: which of them is being dragged.
    """

    first: tuple[float, float] = (-0.5, 0.4)
    second: tuple[float, float] = (0.5, -0.4)
    taken: int | None = None


ChoiceOf = Literal["photo", "folder", "mask", "truth", "map", "model"]
"""map: a disparity map for the photo that is open; model: the folder of a depth model."""


@dataclass(frozen=True)
class PathPrompt:
    """The question for a file, where the system has no file dialog."""

    what: ChoiceOf
    path: str = ""


Saved = Literal["picture", "map"]


@dataclass(frozen=True)
class SavePrompt:
    """The question where to save the picture, and how large, or its disparity map. already_there: there is one.

    problem: why nothing can be saved there, "" before that is known. form: how the picture is written.
    """

    path: str
    size_px: ScreenSize
    already_there: bool = False
    what: Saved = "picture"
    problem: str = ""
    form: PictureFormat = USUAL_FORM


@dataclass(frozen=True)
class PalettePrompt:
    """The list of commands, narrowed down by what was typed. selected: which of those left Enter runs."""

    text: str = ""
    selected: int = 0


Prompt = PathPrompt | SavePrompt | ExportPrompt | ModelsPrompt | PalettePrompt | Literal["help", "welcome", "quit"]
"""quit: whether to close although depth edits are saved nowhere."""


@dataclass(frozen=True)
class ChooseTask:
    """Let the user choose in the system's dialog."""

    what: ChoiceOf


@dataclass(frozen=True)
class ChoosePlaceTask:
    """Let the user choose in the system's dialog where the file goes that this prompt asks about."""

    prompt: SavePrompt


@dataclass(frozen=True)
class SaveTask:
    """Write the picture, or its disparity map. size_px: (width, height). form: how the picture is written."""

    path: str
    size_px: ScreenSize
    may_replace: bool = False
    what: Saved = "picture"
    form: PictureFormat = USUAL_FORM


@dataclass(frozen=True)
class ReadMaskTask:
    """Read an aperture mask."""

    path: str


@dataclass(frozen=True)
class ReadTruthTask:
    """Look what light field this folder holds, to compare with; once a scene is open."""

    path: str


Task = (
    ChooseTask
    | ChoosePlaceTask
    | SaveTask
    | CancelSaveTask
    | CopyTask
    | PasteTask
    | WriteSidecarTask
    | ExportTask
    | CancelExportTask
    | ReadMaskTask
    | ReadTruthTask
    | ListFolderTask
    | ReadFactsTask
    | ListModelsTask
    | GetModelTask
    | CancelGetTask
)
"""What the state asks of the outside world; the loop does it and says what came of it by an action."""

Theme = Literal["dark", "light"]
Units = Literal["photographic", "light field"]
"""near to far and f-numbers, or pixels per view step and view steps."""

Section = Literal["view", "focus", "aperture", "light", "gloss", "depth", "inspect", "scene"]
SECTIONS: tuple[Section, ...] = ("view", "focus", "aperture", "light", "gloss", "depth", "inspect", "scene")


@dataclass(frozen=True)
class Preferences:
    """What outlasts the program. window: x, y, width, height in screen units, None before the first; is_maximized:
    whether it filled the screen then. told_sessions: that depth edits are kept.
    """

    theme: Theme = "dark"
    font_scale: float = 1.0
    open_sections: tuple[Section, ...] = ("view", "focus", "aperture", "light")
    window: tuple[int, int, int, int] | None = None
    is_maximized: bool = False
    shows_filmstrip: bool = False
    folder_order: FolderOrder = "name"
    units: Units = "photographic"
    told_sessions: bool = False


@dataclass(frozen=True)
class FinishedField:
    """All views of a scene are there, while another one is read: what they were made with, to come back to."""

    progress: Progress
    depth_strength: float
    depth: DepthSettings


@dataclass(frozen=True)
class DrawReport:
    """What is known of the picture drawn last.

    samples: drawn so far, of samples_converged. draw_ms: what the last drawing took. error: estimated root mean square
    difference to the converged picture, 1 = white; None where it is not known.
    """

    samples: int = 0
    samples_converged: int = 0
    draw_ms: float = 0.0
    error: float | None = None


@dataclass(frozen=True)
class AppState:
    """Everything. source is what was asked for last, scene what is open; generation numbers the worker's jobs.

    views_there: indices (row, column) of views made. stopped: the generation the user stopped. tilt_handles: None while
    they are hidden. tasks: not yet taken up. recent: paths opened, the latest first. report: None without a window.
    zoom: None where the whole picture is seen. free_camera: None on the plane of the views; poses: of a file, for it.
    depth: what is made of the scene's depth; stroke: of the brush, while it is drawn. saved_edits: of the depth, as a
    file has them. saving, exporting: None without. has_chosen_focus, has_chosen_aperture: whether the user said in this
    scene what is sharp, and how wide the aperture is; told_aperture: that it opens by itself, once. has_dialogs:
    whether the system has file dialogs. left_field: None where the open scene was left unfinished, or not at all.
    shown_generation: whose views are shown; given_up: the newest one that led to nothing, so that no two jobs share a
    number. folder: the photos beside the one that is open, None before they are known. facts: what a photo's file says
    of it, perhaps of the one before. is_fullscreen,
    hides_panel: of the window; shows_before: the photo as it was taken stands in place of the picture.
    downloading: None without. keeps_sessions: whether the photo opens as it is left.
    """

    optics: Optics = field(default_factory=Optics)
    source: Source | None = None
    scene: Scene | None = None
    progress: Progress = field(default_factory=Progress)
    notices: tuple[Notice, ...] = ()
    depth_strength: float = 1.0
    generation: int = 0
    should_quit: bool = False
    views_there: frozenset[tuple[int, int]] = frozenset()
    stopped: int | None = None
    motion: Motion = Motion()
    history: History = History()
    hover: Hover | None = None
    tilt_handles: TiltHandles | None = None
    prompt: Prompt | None = None
    tasks: tuple[Task, ...] = ()
    preferences: Preferences = Preferences()
    recent: tuple[str, ...] = ()
    report: DrawReport | None = None
    inspection: Inspection = field(default_factory=Inspection)
    zoom: Zoom | None = None
    free_camera: FreeCamera | None = None
    poses: Poses | None = None
    depth: DepthSettings = AS_FOUND
    brush: Brush = field(default_factory=Brush)
    stroke: Stroke | None = None
    gloss_brush: GlossBrush = field(default_factory=GlossBrush)
    saved_edits: DepthEdits = UNEDITED
    saving: Saving | None = None
    exporting: Exporting | None = None
    downloading: Downloading | None = None
    has_chosen_focus: bool = False
    has_chosen_aperture: bool = False
    told_aperture: bool = False
    has_dialogs: bool = False
    left_field: FinishedField | None = None
    shown_generation: int = 0
    given_up: int = 0
    folder: PhotoFolder | None = None
    facts: FactsRead = NO_FACTS
    is_fullscreen: bool = False
    hides_panel: bool = False
    shows_before: bool = False
    keeps_sessions: bool = False

    @property
    def shown_optics(self) -> Optics:
        """What the picture on the screen is drawn with."""
        return Optics() if self.shows_before else self.optics

    @property
    def next_generation(self) -> int:
        """Of the next job."""
        return max(self.generation, self.given_up) + 1

    @property
    def has_unsaved_edits(self) -> bool:
        """Whether closing would lose what was done to the depth: no file has it, nor is it kept for the next time."""
        if self.keeps_sessions:
            return False
        return self.stroke is not None or self.depth.edits not in (UNEDITED, self.saved_edits)


@dataclass(frozen=True)
class Picture:
    """Everything the picture depends on: the scene's generation, how many views were uploaded, the optics, its size in
    pixels.

    samples: how far it has come on its way to the converged picture. previews: of edited depth, and of gloss,
    shown so far. part: what is drawn of it, as a share of it.
    """

    generation: int
    views_uploaded: int
    optics: Optics
    size_px: ScreenSize
    samples: int = 0
    previews: int = 0
    part: Rect = WHOLE
