"""Maps are read some rows at a time; what comes out is that of the whole."""

import numpy as np
import pytest

from iibr_core.formats.images.oiio_writer import write_image_file
from iibr_core.formats.maps import disparity_file, resample
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.maps.reader import read_map, read_map_header
from iibr_core.types import ImageSize, InputError

STORED = np.random.default_rng(2).integers(0, 3, (150, 40)).astype(np.uint16)


def test_integers_of_many_rows(tmp_path):
    write_image_file(tmp_path / "a.png", STORED[..., None], "uint16")
    expected = np.where(STORED == 0, np.nan, STORED.astype(np.float32))
    assert np.array_equal(read_map(tmp_path / "a.png"), expected, equal_nan=True)


def test_colour_in_the_last_row_is_told(tmp_path):
    colors = np.repeat(STORED[..., None], 3, axis=2)
    colors[-1, -1, 1] += 1
    write_image_file(tmp_path / "a.png", colors, "uint16")
    with pytest.raises(InputError, match="colour picture"):
        read_map(tmp_path / "a.png")


def test_headers_tell_sizes(tmp_path):
    write_image_file(tmp_path / "a.png", STORED[..., None], "uint16")
    write_pfm(tmp_path / "a.pfm", STORED.astype(np.float32))
    np.save(tmp_path / "a.npy", STORED.astype(np.float64))
    for name, beside in (("a.png", 0), ("a.pfm", 0), ("a.npy", 8)):
        assert read_map_header(tmp_path / name) == ((150, 40), beside)


@pytest.mark.parametrize("rows", [1, 7, 64, 1000])
def test_scaling_does_not_depend_on_how_many_rows_are_scaled_at_once(tmp_path, monkeypatch, rows):
    values = np.where(STORED == 2, 1e6, STORED).astype(np.float32)
    write_pfm(tmp_path / "a.pfm", values)
    monkeypatch.setattr(disparity_file, "ROWS_AT_ONCE", rows)
    read = read_disparity(tmp_path / "a.pfm", ImageSize(150, 40), 0.3)
    known = values != 1e6
    assert np.array_equal(read.values[known], (values[known].astype(np.float64) * 0.3).astype(np.float32))
    assert f"{(~known).sum()} values" in read.notes[-1]


@pytest.mark.parametrize("step", [1, 3, 50, 7000])
def test_the_sample_is_that_of_the_whole(step):
    values = np.where(STORED == 0, np.nan, STORED * np.arange(40)).astype(np.float32)
    assert np.array_equal(resample._some_known(values, step), values[np.isfinite(values)][::step])
