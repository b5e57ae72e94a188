"""Views that come twice: as drafts in closed form, then with the transformer's say on their undecided rays."""

from collections import Counter

import numpy as np
import pytest
from iibr_core.generation.cost_model import DRAFT_BYTES, undecided_bytes

from iibr_core.method.light_field import StoredViews, generate, rays_of_grid
from iibr_core.method.ray_transformer import shipped_transformer
from iibr_core.method.view import Renderer
from iibr_core.runtime import tiling
from iibr_core.runtime.work import stoppable
from iibr_core.training.degradation import blur
from iibr_core.types import GridShape, ViewOffset
from tests.iibr_core.scenes import by_index, disparity_of, literal_plan, photo_of, smooth_texture, square_before_wall

PLENTY = 1 << 40
OUTER = {(0, 0), (0, 4), (4, 0), (4, 4)}


def blurred_square():
    """Its edges are soft, so that many rays are undecided."""
    photo, disparity = square_before_wall(60, 80, 3.0)
    return photo, disparity_of(blur(disparity.values, 0.7))


def crossing_bars():
    """Three depths: outer views inpaint what others see, and inner views have holes that are left."""
    photo = photo_of(np.random.default_rng(0).uniform(0, 1, (60, 80, 3)))
    values = np.zeros((60, 80))
    values[10:20], values[:, 30:36], values[35:45, 50:60] = 1.5, 4.0, -2.0
    return photo, disparity_of(values)


SCENES = {"square": square_before_wall, "blurred square": blurred_square, "bars": crossing_bars}


def made(photo, disparity, grid=5, **options):
    return list(generate(photo, disparity, literal_plan(photo, disparity, grid), **options))


def indices(updates):
    return [(update.row, update.column) for update in updates]


def same(one, other):
    return all(
        np.array_equal(getattr(one, name), getattr(other, name)) for name in ("colors", "disparity", "inpainted")
    )


@pytest.mark.parametrize("quality", ["fast", "balanced"])
@pytest.mark.parametrize("scene", SCENES)
def test_in_the_end_the_pixels_are_those_of_making_views_at_once(monkeypatch, scene, quality):
    photo, disparity = SCENES[scene]()
    at_once = by_index(made(photo, disparity, quality=quality))
    for eye in (ViewOffset(0.0, 0.0), ViewOffset(2.0, -1.0)):
        final = by_index(made(photo, disparity, quality=quality, nearest_to=lambda eye=eye: eye, draft_bytes=PLENTY))
        assert final.keys() == at_once.keys()
        assert all(view.is_final and same(view, at_once[index]) for index, view in final.items())
    monkeypatch.setattr(tiling, "MOST_BAND_PIXELS", 7 * 80)
    monkeypatch.setattr(tiling, "THREADS", 3)
    in_bands = by_index(made(photo, disparity, quality=quality, draft_bytes=PLENTY))
    assert all(same(view, at_once[index]) for index, view in in_bands.items())


@pytest.mark.parametrize("scene", SCENES)
def test_in_the_end_every_view_is_what_the_final_ray_set_shows(scene):
    """The slow twin: each view rendered whole, once the ray set is complete."""
    photo, disparity = SCENES[scene]()
    plan = literal_plan(photo, disparity, 5)
    final = by_index(made(photo, disparity, quality="balanced", draft_bytes=PLENTY))
    rays, outer = rays_of_grid(photo, disparity, plan)
    assert {tuple(offset) for offset, _ in outer} == {tuple(plan.grid.offset(*index)) for index in OUTER}
    with Renderer(transformer=shipped_transformer("balanced")) as synthesis:
        views = StoredViews(synthesis, rays, plan.grid, photo.is_hdr)
        for index in set(final) - {plan.grid.centre}:
            assert same(final[index], views.make(plan.grid.offset(*index)))


def test_drafts_are_the_closed_form_and_the_transformer_changes_undecided_rays_only():
    photo, disparity = blurred_square()
    fast = by_index(made(photo, disparity, quality="fast"))
    updates = made(photo, disparity, draft_bytes=PLENTY)
    drafts, final = by_index([update for update in updates if not update.is_final]), by_index(updates)
    assert len(drafts) == 24
    for index, draft in drafts.items():
        assert same(draft, fast[index])
        changed = (draft.colors != final[index].colors).any(axis=-1)
        assert 0 < changed.mean() < 0.5


def test_only_outer_views_are_made_twice(monkeypatch):
    """Rows rendered of each view: outer ones for the ray set, and again when it is complete."""
    photo, disparity = blurred_square()
    counted = []  # appending is safe in threads
    render_rows = Renderer._render_rows

    def counting_rows(self, rays, offset, span, *rest):
        counted.append((offset, span[1] - span[0]))
        return render_rows(self, rays, offset, span, *rest)

    monkeypatch.setattr(Renderer, "_render_rows", counting_rows)
    for draft_bytes in (PLENTY, 0, None):
        counted.clear()
        made(photo, disparity, draft_bytes=draft_bytes)
        total = Counter()
        for offset, count in counted:
            total[offset] += count
        offsets = {index: GridShape(5, 5).offset(*index) for index in np.ndindex(5, 5) if index != (2, 2)}
        for index, offset in offsets.items():
            assert total[offset] == 60 * (1 + (index in OUTER))


