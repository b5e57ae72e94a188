"""The viewer's whole state, frozen. Everything the screen shows is a function of it.

Comparing two records decides what an edit costs: a new `generation` restarts the worker, a new `Picture` draws anew.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from iibr_core.plan import ScenePlan
from iibr_core.types import GridShape, Quality, ViewOffset

CENTRE = ViewOffset(0.0, 0.0)


@dataclass(frozen=True)
class Optics:
    """What the virtual camera does.

    eye: viewpoint in view steps (t down, s right). focus_disparity: the field disparity that is sharp (px per
    view step). aperture_diameter: in view steps, 0 = pinhole. exposure_stops: brightness as a power of two.
    """

    eye: ViewOffset = CENTRE
    focus_disparity: float = 0.0
    aperture_diameter: float = 0.0
    exposure_stops: float = 0.0


@dataclass(frozen=True)
class Source:
    """What to open and what the user decided about it; None leaves the choice to the program.

    path: a photo or a light-field folder. disparity_path, disparity_scale: see `iibr_core.depth.sidecar.disparity_for`.
    focus_disparity: in the units of the given disparity. quality: where the ray transformer runs.
    """

    path: str
    disparity_path: str | None = None
    disparity_scale: float = 1.0
    grid: GridShape | None = None
    focus_disparity: float | None = None
    max_pixels: int | None = None
    memory_bytes: int | None = None
    quality: Quality = "fast"


@dataclass(frozen=True)
class Scene:
    """What is open: a photo with its plan, or a light field from disk (plan None).

    has_view_disparity: whether every view comes with its own disparity.
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


@dataclass(frozen=True)
class Progress:
    """How far the worker is: views done of total, in seconds; doing says what in words when no views are counted."""

    done: int = 0
    total: int = 0
    seconds: float = 0.0
    doing: str = ""


@dataclass(frozen=True)
class Notice:
    """A message the user can dismiss."""

    text: str
    is_error: bool = False


@dataclass(frozen=True)
class AppState:
    """Everything. source is what was asked for last, scene what is open; generation numbers the worker's jobs."""

    optics: Optics = field(default_factory=Optics)
    source: Source | None = None
    scene: Scene | None = None
    progress: Progress = field(default_factory=Progress)
    notices: tuple[Notice, ...] = ()
    depth_strength: float = 1.0
    generation: int = 0
    should_quit: bool = False


@dataclass(frozen=True)
class Picture:
    """Everything the picture depends on: the scene's generation, the views present, the optics, its size in pixels."""

    generation: int
    views_present: int
    optics: Optics
    size_px: tuple[int, int]
