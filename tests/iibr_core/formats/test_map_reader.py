"""Maps with one value per pixel, as they are stored."""

import numpy as np
import pytest

from iibr_core.formats.images.write import write_image_file
from iibr_core.formats.maps import resample
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.maps.reader import read_map, read_map_header

STORED = np.random.default_rng(2).integers(0, 3, (150, 40)).astype(np.uint16)


def test_integers_of_many_rows(tmp_path):
    write_image_file(tmp_path / "a.png", STORED[..., None], "uint16")
    expected = np.where(STORED == 0, np.nan, STORED.astype(np.float32))
    assert np.array_equal(read_map(tmp_path / "a.png"), expected, equal_nan=True)


def test_headers_tell_sizes(tmp_path):
    write_image_file(tmp_path / "a.png", STORED[..., None], "uint16")
    write_pfm(tmp_path / "a.pfm", STORED.astype(np.float32))
    np.save(tmp_path / "a.npy", STORED.astype(np.float64))
    for name, beside in (("a.png", 0), ("a.pfm", 0), ("a.npy", 8)):
        assert read_map_header(tmp_path / name) == ((150, 40), beside)


@pytest.mark.parametrize("step", [1, 3, 50, 7000])
def test_the_sample_is_that_of_the_whole(step):
    values = np.where(STORED == 0, np.nan, STORED * np.arange(40)).astype(np.float32)
    assert np.array_equal(resample._some_known(values, step), values[np.isfinite(values)][::step])
