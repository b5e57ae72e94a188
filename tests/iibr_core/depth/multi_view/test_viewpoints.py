"""Viewpoints are measured in views whose parallax is tiny or large, and whose light differs."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter, shift

from iibr_core.depth.multi_view.near_side import nearness_ratio
from iibr_core.depth.multi_view.order_by_parallax import find_order
from iibr_core.depth.multi_view.viewpoints import measure_viewpoints
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.types import FloatImage, ViewOffset

OFFSETS = [(0.0, 1.0), (1.0, 0.0), (-1.0, -1.0), (0.0, -2.0), (2.0, 1.0), (0.0, 3.0)]


def views(disparity_px: float) -> list[FloatImage]:
    """Two textured halves whose disparities differ in their sign, the reference first."""
    rough = np.random.default_rng(3).normal(size=(2, 120, 160))
    halves = [0.5 + gaussian_filter(half, 1.5) for half in rough]
    seen = []
    for t, s in [(0.0, 0.0), *OFFSETS]:
        near, far = (shift(half, (-d * t, -d * s)) for half, d in zip(halves, (disparity_px, -disparity_px)))
        seen.append(np.concatenate([near[10:100, 10:80], far[10:100, 80:150]], axis=1).astype(np.float32))
    return seen


def darker_at_the_edge(luma: FloatImage, k: int) -> FloatImage:
    y, x = np.meshgrid(*(np.linspace(-1, 1, length) for length in luma.shape), indexing="ij")
    return np.float32(luma * (0.8 + 0.05 * k) * (1 - 0.15 * (y**2 + (x - 0.1 * k) ** 2)))


@pytest.mark.parametrize("disparity_px", [0.1, 0.6, 2.0])
@pytest.mark.parametrize("is_uneven", [False, True])
def test_viewpoints_are_proportional(disparity_px: float, is_uneven: bool) -> None:
    reference, *others = views(disparity_px)
    if is_uneven:
        others = [darker_at_the_edge(luma, k) for k, luma in enumerate(others)]
    offsets = measure_viewpoints(reference, others).offsets
    assert offsets / offsets[0, 1] == pytest.approx(np.array(OFFSETS), abs=0.25 if is_uneven else 0.15)


def test_pictures_that_do_not_differ_have_no_viewpoints() -> None:
    reference = views(0.0)[0]
    noisy = [reference + np.float32(np.random.default_rng(k).normal(0, 0.004, reference.shape)) for k in range(4)]
    assert not measure_viewpoints(reference, [reference, *noisy]).is_measured.any()


def test_the_order_of_views_is_found_where_neighbours_differ_by_a_seventh_of_the_width(tmp_path: Path) -> None:
    wall = (128 + 200 * gaussian_filter(np.random.default_rng(5).normal(size=(140, 160, 3)), (2, 2, 0))).clip(0, 255)
    colors = []
    for column, row in np.ndindex(3, 3):
        view = wall[14 * row :, 14 * column :][:80, :100].astype(np.uint8)
        Image.fromarray(view).save(tmp_path / f"lf_{column}_{row}.png")
        colors.append(np.float32(view / 255))
    fit, _ = find_order(open_light_field(tmp_path), colors)
    assert fit is not None
    assert (fit.arrangement.order, fit.arrangement.flip, fit.arrangement.row_step) == ("columns", "none", 1.0)


def test_views_that_disagree_about_the_near_side_leave_it_open() -> None:
    rng = np.random.default_rng(4)
    lumas = [np.float32(rng.random((60, 80))) for _ in range(5)]
    values = np.float32(gaussian_filter(rng.normal(size=(60, 80)), 3) * 30)
    offsets = [ViewOffset(0.0, 0.0), *(ViewOffset(0.0, float(s)) for s in (-2, -1, 1, 2))]
    assert nearness_ratio(lumas, offsets, values) == pytest.approx(1, abs=0.05)
