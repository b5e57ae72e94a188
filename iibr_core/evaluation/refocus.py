"""Refocused pictures of a light field: made views, added up through a lens, against the true views added up alike."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from iibr_core.beyond.lens import LensSum
from iibr_core.beyond.optics import Optics
from iibr_core.color import srgb_from_linear
from iibr_core.types import CENTRE, FloatImage, ViewOffset, image_size


@dataclass(frozen=True)
class Focus:
    """disparity: sharp, px per view step. radius: that of the round aperture, in view steps."""

    name: str
    disparity: float
    radius: float

    @property
    def title(self) -> str:
        """Name of its picture."""
        return f"Refocused at the {self.name} focus, {self.disparity:.2f} px"

    @property
    def margin_px(self) -> int:
        """Width of the picture's border that not all views show."""
        return math.ceil(abs(self.disparity) * (self.radius + 0.5)) + 2  # two for interpolation

    def weight(self, offset: ViewOffset) -> float:
        """Return the share of a view's square, one view step wide, that lies in the aperture."""
        points = np.linspace(-0.5, 0.5, 17)
        return float(np.mean(np.hypot.outer(offset.t + points, offset.s + points) <= self.radius))


def foci_of(offsets: Sequence[ViewOffset], disparity: FloatImage) -> list[Focus]:
    """Return a near, a middle and a far focus for an aperture as wide as the views; none if they make no lens.

    offsets: from the given view, which has this disparity (H, W).
    """
    rows, columns = np.array([(0.0, 0.0), *offsets]).T
    radius = float(min(-rows.min(), rows.max(), -columns.min(), columns.max()))
    percentiles = {"near": 95, "middle": 50, "far": 5}
    foci = [Focus(name, float(np.percentile(disparity, p)), radius) for name, p in percentiles.items()]
    is_lens = radius >= 1 and sum(foci[0].weight(offset) > 0 for offset in offsets) >= 8  # the neighbours
    return [focus for focus in foci if is_lens and min(disparity.shape) > 2 * focus.margin_px]


class FocalStack:
    """One light field, refocused; its views are added one by one and none is kept."""

    def __init__(self, foci: Sequence[Focus], photo: FloatImage) -> None:
        """Begin with the given view (H, W, 3), sRGB-encoded."""
        self._foci = foci
        self._sums = [LensSum(Optics(focus_disparity=focus.disparity), image_size(photo)) for focus in foci]
        self.add(CENTRE, photo)

    def add(self, offset: ViewOffset, view: FloatImage) -> None:
        """Add a view (H, W, 3), sRGB-encoded, if it lies in the aperture."""
        for focus, total in zip(self._foci, self._sums):
            if (weight := focus.weight(offset)) > 0:
                total.add(offset, view, weight)

    def pictures(self) -> dict[str, FloatImage]:
        """Return the picture of each focus by its title, sRGB-encoded, cropped to what all views show."""
        inner = [np.s_[focus.margin_px : -focus.margin_px] for focus in self._foci]
        lights = [total.light()[part, part] for total, part in zip(self._sums, inner)]
        return {focus.title: srgb_from_linear(light) for focus, light in zip(self._foci, lights)}
