"""How much of the work on a field's views is done: views differ in cost, so that counting them misleads.

The unit is a view in closed form that one of several threads makes.
"""

from __future__ import annotations

from iibr_core.generation.cost_model import CostEstimates
from iibr_core.runtime.tiling import THREADS
from iibr_core.types import Quality

OUTER_WORK = 1 + THREADS / 2
"""An outer view: all threads make it, and one alone inpaints it."""
OUTER_BY_MODEL = 100.0
"""The same where a diffusion model inpaints it."""


class FieldWork:
    """outer: of an outer view in closed form; inner: of another one as it stays. finish_outer, finish_inner: what is
    left of a draft.
    """

    def __init__(
        self, costs: CostEstimates, quality: Quality, views: tuple[int, int, int], by_model: bool = False
    ) -> None:
        """costs: of the field. views: outer ones, those of them that are wanted, and inner ones. by_model: a diffusion
        model fills their holes.
        """
        self.quality = quality
        self.inner = costs.of(quality).seconds / costs.fast.seconds if costs.fast.seconds > 0 else 1.0
        self.finish_inner = max(self.inner - 1.0, 0.0)
        self.finish_outer = self.inner if quality == "balanced" else 0.0
        self.outer = OUTER_BY_MODEL if by_model else OUTER_WORK
        self._done = 0.0
        self._total = views[0] * self.outer + views[1] * self.finish_outer + views[2] * self.inner

    def add(self, work: float) -> float:
        """So much more is done: the share of all that is."""
        self._done += work
        return min(self._done / self._total, 1.0) if self._total > 0 else 1.0
