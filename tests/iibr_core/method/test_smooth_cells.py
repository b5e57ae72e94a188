import numpy as np
import pytest

from iibr_core.method.candidates import find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.rays import CELL_PX
from iibr_core.types import ImageSize, ViewOffset
from tests.iibr_core.method.ray_sets import ray_set
from tests.iibr_core.scenes import smooth_texture

SIZE = ImageSize(48, 64)
Y, X = np.mgrid[: SIZE[0], : SIZE[1]].astype(np.float32)
SLOPE = 0.5 + 0.02 * X - 0.01 * Y
OFFSETS = [ViewOffset(0.0, 1.0), ViewOffset(-1.3, 0.4), ViewOffset(2.0, -2.0)]


def textured(disparity):
    return ray_set(disparity, colors=smooth_texture(*SIZE), farthest=2.0, room=1)


def by_pixel(cells):
    return cells.repeat(CELL_PX, axis=0).repeat(CELL_PX, axis=1)[: SIZE[0], : SIZE[1]]


@pytest.mark.parametrize("offset", OFFSETS)
def test_on_a_plane_every_ray_is_followed_to_its_exact_disparity(offset):
    rays = textured(SLOPE)
    candidates = find_candidates(rays, offset, (0, SIZE[0]))
    smooth = by_pixel(candidates.smooth)
    # d = a + b x + c y on the surface, seen at (x + d s, y + d t): d (1 - b s - c t) = a + b x + c y
    exact = SLOPE / (1 - 0.02 * offset.s + 0.01 * offset.t)
    assert smooth.mean() > 0.4  # the border takes the rest of so small a picture
    assert candidates.disparity[0][smooth] == pytest.approx(exact[smooth], abs=0.004)
    assert (candidates.number[smooth] == 1).all()
    assert (candidates.coverage[0][smooth] == 1).all()


@pytest.mark.parametrize("slope", [-3.0, -0.9, -0.6, -0.3, 0.3, 0.6, 0.8])
@pytest.mark.parametrize("along", ["rows", "columns"])
def test_a_steep_plane_is_one_closed_surface_of_exact_disparity(slope, along):
    disparity = np.tile(slope * (np.arange(60, dtype=np.float32) - 30), (60, 1))
    offset, turn = (ViewOffset(0.0, 1.0), np.array) if along == "rows" else (ViewOffset(1.0, 0.0), np.transpose)
    found = find_candidates(ray_set(np.ascontiguousarray(turn(disparity))), offset, (0, 60))
    # d = slope (x + d - 30), seen at x
    x = np.arange(60)
    exact = slope * (x - 30) / (1 - slope)
    source = x + exact
    inside = (source > 4) & (source < 55) & (x > 2) & (x < 57)
    assert inside.sum() > 8
    count, disparities = turn(found.number), turn(found.disparity[0])
    weights = turn(closed_form(found)[1])
    assert (count[20:40, inside] == 1).all()
    assert weights[20:40, inside] == pytest.approx(1, abs=1e-3)
    assert disparities[20:40, inside] == pytest.approx(np.broadcast_to(exact[inside], (20, inside.sum())), abs=0.02)


def test_a_steep_surface_is_torn_where_it_ends():
    """Behind a steep slope's last ray lies the wall: between both nothing is known."""
    x = np.arange(80, dtype=np.float32)
    disparity = np.tile(np.where(x < 40, 0.8 * (40 - x), -9.0), (12, 1)).astype(np.float32)
    found = find_candidates(ray_set(disparity), ViewOffset(0.0, 1.0), (0, 12))
    shown = closed_form(found)[1][6]
    # The slope's last ray, 39, lands on 38.2; the wall's first on 49.
    assert shown[41:48] == pytest.approx(0)
    assert shown[20:38] == pytest.approx(1, abs=1e-3)