def test_drafts_come_first_then_both_passes_nearest_to_the_eye_first():
    photo, disparity = blurred_square()
    eye = ViewOffset(0.0, 1.0)
    updates = made(photo, disparity, nearest_to=lambda: eye, draft_bytes=PLENTY)
    order = indices(updates)
    first, second = order[:25], order[25:]
    assert [update.is_final for update in updates] == [True] + [False] * 24 + [True] * 24
    assert first[0] == (2, 2)
    assert set(first[1:5]) == OUTER
    assert first[5] == second[0] == (2, 3)
    for part in (first[5:], second):
        distances = [(row - 2) ** 2 + (column - 3) ** 2 for row, column in part]
        assert distances == sorted(distances)


def test_an_eye_that_moves_reorders_what_is_left_of_the_second_pass():
    photo, disparity = blurred_square()
    eye = [ViewOffset(-2.0, -2.0)]
    updates = []
    for update in generate(
        photo, disparity, literal_plan(photo, disparity, 5), nearest_to=lambda: eye[0], draft_bytes=PLENTY
    ):
        updates.append(update)
        if len(updates) == 30:
            eye[0] = ViewOffset(2.0, 2.0)
    order = indices(updates)
    before, after = order[25:30], order[30 + tiling.THREADS :]
    assert max(row + column for row, column in before) <= 2
    distances = [(row - 4) ** 2 + (column - 4) ** 2 for row, column in after]
    assert distances[0] <= 1
    assert distances == sorted(distances)


def test_where_little_may_be_kept_few_views_come_twice(monkeypatch):
    photo, disparity = blurred_square()
    kept = []
    draft = StoredViews.draft

    def watched(self, offset):
        kept.append(draft(self, offset))
        return kept[-1]

    monkeypatch.setattr(StoredViews, "draft", watched)
    made(photo, disparity, draft_bytes=PLENTY)
    assert len(kept) == 20
    room = 4 * max(draft.nbytes for draft in kept)
    at_once = by_index(made(photo, disparity))
    kept.clear()
    updates = made(photo, disparity, draft_bytes=room)
    assert 4 <= len(kept) <= 4 + 2 * tiling.THREADS
    assert len(updates) == 25 + len(OUTER) + len(kept)
    assert all(same(view, at_once[index]) for index, view in by_index(updates).items())


@pytest.mark.parametrize(
    ("quality", "draft_bytes", "twice"),
    [
        ("fast", PLENTY, set()),
        ("balanced", 0, OUTER),
        ("balanced", None, set()),
    ],
)
def test_who_comes_twice(quality, draft_bytes, twice):
    order = Counter(indices(made(*blurred_square(), quality=quality, draft_bytes=draft_bytes)))
    assert set(order) == set(np.ndindex(5, 5))
    assert {index for index, count in order.items() if count == 2} == twice
    assert max(order.values()) <= 2


@pytest.mark.parametrize("quality", ["fast", "balanced"])
def test_what_leaves_nothing_to_decide_comes_once(quality):
    photo = photo_of(smooth_texture(20, 24))
    for values, grid in ((np.zeros((20, 24)), 3), (np.where(np.arange(24) < 12, 0.0, 2.0) * np.ones((20, 1)), 1)):
        updates = made(photo, disparity_of(values), grid, quality=quality, draft_bytes=PLENTY)
        assert len(updates) == grid * grid
        assert all(update.is_final for update in updates)


def test_outer_views_that_disclose_nothing_are_finished_too():
    """They join no ray set, and are rendered again all the same. A step is open to one side only."""
    photo = square_before_wall(60, 80, 3.0)[0]
    disparity = disparity_of(np.where(np.arange(80) < 40, 3.0, 0.0) * np.ones((60, 1)))
    plan = literal_plan(photo, disparity, 5)
    rays, outer = rays_of_grid(photo, disparity, plan)
    without = {plan.grid.centre} ^ {(2 + int(at.t), 2 + int(at.s)) for at, view in outer if not view.occluded.any()}
    assert len(without) > 1
    final = by_index(made(photo, disparity, draft_bytes=PLENTY))
    with Renderer(transformer=shipped_transformer("balanced")) as synthesis:
        views = StoredViews(synthesis, rays, plan.grid, photo.is_hdr)
        assert all(same(final[index], views.make(plan.grid.offset(*index))) for index in without - {plan.grid.centre})


@pytest.mark.parametrize("share", [0.02, 0.3, 0.6, 0.9, 0.99])
def test_a_stop_ends_either_pass(share):
    photo, disparity = blurred_square()
    asked = [0]

    def count():
        asked[0] += 1
        return False

    with stoppable(count):
        in_all = len(made(photo, disparity, draft_bytes=PLENTY))
    most, asked[0] = share * asked[0], 0
    with stoppable(lambda: count() or asked[0] >= most):
        assert len(made(photo, disparity, draft_bytes=PLENTY)) < in_all


def test_a_draft_takes_about_what_the_plan_says():
    """Of each ray that is undecided; how many those are is another question."""
    photo, disparity = blurred_square()
    rays, outer = rays_of_grid(photo, disparity, literal_plan(photo, disparity, 5))
    assert len(list(outer)) == len(OUTER)
    with Renderer(transformer=shipped_transformer("balanced")) as synthesis:
        draft = StoredViews(synthesis, rays, GridShape(5, 5), False).draft(ViewOffset(1.0, 1.0))
    undecided = sum(len(part.pixel) for part in draft.undecided)
    counted = 60 * 80 * DRAFT_BYTES + undecided * undecided_bytes()
    assert 0.8 * counted < draft.nbytes <= counted
