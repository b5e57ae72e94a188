"""The lens of `iibr screenshot` against that of `field.refocus`, whose words are the same."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import iibr_core
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.write import write_image
from tests.iibr_core.scenes import square_before_wall
from tests.viewer.cli.conftest import output_of

DEMO = Path(__file__).parents[3] / "assets" / "motorcycle" / "motorcycle.png"
LENSES = {
    "blades": (
        ("--f-number", 1.5, "--blades", 5, "--roundness", 0.3, "--rotation", 20),
        {"f_number": 1.5, "blades": 5, "roundness": 0.3, "rotation": 20},
    ),
    "a tilted ring": (
        ("--aperture", 5, "--ring", 0.6, "--tilt", "1,-0.5"),
        {"aperture": 5, "ring": 0.6, "tilt": (1, -0.5)},
    ),
    "a cat's eye": (("--aperture", 5, "--cat-eye", 0.8), {"aperture": 5, "cat_eye": 0.8}),
    "a mask": (("--aperture", 5, "--mask", "mask.png"), {"aperture": 5, "mask": "mask.png"}),
    "highlights": (("--aperture", 5, "--highlights", 3), {"aperture": 5, "highlights": 3}),
    "a range": (("--aperture", 5, "--focus-range", 0.5), {"aperture": 5, "focus_range": 0.5}),
}
PLACES = {"on the wall": (5, 8), "on the square": (40, 30)}


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A square before a wall, and a mask that is open at the left."""
    monkeypatch.chdir(tmp_path)
    photo, disparity = square_before_wall(60, 80)
    pixels = photo.pixels.copy()
    pixels[10:14, 60:64] = 1.0
    write_image(Path("scene.png"), np.round(255 * pixels).astype(np.uint8))
    np.save("scene_disparity.npy", disparity.values)
    write_image(Path("mask.png"), np.repeat(np.uint8([[[255], [0]]] * 2), 3, axis=2))
    return tmp_path


def pictures(iibr_command, path, words, options):
    """The screenshot and the refocused picture, both encoded."""
    output = path.with_name("shot.exr" if path.suffix == ".exr" else "shot.png")
    output_of(iibr_command("screenshot", path, "--grid", 3, "--refine", "off", "-o", output, "--force", *words))
    shot = read_photo(output).pixels
    refocused = iibr_core.open(path, refine=False).light_field(3).refocus(**options)
    return shot, refocused if path.suffix == ".exr" else np.minimum(refocused, 1)


@pytest.mark.parametrize("lens", LENSES)
@pytest.mark.parametrize("place", PLACES)
def test_screenshots_and_python_have_one_lens(iibr, folder, lens, place):
    words, options = LENSES[lens]
    x, y = PLACES[place]
    shot, refocused = pictures(iibr, Path("scene.png"), (*words, "--focus-at", f"{x},{y}"), options | {"at": (x, y)})
    plain = read_photo(Path("scene.png")).pixels
    agreement_db = iibr_core.compare(shot, refocused).psnr_db
    assert agreement_db > 36
    assert agreement_db > iibr_core.compare(plain, refocused).psnr_db + 8, "nearer to each other than to the photo"


def turned(path):
    """The photo on its side, with an Exif tag that turns it upright, and its map."""
    image = Image.open("scene.png").transpose(Image.Transpose.ROTATE_90)
    exif = Image.Exif()
    exif[0x0112] = 6
    image.save(path, exif=exif)


def hdr(path):
    write_image(path, np.float32(read_photo(Path("scene.png")).pixels) ** 2.2 * 4)


INPUTS = {"turned.png": turned, "hdr.exr": hdr, "metres.png": lambda path: shutil.copy("scene.png", path)}


@pytest.mark.parametrize("name", INPUTS)
def test_places_and_f_numbers_of_other_inputs(iibr, folder, name):
    """Places count in the upright photo; the f-number of a photo with distances in metres is exact."""
    path = Path(name)
    INPUTS[name](path)
    disparity = np.load("scene_disparity.npy")
    if name == "metres.png":
        np.save("metres_depth.npy", 4 / (1 + disparity - disparity.min()))
    else:
        np.save(f"{path.stem}_disparity.npy", disparity)
    words, options = LENSES["blades"]
    for x, y in PLACES.values():
        shot, refocused = pictures(iibr, path, (*words, "--focus-at", f"{x},{y}"), options | {"at": (x, y)})
        scale = max(float(shot.max()), 1.0)
        assert iibr_core.compare(shot / scale, refocused / scale).psnr_db > 40
