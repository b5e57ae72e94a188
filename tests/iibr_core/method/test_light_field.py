import itertools
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iibr_core.inpainting.registry import INPAINTERS
from iibr_core.method.farthest_views import WantedViews
from iibr_core.method.light_field import generate
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.view import Renderer
from iibr_core.runtime import tiling
from iibr_core.runtime.work import stoppable
from iibr_core.types import (
    GridShape,
    InputError,
    ViewOffset,
    ViewUpdate,
)
from tests.iibr_core import red_inpainter
from tests.iibr_core.scenes import by_index, disparity_of, literal_plan, photo_of, smooth_texture, square_before_wall


def views_of(photo, disparity, rows, columns=None, **options):
    return by_index(list(generate(photo, disparity, literal_plan(photo, disparity, rows, columns), **options)))


def psnr(a, b):
    return 10 * np.log10(255**2 / np.mean((a.astype(float) - b.astype(float)) ** 2))


def test_the_centre_view_is_the_photo_exactly():
    photo, disparity = square_before_wall()
    views = views_of(photo, disparity, 3)
    assert (views[1, 1].colors == np.round(photo.pixels * 255)).all()
    assert len(views) == 9


def test_rendering_at_offset_zero_gives_the_photo_back():
    photo, disparity = square_before_wall()
    with Renderer() as synthesise:
        view = synthesise.render(rays_of_photo(photo.pixels, disparity.values, 2.0, 0), ViewOffset(0.0, 0.0))
    assert view.colors == pytest.approx(photo.pixels, abs=1e-4)
    assert not view.inpainted.any()


@pytest.mark.parametrize(("row", "column"), [(0, 1), (1, 0), (2, 2)])
def test_a_constant_disparity_shifts_the_photo(row, column):
    """Content at (x, y) moves to (x - d*s, y - d*t): the sign convention itself."""
    photo, d = photo_of(smooth_texture(40, 50)), 3
    view = views_of(photo, disparity_of(np.full((40, 50), d)), 3)[row, column]
    t, s = row - 1, column - 1
    moved = np.roll(photo.pixels, (-d * t, -d * s), axis=(0, 1))[6:-6, 6:-6]
    assert np.abs(view.colors[6:-6, 6:-6] - moved * 255).max() <= 1
    assert view.disparity == pytest.approx(d)


