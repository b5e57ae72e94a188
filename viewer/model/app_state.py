"""The viewer's whole state, frozen. Everything the screen shows is a function of it.

Comparing two records decides what an edit costs: a new `generation` restarts the worker, new optics draw again.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Literal, TypeAlias

from iibr_core.beyond.optics import Optics
from iibr_core.exports.loops import LOOPS
from iibr_core.scenes.scene import AS_FOUND, DepthSettings, Progress, Scene, Source
from viewer.model.depth import Brush
from viewer.model.depth_models import DepthModels, ModelsPrompt
from viewer.model.history import History
from viewer.model.inspection import Hover, Inspection
from viewer.model.layout import Zoom
from viewer.model.lens import GlossBrush, TiltHandles
from viewer.model.messages import Notice
from viewer.model.preferences import Preferences
from viewer.model.stereo import Monitor, Stereo
from viewer.model.viewpoint import FreeCamera, Motion

if TYPE_CHECKING:
    from iibr_core.depth.editing.edits import Stroke
    from viewer.model.browsing import PathPrompt
    from viewer.model.commands import PalettePrompt
    from viewer.model.folder import PhotoFacts, PhotoFolder
    from viewer.model.look import Look
    from viewer.model.saving import ExportPrompt, FinishedFile, JobProgress, SavePrompt
    from viewer.model.selection import Selection
    from viewer.model.tasks import Task
    from viewer.model.tracking import Tracking
    from viewer.model.window import DrawReport

PlainPrompt = Literal["help", "about", "quit", "files"]
"""quit: whether to close although jobs are under way. files: the list of saved and exported files."""

Prompt: TypeAlias = "PathPrompt | SavePrompt | ExportPrompt | ModelsPrompt | PalettePrompt | PlainPrompt"


@dataclass(frozen=True)
class AppState:
    """The viewer's state.

    source was asked for last, scene is open; generation numbers the requests, shown_generation is that of the scene.
    views_there: (row, column) of views that were made. stopped: generation that the user stopped. tilt_handles: None
    while hidden. recent: paths, the latest first; existing_recent: those that were found on disk. report: None without
    a window. zoom: None for the whole picture.
    free_camera: None in the plane of the views; free_progress: share of its preparation, None once done. depth:
    refinement and edits; stroke: of the brush while it is drawn. chosen_focus: disparity that the user chose for this
    scene, focused_at: place that was clicked for it (see focal_plane), None without. restoring: optics now, and those
    that the photo was left with, while its views are made again with the depth that it was left with. facts: of a
    photo's file, perhaps of the one before. hides_panel: None to follow the window; hid_panel: the same before full
    screen. shows_before: whether the unchanged photo is shown. tracking: None unless the viewpoint follows the head.
    files: saved and exported in this run, the latest first. monitors: the connected ones, that of the window first.
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
    motion: Motion = field(default_factory=Motion)
    history: History = field(default_factory=History)
    hover: Hover | None = None
    tilt_handles: TiltHandles | None = None
    prompt: Prompt | None = None
    tasks: tuple[Task, ...] = ()
    preferences: Preferences = field(default_factory=Preferences)
    recent: tuple[str, ...] = ()
    existing_recent: tuple[str, ...] = ()
    report: DrawReport | None = None
    inspection: Inspection = field(default_factory=Inspection)
    zoom: Zoom | None = None
    free_camera: FreeCamera | None = None
    free_progress: float | None = None
    depth: DepthSettings = AS_FOUND
    brush: Brush = field(default_factory=Brush)
    selection: Selection | None = None
    stroke: Stroke | None = None
    gloss_brush: GlossBrush = field(default_factory=GlossBrush)
    jobs: tuple[JobProgress, ...] = ()
    quits_when_done: bool = False
    files: tuple[FinishedFile, ...] = ()
    last_export: ExportPrompt | None = None
    models: DepthModels = field(default_factory=DepthModels)
    chosen_focus: float | None = None
    focus_before: float | None = None
    has_chosen_aperture: bool = False
    focused_at: tuple[float, float] | None = None
    restoring: tuple[Optics, Optics] | None = None
    has_dialogs: bool = False
    shown_generation: int = 0
    folder: PhotoFolder | None = None
    facts: PhotoFacts | None = None
    is_fullscreen: bool = False
    hides_panel: bool | None = None
    hid_panel: bool | None = None
    is_narrow: bool = False
    shows_before: bool = False
    tracking: Tracking | None = None
    stereo: Stereo = field(default_factory=Stereo)
    monitors: tuple[Monitor, ...] = ()
    look: Look | None = None

    @property
    def at_rest(self) -> AppState:
        """The state without a motion that runs by itself: what the user decided."""
        motion = self.motion
        if motion.kind not in LOOPS or motion.is_paused:
            return self
        return replace(self, optics=replace(self.optics, eye=motion.start), motion=motion.stopped)

    @property
    def shown_optics(self) -> Optics:
        """Optics of the picture on the screen."""
        return Optics() if self.shows_before else self.optics

    @property
    def is_making_views(self) -> bool:
        """Whether a scene is being read, or views of it are being made."""
        progress, is_stopped = self.progress, self.stopped == self.generation
        return not (is_stopped or progress.is_complete) and bool(progress.doing or progress.total)

    @property
    def is_panel_hidden(self) -> bool:
        """Whether the panel is hidden: by the user, or in a narrow window, full screen or on a stereo picture."""
        has_no_room = self.is_narrow or self.is_fullscreen or self.stereo.fills_window
        return has_no_room if self.hides_panel is None else self.hides_panel

    def with_tasks(self, *tasks: Task) -> AppState:
        """Return the state with more tasks for the outside world."""
        return replace(self, tasks=(*self.tasks, *tasks))
