"""Light fields whose views and disparity are known, read from a folder: one view is given, the others judge.

A folder holds views/vVV_uUU.* and gt_disp_uUU_vVV.npy (NaN unknown) of the view that is given.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from iibr_core.depth.fill import fill_from_background
from iibr_core.formats.photo import read_photo
from iibr_core.types import Disparity, FloatImage, GridShape, Photo, ViewOffset

SCENES = {
    "antinous": "hci_antinous",
    "teddy": "mb2003_teddy_quarter",
    "moebius": "mb2005_moebius_third",
    "motorcycle": "mb2014_motorcycle_quarter",
}
OUTER = {(-4, -4), (-4, 4), (4, -4), (4, 4), (0, -4), (0, 4), (-4, 0), (4, 0), (-2, -2), (-2, 2), (2, -2), (2, 2)}
VIEW_NAME = re.compile(r"v(\d+)_u(\d+)")
DISPARITY_NAME = re.compile(r"gt_disp_u(\d+)_v(\d+)")


@dataclass(frozen=True, eq=False)
class GroundTruth:
    """photo and disparity of the given view; truth: (H, W, 3) sRGB-encoded by (t, s); grid: holds all of them."""

    name: str
    photo: Photo
    disparity: Disparity
    truth: Mapping[tuple[int, int], FloatImage]
    grid: GridShape

    @property
    def farthest(self) -> int:
        """The largest view offset."""
        return self.grid.rows // 2


def read_ground_truth(data: Path, name: str) -> GroundTruth:
    """A scene of SCENES; of the 9x9 ones the 12 views of OUTER judge."""
    folder = data / SCENES[name]
    paths = {tuple(map(int, VIEW_NAME.search(path.stem).groups())): path for path in (folder / "views").iterdir()}
    file = min(folder.glob("gt_disp_*.npy"))
    u, v = map(int, DISPARITY_NAME.search(file.stem).groups())
    values = np.load(file).astype(np.float32)
    filled = values if np.isfinite(values).all() else fill_from_background(values)
    offsets = {(row - v, column - u): path for (row, column), path in paths.items() if (row, column) != (v, u)}
    chosen = {at: path for at, path in offsets.items() if len(offsets) < 12 or at in OUTER}
    side = 2 * max(max(map(abs, at)) for at in chosen) + 1
    truth = {at: read_photo(path).pixels for at, path in chosen.items()}
    return GroundTruth(name, read_photo(paths[v, u]), Disparity(filled, file.name), truth, GridShape(side, side))


def psnr(image: FloatImage, truth: FloatImage) -> float:
    """Of sRGB-encoded colours, in dB."""
    error = float(np.square(np.clip(image, 0, 1) - truth, dtype=np.float64).mean())
    return 10 * np.log10(1 / max(error, 1e-10))


def offset_of(at: tuple[int, int]) -> ViewOffset:
    """(t, s) as a view offset."""
    return ViewOffset(float(at[0]), float(at[1]))
