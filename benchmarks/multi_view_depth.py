"""Disparity found from the views of a light field: how right it is, what it costs, and what views between views gain.

    python -m benchmarks.multi_view_depth --data DATA [--no-views]

DATA holds light fields; where one has a true map of its centre view (gt_*.npy), bad pixels and the square error are
told, 15 px of border left out, as the HCI benchmark does. Every second view is held back, drawn from the others as the
window does it, and compared with the plain blend of the four views around it.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.refocus import read_views
from iibr_core.color import encoded_from_stored, srgb_from_linear
from iibr_core.depth.multi_view.estimate import estimate_coarse, estimate_disparity
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.formats.images.oiio_writer import write_image_file
from iibr_core.types import FloatImage, GridShape, ViewOffset
from viewer.app.headless import HeadlessViewer
from viewer.model.state.scene import Source

BORDER_PX = 15
BAD_PX = 0.07


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--no-views", action="store_true")
    options = parser.parse_args()
    for folder in (options.data, *sorted(options.data.iterdir())):
        if (folder / "views").is_dir() and len(list((folder / "views").iterdir())) >= 9:
            grid, views = read_views(folder)
            print(f"{folder.name}: {grid.columns}x{grid.rows} views")
            _judge_map(folder, grid, views)
            if not options.no_views:
                _judge_views(grid, views)


def _judge_map(folder: Path, grid: GridShape, views: NDArray[np.uint8]) -> None:
    offsets = [grid.offset(*at) for at in np.ndindex(*grid)]
    reference = grid.centre[0] * grid.columns + grid.centre[1]
    start = time.process_time()
    coarse = estimate_coarse(list(views), offsets, reference)
    between = time.process_time()
    values = estimate_disparity(list(views), offsets, reference, coarse.range_px)
    print(f"  coarse {between - start:.1f} s, whole {time.process_time() - start:.1f} s of processor time")
    for truth in sorted(folder.glob("gt_disp*.npy")):
        error = np.abs(values - np.load(truth))[BORDER_PX:-BORDER_PX, BORDER_PX:-BORDER_PX]
        known = np.isfinite(error)
        bad, square = (error[known] > BAD_PX).mean(), (error[known] ** 2).mean()
        print(f"  bad pixels (> {BAD_PX}) {100 * bad:.2f} %, square error x 100 {100 * square:.2f}")


def _judge_views(grid: GridShape, views: NDArray[np.uint8]) -> None:
    """PSNR of the views held back, drawn and blended."""
    flat = views.reshape(*grid, *views.shape[1:])
    kept = flat[::2, ::2]
    drawn, blended = [], []
    with tempfile.TemporaryDirectory() as folder:
        _write_views(Path(folder), kept)
        with HeadlessViewer() as viewer:
            viewer.open(Source(folder), 1.0, lambda progress: None)
            for row, column in _held_back(grid):
                eye = ViewOffset((row - 2 * (kept.shape[0] // 2)) / 2, (column - 2 * (kept.shape[1] // 2)) / 2)
                viewer.state = replace(viewer.state, optics=replace(viewer.state.optics, eye=eye))
                truth = encoded_from_stored(flat[row, column])
                drawn.append(bounded_psnr(srgb_from_linear(viewer.picture(is_linear=True)), truth))
                blended.append(bounded_psnr(_blend(kept, row / 2, column / 2), truth))
    print(f"  views held back: drawn {np.mean(drawn):.2f} dB, plain blend {np.mean(blended):.2f} dB")


def _held_back(grid: GridShape) -> Iterator[tuple[int, int]]:
    inside = (2 * ((length - 1) // 2) for length in grid)
    last_row, last_column = inside
    for row, column in np.ndindex(last_row + 1, last_column + 1):
        if row % 2 or column % 2:
            yield row, column


def _blend(kept: NDArray[np.uint8], row: float, column: float) -> FloatImage:
    rows, columns = {int(np.floor(row)), int(np.ceil(row))}, {int(np.floor(column)), int(np.ceil(column))}
    around = [encoded_from_stored(kept[r, c]) for r in rows for c in columns]
    return np.mean(around, axis=0, dtype=np.float32)


def _write_views(folder: Path, views: NDArray[np.uint8]) -> None:
    (folder / "views").mkdir()
    for row, column in np.ndindex(*views.shape[:2]):
        write_image_file(folder / "views" / f"v{row:02}_u{column:02}.png", views[row, column], "uint8")


if __name__ == "__main__":
    main()
