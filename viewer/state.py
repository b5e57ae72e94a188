"""The viewer's whole state, frozen. Everything the screen shows is a function of it; comparing two records decides a redraw."""

from __future__ import annotations

from dataclasses import dataclass, field

from iibr_core.plan import ScenePlan
from iibr_core.types import GridShape, ViewOffset


@dataclass(frozen=True)
class Optics:
    """What the virtual camera does.

    eye: viewpoint in view steps (t down, s right). focus_disparity: the field disparity that is sharp (px per view step).
    aperture_diameter: in view steps, 0 = pinhole. exposure_stops: brightness as a power of two.
    """

    eye: ViewOffset = ViewOffset(0.0, 0.0)
    focus_disparity: float = 0.0
    aperture_diameter: float = 0.0
    exposure_stops: float = 0.0


@dataclass(frozen=True)
class Scene:
    """What is open: a photo with its plan, or a light field from disk (plan None)."""

    path: str
    name: str
    width: int
    height: int
    grid: GridShape
    disparity_range_px: tuple[float, float]
    depth_source: str
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
    """Everything."""

    optics: Optics = field(default_factory=Optics)
    scene: Scene | None = None
    progress: Progress = field(default_factory=Progress)
    notices: tuple[Notice, ...] = ()
    depth_strength: float = 1.0
    generation: int = 0
    should_quit: bool = False
