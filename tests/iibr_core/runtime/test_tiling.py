import itertools
import threading

import numpy as np
import pytest

from iibr_core.depth.edges.blur import measure_edge_blur
from iibr_core.depth.edges.refine import refine
from iibr_core.depth.guess import guess_depth
from iibr_core.inpainting import background
from iibr_core.inpainting.background import fill_background
from iibr_core.inpainting.disparity_holes import fill_disparity_holes
from iibr_core.method.mixed_pixels import split_mixed_pixels
from iibr_core.method.occlusion import view_entropy
from iibr_core.method.ray_transformer import shipped_transformer
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.view import Renderer
from iibr_core.runtime import tiling
from iibr_core.runtime.tiling import in_pieces, side_by_side
from iibr_core.runtime.work import Cancelled, raise_if_stopped, stoppable
from iibr_core.types import ImageSize, Photo, ViewOffset

RANDOM = np.random.default_rng(5)
SIZE = ImageSize(83, 67)
COLORS = np.repeat(np.repeat(RANDOM.uniform(0, 1, (21, 17, 3)), 4, axis=0), 4, axis=1)[: SIZE[0], : SIZE[1]]
COLORS = np.ascontiguousarray(COLORS, np.float32)
LAYERS = np.repeat(np.repeat(RANDOM.integers(-3, 4, (6, 5)), 14, axis=0), 14, axis=1)[: SIZE[0], : SIZE[1]]
LAYERS = np.ascontiguousarray(LAYERS, np.float32)
SOFT = sum(np.roll(LAYERS, k, axis=1) for k in range(-4, 5)).astype(np.float32) / 9
HOLES = RANDOM.random(SIZE) < 0.3


def filled():
    colors, disparity = COLORS.copy(), LAYERS.copy()
    fill_background(colors, disparity, HOLES, LAYERS, ViewOffset(1.0, -2.0), threads=2)
    return colors, disparity


def rendered():
    rays, offset = rays_of_photo(COLORS, LAYERS, 2.0, 0), ViewOffset(2.0, 1.5)
    view = Renderer(shipped_transformer()).render(rays, offset)
    return view.colors, view.disparity, view.occluded, view.inpainted, view_entropy(rays, offset)


STAGES = {
    "rays of a photo": lambda: rays_of_photo(COLORS, LAYERS, 2.0, 1).arrays,
    "split": lambda: split_mixed_pixels(COLORS, LAYERS, 0.5),
    "render": rendered,
    "fill": filled,
    "refine": lambda: [refine(COLORS, np.where(HOLES, np.nan, SOFT))],
    "blur": lambda: [np.float64(measure_edge_blur(COLORS, SOFT))],
    "offline": lambda: [guess_depth(Photo(COLORS, 100.0, "test")).values],
    "unknown depth": lambda: [fill_disparity_holes(np.where(HOLES, np.nan, LAYERS))],
}


@pytest.fixture
def narrow(monkeypatch):
    """A few rows a band, more threads than usual."""
    monkeypatch.setattr(tiling, "MAX_PIXELS_AT_ONCE", 7 * SIZE[1])
    monkeypatch.setattr(tiling, "THREADS", 3)
    monkeypatch.setattr(background, "MAX_HOLE_PIXELS_AT_ONCE", 100)


@pytest.mark.parametrize("name", STAGES)
def test_the_number_of_bands_changes_no_bit(name, request):
    whole = [np.array(part) for part in STAGES[name]()]
    request.getfixturevalue("narrow")
    for part, expected in zip(STAGES[name](), whole, strict=True):
        np.testing.assert_array_equal(part, expected)


@pytest.mark.usefixtures("narrow")
@pytest.mark.parametrize("name", STAGES)
def test_a_stage_asks_for_every_band_and_ends_wherever_it_is_told_to(name):
    questions = itertools.count()
    with stoppable(lambda: next(questions) < 0):
        STAGES[name]()
    asked = next(questions)
    assert asked >= (3 if name == "unknown depth" else SIZE[0] // 7)
    for last in (1, asked // 2, asked):
        questions = itertools.count(1)
        with pytest.raises(Cancelled), stoppable(lambda last=last, questions=questions: next(questions) >= last):
            STAGES[name]()


@pytest.mark.parametrize("threads", [1, 3])
def test_nothing_is_begun_after_the_word(threads):
    stop, began = threading.Event(), []

    def work(n):
        began.append(n)
        if n == 5:
            stop.set()
        assert n <= 5 or stop.wait(60)

    with pytest.raises(Cancelled), stoppable(stop.is_set):
        in_pieces(work, range(1000), threads)
    assert sorted(began)[:6] == list(range(6))
    assert len(began) < 6 + threads


@pytest.mark.parametrize("threads", [1, 3])
def test_results_come_in_order_and_errors_come_through(threads):
    assert in_pieces(lambda n: n * n, range(20), threads=threads) == [n * n for n in range(20)]
    with pytest.raises(ZeroDivisionError):
        in_pieces(lambda n: 1 // (n - 7), range(20), threads=threads)


def test_pieces_may_have_pieces():
    def row(n):
        return sum(in_pieces(lambda m: n * m, range(50), threads=8))

    assert in_pieces(row, range(50), threads=8) == [n * 1225 for n in range(50)]


@pytest.mark.usefixtures("narrow")
def test_views_under_way_end_with_those_who_take_them():
    began, ended = threading.Event(), []

    def view(number):
        try:
            while number:
                began.set()
                raise_if_stopped()
        except Cancelled:
            ended.append(number)

    views = side_by_side(view, [0, 1])
    next(views)
    assert began.wait(60)
    views.close()
    assert ended == [1]
