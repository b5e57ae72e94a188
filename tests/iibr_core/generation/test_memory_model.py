"""`--memory` is a bound for the whole process: what does not fit is refused or made smaller before it is allocated."""

import math

import numpy as np
import pytest

from iibr_core.generation import memory_model, plan
from iibr_core.generation.memory_model import (
    HEADROOM,
    LEAST_PIXELS,
    MIB,
    PHOTO_BYTES,
    RAY_BYTES,
    VIEWER_BYTES,
    WRITER_BYTES,
    Budget,
    Making,
    budget_of,
    largest_side,
    making_bytes,
    own_size_bytes,
    pixels_within,
    require_decoding,
    require_map,
    require_picture,
    require_process,
    require_reading,
    require_views,
    view_bytes,
    whole_bytes,
)
from iibr_core.generation.plan import PlanOverrides, plan_for_viewing, plan_literal
from iibr_core.rendering.ray_set import RaySet
from iibr_core.runtime.machine import memory_bytes
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset
from tests.iibr_core.scenes import square_before_wall

GIB = 1024 * MIB


def test_a_budget_is_no_larger_than_the_machine():
    assert budget_of(2**62).bytes == memory_bytes()
    assert budget_of(1000).bytes == 1000
    assert 0 < budget_of(None).bytes < memory_bytes()
    with pytest.raises(InputError, match="--memory 0"):
        budget_of(0)


def test_a_process_takes_something_before_it_does_anything():
    with pytest.raises(InputError, match=r"takes \d+ MiB, --memory is 100 MiB"):
        require_process(budget_of(100 * MIB), keeps_views=True)
    require_process(budget_of(WRITER_BYTES + 10 * MIB), keeps_views=False)
    with pytest.raises(InputError):
        require_process(budget_of(WRITER_BYTES + 10 * MIB), keeps_views=True)


def test_more_memory_makes_room_for_larger_photos_and_fewer_views_for_larger_ones():
    sizes = [pixels_within(Budget(gigabytes * GIB, ""), None) for gigabytes in (1, 2, 4, 8)]
    assert sizes == sorted(set(sizes))
    assert sizes[0] > 500_000
    one = Budget(GIB, "")
    assert pixels_within(one, GridShape(1, 1)) > pixels_within(one, GridShape(3, 3)) > pixels_within(one, None)
    assert pixels_within(one, GridShape(99, 99)) == pixels_within(one, None)
    assert pixels_within(Budget(1, ""), None) == LEAST_PIXELS


def test_so_many_pixels_fit_indeed():
    """With the views that a photo is made no smaller for, and what usual scenes take while they are made."""
    budget = Budget(GIB, "")
    pixels = pixels_within(budget, None)
    field = 25 * view_bytes(pixels, is_hdr=False)
    assert whole_bytes(pixels, field, making_bytes(Making.usual(pixels)), True) == pytest.approx(GIB, rel=1e-3)


def test_views_that_are_kept_count_and_those_that_are_written_do_not():
    kept, written = (whole_bytes(1000, 10**9, 10**6, keeps) for keeps in (True, False))
    assert kept - written == HEADROOM * 10**9 + VIEWER_BYTES - WRITER_BYTES


def test_a_grid_that_was_asked_for_is_refused_with_the_largest_that_fits():
    budget = Budget(2 * GIB, "--memory is")
    with pytest.raises(InputError, match=r"99 x 99 views of a\.jpg .* at most --grid \d+, or raise --memory") as error:
        require_views(budget, "a.jpg", ImageSize(1000, 1000), GridShape(99, 99))
    side = int(str(error.value).split("--grid ")[1].split(",")[0])
    assert side > 1
    require_views(budget, "a.jpg", ImageSize(1000, 1000), GridShape(side, side))
    assert largest_side(Budget(10 + math.ceil(HEADROOM * 90), ""), 10, 10) == 3


def test_a_photo_too_large_to_be_read_is_refused_with_the_size_that_fits():
    with pytest.raises(InputError, match=r"100x1000000 takes .* give --max-pixels (\d+)"):
        require_reading(Budget(GIB, "--memory is"), ImageSize(1_000_000, 100))
    require_reading(Budget(GIB, "--memory is"), ImageSize(1000, 1000))
    with pytest.raises(InputError, match="row by row"):
        require_decoding(Budget(GIB, "--memory is"), "a.heic", GIB, keeps_views=False)


def test_maps_count_and_those_of_depth_count_more():
    size, budget = ImageSize(4000, 5000), Budget(GIB, "--memory is")
    require_map(budget, "a.pfm", size, 0, keeps_views=True)
    for name, beside in (("a_depth.pfm", 4), ("a.npy", 64)):
        with pytest.raises(InputError, match=r"the map a.* \(5000x4000\) takes"):
            require_map(budget, name, size, beside, keeps_views=True)


