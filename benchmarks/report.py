"""Prints the figures the README quotes: accuracy, speed of generation, invariances, window, refocus pass.

    python -m benchmarks.report                                     # what the bundled demo photo can show
    python -m benchmarks.report --data DATA --yardsticks BENCH      # with evaluation scenes and the yardstick scripts

DATA holds hci_antinous, blender_shop_9x9 and the Middlebury pairs; BENCH holds judge_views.py and plain_refocus.py.
Machines differ and are shared: quote medians and ratios.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import map_coordinates, maximum_filter, minimum_filter

from iibr_core.depth.search import open_with_depth
from iibr_core.formats.images.photo import read_photo
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_for_viewing, plan_literal
from iibr_core.runtime import tiling
from iibr_core.runtime.resources import resource_folder
from iibr_core.types import Disparity, GridShape, Photo, ViewOffset, ViewUpdate

SCENES = ["antinous", "teddy", "moebius", "motorcycle"]
REPEATS = 5
CENTRE = ViewOffset(0.0, 0.0)
SAME_SURFACE = 0.25
VIEW_PAIRS = [
    ((4, 8), (4, 6)),
    ((4, 8), (0, 8)),
    ((0, 4), (2, 4)),
    ((0, 0), (1, 1)),
    ((8, 8), (6, 6)),
    ((3, 1), (3, 2)),
]


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
    found = open_with_depth(path)
    return found.photo, plan_for_viewing(found.photo, found.disparity).field_disparity(found.disparity)


def views(photo: Photo, disparity: Disparity, nearest_to: ViewOffset = CENTRE) -> list[ViewUpdate]:
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

    reference = pixels(CENTRE)
    same_order = pixels(ViewOffset(3.0, -2.0)) == reference
    usual, tiling.MOST_BAND_PIXELS = tiling.MOST_BAND_PIXELS, 10_000
    same_bands = pixels(CENTRE) == reference
    tiling.MOST_BAND_PIXELS = usual
    words = {True: "identical", False: "DIFFERENT"}
    print(f"pixels in another order of views: {words[same_order]}; in other bands: {words[same_bands]}", flush=True)


def holes(photo: Photo, disparity: Disparity) -> None:
    """Inpainted content of one view, warped along its disparity into another that shows it too, must agree."""
    by_index = {(v.row, v.column): v for v in views(photo, disparity)}
    errors = np.concatenate([disagreement(by_index[a], by_index[b]) for a, b in VIEW_PAIRS])
    print(f"hole content between views: rms {np.sqrt(np.mean(errors**2)):.2f} / 255, {len(errors)} pixels", flush=True)


def disagreement(a: ViewUpdate, b: ViewUpdate) -> NDArray[np.float64]:
    """Differences (N, 3) in 1/255 where a pixel and its neighbours show one inpainted surface in both views."""
    (in_a, surface_a), (in_b, surface_b) = inpainted_surface(a), inpainted_surface(b)
    y, x = np.nonzero(in_a)
    d = surface_a[y, x]
    there = np.stack([y - d * (b.row - a.row), x - d * (b.column - a.column)])
    inside = ((there > 1) & (there < np.array(in_a.shape)[:, None] - 2)).all(axis=0)
    y, x, d, there = y[inside], x[inside], d[inside], there[:, inside]
    pixel = tuple(np.rint(there).astype(int))
    same = in_b[pixel] & (np.abs(surface_b[pixel] - d) < SAME_SURFACE)
    warped = [map_coordinates(b.colors[..., c].astype(float), there[:, same], order=1) for c in range(3)]
    return np.stack(warped, axis=-1) - a.colors[y[same], x[same]]


def inpainted_surface(view: ViewUpdate) -> tuple[NDArray[np.bool_], NDArray[np.float32]]:
    """Where all 3x3 pixels are inpainted and on one surface, and the disparity."""
    if view.disparity is None or view.inpainted is None:
        raise ValueError("a generated view has both")
    extent = maximum_filter(view.disparity, 3) - minimum_filter(view.disparity, 3)
    return minimum_filter(view.inpainted, 3) & (extent < SAME_SURFACE), view.disparity


if __name__ == "__main__":
    main()
