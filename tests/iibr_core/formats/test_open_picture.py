"""A photo's file is looked at once: its opens are counted by the kernel, so those of libraries in C count, too."""

import ctypes
import os
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.write import write_image
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.scenes.photo import load_photo
from iibr_core.scenes.scene import Source
from iibr_core.types import InputError
from tests.iibr_core.scenes import square_before_wall

IN_ACCESS, IN_CLOSE_NOWRITE, IN_OPEN = 0x1, 0x10, 0x20


def opens_of(path: Path, act: Callable[[], object]) -> int:
    """Return how often a file is opened meanwhile. Reads and closes keep inotify from joining two opens."""
    libc = ctypes.CDLL(None)
    queue = libc.inotify_init1(os.O_NONBLOCK)
    libc.inotify_add_watch(queue, os.fsencode(path), IN_OPEN | IN_ACCESS | IN_CLOSE_NOWRITE)
    act()
    events = os.read(queue, 1 << 20)
    os.close(queue)
    return sum(bool(mask & IN_OPEN) for _, mask, _, _ in struct.iter_unpack("iIII", events))


@pytest.mark.parametrize(("name", "most"), [("photo.png", 4), ("photo_disparity.pfm", 1)])
def test_a_photo_and_its_map_are_opened_a_few_times_only(tmp_path, name, most) -> None:
    photo, disparity = square_before_wall(60, 80)
    write_image(tmp_path / "photo.png", np.round(255 * photo.pixels).astype(np.uint8))
    write_pfm(tmp_path / "photo_disparity.pfm", disparity.values)
    source = Source(str(tmp_path / "photo.png"))
    assert 1 <= opens_of(tmp_path / name, lambda: load_photo(source)) <= most


def test_a_program_that_looked_at_a_picture_ends_silently(tmp_path) -> None:
    Image.new("RGB", (8, 6)).save(tmp_path / "a.png")
    code = "from pathlib import Path; from iibr_core.formats.images.open_picture import open_picture as o"
    code += f"; print(o(Path({str(tmp_path / 'a.png')!r})).size)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert (done.stdout, done.stderr) == ("8x6\n", "")


def test_a_file_in_the_place_of_another_is_looked_at_again(tmp_path) -> None:
    path = tmp_path / "a.png"
    Image.new("RGB", (8, 6)).save(path)
    assert open_picture(path) is open_picture(path)
    assert open_picture(path).size == (6, 8)
    exif = Image.Exif()
    exif[0x0112] = 6
    Image.new("RGB", (9, 5)).save(tmp_path / "b.jpg", exif=exif)
    os.replace(tmp_path / "b.jpg", path)
    picture = open_picture(path)
    assert (picture.kind, picture.size, picture.upright_size) == ("JPEG", (5, 9), (9, 5))
    path.unlink()
    with pytest.raises(InputError, match="no such file"):
        open_picture(path)
