"""What a step of the depth brush takes: `python -m benchmarks.brush [PHOTO]`, processor time; the demo by default."""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np

from iibr_core.depth.editing.canvas import DepthCanvas
from iibr_core.depth.editing.edits import BRUSH_TOOLS, DepthEdits, Stroke
from iibr_core.formats.images.photo import read_photo
from iibr_core.runtime.resources import resource_folder

RADII = (0.03, 0.1, 0.2)
"""Shares of the width, as the panel's Size has them."""
SPACING = 1 / 6
"""Of the radius, as strokes are remembered."""
STEPS = 12
STRENGTH = 0.2


def milliseconds_a_step(canvas: DepthCanvas, tool: str, radius: float) -> float:
    """The median over a stroke; the first step, which begins it, is left out."""
    points = [(0.3 + SPACING * radius * k, 0.4 + SPACING * radius * k / 3) for k in range(STEPS)]
    taken = []
    for k in range(1, STEPS + 1):
        edits = DepthEdits(strokes=(Stroke(tool, tuple(points[:k]), radius, STRENGTH),))  # type: ignore[arg-type]
        start = time.process_time()
        canvas.apply(edits)
        taken.append(time.process_time() - start)
    return 1e3 * float(np.median(taken[1:]))


def main() -> None:
    """Print a row for each tool."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "photo", nargs="?", type=Path, default=resource_folder("assets") / "motorcycle" / "motorcycle.png"
    )
    photo = read_photo(parser.parse_args().photo).pixels
    height, width = photo.shape[:2]
    disparity = np.broadcast_to(np.linspace(0, 5, width, dtype=np.float32), (height, width)).copy()
    canvas = DepthCanvas(photo, disparity)
    for tool in BRUSH_TOOLS:
        milliseconds_a_step(canvas, tool, RADII[0])  # compiled now
        row = "  ".join(f"{100 * radius:g} %: {milliseconds_a_step(canvas, tool, radius):5.1f} ms" for radius in RADII)
        print(f"{width}x{height} {tool:8} {row}")


if __name__ == "__main__":
    main()
