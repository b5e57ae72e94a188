"""What an export is made with where its options leave that to the kind: the window shows it, the export takes it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from iibr_core.exports.kinds import ExportKind
from iibr_core.exports.options import ANIMATIONS, AnimationKind, ExportOptions
from iibr_core.formats.animations import even_size
from iibr_core.rendering.optics import Optics
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ImageSize

USUAL_SECONDS = 4.0
"""Of an animation."""
MOST_FRAMES = 10_000
RATE_LIMITS = 0.1, 240.0
"""Frames a second."""


@dataclass(frozen=True)
class ExportSettings:
    """As `ExportOptions`, with all choices made; device: None for any display. aspect: width / height of what there is
    to be seen in each picture. eyes: view steps from the first viewpoint to the last, of a quilt too.
    """

    size: ScreenSize
    aspect: float
    device: str | None
    eyes: float
    motion: AnimationKind
    keys: Path | None
    frames: int
    rate: float
    row: int
    show: bool
    budget: int | None = None
    credit: bool = False
    stills: bool = False


def resolve_settings(kind: ExportKind, options: ExportOptions, scene: Scene, optics: Optics) -> ExportSettings:
    """What the user said, and what is usual of this kind where nothing was said."""
    rate = options.rate or kind.rate
    eyes = float(scene.grid.columns - 1) if options.eyes is None else options.eyes
    width = scene.width
    if "eyes" in kind.supports:
        width = max(round(width * (1 - 2 * shear_margin(scene, optics, eyes))), 1)
    aspect = width / scene.height
    return ExportSettings(
        options.size or size_of_width(kind, aspect, min(width, kind.most_width_px or width)),
        aspect,
        options.device,
        eyes,
        options.motion or ANIMATIONS[0],
        options.keys,
        options.frames or kind.frames or max(round(USUAL_SECONDS * rate), 2),
        rate,
        scene.height // 2 if options.row is None else options.row,
        options.show,
        options.budget,
        options.credit,
        options.stills,
    )


def shear_margin(scene: Scene, optics: Optics, span_views: float) -> float:
    """What of the width is cut off at each side for pictures that hold still what is in focus, over so many view steps
    about the middle of the grid.
    """
    middle = (scene.grid.columns - 1) / 2 - scene.grid.centre[1]
    return abs(optics.focus_disparity) * (abs(middle) + span_views / 2) / scene.width


def size_of_width(kind: ExportKind, aspect: float, width: int) -> ScreenSize:
    """A size of about this aspect that the kind can have."""
    size = ImageSize(max(round(width / aspect), 1), width)
    height, width = even_size(size) if kind.is_video else size
    return ScreenSize(width, height)
