"""Names that OpenImageIO does not take: links to them, there and back."""

import os
from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.images.oiio_names import oiio_name
from iibr_core.formats.images.photo import read_photo, write_image

PIXELS = np.random.default_rng(0).integers(0, 256, (6, 8, 3), dtype=np.uint8)


def test_names_that_are_text_stay():
    assert oiio_name(Path("a/ü€.png")) == "a/ü€.png"


@pytest.mark.parametrize("name", [b"\xff.png", b"\xff.exr", b"x.\xff", b"\xfe/a.png"])
def test_a_link_leads_to_the_file_and_back(tmp_path, monkeypatch, name):
    path = Path(os.fsdecode(os.fsencode(tmp_path) + b"/" + name))
    path.parent.mkdir(exist_ok=True)
    path.write_bytes(b"there")
    assert Path(oiio_name(path)).read_bytes() == b"there"
    monkeypatch.chdir(tmp_path)
    assert Path(oiio_name(path.relative_to(tmp_path))).read_bytes() == b"there"
    if path.suffix.isascii():
        write_image(path, PIXELS)
        read = read_photo(path)
        np.testing.assert_allclose(read.pixels * 255, PIXELS, atol=1)
        read.name.encode()
        assert [entry.name for entry in path.parent.iterdir()] == [path.name], "nothing else is left"
