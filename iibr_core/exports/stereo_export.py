"""Two pictures, for the left and the right eye, in one file: side by side, one over the other, crossed, as anaglyph."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.exports.framing import draw_framed
from iibr_core.exports.options import ExportOptions
from iibr_core.exports.parallax import side_pictures
from iibr_core.exports.pictures import saved_space, write_with_metadata
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.settings import ExportSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.images.picture_kinds import BEST_QUALITY, PictureFormat
from iibr_core.formats.images.side_by_side import FULL_TAG, HALF_TAG, OVER_TAG, TAG
from iibr_core.formats.quilts import tagged
from iibr_core.rendering.optics import Optics
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace

Eyes = tuple[NDArray[Any], NDArray[Any]]


def full_path(path: Path, scene: Scene, options: ExportOptions) -> Path:
    """With the tag of pictures side by side."""
    return _named(path, FULL_TAG)


def half_path(path: Path, scene: Scene, options: ExportOptions) -> Path:
    """With the tag of pictures side by side, each of half the width."""
    return _named(path, HALF_TAG)


def over_path(path: Path, scene: Scene, options: ExportOptions) -> Path:
    """With the tag of one over the other."""
    return _named(path, OVER_TAG)


def _named(path: Path, tag: str) -> Path:
    """The path as it is where its name says in any known way how the two pictures lie, else with this tag."""
    found = TAG.search(path.stem)
    said = found and (OVER_TAG if found[3] else HALF_TAG if found[1] or found[2] else FULL_TAG)
    return path if said == tag else tagged(path, tag)


def optics_of_eyes(scene: Scene, optics: Optics, settings: ExportSettings) -> list[Optics]:
    """Of the left eye and the right one. Raises InputError as `draw_eyes` does."""
    return [eye.optics for eye in side_pictures(scene, RenderSettings(optics, settings.size), 2, settings.eyes)]


def draw_eyes(source: ExportSource, settings: ExportSettings, squeeze: int = 1, color_space: ColorSpace = SRGB) -> Eyes:
    """The left eye's picture and the right one's, (H, W, 3) uint8. squeeze: the width is divided by it.

    Raises InputError where what is in focus cannot be held still, Cancelled once the export should stop.
    """
    width, height = settings.size
    both = RenderSettings(source.optics, ScreenSize(max(width // squeeze, 1), height), color_space=color_space)
    eyes = side_pictures(source.scene, both, 2, settings.eyes)
    drawn = (draw_framed(source, eye, width / height) for eye in eyes)
    left, right = source.watched(drawn, 2, "drawing")
    return left, right


def write_side_by_side(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """The left eye's at the left."""
    _write(path, source, settings, np.hstack)


def write_half_side_by_side(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """The same, together as wide as one."""
    _write(path, source, settings, np.hstack, squeeze=2)


def write_over_under(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """The left eye's on top."""
    _write(path, source, settings, np.vstack)


def write_cross_eyed(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """The left eye's at the right, to be seen with crossed eyes."""
    _write(path, source, settings, lambda eyes: np.hstack(eyes[::-1]))


def write_anaglyph(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """For red-cyan glasses, the left eye's red; at the best quality, for coarser colour would mix the eyes."""
    from iibr_core.formats.stereo import anaglyph

    pixels = anaglyph(*draw_eyes(source, settings))
    write_with_metadata(path, pixels, source, PictureFormat(quality=BEST_QUALITY))


def _write(
    path: Path,
    source: ExportSource,
    settings: ExportSettings,
    join: Callable[[Eyes], NDArray[Any]],
    squeeze: int = 1,
) -> None:
    space = saved_space(source)
    pixels = join(draw_eyes(source, settings, squeeze, space))
    write_with_metadata(path, pixels, source, color_space=space)
