"""Disparity found from the views of a light field: how right it is, what it costs, and what views between views gain.

    python -m benchmarks.multi_view_depth --data DATA

Of light fields below DATA with 3x3 views and more. If one has a true map of its centre view (gt_*.npy), bad pixels
and the square error are given, 15 px of border left out, as the HCI benchmark does. Every second view is held back,
drawn from the others as the window does it, and compared with the plain blend of the four views around it.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.harness.bench_scenes import offsets_of, read_views
from benchmarks.harness.reports import emit, head, parser_of, row, start
from benchmarks.harness.timing import cost_of
from iibr_core.color import encoded_from_stored, srgb_from_linear
from iibr_core.depth.multi_view.estimate_disparity import estimate_coarse, estimate_disparity
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.formats.images.write import write_image
from iibr_core.scenes.scene import Source
from iibr_core.types import FloatImage, GridShape, ViewOffset
from viewer.app.headless import HeadlessViewer

BORDER_PX = 15
BAD_PX = 0.07


def main() -> None:
    parser = parser_of(__doc__, data={"required": True})
    emit(report(parser.parse_args().data))


def report(data: Path) -> Iterator[str]:
    names = f"bad pixels (> {BAD_PX}), %", "square error x 100", "views held back: drawn, dB", "plain blend, dB"
    yield head("light field", "views", "coarse, s of processor time", "whole, s", *names)
    for folder in (data, *sorted(data.iterdir())):
        if (folder / "views").is_dir() and len(list((folder / "views").iterdir())) >= 9:
            views = read_views(folder)
            yield row(folder.name, "{}x{}".format(*views.shape[:2]), *judge_map(folder, views), *judge_views(views))


def judge_map(folder: Path, views: NDArray[np.uint8]) -> Iterator[str]:
    """Seconds, and errors of the map where the true one is known."""
    grid, each = GridShape(*views.shape[:2]), list(views.reshape(-1, *views.shape[2:]))
    about = each, list(offsets_of(grid)), grid.centre[0] * grid.columns + grid.centre[1]
    found = []
    coarse = cost_of(lambda: found.append(estimate_coarse(*about).range_px))
    whole = cost_of(lambda: found.append(estimate_disparity(*about, found[0])))
    yield f"{coarse.cpu_s:.1f}"
    yield f"{(coarse + whole).cpu_s:.1f}"
    truth = next(iter(sorted(folder.glob("gt_disp*.npy"))), None)
    if truth is None:
        yield from ("", "")
        return
    error = np.abs(found[1] - np.load(truth))[BORDER_PX:-BORDER_PX, BORDER_PX:-BORDER_PX]
    known = np.isfinite(error)
    yield f"{100 * (error[known] > BAD_PX).mean():.2f}"
    yield f"{100 * (error[known] ** 2).mean():.2f}"


def judge_views(views: NDArray[np.uint8]) -> list[str]:
    """PSNR of the views held back, drawn and blended."""
    kept, errors = views[::2, ::2], []
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "views").mkdir()
        for v, u in np.ndindex(*kept.shape[:2]):
            write_image(Path(folder, "views", f"v{v:02}_u{u:02}.png"), kept[v, u])
        with HeadlessViewer() as viewer:
            viewer.open(Source(folder))
            for v, u in np.ndindex(*(2 * length - 1 for length in kept.shape[:2])):
                if v % 2 or u % 2:
                    eye = ViewOffset(v / 2 - kept.shape[0] // 2, u / 2 - kept.shape[1] // 2)
                    viewer.state = replace(viewer.state, optics=replace(viewer.state.optics, eye=eye))
                    made = srgb_from_linear(viewer.picture(is_linear=True)), blend(kept, v, u)
                    errors.append([bounded_psnr(image, encoded_from_stored(views[v, u])) for image in made])
    return [f"{mean:.2f}" for mean in np.mean(errors, axis=0)]


def blend(kept: NDArray[np.uint8], v: int, u: int) -> FloatImage:
    """The mean of the kept views around one, which stands at half its index among them."""
    around = product({v // 2, -(-v // 2)}, {u // 2, -(-u // 2)})
    return np.mean([encoded_from_stored(kept[at]) for at in around], axis=0, dtype=np.float32)


if __name__ == "__main__":
    start("benchmarks.multi_view_depth", main)
