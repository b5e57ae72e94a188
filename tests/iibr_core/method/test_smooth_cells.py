import numpy as np
import pytest

from iibr_core.method import candidates as candidates_module
from iibr_core.method.candidates import find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.look_up import look_up
from iibr_core.method.rays import CELL_PX, RaySet
from iibr_core.method.smooth_cells import find_smooth_cells
from iibr_core.types import ImageSize, ViewOffset, image_size
from tests.iibr_core.scenes import smooth_texture

SIZE = ImageSize(48, 64)
Y, X = np.mgrid[: SIZE[0], : SIZE[1]].astype(np.float32)
SLOPE = 0.5 + 0.02 * X - 0.01 * Y
BUMPS = 0.6 * np.sin(X / 9) * np.cos(Y / 7)
STEP = np.where(X < 30, 0.0, 2.0).astype(np.float32) + 0.01 * Y
OFFSETS = [ViewOffset(0.0, 1.0), ViewOffset(-1.3, 0.4), ViewOffset(2.0, -2.0)]


def ray_set(disparity):
    rays = RaySet(2, image_size(disparity), 2.0)
    rays.add(
        ViewOffset(0.0, 0.0), smooth_texture(*disparity.shape), disparity.astype(np.float32), np.ones_like(disparity)
    )
    return rays


def by_pixel(cells, rows):
    """Return (N, W) from cells, of target rows [first, last)."""
    grown = cells.repeat(CELL_PX, axis=0).repeat(CELL_PX, axis=1)
    first = rows[0] % CELL_PX
    return grown[first : first + rows[1] - rows[0], : SIZE[1]]


def nowhere_smooth(rays, offset, rows, columns):
    smooth, about = find_smooth_cells(rays, offset, rows, columns)
    return np.zeros_like(smooth), about


def both_ways(monkeypatch, rays, offset):
    """Return (candidates, colours) as they are, and with everything left to landing."""
    found = []
    for patch in (False, True):
        if patch:
            monkeypatch.setattr(candidates_module, "find_smooth_cells", nowhere_smooth)
        candidates = find_candidates(rays, offset, (0, SIZE[0]))
        found.append((candidates, look_up(rays, candidates, closed_form(candidates)[0]).colors))
    return found


@pytest.mark.parametrize("offset", OFFSETS)
def test_on_a_plane_every_ray_is_followed_to_its_exact_disparity(offset):
    rays = ray_set(SLOPE)
    candidates = find_candidates(rays, offset, (0, SIZE[0]))
    smooth = by_pixel(candidates.smooth, (0, SIZE[0]))
    # d = a + b x + c y on the surface, seen at (x + d s, y + d t): d (1 - b s - c t) = a + b x + c y
    exact = SLOPE / (1 - 0.02 * offset.s + 0.01 * offset.t)
    assert smooth.mean() > 0.4  # the border takes the rest of so small a picture
    assert candidates.disparity[0][smooth] == pytest.approx(exact[smooth], abs=0.004)
    assert (candidates.number[smooth] == 1).all()
    assert (candidates.coverage[0][smooth] == 1).all()


@pytest.mark.parametrize("disparity", [SLOPE, BUMPS, STEP], ids=["slope", "bumps", "step"])
@pytest.mark.parametrize("offset", OFFSETS)
def test_following_back_gives_what_landing_gives(disparity, offset, monkeypatch):
    (own, colors), (landed, expected) = both_ways(monkeypatch, ray_set(disparity), offset)
    smooth = by_pixel(own.smooth, (0, SIZE[0]))
    assert smooth.any()
    assert not landed.smooth.any()
    assert (landed.number[smooth] == 1).all()
    assert landed.coverage[0][smooth] == pytest.approx(np.ones(smooth.sum()), abs=0.1)
    # Landing takes the mean over a pixel's area, following back the value at its centre.
    assert own.disparity[0][smooth] == pytest.approx(landed.disparity[0][smooth], abs=0.02)
    assert (own.number[~smooth] == landed.number[~smooth]).all()
    assert np.abs(colors - expected).max() < 2 / 255


@pytest.mark.parametrize(("disparity", "is_smooth"), [(12.0, False), (-12.0, True)], ids=["in front", "behind"])
def test_inpainted_rays_matter_only_in_front(disparity, is_smooth):
    photo, at = np.zeros(SIZE, np.float32), ViewOffset(0.0, 1.0)
    photo[:, 32:36] = 20  # hides from the photo what is in front of its wall there
    rays = ray_set(photo)
    filled = np.zeros(SIZE, np.float32)
    filled[20:24, 20:24] = 1
    rays.add(at, np.zeros((*SIZE, 3), np.float32), np.full(SIZE, disparity, np.float32), filled)
    smooth, _ = find_smooth_cells(rays, at, (0, SIZE[0]))
    assert by_pixel(smooth, (0, SIZE[0]))[20:24, 20:24].all() == is_smooth
    assert by_pixel(smooth, (0, SIZE[0]))[8:12, 48:52].all()


@pytest.mark.parametrize("rows", [(0, 5), (3, 4), (17, 48)])
def test_bands_do_not_change_what_is_followed(rows):
    rays, offset = ray_set(BUMPS), ViewOffset(-1.3, 0.4)
    whole, band = find_candidates(rays, offset, (0, SIZE[0])), find_candidates(rays, offset, rows)
    inner = slice(*rows)
    assert (by_pixel(band.smooth, rows) == by_pixel(whole.smooth, (0, SIZE[0]))[inner]).all()
    assert (band.disparity[0] == whole.disparity[0][inner])[band.number > 0].all()
