"""Disparity maps on disk come back as they were written, or up to the steps of 16 bits."""

from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.maps.reader import read_map
from iibr_core.formats.maps.writer import MAX_PNG_VALUE, write_map
from iibr_core.types import InputError


def some_map() -> np.ndarray:
    return np.random.default_rng(0).normal(0, 5, (13, 17)).astype(np.float32)


@pytest.mark.parametrize("suffix", [".pfm", ".npy", ".exr", ".EXR", ".tif"])
def test_floating_point_maps_come_back_exactly(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"map{suffix}"
    assert write_map(path, some_map()) == ""
    np.testing.assert_array_equal(read_map(path), some_map())
    assert [other.name for other in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("name", ["map.jpg", "map", "map_depth.pfm"])
def test_names_that_would_be_read_as_something_else_are_refused(tmp_path: Path, name: str) -> None:
    with pytest.raises(InputError, match=name):
        write_map(tmp_path / name, some_map())
    assert not list(tmp_path.iterdir())


def test_a_png_says_how_its_values_were_scaled(tmp_path: Path) -> None:
    path, wanted = tmp_path / "map.png", some_map()
    step = (wanted.max() - wanted.min()) / (MAX_PNG_VALUE - 1)
    assert f"{step:.6g}" in write_map(path, wanted)
    np.testing.assert_allclose(read_map(path), wanted, atol=step)
    write_map(path, np.full((4, 5), -3.0, np.float32))
    np.testing.assert_allclose(read_map(path), -3.0)
