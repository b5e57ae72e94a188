"""Errors and time of disparity found from the views of light fields.

    python -m benchmarks disparity --data DATA

DATA holds light fields of 3x3 views and more, or is one. Errors are those of the HCI benchmark, without a border of 15
px, where the true map of the centre view is known. For all fields, disparity is also found from every second view, as
on a chessboard, and the views left out are warped to the centre by it: the PSNR of their median shows visible errors.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from scipy.ndimage import map_coordinates

from benchmarks.report import markdown
from iibr_core.color import encoded_from_stored
from iibr_core.depth.multi_view.estimate import estimate_coarse, estimate_disparity
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.order import grid_of
from iibr_core.formats.light_fields.views import read_views
from iibr_core.types import CENTRE, FloatImage, StoredColors, ViewOffset

CENTRE = CENTRE
HEAD = "light field", "views", "bad pixels (> 0.07 px), %", "square error x 100", "views left out, dB", "processor, s"


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True, help="a light field, or a folder of light fields")
    data: Path = parser.parse_args().data
    folders = [folder for folder in (data, *sorted(data.iterdir())) if len(list(folder.glob("views/*"))) >= 9]
    print(markdown(HEAD, map(judge, folders)))


def judge(folder: Path) -> list[str]:
    """Return the cells of a light field's row."""
    scene = open_light_field(folder)
    grid, read = grid_of(scene), list(read_views(scene)[1])
    views = {grid.offset(view.row, view.column): view.colors for view in read}
    find({at: colors[:64, :64] for at, colors in views.items()})  # compiles the kernels
    begin = time.process_time()
    found = find(views)
    seconds = f"{time.process_time() - begin:.1f}"
    known, truth, cells = scene.disparity.get(scene.centre), read[0].disparity, ["", ""]
    if known and known.is_truth and truth is not None:
        errors = np.abs(found - truth)[15:-15, 15:-15]
        errors = errors[np.isfinite(errors)]
        cells = [f"{100 * (errors > 0.07).mean():.2f}", f"{100 * (errors**2).mean():.2f}"]
    sparse = find({at: colors for at, colors in views.items() if (at.t + at.s) % 2 == 0})
    warped = [warp(colors, sparse, at) for at, colors in views.items() if (at.t + at.s) % 2]
    likeness = bounded_psnr(np.median(warped, axis=0), encoded_from_stored(views[CENTRE]))
    return [scene.name, f"{grid.rows}x{grid.columns}", *cells, f"{likeness:.2f}", seconds]


def find(views: dict[ViewOffset, StoredColors]) -> FloatImage:
    """Return the disparity (H, W) of the centre view."""
    colors, offsets = list(views.values()), list(views)
    coarse = estimate_coarse(colors, offsets, offsets.index(CENTRE))
    return estimate_disparity(colors, offsets, offsets.index(CENTRE), coarse.range_px)


def warp(colors: StoredColors, disparity: FloatImage, at: ViewOffset) -> FloatImage:
    """Return a view's colours (H, W, 3) at the places where the centre view shows the same points."""
    y, x = np.indices(disparity.shape)
    places = y - disparity * at.t, x - disparity * at.s
    channels = np.moveaxis(encoded_from_stored(colors), -1, 0)
    return np.stack([map_coordinates(channel, places, order=1, mode="nearest") for channel in channels], axis=-1)


if __name__ == "__main__":
    main()
