"""Whether a made light field, refocused, looks as the true one does: sums of sheared views, by the core's lens."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.lens import LensSum
from iibr_core.beyond.optics import Optics
from iibr_core.color import srgb_from_linear, stored_from_encoded
from iibr_core.evaluation.lens_picture import LensPicture
from iibr_core.evaluation.metrics import bounded_psnr, flip
from iibr_core.types import FloatImage, ViewOffset, image_size

NEAR, MIDDLE, FAR, LENS = "near", "middle", "far", "path-traced lens"
BEYOND_PERCENT = 5
"""So much of the picture lies nearer than the near focus, and farther than the far one."""
LEAST_ROWS = 3
"""Of views, and of columns, that make a lens."""
LEAST_PX = 16
"""Smaller pictures are not worth comparing."""
POINTS = 16
"""Of a view's own square of the aperture, across: its weight is the share of them inside the disc."""


@dataclass(frozen=True)
class Focus:
    """disparity: px per view step, sharp. radius: of the round aperture, in view steps."""

    name: str
    disparity: float
    radius: float

    @property
    def margin_px(self) -> int:
        """Of the picture, beyond which not all views show something. Views up to half a step outside the aperture
        count; two pixels more for interpolation.
        """
        return math.ceil(abs(self.disparity) * (self.radius + 0.5)) + 2


@dataclass(frozen=True)
class RefocusFigures:
    """PSNR in dB and FLIP of one picture."""

    db: float
    flip: float


@dataclass(frozen=True, eq=False)
class RefocusResult:
    """One focus: figures by method; to look at, the picture of one of them and how it should be, (H, W, 3).

    views: how many were added up.
    """

    focus: Focus
    views: int
    figures: Mapping[str, RefocusFigures]
    shown: str
    made: NDArray[np.uint8]
    expected: NDArray[np.uint8]


def foci_of(offsets: Iterable[ViewOffset], disparity: FloatImage) -> list[Focus]:
    """Near, middle and far focus for an aperture as wide as the grid; none where views are too few for a lens.

    offsets: from the given view, whose disparity (H, W) is; without the given view's own.
    """
    every = [ViewOffset(0.0, 0.0), *offsets]
    rows, columns = (np.array(axis) for axis in zip(*every))
    if min(len(set(np.round(axis))) for axis in (rows, columns)) < LEAST_ROWS:
        return []
    radius = float(min(-rows.min(), rows.max(), -columns.min(), columns.max()))
    if radius < 1:
        return []
    far, near = (float(p) for p in np.percentile(disparity, (BEYOND_PERCENT, 100 - BEYOND_PERCENT)))
    at = {NEAR: near, MIDDLE: (near + far) / 2, FAR: far}
    found = [Focus(name, focus, radius) for name, focus in at.items()]
    return [focus for focus in found if _is_worth_it(focus, disparity)]


def lens_focus(lens: LensPicture, offsets: Iterable[ViewOffset]) -> Focus | None:
    """The lens's own focus; None where views are missing from its aperture, or nothing lies in all of them."""
    focus = Focus(LENS, lens.focus_disparity, lens.radius_views)
    there = {(round(at.t), round(at.s)) for at in offsets} | {(0, 0)}
    reach = math.ceil(lens.radius_views)
    steps = range(-reach, reach + 1)
    wanted = {(t, s) for t in steps for s in steps if weight_of(ViewOffset(t, s), lens.radius_views) > 0}
    return focus if wanted <= there and _is_worth_it(focus, lens.picture) else None


def weight_of(offset: ViewOffset, radius: float) -> float:
    """Share of the view's own square, one view step wide, that lies in the aperture."""
    within = (np.arange(POINTS) + 0.5) / POINTS - 0.5
    return float(np.mean(np.hypot.outer(offset.t + within, offset.s + within) <= radius))


class FocalStack:
    """One light field, refocused, its views added up one by one."""

    def __init__(self, foci: Sequence[Focus]) -> None:
        self.foci = foci
        self._sums: list[LensSum] = []
        self.views = [0] * len(foci)

    def add(self, offset: ViewOffset, view: FloatImage) -> None:
        """Add a view (H, W, 3), sRGB-encoded."""
        if not self._sums:
            self._sums = [LensSum(Optics(focus_disparity=focus.disparity), image_size(view)) for focus in self.foci]
        for k, focus in enumerate(self.foci):
            if (weight := weight_of(offset, focus.radius)) > 0:
                self._sums[k].add(offset, view, weight)
                self.views[k] += 1

    def pictures(self) -> list[FloatImage]:
        """One for each focus, sRGB-encoded; only the part that all views show, see `within`."""
        return [srgb_from_linear(within(total.light(), focus)) for total, focus in zip(self._sums, self.foci)]


def within(image: FloatImage, focus: Focus) -> FloatImage:
    """The part of the given view that all views of the aperture show when they are sheared for this focus."""
    margin = focus.margin_px
    return image[margin : image.shape[0] - margin, margin : image.shape[1] - margin]


def _is_worth_it(focus: Focus, image: FloatImage) -> bool:
    """Whether enough of the picture lies within all views."""
    return bool(min(image.shape[:2]) - 2 * focus.margin_px >= LEAST_PX)


def score_methods(
    stacks: Mapping[str, FocalStack], truth: str, shown: str, lens: LensPicture | None
) -> tuple[RefocusResult, ...]:
    """Every method's pictures against those of the stack named `truth`; what a lens shows, the truth's too, against
    the lens's own picture. shown: the method whose pictures are kept.
    """
    pictures = {method: stack.pictures() for method, stack in stacks.items()}
    found = []
    for k, focus in enumerate(stacks[truth].foci):
        of_methods = {method: of_foci[k] for method, of_foci in pictures.items()}
        expected = of_methods[truth]
        if focus.name == LENS and lens is not None:
            expected = within(lens.picture, focus)
        else:
            del of_methods[truth]
        figures = {m: RefocusFigures(bounded_psnr(p, expected), flip(p, expected)) for m, p in of_methods.items()}
        to_see = [stored_from_encoded(picture, False).astype(np.uint8) for picture in (of_methods[shown], expected)]
        found.append(RefocusResult(focus, stacks[truth].views[k], figures, shown, to_see[0], to_see[1]))
    return tuple(found)
