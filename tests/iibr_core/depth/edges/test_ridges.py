"""Wires and slits in blurred maps: they get back the height that the blur took, where the photo shows their width."""

from __future__ import annotations

import numpy as np
import pytest

from iibr_core.depth.edges.refine import refine
from iibr_core.training.degradation import blur
from tests.iibr_core.scenes import smooth_texture

SIZE, FINER = (120, 160), 8
DISPARITY = 3.0


def strip(width: float, angle: float) -> np.ndarray:
    """Share of each pixel that a straight strip covers."""
    y, x = (np.mgrid[: SIZE[0] * FINER, : SIZE[1] * FINER] + 0.5) / FINER - 0.5
    inside = np.abs((x - 80.25) * np.cos(angle) + (y - 60.25) * np.sin(angle)) <= width / 2
    return inside.reshape(SIZE[0], FINER, SIZE[1], FINER).mean((1, 3))


def wire(width: float, angle: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Photo, exact disparity, pixels of a dark wire before a textured wall that is slanted."""
    cover = strip(width, angle)
    photo = (smooth_texture(*SIZE) * 0.4 + 0.4) * (1 - cover[..., None]) + cover[..., None] * [0.1, 0.12, 0.3]
    wall = 0.005 * np.arange(SIZE[1])
    is_wire = cover >= 0.5
    return photo.astype(np.float32), np.where(is_wire, wall + DISPARITY, wall).astype(np.float32), is_wire


def inner(mask: np.ndarray) -> np.ndarray:
    """Away from the frame, where no ends are."""
    kept = np.zeros_like(mask)
    kept[12:-12, 12:-12] = mask[12:-12, 12:-12]
    return kept


@pytest.mark.parametrize("angle", [0.0, 0.3, 0.8, 1.2, np.pi / 2])
@pytest.mark.parametrize("width", [3, 4, 5])
@pytest.mark.parametrize("sigma", [1.0, 2.0])
def test_wires_get_their_height_back(width: int, sigma: float, angle: float) -> None:
    photo, exact, is_wire = wire(width, angle)
    soft = blur(exact, sigma)
    refined = refine(photo, soft)
    wall = 0.005 * np.arange(SIZE[1])
    shown = (refined - wall)[inner(is_wire)]
    assert 0.9 * DISPARITY <= shown.mean() <= 1.1 * DISPARITY
    around = inner(np.ones_like(is_wire))
    assert np.square(refined - exact)[around].mean() < np.square(soft - exact)[around].mean()


def test_a_slit_gets_its_depth_back() -> None:
    photo, exact, is_slit = wire(3, 0.4)
    soft = blur(-exact, 2.0)
    refined = refine(photo, soft)
    assert (refined + 0.005 * np.arange(SIZE[1]))[inner(is_slit)].mean() <= -0.9 * DISPARITY


def test_between_off_and_on_it_is_between() -> None:
    photo, exact, is_wire = wire(3, 0.3)
    soft = blur(exact, 2.0)
    heights = [refine(photo, soft, strength)[inner(is_wire)].mean() for strength in (0.0, 0.5, 1.0)]
    assert heights == sorted(heights)
    assert heights[1] == pytest.approx((heights[0] + heights[2]) / 2, rel=0.05)


def test_a_wire_that_the_photo_does_not_show_is_made_no_higher() -> None:
    """Beside a disc that tells the blur; what is thin and has no outline may be a fold."""
    photo, exact, is_wire = wire(3, 0.0)
    photo = smooth_texture(*SIZE) * 0.1 + 0.4
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    disc = np.hypot(x - 40, y - 60) < 22
    photo[disc], exact[disc] = [0.9, 0.5, 0.1], 2.5
    soft = blur(exact, 2.0)
    refined = refine(photo, soft)
    assert not np.array_equal(refined[:, :70], soft[:, :70])
    assert refined[inner(is_wire)].max() <= 1.02 * soft[inner(is_wire)].max()
