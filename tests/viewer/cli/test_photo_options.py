"""Options about a photo's depth and a picture's file: each changes what it says."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.images.color_profile import icc_profile
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.types import DISPLAY_P3, SRGB
from tests.viewer.cli.conftest import output_of
from tests.viewer.conftest import NEAR, WIDTH

SQUARE, WALL = np.s_[20:44, 36:60], np.s_[2:10, 2:90]


@pytest.fixture
def folder(photo_path, monkeypatch):
    """The working folder: a photo, its map, the same in metres, and a map of another shape."""
    monkeypatch.chdir(photo_path.parent)
    given = np.load("scene_disparity.npy")
    np.save("metres.npy", np.where(given == NEAR, 1.25, 4.0).astype(np.float32))
    np.save("narrow.npy", given[:, ::2])
    return photo_path.parent


def is_square_near(found, given):
    return found[SQUARE].mean() > found[WALL].mean() + 0.5


def is_square_far(found, given):
    return found[SQUARE].mean() < found[WALL].mean() - 0.5


@pytest.mark.parametrize(
    ("words", "holds"),
    [
        (
            "--disparity scene_disparity.npy --disparity-scale 0.5",
            lambda found, given: np.array_equal(found, given / 2),
        ),
        ("--disparity scene_disparity.npy --disparity-scale -1", is_square_far),
        ("--depth flat", lambda found, given: np.ptp(found) == 0),
        ("--invert-depth", is_square_far),
        ("--disparity metres.npy --planned", is_square_far),
        ("--disparity metres.npy --planned --metric", is_square_near),
        ("--disparity narrow.npy --planned --stretch", is_square_near),
        ("--max-pixels 1536", lambda found, given: found.shape == (32, 48)),
    ],
)
def test_depth_is_read_as_the_options_say(iibr, folder, words, holds):
    output_of(iibr("generate", "scene.png", "--grid", 3, "--refine", "off", "-o", "field", *words.split()))
    assert holds(read_pfm(Path("field/gt_disp_lowres.pfm")), np.load("scene_disparity.npy"))


@pytest.mark.parametrize(("words", "moves"), [((), True), (("--focus-disparity", NEAR), False)])
def test_the_plane_of_a_given_disparity_stays_still(iibr, folder, words, moves):
    output_of(iibr("screenshot", "scene.png", "--grid", 3, "--view", "1,0", *words, "-o", "o.png"))
    pixels = read_photo(Path("o.png")).pixels
    red = np.nonzero(pixels[..., 0] > pixels[..., 1] + 0.2)[1].mean()
    assert (abs(red - (WIDTH - 1) / 2) > 1) == moves


def test_a_file_has_the_bits_quality_profile_and_position_that_were_asked_for(iibr, folder):
    exif = Image.Exif()
    exif[0x010F] = "Maker"
    exif.get_ifd(0x8825).update({1: "N", 2: (1.0, 2.0, 3.0), 3: "E", 4: (4.0, 5.0, 6.0)})
    with Image.open("scene.png") as photo:
        photo.convert("RGB").save("photo.jpg", exif=exif, quality=100)

    def saved(name, *words):
        output_of(iibr("screenshot", "photo.jpg", "--depth", "flat", "--grid", 1, "-o", name, *words))
        with Image.open(name) as picture:
            return (
                picture.getexif().get_ifd(0x8825),
                picture.info["icc_profile"],
                getattr(picture, "quantization", None),
            )

    position, profile, steps = saved("usual.jpg")
    assert not position
    assert profile == icc_profile(SRGB)
    assert saved("there.jpg", "--gps")[0]
    assert saved("p3.jpg", "--profile", "p3")[1] == icc_profile(DISPLAY_P3)
    assert sum(saved("poor.jpg", "--picture-quality", 20)[2][0]) > 2 * sum(steps[0])
    saved("fine.png", "--bits", 16)
    assert Path("fine.png").read_bytes()[24] == 16, "the header's bit depth"
