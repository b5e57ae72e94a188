"""Stacks of pictures: one focus after the other from far to near, or the aperture from a pinhole to its widest; beside
them what is sharp everywhere, and the disparity.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from iibr_core.exports.framing import draw_framed
from iibr_core.exports.pictures import saved_space, write_with_metadata
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.settings import ExportSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.images.picture_kinds import is_float
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.outputs import write_folder
from iibr_core.rendering.optics import Optics
from iibr_core.scenes.lens_limits import aperture_limit
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import FloatImage, ImageSize

OPENED = 0.8
"""Of the widest aperture, where it is closed."""

Stack = Sequence[tuple[str, Optics]]
"""Pictures by name."""
ALL_IN_FOCUS = "all_in_focus"


def focal_stack(scene: Scene, optics: Optics, count: int) -> Stack:
    """Focus by focus, from far to near."""
    far, near = scene.disparity_range_px
    opened = optics.aperture_diameter or OPENED * aperture_limit(scene.grid)
    focuses = np.linspace(far, near, count)
    return [
        (f"focus_{k:03d}", replace(optics, focus_disparity=float(focus), aperture_diameter=opened))
        for k, focus in enumerate(focuses)
    ]


def aperture_sweep(scene: Scene, optics: Optics, count: int) -> Stack:
    """Aperture by aperture, from a pinhole."""
    diameters = np.linspace(0.0, aperture_limit(scene.grid), count)
    return [
        (f"aperture_{k:03d}", replace(optics, aperture_diameter=float(diameter)))
        for k, diameter in enumerate(diameters)
    ]


def optics_of_focal_stack(scene: Scene, optics: Optics, settings: ExportSettings) -> list[Optics]:
    """Of its pictures, the one that is sharp everywhere last."""
    return [each for _, each in _with_all_in_focus(focal_stack(scene, optics, settings.frames), optics)]


def optics_of_aperture_sweep(scene: Scene, optics: Optics, settings: ExportSettings) -> list[Optics]:
    """Likewise."""
    return [each for _, each in _with_all_in_focus(aperture_sweep(scene, optics, settings.frames), optics)]


def _with_all_in_focus(stack: Stack, optics: Optics) -> Stack:
    return [*stack, (ALL_IN_FOCUS, replace(optics, aperture_diameter=0.0))]


def write_focal_stack(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """A folder of PNGs, or an OpenEXR file; so do the others, with TIFFs where their names say so.

    They raise InputError where it cannot be written, Cancelled once the export should stop.
    """
    _write(path, source, settings, focal_stack, ".png")


def write_focal_tiffs(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """16 bits a channel."""
    _write(path, source, settings, focal_stack, ".tif")


def write_aperture_sweep(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """See `aperture_sweep`."""
    _write(path, source, settings, aperture_sweep, ".png")


def write_aperture_tiffs(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """16 bits a channel."""
    _write(path, source, settings, aperture_sweep, ".tif")


def _write(
    path: Path,
    source: ExportSource,
    settings: ExportSettings,
    stack_of: Callable[[Scene, Optics, int], Stack],
    ending: str,
) -> None:
    stack = _with_all_in_focus(stack_of(source.scene, source.optics, settings.frames), source.optics)
    disparity = source.disparity_seen()
    if path.suffix.lower() == ".exr":
        _write_parts(path, source, settings.size, stack, disparity)
    else:
        _write_folder(path, source, settings.size, stack, disparity, ending)


def _write_folder(
    path: Path, source: ExportSource, size: ScreenSize, stack: Stack, disparity: FloatImage | None, ending: str
) -> None:
    space = saved_space(source)
    with write_folder(path) as unfinished:
        for name, optics in source.watched(stack, len(stack), "drawing"):
            place = unfinished / f"{name}{ending}"
            pixels = draw_framed(source, RenderSettings(optics, size, is_linear=is_float(place), color_space=space))
            write_with_metadata(place, pixels, source, color_space=space)
        if disparity is not None:
            write_pfm(unfinished / "disparity.pfm", disparity)


def _write_parts(
    path: Path, source: ExportSource, size: ScreenSize, stack: Stack, disparity: FloatImage | None
) -> None:
    """A part a picture, linear light; the one that is sharp everywhere has the disparity where their sizes agree."""
    from iibr_core.formats.images.exr_parts import COLORS, DISPARITY, ExrPart, write_exr_parts

    known = disparity if disparity is not None and disparity.shape == (size.height, size.width) else None

    def has_disparity(name: str) -> bool:
        return known is not None and name == ALL_IN_FOCUS

    def draw(name: str, optics: Optics) -> FloatImage:
        light = draw_framed(source, RenderSettings(optics, size, is_linear=True))
        return light if known is None or not has_disparity(name) else np.dstack([light, known])

    parts = [ExrPart(name, COLORS | (DISPARITY if has_disparity(name) else {})) for name, _ in stack]
    drawn = (draw(name, optics) for name, optics in source.watched(stack, len(stack), "drawing"))
    write_exr_parts(path, ImageSize(size.height, size.width), parts, drawn)
