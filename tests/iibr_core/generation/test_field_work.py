"""The share of the work that is done with each view: it grows to 1, whatever the order and the passes."""

import pytest

from iibr_core.generation.cost_model import CostEstimate, CostEstimates
from iibr_core.generation.field_work import OUTER_WORK, FieldWork
from iibr_core.generation.light_field import generate
from tests.iibr_core.scenes import literal_plan, square_before_wall

COSTS = CostEstimates(CostEstimate(2.0, 0), CostEstimate(3.0, 0))


@pytest.mark.parametrize("quality", ["fast", "balanced"])
@pytest.mark.parametrize("draft_bytes", [None, 0, 1 << 30])
def test_shares_grow_to_the_end_of_all_passes(quality, draft_bytes):
    photo, disparity = square_before_wall()
    plan = literal_plan(photo, disparity, 3, 5)
    shares = [view.share for view in generate(photo, disparity, plan, quality=quality, draft_bytes=draft_bytes)]
    assert shares[0] == 0.0
    assert shares == sorted(shares)
    assert shares[-1] == pytest.approx(1.0)
    assert sum(share > 0.999 for share in shares) == 1


def test_outer_views_and_the_transformer_count_for_what_they_cost():
    work = FieldWork(COSTS, "balanced", (8, 8, 72))
    assert (work.inner, work.finish_inner) == (1.5, 0.5)
    assert work.add(8 * work.outer) == pytest.approx(8 * OUTER_WORK / (8 * (OUTER_WORK + work.finish_outer) + 72 * 1.5))


def test_one_view_is_all_of_the_work():
    photo, disparity = square_before_wall()
    (view,) = generate(photo, disparity, literal_plan(photo, disparity, 1))
    assert view.share == 1.0