def test_plans_stay_within_their_budget(monkeypatch):
    monkeypatch.setattr(memory_model, "VIEWER_BYTES", MIB)
    photo, disparity = square_before_wall(300, 400)
    roomy = plan_for_viewing(photo, disparity)
    for share in (0.5, 0.7, 0.9):
        most = round(share * whole_bytes(300 * 400, roomy.field_bytes, roomy.peak_bytes, keeps_views=True))
        try:
            tight = plan_for_viewing(photo, disparity, PlanOverrides(memory_bytes=most))
        except InputError:
            assert whole_bytes(300 * 400, 9 * view_bytes(300 * 400, False), roomy.peak_bytes, True) > most
        else:
            assert whole_bytes(300 * 400, tight.field_bytes, tight.peak_bytes, keeps_views=True) <= most


def test_holes_count():
    """What fills them looks around in sixteen directions: 128 bytes a pixel of them."""
    photo, disparity = square_before_wall(120, 160, foreground=6.0)
    grid = GridShape(9, 9)
    statistics = plan.measure_parallax(disparity.values, 4.0)
    assert 0.05 < statistics.hole_share <= 1
    assert plan.measure_parallax(np.zeros((120, 160), np.float32), 4.0).hole_share == 0
    ramp = np.linspace(0, 0.05, 160, dtype=np.float32) * np.ones((120, 1), np.float32)
    assert plan.measure_parallax(ramp, 4.0).hole_share < 0.01
    holes = [int(view.inpainted.sum()) for view in _views(photo, disparity, grid)]
    assert max(holes) <= statistics.hole_share * 120 * 160


def _views(photo, disparity, grid):
    from iibr_core.generation.light_field import generate

    return generate(photo, disparity, plan_literal(photo, disparity, grid), quality="fast")


def test_the_whole_is_what_the_plan_says():
    photo, disparity = square_before_wall(60, 80)
    made = plan_for_viewing(photo, disparity)
    whole = whole_bytes(math.prod(photo.size), made.field_bytes, made.peak_bytes, keeps_views=True)
    assert f"{math.ceil(whole / MIB)} MiB in all" in made.reasons[-1]


def test_the_picture_counts_and_floats_count_more():
    size, budget = ImageSize(9000, 9000), Budget(2 * GIB, "--memory is")
    require_picture(budget, size, is_float=False)
    with pytest.raises(InputError, match="a picture of 9000x9000 takes"):
        require_picture(budget, size, is_float=True)


def test_a_ray_takes_what_is_counted_for_it():
    rays = RaySet(3, ImageSize(64, 80), 0.1)
    image = np.zeros((64, 80), np.float32)
    rays.add(ViewOffset(0.0, 0.0), np.zeros((64, 80, 3), np.float32), image, np.ones_like(image))
    assert sum(part.nbytes for part in rays.arrays if np.ndim(part) > 2) == 5120 * RAY_BYTES
    more = making_bytes(Making(5120, 5120, 3, 0, 0)) - making_bytes(Making(5120, 5120, 2, 0, 0))
    assert more == 5120 * RAY_BYTES


def test_views_in_flight_and_the_one_that_is_filled_do_not_add_up():
    counts = [making_bytes(Making(10**6, 10**6, 2, hole, 0)) for hole in (0.0, 0.2, 0.9)]
    assert counts[0] == counts[1] < counts[2]


def test_a_picture_at_the_photos_own_size_counts_what_it_shows_of_what_is_hidden():
    large, view, tile = ImageSize(3000, 4000), ImageSize(600, 800), ImageSize(1100, 1100)
    in_the_middle, aside = (own_size_bytes(large, view, 0, tile, hidden) for hidden in (False, True))
    assert VIEWER_BYTES + 28 * 12_000_000 < in_the_middle < aside < 2 * in_the_middle
    assert own_size_bytes(large, view, 10**8, tile, False) == in_the_middle + HEADROOM * 10**8
    assert own_size_bytes(large, view, 0, ImageSize(1300, 1300), True) > aside


def test_views_that_are_shown_count_beside_the_viewer_and_the_photo():
    size, grid = ImageSize(1000, 1000), GridShape(3, 3)
    needed = VIEWER_BYTES + 10**6 * PHOTO_BYTES + round(HEADROOM * 9 * view_bytes(10**6, is_hdr=False))
    require_views(Budget(needed, "--memory is"), "a.jpg", size, grid)
    with pytest.raises(InputError, match="3 x 3 views"):
        require_views(Budget(needed - 1, "--memory is"), "a.jpg", size, grid)
