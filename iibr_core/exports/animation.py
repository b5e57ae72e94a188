"""Animations: the viewpoint on its loops, the focus or the aperture going and coming back, or a path of the user's own.

Every path is closed: the last frame leads to the first.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from iibr_core.exports.framing import draw_framed
from iibr_core.exports.loops import point_on_loop
from iibr_core.exports.options import AnimationKind
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.settings import ExportSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.animations import require_video_size, write_animation
from iibr_core.formats.files import read_text
from iibr_core.rendering.optics import Optics
from iibr_core.scenes.lens_limits import aperture_limit, clamp_optics
from iibr_core.scenes.scene import Scene
from iibr_core.types import ImageSize, InputError, ViewOffset

OPENED = 0.8
"""Of the widest aperture, for motions that need an open one."""
MOST_PATH_BYTES = 1_000_000
MOST_KEYS = 1000


def write_motion(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """Raises InputError where it cannot be written, Cancelled once the export should stop."""
    size = ImageSize(settings.size.height, settings.size.width)
    require_video_size(path, size)
    optics = optics_on_path(source.scene, source.optics, settings)
    drawn = (draw_framed(source, RenderSettings(each, settings.size)) for each in optics)
    frames = source.watched(drawn, settings.frames, "drawing frames")
    write_animation(path, frames, size, settings.rate)


def optics_on_path(scene: Scene, optics: Optics, settings: ExportSettings) -> list[Optics]:
    """One a frame, evenly spread over one turn of a closed path. Raises InputError for a path that cannot be read."""
    turns = [k / settings.frames for k in range(settings.frames)]
    if settings.keys is not None:
        keys = read_keys(settings.keys)
        if any(not _is_within(scene, _between(keys, k / len(keys), optics)) for k in range(len(keys))):
            raise InputError(f"{settings.keys}: a key lies beyond what {scene.name} has; take smaller numbers")
        return [clamp_optics(_between(keys, turn, optics), scene) for turn in turns]
    return [_on_motion(scene, optics, settings.motion, turn) for turn in turns]


def read_keys(path: Path) -> list[tuple[float, ...]]:
    """A path of the user's own: a text with a line a key, "s t focus aperture", the last two as they are where they are
    left out; # begins a comment. Raises InputError.
    """
    keys: list[tuple[float, ...]] = []
    for number, line in enumerate(read_text(path, MOST_PATH_BYTES).splitlines(), 1):
        words = line.split("#")[0].replace(",", " ").split()
        if not words:
            continue
        try:
            values = tuple(map(float, words))
        except ValueError:
            values = ()
        if not 2 <= len(values) <= 4 or not all(map(math.isfinite, values)):
            raise InputError(f"{path}: line {number} is not a key; give numbers: s t [focus [aperture]]")
        keys.append(values)
    if not 1 <= len(keys) <= MOST_KEYS:
        raise InputError(f"{path}: holds {len(keys)} keys; give 1 to {MOST_KEYS} lines: s t [focus [aperture]]")
    return keys


def _between(keys: Sequence[tuple[float, ...]], turn: float, optics: Optics) -> Optics:
    """On the closed Catmull-Rom spline through the keys; what a key leaves out is the optics'."""
    whole = np.array([(*key, optics.focus_disparity, optics.aperture_diameter)[:4] if len(key) == 2 else
                      (*key, optics.aperture_diameter)[:4] for key in keys])  # fmt: skip
    at = turn * len(keys)
    first, x = int(at), at - int(at)
    a, b, c, d = (whole[(first + i) % len(keys)] for i in (-1, 0, 1, 2))
    s, t, focus, aperture = b + x / 2 * (c - a + x * (2 * a - 5 * b + 4 * c - d + x * (3 * (b - c) + d - a)))
    return replace(
        optics,
        eye=ViewOffset(float(t), float(s)),
        focus_disparity=float(focus),
        aperture_diameter=max(float(aperture), 0.0),
    )


def _is_within(scene: Scene, optics: Optics) -> bool:
    allowed = clamp_optics(optics, scene)
    asked, taken = ((*o.eye, o.focus_disparity, o.aperture_diameter) for o in (optics, allowed))
    return np.allclose(asked, taken, atol=1e-6)


def _on_motion(scene: Scene, optics: Optics, motion: AnimationKind, turn: float) -> Optics:
    wave = (1 - math.cos(2 * math.pi * turn)) / 2
    opened = optics.aperture_diameter or OPENED * aperture_limit(scene.grid)
    match motion:
        case "focus":
            far, near = scene.disparity_range_px
            return replace(optics, focus_disparity=near + wave * (far - near), aperture_diameter=opened)
        case "aperture":
            return replace(optics, aperture_diameter=wave * opened)
    return replace(optics, eye=point_on_loop(motion, turn, scene.grid))
