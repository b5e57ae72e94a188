"""Focal stacks: pictures focused from far to near, a picture that is sharp everywhere, and the disparity."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from iibr_core.beyond.optics import Optics
from iibr_core.exports.framing import draw_framed
from iibr_core.exports.kinds import STACK_BITS, ExportOptions
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.images.picture_kinds import PictureFormat
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.outputs import write_folder
from iibr_core.scenes.lens_limits import aperture_of_disc
from iibr_core.scenes.scene import Scene
from iibr_core.types import CENTRE, InputError

OPENED_DISC = 0.03
"""Widest disc as a share of the picture's width, if an open aperture is needed and the window shows a closed one."""


def open_diameter(scene: Scene, optics: Optics) -> float:
    """Return the diameter of the aperture in view steps, opened if it is closed."""
    return optics.aperture_diameter or aperture_of_disc(scene, OPENED_DISC)


def focal_stack(scene: Scene, optics: Optics, count: int) -> dict[str, Optics]:
    """Return the optics of `count` pictures from the farthest to the nearest focus by name, then of the sharp one."""
    far, near = scene.disparity_range_px
    diameter = open_diameter(scene, optics)
    stack = {
        f"focus_{k:03d}": replace(optics, focus_disparity=float(focus), aperture_diameter=diameter)
        for k, focus in enumerate(np.linspace(far, near, count))
    }
    return stack | {"all_in_focus": replace(optics, aperture_diameter=0.0)}


def optics_of_stack(scene: Scene, optics: Optics, options: ExportOptions) -> list[Optics]:
    """Return the optics of all pictures of a stack."""
    return list(focal_stack(scene, optics, options.frames).values())


def write_focal_stack(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Write a folder of PNGs, with the disparity of the centre view if that is the viewpoint."""
    if options.bits not in STACK_BITS:
        raise InputError(f"{options.bits} bits: PNGs have {' or '.join(map(str, STACK_BITS))} bits a channel")
    form, space = PictureFormat(options.bits), source.color_space
    stack = focal_stack(source.scene, source.optics, options.frames)
    disparity = source.centre_view().disparity if source.optics.eye == CENTRE else None
    with write_folder(path) as folder:
        for name, optics in source.watched(stack.items(), len(stack), "drawing"):
            settings = RenderSettings(optics, options.size, is_linear=options.bits > 8, color_space=space)
            source.write_picture(folder / f"{name}.png", draw_framed(source, settings), form, space)
        if disparity is not None:
            write_pfm(folder / "disparity.pfm", disparity)
