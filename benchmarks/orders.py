"""Light fields whose files are named in a wrong order, or whose rows stand closer together: are they opened right?

    python -m benchmarks orders [--seeds 8]

Fields are rendered of random scenes, of several grids, and written as people name them. "right": the disparity of the
centre view is the true one; "refused": an error names the remedy; "wrong": neither. The last column is the time of the
test of the order as a share of the time of finding disparity.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from benchmarks.report import markdown
from iibr_core.color import bytes_from_encoded
from iibr_core.depth.multi_view.order_by_parallax import find_order
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.order import Arrangement, places_in
from iibr_core.formats.light_fields.views import in_order_of, read_views
from iibr_core.scenes.light_fields import find_disparity
from iibr_core.scenes.scene import Source
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import RaycastScene, render
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset

SIZE = ImageSize(150, 200)
GRIDS = GridShape(5, 5), GridShape(3, 3), GridShape(4, 6), GridShape(7, 3), GridShape(9, 9)
LINES = GridShape(1, 16), GridShape(1, 21), GridShape(1, 25)
MAX_DISPARITY_PX = 2.5
NOISE = 1.0
"""Standard deviation of noise, of 255."""
HEAD = "scene", "grid", "files", "outcome", "note", "order, % of the time"

ORDERS: dict[str, tuple[Arrangement, bool]] = {
    "as named": (Arrangement("rows", None, "none"), True),
    "columns first": (Arrangement("columns", None, "none"), True),
    "column by column": (Arrangement("columns", None, "none"), False),
    "columns mirrored": (Arrangement("rows", None, "x"), True),
    "rows mirrored": (Arrangement("rows", None, "y"), False),
    "from behind": (Arrangement("rows", None, "xy"), True),
    "every other row backwards": (Arrangement("snake", None, "none"), False),
    "rows 0.4 apart": (Arrangement("rows", None, "none", 0.4), True),
}
"""Orders, and whether names have two numbers."""


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seeds", type=int, default=8)
    rows = []
    for seed in range(parser.parse_args().seeds):
        rng = np.random.default_rng(100 + seed)
        scene = random_scene(rng, SIZE, MAX_DISPARITY_PX)
        for number, (files, (order, has_two)) in enumerate(ORDERS.items()):
            grid = GRIDS[(seed + number) % len(GRIDS)]
            rows.append([str(seed), f"{grid.rows}x{grid.columns}", files, *judge(scene, grid, order, has_two, rng)])
        line = LINES[seed % len(LINES)]
        numbered = judge(scene, line, Arrangement("rows", None, "none"), False, rng)
        rows.append([str(seed), f"1x{line.columns}", "a row, numbered", *numbered])
    print(markdown(HEAD, rows))
    outcomes = [row[3].split()[0] for row in rows]
    print(*(f"{outcomes.count(outcome)} {outcome}" for outcome in ("right", "refused", "wrong")), sep=", ")


def judge(
    scene: RaycastScene, grid: GridShape, order: Arrangement, has_two: bool, rng: np.random.Generator
) -> list[str]:
    """Return the outcome, the note, and the time of a field."""
    step = order.row_step or 1.0
    with tempfile.TemporaryDirectory() as folder:
        for row, column in np.ndindex(*grid):
            t, s = grid.offset(row, column)
            colors = render(scene, SIZE, ViewOffset(t * step, s))[0]
            noisy = colors + rng.normal(0, NOISE / 255, colors.shape).astype(np.float32)
            write(Path(folder), bytes_from_encoded(noisy), name_of((row, column), grid, order, has_two))
        truth = render(scene, SIZE, ViewOffset(0.0, 0.0), samples=1)[1]
        try:
            field = open_light_field(Path(folder))
            views = in_order_of(field, list(read_views(field)[1]))
            begin = time.process_time()
            find_order(field, [view.colors for view in views])
            middle = time.process_time()
            _, found, notes = find_disparity(Source(folder))
            share = f"{100 * (middle - begin) / (time.process_time() - middle):.0f}"
        except InputError as error:
            return [f"refused ({error})".replace(folder, "FOLDER"), "", ""]
    away, turned = (float(np.median(np.abs(sign * found - truth))) for sign in (1, -1))
    span = float(np.ptp(truth))
    is_right = away < min(0.1 * span, 0.25) and away < turned
    outcome = "right" if is_right else f"wrong (off by {away:.2f} of {span:.1f} px)"
    return [outcome, " ".join(notes), share]


def name_of(place: tuple[int, int], grid: GridShape, order: Arrangement, has_two: bool) -> str:
    """Return the name of a view, counted in this order."""
    sides = grid[::-1] if "columns" in (order.order or "") else grid
    numbers = list(np.ndindex(*sides)) if has_two else [(k,) for k in range(grid.rows * grid.columns)]
    at = places_in(numbers, Arrangement(order.order, grid, order.flip)).index(place)
    return "_".join(f"{number:03d}" for number in numbers[at])


def write(folder: Path, pixels: NDArray[np.uint8], name: str) -> None:
    """Write one view."""
    Image.fromarray(pixels).save(folder / f"view_{name}.png")


if __name__ == "__main__":
    main()
