"""The blur of a map, place by place: of steps, not of slopes or of what the photo does not share."""

from __future__ import annotations

import numpy as np
import pytest

from iibr_core.depth.edges.edge_blur import measure_edge_blur
from iibr_core.training.degradation import blur
from tests.iibr_core.scenes import smooth_texture


def disc(size: int = 160) -> tuple[np.ndarray, np.ndarray]:
    """Photo and exact disparity of a disc before a wall."""
    y, x = np.mgrid[:size, :size]
    front = (x - 0.47 * size) ** 2 + (y - 0.52 * size) ** 2 < (size / 4) ** 2
    photo = np.where(front[..., None], smooth_texture(size, size, 1) * [1, 0.6, 0.3], smooth_texture(size, size) * 0.4)
    return photo.astype(np.float32), np.where(front, 2.0, 0.5).astype(np.float32)


@pytest.mark.parametrize("sigma", [1.0, 1.5, 2.0, 3.0, 4.0])
def test_the_blur_of_a_map_is_measured(sigma: float) -> None:
    photo, disparity = disc()
    np.testing.assert_allclose(measure_edge_blur(photo, blur(disparity, sigma)).sigma_px, sigma, rtol=0.15)


def test_a_wide_blur_is_measured_on_a_smaller_map() -> None:
    photo, disparity = disc(480)
    np.testing.assert_allclose(measure_edge_blur(photo, blur(disparity, 8.0)).sigma_px, 8.0, rtol=0.15)


def test_exact_edges_have_none() -> None:
    photo, disparity = disc()
    assert not measure_edge_blur(photo, disparity).sigma_px.any()


def test_each_part_of_a_map_has_its_own() -> None:
    photo, disparity = disc()
    photo, disparity = np.tile(photo, (1, 3, 1)), np.tile(disparity, (1, 3))
    disparity = np.concatenate([disparity[:, :160], blur(disparity, 1.5)[:, 160:320], blur(disparity, 4.0)[:, 320:]], 1)
    measured = measure_edge_blur(photo, disparity)
    parts = [measured.sigma_px[:, round(at / measured.cell_px)] for at in (60, 235, 400)]
    assert not parts[0].any()
    np.testing.assert_allclose(parts[1], 1.5, rtol=0.15)
    np.testing.assert_allclose(parts[2], 4.0, rtol=0.15)


def test_an_edge_that_the_photo_does_not_share_proves_nothing() -> None:
    photo, disparity = disc()
    soft = blur(disparity, 2.0)
    assert measure_edge_blur(photo, soft).sigma_px.any()
    for other in (np.full_like(photo, 0.5), smooth_texture(160, 160), np.rot90(photo, 1, (0, 1))[::-1, 40:200]):
        if other.shape == photo.shape:
            assert not measure_edge_blur(np.ascontiguousarray(other, np.float32), soft).sigma_px.any()


@pytest.mark.parametrize("sigma", [1.0, 2.0])
def test_a_wire_alone_tells_the_blur(sigma: float) -> None:
    photo, disparity = smooth_texture(120, 160) * 0.4 + 0.4, np.zeros((120, 160), np.float32)
    photo[:, 80:83], disparity[:, 80:83] = [0.1, 0.1, 0.3], 2.0
    np.testing.assert_allclose(measure_edge_blur(photo, blur(disparity, sigma)).sigma_px, sigma, rtol=0.2)
