"""A matte of one surface: white where the picture shows it, grey where its edge covers a pixel in part."""

from pathlib import Path

import numpy as np

from iibr_core.depth.editing.bucket import surface_at
from iibr_core.depth.editing.edits import Stroke, extent_of
from iibr_core.depth.guided_filter import GuidedFilter
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.lens_maps import at_own_size, write_grey
from iibr_core.exports.source import ExportSource
from iibr_core.scenes.lens_choice import require_inside
from iibr_core.types import InputError

HOLE_RADIUS = 0.01
"""Radius of the largest hole in a surface that belongs to it, as a share of the picture's width."""
EDGE_RADIUS_PX, EDGE_VARIANCE = 2, 1e-3
"""Window in which an edge follows the colours, and the variance of grey below which it is not moved."""


def write_matte(path: Path, source: ExportSource, options: ExportOptions) -> str:
    """Write the matte of the surface at `options.at`; return a sentence about the file."""
    if options.at is None:
        raise InputError(f"{path}: which surface? give a place of it, in pixels from the left and the top")
    (x, y), (width, height) = options.at, require_inside(options.at, source.scene)
    photo = at_own_size(source)
    stroke = Stroke("fill", ((x / width, y / height),), HOLE_RADIUS, 1.0, tolerance=options.tolerance)
    surface = surface_at(photo.colors, photo.disparity, stroke, 0, extent_of(photo.disparity))
    matte = surface.astype(np.float32)
    grey = np.ascontiguousarray(photo.colors.mean(axis=2), np.float32)
    GuidedFilter(grey, EDGE_RADIUS_PX, EDGE_VARIANCE).apply(matte[None])
    write_grey(path, np.clip(matte, 0, 1))
    return f"The surface at {x:g},{y:g} fills {surface.mean():.1%} of the picture."
