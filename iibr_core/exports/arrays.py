"""All views as NumPy arrays in one file."""

from contextlib import closing
from math import prod
from pathlib import Path

import numpy as np

from iibr_core.exports.cameras import colors_of
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.source import ExportSource
from iibr_core.formats.outputs import write_file
from iibr_core.method.memory import require_memory


def write_arrays(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Write all views, their known disparity and their places as arrays of an NPZ file.

    views: (rows, columns, H, W, 3), bytes, sRGB-encoded. disparity: (rows, columns, H, W), float32, in pixels per view
    step, larger is nearer, NaN where it is not known. offsets: (rows, columns, 2), steps down and right of the centre.
    """
    scene, grid = source.scene, source.scene.grid
    shape = (*grid, scene.height, scene.width)
    require_memory(7 * prod(shape), f"{grid.columns} x {grid.rows} views of {scene.name} as arrays")
    views, disparity = np.zeros((*shape, 3), np.uint8), np.full(shape, np.nan, np.float32)
    with closing(source.views(with_disparity=True)) as made:
        for view in made:
            views[view.row, view.column] = colors_of(view)
            if view.disparity is not None:
                disparity[view.row, view.column] = view.disparity
    offsets = np.array([grid.offset(*place) for place in np.ndindex(*grid)], np.float32).reshape(*grid, 2)
    with write_file(path) as temporary, temporary.open("wb") as file:
        np.savez(file, views=views, disparity=disparity, offsets=offsets)
