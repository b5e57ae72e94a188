"""The viewer's whole state, frozen. Everything the screen shows is a function of it.

Comparing two records decides what an edit costs: a new `generation` restarts the worker, a new `Picture` draws again.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace

from iibr_core.beyond.optics import Optics
from iibr_core.depth.editing.edits import Stroke
from iibr_core.exports.loops import LOOPS
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.scene import AS_FOUND, DepthSettings, Progress, Scene, Source
from iibr_core.scenes.screen_size import ScreenSize
from viewer.model.state.depth import Brush, Selection
from viewer.model.state.depth_models import DepthModels
from viewer.model.state.folder import PhotoFolder
from viewer.model.state.history import History
from viewer.model.state.inspection import Inspection
from viewer.model.state.jobs import FinishedExport, JobProgress
from viewer.model.state.lens import GlossBrush, TiltHandles
from viewer.model.state.notices import Notice
from viewer.model.state.photo_facts import NO_FACTS, PhotoFacts
from viewer.model.state.preferences import Preferences
from viewer.model.state.prompts import ExportPrompt, Prompt
from viewer.model.state.tasks import Task
from viewer.model.state.viewpoint import FreeCamera, Motion, Zoom


@dataclass(frozen=True)
class Hover:
    """Where the pointer is in the picture: pixels of it, and the disparity seen there (None where not known)."""

    x_px: float
    y_px: float
    disparity: float | None


@dataclass(frozen=True)
class DrawReport:
    """What is known of the picture drawn last.

    samples: drawn so far, of samples_converged. draw_ms: what the last drawing took.
    """

    samples: int = 0
    samples_converged: int = 0
    draw_ms: float = 0.0


@dataclass(frozen=True)
class AppState:
    """Everything. source is what was asked for last, scene what is open; generation numbers the worker's jobs.

    views_there: indices (row, column) of views made. stopped: the generation the user stopped. tilt_handles: None while
    they are hidden. tasks: not yet taken up. recent: paths opened, the latest first. report: None without a window.
    zoom: None where the whole picture is seen. free_camera: None on the plane of the views;
    free_progress: how much is done of what its views are made of, None when that is there. depth: what is made of the
    scene's depth; stroke: of the brush, while it is drawn. jobs: saves, copies and exports under way; quits_when_done:
    the window closes once there are none. has_chosen_focus, has_chosen_aperture: whether the user said in this scene
    what is sharp, and how wide the aperture is. has_dialogs: whether the system has file dialogs. shown_generation:
    whose views are shown. folder: the photos beside the one that is open, None before they are known. facts: what a
    photo's file says of it, perhaps of the one before. is_fullscreen, hides_panel: of the window, None: where that
    is_narrow, see `layout`; shows_before: the photo as it was taken stands in place of the picture. models: of depth.
    focused_at: the place (see focal_plane) that was clicked last to be sharp, None where the focus was set otherwise.
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
    exports: tuple[FinishedExport, ...] = ()
    last_export: ExportPrompt | None = None
    models: DepthModels = field(default_factory=DepthModels)
    chosen_focus: float | None = None
    focus_before: float | None = None
    has_chosen_aperture: bool = False
    focused_at: tuple[float, float] | None = None
    has_dialogs: bool = False
    shown_generation: int = 0
    folder: PhotoFolder | None = None
    facts: PhotoFacts = NO_FACTS
    is_fullscreen: bool = False
    hides_panel: bool | None = None
    is_narrow: bool = False
    shows_before: bool = False

    @property
    def at_rest(self) -> AppState:
        """The state that a viewpoint which moves by itself has left: what the user decided."""
        motion = self.motion
        if motion.kind not in LOOPS or motion.is_paused:
            return self
        return replace(self, optics=replace(self.optics, eye=motion.start), motion=Motion(speed=motion.speed))

    @property
    def shown_optics(self) -> Optics:
        """What the picture on the screen is drawn with."""
        return Optics() if self.shows_before else self.optics

    @property
    def is_panel_hidden(self) -> bool:
        """As the user wants it; else it gives way to the picture in a narrow window."""
        return self.is_narrow if self.hides_panel is None else self.hides_panel

    def with_task(self, task: Task) -> AppState:
        """Return the state with one more task for the outside world."""
        return replace(self, tasks=(*self.tasks, task))


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
