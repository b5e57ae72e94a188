"""Maps of drawn light fields, as a person sees them: each kind of grid, of light and of surface."""

import numpy as np

from iibr_core.color import bytes_from_encoded
from iibr_core.depth.multi_view.all_views import carry, estimate_all
from iibr_core.depth.multi_view.estimate import estimate_coarse, estimate_with_doubt
from iibr_core.depth.multi_view.reduced import estimate_within_memory
from iibr_core.runtime.work import watched
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import render
from iibr_core.types import FloatImage, ImageSize, ViewOffset, ViewUpdate
from tests.iibr_core.depth.multi_view.test_plain_areas import draw
from tests.iibr_core.depth.test_sheets import assert_sheet
from tests.image_compare import MATCHED

SIZE = ImageSize(64, 80)
GRIDS: dict[str, list[tuple[float, float]]] = {
    "pair": [(0, 0), (0, 1.5)],
    "pair, from the right": [(0, 0), (0, -1.5)],
    "column": [(t, 0) for t in (-2, -1, 0, 1, 2)],
    "row that begins at ours": [(0, s) for s in (0, 1, 2, 3)],
    "grid, rows half as far apart": [(t, s) for t in (-0.5, 0, 0.5) for s in (-1, 0, 1)],
    "grid off the centre, jittered": [(t + 0.1 * s, s - 0.05 * t) for t in (0, 1, 2) for s in (-2, -1, 0, 1)],
}


def drawn_field(places: list[tuple[float, float]]) -> tuple[list[np.ndarray], list[FloatImage]]:
    """Return views (uint8) of a drawn scene and their true maps."""
    scene = random_scene(np.random.default_rng(7), SIZE, 2.0)
    drawn = [render(scene, SIZE, ViewOffset(*place), samples=2) for place in places]
    return [bytes_from_encoded(colors.astype(np.float32)) for colors, _ in drawn], [truth for _, truth in drawn]


def found_and_truth(places, made=lambda view: view):
    """Return map and doubt of the view at the origin, and its true map. made: views from those drawn."""
    offsets, (views, truths) = [ViewOffset(*map(float, at)) for at in places], drawn_field(places)
    views, reference = [made(view) for view in views], places.index((0, 0))
    range_px = estimate_coarse(views, offsets, reference).range_px
    return *estimate_with_doubt(views, offsets, reference, range_px), truths[reference]


def as_hdr(view: np.ndarray) -> np.ndarray:
    """Half floats, what is nearly white twice as bright."""
    return np.where(view > 200, view / 127, view / 255).astype(np.float16)


def plain() -> FloatImage:
    """Return the map of squares on a plain page, seen by a pair."""
    offsets = [ViewOffset(0.0, 0.0), ViewOffset(0.0, 1.0)]
    views = [draw(offset, 8.0)[0] for offset in offsets]
    values, _ = estimate_with_doubt(views, offsets, 0, estimate_coarse(views, offsets, 0).range_px)
    return values[16:80, 30:110] / 8 * 3 - 2


def test_maps_of_all_grids_are_what_they_were_and_near_the_truth(regenerate_golden, tmp_path) -> None:
    maps, grid = [], GRIDS["grid, rows half as far apart"]
    for places in GRIDS.values():
        values, is_doubtful, truth = found_and_truth(places)
        assert np.median(np.abs(values - truth)) < 0.06
        assert (np.abs(values - truth) > 0.25).mean() < 0.22
        maps += [values, np.where(is_doubtful, 1.5, -2.5)]
    maps += [found_and_truth(GRIDS["pair"], as_hdr)[0], found_and_truth(grid, as_hdr)[0], plain()]
    offsets, (views, truths) = [ViewOffset(*map(float, at)) for at in grid], drawn_field(grid)
    reports: list[tuple[float, float, str]] = []
    with watched(lambda *now: reports.append(now)):
        every = estimate_all(views, offsets, (-3.0, 2.0))
    done, totals, _ = zip(*reports)
    assert list(done) == sorted(done)
    assert set(totals) == {done[-1]}
    assert all((np.abs(values - truth) > 0.25).mean() < 0.25 for values, truth in zip(every, truths))
    small, notes = estimate_within_memory(views, offsets, 4, (-3.0, 2.0), max_pixels=48 * 60)
    assert notes == ("Found from views reduced to 60x48, then enlarged to 80x64 along the edges of the picture.",)
    others = ((ViewUpdate(0, k, views[k], None), offsets[k]) for k in (0, 5))
    carried = [update.disparity for update in carry(truths[4], views[4], others, 1.0)]
    assert all((np.abs(values - truths[k]) > 0.25).mean() < 0.08 for values, k in zip(carried, (0, 5)))
    maps += [every[0], every[1], every[5], small, *carried]
    assert_sheet("matched", maps, (-2.5, 1.5), 7, regenerate_golden, tmp_path, MATCHED)
