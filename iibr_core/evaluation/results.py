"""What an evaluation comes to: figures of every way of making views, and pictures to look at."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iibr_core.evaluation.consistency import Consistency
from iibr_core.evaluation.focal_stacks import RefocusResult
from iibr_core.types import ImageSize

IDENTITY, REFERENCE, OURS, TRUTH = "identity", "reference warp", "iibr", "truth"
"""Ways of making a view, and the true view."""
Bytes = NDArray[np.uint8]
"""(H, W, 3), sRGB-encoded."""


@dataclass(frozen=True)
class Figures:
    """PSNR in dB of the frame, of what the given view sees, and of holes; SSIM, FLIP and LPIPS of the frame; time."""

    full_db: float
    visible_db: float
    hole_db: float
    ssim: float
    flip: float
    lpips: float
    ms: float


@dataclass(frozen=True)
class Row:
    """One method: means over the views (of holes over those that have any), the worst view, figures of each view."""

    method: str
    mean: Figures
    worst_view: str
    worst_db: float
    of_views: Mapping[str, Figures]


@dataclass(frozen=True, eq=False)
class Pictures:
    """To look at: one view by every method and as it is, and EPIs of one row of pixels, (views, W, 3) each."""

    view: str
    by_method: Mapping[str, Bytes]
    epis: Mapping[str, Bytes]
    epi_row: int


@dataclass(frozen=True, eq=False)
class EvaluationResult:
    """One trial with one disparity map.

    consistency: of this program's views, and of the truth's EPIs where it has a row of views. refocus: of grids, from
    the centre view. hole_share: of the pixels, mean over views. seconds: for everything.
    """

    scene: str
    layout: str
    trial: str
    given: str
    size: ImageSize
    disparity: str
    rows: tuple[Row, ...]
    consistency: Mapping[str, Consistency]
    refocus: tuple[RefocusResult, ...]
    pictures: Pictures
    hole_share: float
    notes: tuple[str, ...]
    seconds: float


def row_of(method: str, of_views: Mapping[str, Figures]) -> Row:
    """A method's row, of its figures of each view."""
    worst = min(of_views, key=lambda name: of_views[name].full_db)
    table = np.array([list(vars(figures).values()) for figures in of_views.values()])
    known = np.isfinite(table)
    means = np.where(known, table, 0).sum(axis=0) / np.where(known.any(axis=0), known.sum(axis=0), np.nan)
    return Row(method, Figures(*(float(mean) for mean in means)), worst, of_views[worst].full_db, of_views)
