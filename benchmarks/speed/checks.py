"""What must hold however a field is made: no order of views and no size of bands changes a pixel; views agree."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial

from benchmarks.speed.prediction import BenchInput
from benchmarks.speed.targets import SpeedTarget
from iibr_core.evaluation.consistency import Consistency, consistency
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_literal
from iibr_core.generation.view_maker import ViewMaker
from iibr_core.runtime import tiling
from iibr_core.types import Quality, ViewOffset

QUALITY: Quality = "balanced"
CENTRE, ELSEWHERE = ViewOffset(0.0, 0.0), ViewOffset(3.0, -2.0)
SMALL_BAND_PIXELS = 10_000


def invariance_targets(given: BenchInput) -> Iterator[SpeedTarget]:
    """Views in another order, and rendered in smaller bands, beside the usual ones."""
    usual = field_bytes(given, CENTRE)
    yield _identity_target(f"pixels of {given.name}, views in another order", field_bytes(given, ELSEWHERE) == usual)
    with band_pixels(SMALL_BAND_PIXELS):
        in_bands = field_bytes(given, CENTRE)
    yield _identity_target(f"pixels of {given.name}, in smaller bands", in_bands == usual)


def field_bytes(given: BenchInput, nearest_to: ViewOffset) -> dict[tuple[int, int], bytes]:
    """The colours of every view, by index, made from this viewpoint outwards."""
    plan = plan_literal(given.photo, given.disparity, given.grid)
    updates = generate(given.photo, given.disparity, plan, nearest_to=lambda: nearest_to, quality=QUALITY)
    return {(update.row, update.column): update.colors.tobytes() for update in updates}


@contextmanager
def band_pixels(most: int) -> Iterator[None]:
    """Bands of at most so many pixels while the block runs."""
    usual, tiling.MOST_BAND_PIXELS = tiling.MOST_BAND_PIXELS, most
    try:
        yield
    finally:
        tiling.MOST_BAND_PIXELS = usual


def view_agreement(given: BenchInput) -> Consistency:
    """Whether the views of a field agree, see `iibr_core.evaluation.consistency`."""
    offsets = [given.grid.offset(*at) for at in ((0, 0), (given.grid.rows - 1, given.grid.columns - 1))]
    with ViewMaker(given.photo.pixels, given.disparity.values, offsets, (QUALITY,)) as maker:
        return consistency(partial(maker.view, QUALITY), offsets, given.photo.pixels, given.disparity.values)


def _identity_target(what: str, is_same: bool) -> SpeedTarget:
    return SpeedTarget(what, "identical", "identical" if is_same else "different", is_same)
