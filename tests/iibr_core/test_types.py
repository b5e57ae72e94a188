from dataclasses import replace

import numpy as np
import pytest

from iibr_core.types import Camera, GridShape, ImageSize, InputError, Margins

CAMERA = Camera(np.eye(3), np.array([1.0, -2.0, 3.0]), ImageSize(60, 80), (90.0, 100.0), (30.0, 20.5), "pose 3")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"position": np.array([0.0, np.nan, 0.0])}, "NaN, infinite or too large"),
        ({"centre_px": (0.0, 2e12)}, "NaN, infinite or too large"),
        ({"depth_range": (1.0, np.inf)}, "NaN, infinite or too large"),
        ({"world_from_camera": 1.01 * np.eye(3)}, "no rotation"),
        ({"world_from_camera": np.diag([1.0, 1.0, -1.0])}, "no rotation"),
        ({"focal_px": (0.7, 90.0)}, "pictures of 80x60 with focal lengths of 0.7 and 90 px; .* 1/100 to 100"),
        ({"focal_px": (90.0, 8100.0)}, "focal lengths"),
        ({"size": ImageSize(0, 80)}, "focal lengths"),
        ({"depth_range": (0.0, 5.0)}, "depths from 0 to 5 are not positive and ascending"),
        ({"depth_range": (5.0, 5.0)}, "ascending"),
    ],
    ids=lambda value: value if isinstance(value, str) else "-".join(value),
)
def test_values_that_make_no_camera_are_refused(changes, words):
    with pytest.raises(InputError, match=f"pose 3: .*{words}") as caught:
        replace(CAMERA, **changes)
    assert "\n" not in str(caught.value)


def test_cameras_at_the_limits_and_with_larger_pictures():
    replace(CAMERA, depth_range=(0.1, 0.2), focal_px=(0.8, 8000.0), position=np.full(3, 9e11))
    large = CAMERA.resized(ImageSize(90, 240))
    assert large.size == (90, 240)
    for at in ((0.3, 0.2), (-0.1, 0.0)):
        (x, y, _), (u, v, _) = (each.intrinsics @ (*at, 1.0) for each in (CAMERA, large))
        assert (u + 0.5, v + 0.5) == pytest.approx((3 * (x + 0.5), 1.5 * (y + 0.5))), "areas of pixels coincide"


def test_places_in_grids_of_even_and_odd_sides():
    grid = GridShape(4, 5)
    assert (grid.centre, grid.offset(0, 4), grid.index_of(grid.offset(3, 1))) == ((2, 2), (-2, 2), (3, 1))
    assert Margins(1, 2, 3, 4).around(ImageSize(10, 20)) == (13, 27)
