import numpy as np
import pytest
from scipy.ndimage import gaussian_filter, map_coordinates

from iibr_core.depth.multi_view.estimate import estimate_coarse, estimate_disparity, estimate_with_doubt
from iibr_core.types import GridShape, ImageSize, ViewOffset, image_size
from tests.iibr_core.depth.multi_view.test_estimate import PAIR, textured

SIZE = ImageSize(96, 144)
SQUARES = (((52.0, 30.0), 17.0, 0.1, 235), ((40.0, 96.0), 22.0, 0.9, 150))
"""Middle (y, x), half a diagonal in px, share of the largest disparity, and grey of each square, the farther first."""


def draw(offset, largest, squares=SQUARES, page=None, noise=0.0):
    """Return a view (H, W, 3) of squares on their corners on a plain page, and which square each pixel shows or -1."""
    y, x = np.mgrid[: SIZE.height, : SIZE.width].astype(np.float64)
    image = np.full((*SIZE, 3), (96.0, 116.0, 170.0)) if page is None else page.astype(np.float64)
    shown = np.full(SIZE, -1)
    for number, (middle, half, share, grey) in enumerate(squares):
        apart = np.abs(y - middle[0] + share * largest * offset.t) + np.abs(x - middle[1] + share * largest * offset.s)
        cover = np.clip((half - apart) / np.sqrt(2) + 0.5, 0, 1)[..., None]
        image, shown = image * (1 - cover) + grey * cover, np.where(cover[..., 0] > 0.5, number, shown)
    rng = np.random.default_rng([round(4 * value) + 400 for value in offset])
    return np.clip(image + noise * rng.normal(0, 1, image.shape) + 0.5, 0, 255).astype(np.uint8), shown


def find(offsets, largest, **parts):
    """Return disparity as a share of the largest, and what each pixel of the view at the origin shows."""
    reference = min(range(len(offsets)), key=lambda index: np.hypot(*offsets[index]))
    drawn = [draw(offset, largest, **parts) for offset in offsets]
    views = [view for view, _ in drawn]
    coarse = estimate_coarse(views, offsets, reference)
    return estimate_disparity(views, offsets, reference, coarse.range_px) / largest, drawn[reference][1]


FIELDS = {
    "pair": (PAIR, 12.0, 0.0),
    "row": ([ViewOffset(0.0, s) for s in np.arange(24) - 11.5], 1.0, 0.0),
    "noisy row": ([ViewOffset(0.0, float(s)) for s in range(-2, 3)], 6.0, 1.5),
    "grid": ([GridShape(5, 5).offset(*at) for at in np.ndindex(5, 5)], 6.0, 0.0),
}


@pytest.mark.parametrize("field", FIELDS)
def test_a_plain_background_lies_with_the_farthest_object(field):
    offsets, largest, noise = FIELDS[field]
    found, shown = find(offsets, largest, noise=noise)
    background = found[shown == -1]
    assert (background > 0.2).mean() < 0.12  # half of it and more where outlines count for both of their sides
    assert (background < -0.1).mean() < 0.02
    for number, (_, _, share, _) in enumerate(SQUARES):
        assert np.median(np.abs(found[shown == number] - share)) < 0.1


def test_a_plain_object_before_a_textured_wall_keeps_its_disparity():
    wall = (textured(image_size(draw(PAIR[0], 0.0)[0])) // 4).astype(np.uint8)
    offsets = FIELDS["grid"][0]
    found, shown = find(offsets, 4.0, squares=SQUARES[1:], page=wall)
    assert np.median(np.abs(found[shown == 0] - 0.9)) < 0.1
    assert np.median(np.abs(found[shown == -1])) < 0.02


def test_stripes_stay_smooth_and_are_in_doubt():
    """Stripes of 4 px in a textured frame, all at 1.5 px: every 4 px they match again."""
    waves = np.sin(2 * np.pi * (np.arange(144 + 80) - 40) / 4)
    wall = 110 + 300 * gaussian_filter(np.random.default_rng(2).normal(size=(96 + 80, 144 + 80)), 1.2)
    wall[60:116, 76:148] = 128 + 70 * waves[76:148]
    y, x = np.mgrid[:96, :144].astype(float)
    offsets = [ViewOffset(0.0, float(s)) for s in range(-2, 3)]
    views = [map_coordinates(wall, [y + 40, x + 1.5 * s + 40], order=1).clip(0, 255) for _, s in offsets]
    colors = [np.repeat(view.astype(np.uint8)[..., None], 3, -1) for view in views]
    values, is_doubtful = estimate_with_doubt(colors, offsets, 2, (-12.0, 14.0))
    assert np.abs(values[24:72, 40:104] - 1.5).max() < 0.3
    assert is_doubtful[24:72, 40:104].mean() > 0.5
    assert is_doubtful[:16].mean() < 0.05


@pytest.mark.parametrize("wall", [0, 6])
def test_a_patterned_wall_takes_the_match_nearest_to_what_is_sure(wall):
    """A wall that repeats itself every 24 px, and a square 12 px nearer: the wall fits at wall + 24 n, too."""
    pattern = np.tile(textured((96, 24), 4), (1, 12, 1))
    left, right = pattern[:, 24:168].copy(), pattern[:, 24 + wall : 168 + wall].copy()
    square = textured((40, 40), 5)
    left[30:70, 70:110] = right[30:70, 70 - wall - 12 : 110 - wall - 12] = square
    values, is_doubtful = estimate_with_doubt([left, right], PAIR, 0, estimate_coarse([left, right], PAIR, 0).range_px)
    assert np.median(np.abs(values[40:60, 80:100] - wall - 12)) < 0.5
    assert np.mean(np.abs(values[:24, 24:-24] - wall) > 1) < 0.1
    assert is_doubtful[:24].mean() > 0.8
    assert is_doubtful[40:60, 80:100].mean() < 0.1
