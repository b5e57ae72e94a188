"""Prints the figures the README quotes: accuracy, speed of generation, invariances, window, refocus pass.

    python -m benchmarks.report                                     # what the bundled demo photo can show
    python -m benchmarks.report --data DATA --yardsticks BENCH      # with evaluation scenes and the yardstick scripts

DATA holds hci_antinous, blender_shop_9x9 and the Middlebury pairs; BENCH holds judge_views.py and plain_refocus.py. Machines
differ and are shared: quote medians and ratios.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from scipy.ndimage import map_coordinates

from iibr_core import synthesis
from iibr_core.depth.sidecar import disparity_for
from iibr_core.formats.photo import read_photo
from iibr_core.generate import generate
from iibr_core.plan import plan_for_viewing, plan_literal
from iibr_core.resources import resource_folder
from iibr_core.types import Disparity, GridShape, Photo, ViewOffset, ViewUpdate

SCENES = ["antinous", "teddy", "moebius", "motorcycle"]
REPEATS = 5


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, help="folder of evaluation scenes")
    parser.add_argument("--yardsticks", type=Path, help="folder with judge_views.py and plain_refocus.py")
    options = parser.parse_args()
    if options.data and options.yardsticks:
        accuracy(options.yardsticks, options.data)
    photo, disparity = antinous(options.data) if options.data else demo_photo()
    generation(photo, disparity)
    order(photo, disparity)
    holes(photo, disparity)
    command(["-m", "benchmarks.window"])
    if options.data and options.yardsticks:
        yardstick = options.yardsticks / "plain_refocus.py"
        command(["-m", "benchmarks.refocus", "--data", options.data / "blender_shop_9x9", "--yardstick", yardstick])


def command(arguments: list[object]) -> None:
    """Run another benchmark in a process of its own."""
    subprocess.run([sys.executable, *map(str, arguments)], check=False)


def accuracy(yardsticks: Path, data: Path) -> None:
    print("accuracy (PSNR in dB; judge_views.py)", flush=True)
    iibr = Path(sys.executable).parent / "iibr"
    command([yardsticks / "judge_views.py", *SCENES, "--iibr", iibr, "--data", data])


def antinous(data: Path) -> tuple[Photo, Disparity]:
    folder = data / "hci_antinous"
    values = np.load(folder / "gt_disp_u04_v04.npy").astype(np.float32)
    return read_photo(folder / "views" / "v04_u04.png"), Disparity(values, "ground truth")


def demo_photo() -> tuple[Photo, Disparity]:
    """The bundled photo with the disparity that its viewing plan gives."""
    path = resource_folder("assets") / "motorcycle" / "motorcycle.png"
    photo = read_photo(path)
    given = disparity_for(photo, path)
    return photo, plan_for_viewing(photo, given).field_disparity(given)


def views(photo: Photo, disparity: Disparity, nearest_to: ViewOffset = ViewOffset(0.0, 0.0)) -> list[ViewUpdate]:  # noqa: B008
    plan = plan_literal(photo, disparity, GridShape(9, 9))
    return list(generate(photo, disparity, plan, nearest_to=lambda: nearest_to))


def generation(photo: Photo, disparity: Disparity) -> None:
    views(photo, disparity)  # compiles
    seconds = []
    for _ in range(REPEATS):
        start = time.perf_counter()
        views(photo, disparity)
        seconds.append(time.perf_counter() - start)
    height, width = photo.size
    print(
        f"generation: 9x9 views of {width}x{height}: {np.median(seconds):.2f} s (least {min(seconds):.2f}),"
        f" {np.median(seconds) / 81 * 1e3:.1f} ms a view",
        flush=True,
    )


def order(photo: Photo, disparity: Disparity) -> None:
    """Other orders of views and other bands must not change a pixel."""

    def pixels(nearest_to: ViewOffset) -> dict[tuple[int, int], bytes]:
        return {(v.row, v.column): v.colors.tobytes() for v in views(photo, disparity, nearest_to)}

    reference = pixels(ViewOffset(0.0, 0.0))
    same_order = pixels(ViewOffset(3.0, -2.0)) == reference
    synthesis.MOST_BAND_PIXELS, bands = 10_000, synthesis.MOST_BAND_PIXELS
    same_bands = pixels(ViewOffset(0.0, 0.0)) == reference
    synthesis.MOST_BAND_PIXELS = bands
    print(
        f"order of views: {'identical' if same_order else 'DIFFERENT'}, other bands: {'identical' if same_bands else 'DIFFERENT'}"
    )


def holes(photo: Photo, disparity: Disparity) -> None:
    """Inpainted content of one view, warped along its disparity into another that shows it too, must agree."""
    by_index = {(v.row, v.column): v for v in views(photo, disparity)}
    errors = []
    for a, b in [
        ((4, 8), (4, 6)),
        ((4, 8), (0, 8)),
        ((0, 4), (2, 4)),
        ((0, 0), (1, 1)),
        ((8, 8), (6, 6)),
        ((3, 1), (3, 2)),
    ]:
        errors.append(disagreement(by_index[a], by_index[b]))
    print(f"hole content between views: rms {np.sqrt(np.mean(np.concatenate(errors) ** 2)):.2f} / 255")


def disagreement(a: ViewUpdate, b: ViewUpdate) -> np.ndarray:
    """Differences (in 1/255) at the pixels of a's holes that b shows too, away from other surfaces."""
    assert a.disparity is not None and b.disparity is not None and a.inpainted is not None
    y, x = np.nonzero(a.inpainted)
    d = a.disparity[y, x]
    there = np.stack([y - d * (b.row - a.row), x - d * (b.column - a.column)])
    height, width = d.shape[0], b.disparity.shape[1]
    inside = ((there > 2) & (there < np.array([[b.disparity.shape[0] - 3], [width - 3]]))).all(axis=0)
    block = np.rint(there[:, inside]).astype(int)
    near = [np.abs(b.disparity[block[0] + j, block[1] + i] - d[inside]) < 0.25 for j in (-1, 0, 1) for i in (-1, 0, 1)]
    shown = np.all(near, axis=0)
    warped = np.stack(
        [map_coordinates(b.colors[..., c].astype(float), there[:, inside][:, shown], order=3) for c in range(3)]
    )
    return warped.T - a.colors[y[inside][shown], x[inside][shown]].astype(float)


if __name__ == "__main__":
    main()
