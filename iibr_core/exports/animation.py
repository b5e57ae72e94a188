"""Animations: the viewpoint on a loop, focus or aperture going back and forth, or a camera path from a file.

Every path is closed: the last frame leads to the first.
"""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from iibr_core.beyond.optics import Optics
from iibr_core.exports.framing import draw_framed
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.loops import point_on_loop, rack_share
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.exports.stack import open_diameter
from iibr_core.formats.animations import write_animation
from iibr_core.formats.files import read_text
from iibr_core.scenes.lens_limits import clamp_optics
from iibr_core.scenes.scene import Scene
from iibr_core.types import ImageSize, InputError, ViewOffset

MAX_KEYS = 1000


def write_motion(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Write an animation."""
    size = ImageSize(options.size.height, options.size.width)
    frames = optics_on_path(source.scene, source.optics, options)
    drawn = (draw_framed(source, RenderSettings(optics, options.size)) for optics in frames)
    write_animation(path, source.watched(drawn, options.frames, "drawing frames"), size, options.rate)


def optics_on_path(scene: Scene, optics: Optics, options: ExportOptions) -> list[Optics]:
    """Return the optics of every frame, evenly spread over a closed path."""
    turns = [k / options.frames for k in range(options.frames)]
    if options.keys is None:
        return [_on_motion(scene, optics, options, turn) for turn in turns]
    keys = read_keys(options.keys)
    if any(not _is_within(scene, _between(keys, k / len(keys), optics)) for k in range(len(keys))):
        raise InputError(f"{options.keys}: a key lies beyond what {scene.name} has; take smaller numbers")
    return [clamp_optics(_between(keys, turn, optics), scene) for turn in turns]


def read_keys(path: Path) -> list[tuple[float, ...]]:
    """Return the keys of a camera path, each (s, t), (s, t, focus) or (s, t, focus, aperture).

    The file has one key a line, and comments that begin with #.
    """
    keys: list[tuple[float, ...]] = []
    for number, line in enumerate(read_text(path).splitlines(), 1):
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
    if not 1 <= len(keys) <= MAX_KEYS:
        raise InputError(f"{path}: holds {len(keys)} keys; give 1 to {MAX_KEYS} lines: s t [focus [aperture]]")
    return keys


def _between(keys: Sequence[tuple[float, ...]], turn: float, optics: Optics) -> Optics:
    """Return the optics on the closed Catmull-Rom spline through the keys; short keys keep the given optics."""
    kept = (0.0, 0.0, optics.focus_disparity, optics.aperture_diameter)
    whole = np.array([(*key, *kept[len(key) :]) for key in keys])
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
    wanted, allowed = ((*o.eye, o.focus_disparity, o.aperture_diameter) for o in (optics, clamp_optics(optics, scene)))
    return np.allclose(wanted, allowed, atol=1e-6)


def _on_motion(scene: Scene, optics: Optics, options: ExportOptions, turn: float) -> Optics:
    wave = (1 - math.cos(2 * math.pi * turn)) / 2
    diameter = open_diameter(scene, optics)
    far, near = scene.disparity_range_px
    match options.motion:
        case "rack":
            start, end = options.rack or (near, far)
            focus = start + rack_share(turn) * (end - start)
            return clamp_optics(replace(optics, focus_disparity=focus, aperture_diameter=diameter), scene)
        case "focus":
            return replace(optics, focus_disparity=near + wave * (far - near), aperture_diameter=diameter)
        case "aperture":
            return replace(optics, aperture_diameter=wave * diameter)
    return replace(optics, eye=point_on_loop(options.motion, turn, scene.grid))
