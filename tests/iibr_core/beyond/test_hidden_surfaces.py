import numpy as np
import pytest

from iibr_core.beyond.hidden_surfaces import hidden_surface

SIZE = 60, 80
SQUARE = np.s_[20:40, 25:55]
WALL, DARK = 0.8, 0.1


def scene() -> tuple[np.ndarray, np.ndarray]:
    """Return colours and disparity of a dark square before a light wall; the wall beside it is half dark."""
    colors, disparity = np.full((*SIZE, 3), WALL, np.float32), np.zeros(SIZE, np.float32)
    colors[19:41, 24:56] = (WALL + DARK) / 2
    colors[SQUARE], disparity[SQUARE] = DARK, 3.0
    return colors, disparity


def test_nothing_of_the_foreground_is_seen_behind_it() -> None:
    colors, disparity = scene()
    hidden = hidden_surface(colors, disparity, 4.0)
    behind = hidden.mask & (disparity > 1)
    assert behind[SQUARE].mean() > 0.9
    np.testing.assert_allclose(hidden.disparity[behind], 0.0, atol=0.05)
    np.testing.assert_allclose(hidden.colors[behind], WALL, atol=0.02)
    narrow = hidden_surface(colors, disparity, 2.0)
    assert narrow.disparity[30, 40] == 3, "a narrower lens sees nothing behind the middle"
    assert narrow.disparity[21, 40] == pytest.approx(0, abs=0.05)


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (2, 2)])
def test_small_pictures_and_pinholes_hide_nothing(shape) -> None:
    disparity = np.arange(shape[0] * shape[1], dtype=np.float32).reshape(shape)
    for radius in (0.0, 1e-3, 1e6):
        hidden = hidden_surface(np.ones((*shape, 3), np.float32), disparity, radius)
        assert np.isfinite(hidden.colors).all()
        assert np.isfinite(hidden.disparity).all()