def test_a_square_before_a_wall_against_the_true_view():
    """The true view is known: both textures are smooth functions of position."""
    height, width, foreground = 60, 80, 2.0
    photo, disparity = square_before_wall(height, width, foreground)
    view = views_of(photo, disparity, 5)[2, 4]
    truth = photo.pixels.copy()
    square = np.s_[height // 3 : 2 * height // 3, width // 3 - 4 : 2 * width // 3 - 4]
    truth[square] = photo.pixels[height // 3 : 2 * height // 3, width // 3 : 2 * width // 3]
    uncovered = np.s_[height // 3 : 2 * height // 3, 2 * width // 3 - 4 : 2 * width // 3]
    wall = smooth_texture(height, width) * np.float32([0.3, 0.5, 1.0])
    truth[uncovered] = wall[uncovered]
    assert view.inpainted[uncovered].all()
    assert view.inpainted.sum() == view.inpainted[uncovered].size
    assert psnr(view.colors, truth * 255) > 34
    assert view.disparity[square] == pytest.approx(foreground)
    assert view.disparity[uncovered] == pytest.approx(0, abs=0.01)


@pytest.mark.parametrize(
    ("seen", "asked", "made"),
    [("one", None, "balanced"), ("sum", None, "fast")]
    + [("sum", quality, quality) for quality in ("fast", "balanced")],
)
def test_views_of_a_sum_are_fast_where_nobody_asked_for_more(monkeypatch, seen, asked, made):
    photo, disparity = square_before_wall()
    plan, qualities = replace(literal_plan(photo, disparity, 5), quality="balanced"), []
    monkeypatch.setattr("iibr_core.method.ray_transformer.shipped_transformer", qualities.append)
    at = ViewOffset(1.0, -1.0)
    views = list(generate(photo, disparity, plan, quality=asked, wanted=lambda: WantedViews([at], seen)))
    assert [plan.grid.offset(view.row, view.column) for view in views] == [(0, 0), at]
    assert qualities == [made]


def test_order_and_bands_do_not_change_a_pixel(monkeypatch):
    photo, disparity = square_before_wall()
    reference = views_of(photo, disparity, 5)
    other_order = views_of(photo, disparity, 5, nearest_to=lambda: ViewOffset(2.0, -2.0))
    monkeypatch.setattr(tiling, "MOST_BAND_PIXELS", 7 * 80)
    monkeypatch.setattr(tiling, "THREADS", 3)
    small_bands = views_of(photo, disparity, 5)
    for other in (other_order, small_bands):
        assert other.keys() == reference.keys()
        for index, view in reference.items():
            assert (view.colors == other[index].colors).all()
            assert (view.disparity == other[index].disparity).all()


def test_views_arrive_photo_first_then_farthest_then_nearest_to_the_eye():
    photo, disparity = square_before_wall()
    plan = literal_plan(photo, disparity, 5)
    made = generate(photo, disparity, plan, nearest_to=lambda: ViewOffset(0.0, 1.0), quality="fast")
    order = [(v.row, v.column) for v in made]
    assert order[0] == (2, 2)
    assert set(order[1:5]) == {(0, 0), (0, 4), (4, 0), (4, 4)}
    assert order[5] == (2, 3)
    assert len(set(order)) == 25


@pytest.mark.parametrize("quality", ["fast", "balanced"])
def test_the_inpainter_of_that_name_fills_all_that_is_inpainted(monkeypatch, quality):
    monkeypatch.setitem(INPAINTERS, "red", red_inpainter.ENTRY)
    photo, disparity = square_before_wall(60, 80, 3.0)
    red = views_of(photo, disparity, 5, quality=quality, inpaint="red")
    for view in red.values():
        inner = view.colors[view.inpainted & ~beside(~view.inpainted)]  # what lies beside is mixed in at edges
        assert (inner[:, :1] > 2.0 * inner[:, 1:]).all(), "the wall behind is blue"
    assert sum(view.inpainted.sum() for view in red.values()) > 0


def test_an_unknown_inpainter_is_refused():
    photo, disparity = square_before_wall()
    with pytest.raises(InputError, match="--inpaint magic"):
        views_of(photo, disparity, 3, inpaint="magic")


def beside(mask):
    """The mask grown by one pixel each way."""
    return sum(np.roll(mask, (j, i), axis=(0, 1)) for j in (-1, 0, 1) for i in (-1, 0, 1)) > 0


def test_all_views_show_the_same_content_in_a_hole():
    photo, disparity = square_before_wall(90, 120, 3.0)
    views = views_of(photo, disparity, 5)
    compared = 0
    for a, b in itertools.permutations([(2, 4), (1, 4), (2, 3), (0, 4), (4, 4)], 2):
        # The wall stands still (disparity 0): what both views see of it must be the same. Beside the square its
        # antialiased edge is mixed in, and the outermost pixels are at the frame.
        both = views[a].inpainted & ~beside(views[a].disparity > 0.5) & ~beside(views[b].disparity > 0.5)
        both[:6] = both[-6:] = both[:, :6] = both[:, -6:] = False
        difference = views[a].colors[both].astype(float) - views[b].colors[both]
        assert np.sqrt(np.mean(difference**2)) <= 1
        compared += both.sum()
    assert compared > 500


def test_stopping_ends_the_generator():
    photo, disparity = square_before_wall()
    produced: list[ViewUpdate] = []
    plan = literal_plan(photo, disparity, 9)
    with stoppable(lambda: len(produced) == 4):
        produced.extend(generate(photo, disparity, plan))
    assert len(produced) == 4


def test_flat_scene_needs_no_holes_filled():
    photo = photo_of(smooth_texture(20, 24))
    views = views_of(photo, disparity_of(np.zeros((20, 24))), 3)
    for view in views.values():
        assert (view.colors == views[1, 1].colors).all()
        assert not view.inpainted.any()


def test_hdr_stays_hdr():
    pixels = smooth_texture(20, 24)
    pixels[5:9, 5:9] = 6.0
    views = views_of(photo_of(pixels, is_hdr=True), disparity_of(np.full((20, 24), 0.4)), 3)
    assert views[0, 0].colors.dtype == np.float16
    assert views[0, 0].colors.max() > 4


def test_sizes_must_agree():
    photo, _ = square_before_wall()
    flat = disparity_of(np.zeros((3, 3)))
    with pytest.raises(ValueError, match=r"3x3.*80x60"):
        next(generate(photo, flat, literal_plan(photo, disparity_of(np.zeros(photo.size)), 3)))


def checked(views, photo):
    for view in views.values():
        assert view.colors.shape == (*photo.size, 3)
        assert np.isfinite(view.disparity).all()
    return views


@pytest.mark.parametrize("size", [(1, 1), (1, 13), (11, 1), (2, 2), (7, 13)])
def test_tiny_and_prime_sizes(size):
    photo = photo_of(np.random.default_rng(0).uniform(0, 1, (*size, 3)))
    disparity = disparity_of(np.random.default_rng(1).uniform(-2, 2, size))
    assert len(checked(views_of(photo, disparity, 3), photo)) == 9


@pytest.mark.parametrize("grid", [GridShape(1, 1), GridShape(1, 6), GridShape(2, 2), GridShape(17, 1)])
def test_unusual_grids(grid):
    photo, disparity = square_before_wall(12, 14)
    assert len(checked(views_of(photo, disparity, *grid), photo)) == grid.rows * grid.columns


@pytest.mark.parametrize(
    "values",
    [
        np.full((16, 18), -2.5),
        np.full((16, 18), 500.0),
        np.where(np.arange(18) == 9, 1e6, 0.0) * np.ones((16, 1)),
        np.where(np.arange(18) == 9, 3.0, 0.0) * np.ones((16, 1)),
        np.random.default_rng(0).uniform(-40, 40, (16, 18)),
        np.where(np.arange(18) < 9, 1.0, 1.0001) * np.ones((16, 1)),
    ],
    ids=["negative", "larger than the photo", "outlier 1e6", "one-pixel wire", "noise", "surfaces 1e-4 apart"],
)
def test_hard_disparities(values):
    photo = photo_of(smooth_texture(16, 18))
    checked(views_of(photo, disparity_of(values), 5), photo)


def test_a_wire_keeps_its_width():
    values = np.where(np.arange(30) == 15, 3.0, 0.0) * np.ones((20, 1))
    pixels = np.full((20, 30, 3), 0.1)
    pixels[:, 15] = 0.9
    view = views_of(photo_of(pixels), disparity_of(values), 3)[1, 2]
    assert (view.colors[5:-5, 12] > 200).all()
    assert (view.colors[5:-5, [10, 11, 13, 14]] < 60).all()


@settings(max_examples=15)
@given(st.integers(-3, 3), st.integers(-3, 3), st.integers(0, 3))
def test_shifting_the_photo_shifts_the_views(down, right, seed):
    random = np.random.default_rng(seed)
    height, width, margin = 44, 50, 16  # farther in than a ray looks around
    pixels = random.uniform(0, 1, (height, width, 3))
    values = np.zeros((height, width))  # around what moves, so that no edge wraps and the map stays as soft as it is
    values[4:-4, 4:-4] = np.kron(random.integers(0, 3, (6, 6)), np.ones((6, 7)))
    one = views_of(photo_of(pixels), disparity_of(values), 3)[0, 2]
    shifted = np.roll(pixels, (down, right), axis=(0, 1)), np.roll(values, (down, right), axis=(0, 1))
    two = views_of(photo_of(shifted[0]), disparity_of(shifted[1]), 3)[0, 2]
    inner = np.s_[margin:-margin, margin:-margin]
    seen = ~(one.inpainted | np.roll(two.inpainted, (-down, -right), axis=(0, 1)))[inner]
    difference = one.colors.astype(int) - np.roll(two.colors, (-down, -right), axis=(0, 1)).astype(int)
    assert np.abs(difference[inner][seen]).max(initial=0) <= 1


def test_disparity_error_towards_zero_lowers_the_error():
    photo = photo_of(smooth_texture(40, 48))
    noise = np.random.default_rng(0).normal(0, 1, (40, 48))
    truth = views_of(photo, disparity_of(np.full((40, 48), 1.0)), 3)[1, 2].colors
    errors = [
        np.mean((views_of(photo, disparity_of(1.0 + sigma * noise), 3)[1, 2].colors.astype(float) - truth) ** 2)
        for sigma in (0.8, 0.4, 0.2, 0.1, 0.0)
    ]
    assert errors == sorted(errors, reverse=True)
    assert errors[-1] == 0
