import re
import struct
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.side_by_side import stated_pair
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.views import read_views
from iibr_core.types import ImageSize

SIZE = ImageSize(60, 80)


def photo(height: int = 96, width: int = 128, seed: int = 0) -> NDArray[np.uint8]:
    """A wall of blurred noise, a red disc at the left and a blue box at the right, none of which repeats."""
    small = np.random.default_rng(seed).integers(0, 256, (height // 6, width // 6, 3), np.uint8)
    picture = np.array(Image.fromarray(small).resize((width, height), Image.Resampling.BICUBIC))
    y, x = np.mgrid[:height, :width]
    picture[(x - 0.28 * width) ** 2 + (y - 0.5 * height) ** 2 < (0.22 * height) ** 2] //= np.array([1, 4, 4], np.uint8)
    picture[(x > 0.6 * width) & (x < 0.85 * width) & (y > 0.45 * height) & (y < 0.9 * height)] //= 3
    return picture


def eyes(size: ImageSize = SIZE, apart_px: int = 4) -> tuple[NDArray[np.uint8], NDArray[np.uint8]]:
    """Return a scene for the left and the right eye: near things are farther left for the right eye."""
    wall = photo(size.height, size.width + 20)
    left, right = wall[:, 10 : 10 + size.width].copy(), wall[:, 11 : 11 + size.width].copy()
    top, first = size.height // 3, size.width // 2
    for picture, at in ((left, first), (right, first - apart_px)):
        picture[top : 2 * top, at : at + size.width // 4] = photo(top, size.width // 4, seed=5)
    return left, right


LEFT, RIGHT = eyes()


def squeezed(picture: NDArray[np.uint8], axis: int) -> NDArray[np.uint8]:
    return picture[::2] if axis == 0 else picture[:, ::2]


NAMES = {
    "a_LRF_Full_SBS.png": ("beside", False, False),
    "a_LRF_Half_SBS.png": ("beside", True, False),
    "a.left-right.png": ("beside", False, False),
    "a.3D.H-SBS.png": ("beside", True, False),
    "a_RL.png": ("beside", False, True),
    "a-crosseyed.png": ("beside", False, True),
    "a_TB.png": ("over", False, False),
    "a.top-bottom (1).png": ("over", False, False),
    "a_SBS - Copy (2).png": ("beside", False, False),
    "a.bottom-top.png": ("over", False, True),
    "a-htab.png": ("over", True, False),
    "a.jps": ("beside", False, True),
    "a_lr.jps": ("beside", False, False),
}


@pytest.mark.parametrize("name", NAMES)
def test_pairs_are_known_by_their_names_and_show_the_left_eye(tmp_path, name) -> None:
    arrangement, is_half, right_first = NAMES[name]
    axis = 0 if arrangement == "over" else 1
    pictures = (RIGHT, LEFT) if right_first else (LEFT, RIGHT)
    parts = [squeezed(picture, axis) if is_half else picture for picture in pictures]
    path = tmp_path / name
    kind = {".jps": "JPEG", ".png": "PNG", ".pns": "PNG"}[path.suffix.lower()]
    Image.fromarray(np.concatenate(parts, axis=axis)).save(path, kind, quality=95, subsampling=0)
    shown = read_photo(path)
    assert shown.size == SIZE
    assert re.match(r"Taken for a stereo pair.*: the left eye's picture is shown", shown.notes[0])
    assert ("side by side" if axis == 1 else "one over the other") in shown.notes[0]
    tolerance = 12 if is_half else 4
    assert np.abs(255 * shown.pixels - LEFT).mean() < tolerance
    size, updates = read_views(open_light_field(path))
    assert size == SIZE
    views = {update.column: update.colors.astype(float) for update in updates}
    for column, expected in enumerate((LEFT, RIGHT)):
        assert np.abs(views[column] - expected).mean() < tolerance


@pytest.mark.parametrize("name", ["Corfou_ou", "collage_2x1", "IMG_0001_TB", "two side-by-side"])
def test_ordinary_photos_are_not_cut_whatever_their_name(tmp_path, name) -> None:
    path = tmp_path / f"{name}.jpg"
    Image.fromarray(photo()).save(path, quality=95)
    shown = read_photo(path)
    assert shown.size == (96, 128)
    assert stated_pair(path)[0] is None
    assert re.search(r"^Shown whole: .* is that of a stereo pair, but its halves differ", shown.notes[0])


def write_jps(path: Path, picture: NDArray[np.uint8], layout: int, flags: int, kind: int = 1) -> None:
    """A JPEG with VRex's descriptor behind its first segment, as cameras write it."""
    stored = BytesIO()
    Image.fromarray(picture).save(stored, "JPEG", quality=95, subsampling=0)
    content = b"_JPSJPS_" + struct.pack(">H4BH", 4, 0, flags, layout, kind, 0)
    data, marker = stored.getvalue(), b"\xff\xe3" + struct.pack(">H", len(content) + 2) + content
    path.write_bytes(data[:2] + marker + data[2:])


@pytest.mark.parametrize(
    ("picture", "layout", "flags"),
    [
        (np.hstack([RIGHT, LEFT]), 2, 0),
        (np.hstack([LEFT, RIGHT]), 2, 4),
        (np.hstack([squeezed(RIGHT, 1), squeezed(LEFT, 1)]), 2, 2),
        (np.vstack([RIGHT, LEFT]), 3, 0),
        (np.vstack([squeezed(LEFT, 0), squeezed(RIGHT, 0)]), 3, 5),
        (np.vstack([squeezed(RIGHT, 0), squeezed(LEFT, 0)]), 3, 1),
    ],
    ids=["crossed", "left first", "half width", "over", "half height, left first", "half height"],
)
def test_the_descriptor_of_a_jps_states_its_arrangement(tmp_path, picture, layout, flags) -> None:
    write_jps(tmp_path / "a.jpg", picture, layout, flags)
    shown = read_photo(tmp_path / "a.jpg")
    assert shown.size == SIZE
    assert np.abs(255 * shown.pixels - LEFT).mean() < 12
    assert "JPS descriptor" in shown.notes[0]
