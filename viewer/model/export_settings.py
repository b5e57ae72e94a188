"""What an export is made with where its options leave that to the kind: the window shows it, the export takes it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from iibr_core.formats.animations import even_size
from iibr_core.types import ImageSize
from viewer.model.export_kinds import ExportKind
from viewer.model.layout import ScreenSize
from viewer.model.state.app_state import Scene
from viewer.model.state.exporting import ANIMATIONS, AnimationKind, ExportOptions
from viewer.model.state.optics import Optics

USUAL_SECONDS = 4.0
"""Of an animation."""


@dataclass(frozen=True)
class ExportSettings:
    """As `ExportOptions`, with all choices made but for the display, which may be any. size: of each picture, for both
    eyes of one. eyes: view steps between them, or from the first picture of a quilt to its last.
    """

    size: ScreenSize
    device: str | None
    eyes: float
    motion: AnimationKind
    keys: Path | None
    frames: int
    rate: float
    row: int


def settle(kind: ExportKind, options: ExportOptions, scene: Scene, optics: Optics) -> ExportSettings:
    """What the user said, and what is usual of this kind where nothing was said."""
    rate = options.rate or kind.rate
    eyes = float(scene.grid.columns - 1) if options.eyes is None else options.eyes
    return ExportSettings(
        options.size or _usual_size(kind, scene, 1 - 2 * shear_margin(scene, optics, eyes)),
        options.device,
        eyes,
        options.motion or ANIMATIONS[0],
        options.keys,
        options.frames or kind.frames or max(round(USUAL_SECONDS * rate), 2),
        rate,
        scene.height // 2 if options.row is None else options.row,
    )


def shear_margin(scene: Scene, optics: Optics, span_views: float) -> float:
    """What of the width is cut off at each side for pictures that hold still what is in focus, over so many view steps
    about the middle of the grid.
    """
    middle = (scene.grid.columns - 1) / 2 - scene.grid.centre[1]
    return abs(optics.focus_disparity) * (abs(middle) + span_views / 2) / scene.width


def _usual_size(kind: ExportKind, scene: Scene, width_left: float) -> ScreenSize:
    """As large as the views. width_left: what shear leaves of their width, for eyes."""
    share = max(width_left, 1 / scene.width) if "eyes" in kind.heeds else 1.0
    width = min(max(round(share * scene.width), 1), kind.most_width_px or scene.width)
    size = ImageSize(max(round(scene.height * width / (share * scene.width)), 1), width)
    height, width = even_size(size) if kind.is_video else size
    return ScreenSize(width, height)
