"""`iibr export`, as a person runs it: files, messages, refusals. Gloss, too."""

from configparser import ConfigParser
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.maps.pfm import read_pfm
from tests.viewer.cli.conftest import output_of, refusal_of

GLOSS = "roughness = 0.5\nreflectance = 0.5\n[light]\ndirection = [0, 0, -1]\n"


@pytest.fixture
def photo(photo_path, monkeypatch):
    """A photo in the working folder, with a gloss."""
    monkeypatch.chdir(photo_path.parent)
    Path("gloss.toml").write_text(GLOSS)
    return photo_path


def views_of(folder):
    return np.stack([np.asarray(Image.open(path)) for path in sorted(Path(folder).glob("input_Cam*.png"))]).astype(int)


def test_the_lens_of_a_drawn_kind_has_the_options_of_a_screenshot(iibr, photo):
    """A picture of a stack is the screenshot with the same lens; the place in focus does not count in a stack."""
    lens = ("--grid", 3, "--f-number", 1.5, "--blades", 3, "--rotation", 20, "--tilt", "0.2,0.1")
    output_of(iibr("export", photo, "--to", "focal-stack", "-o", "stack", "--frames", 1, *lens))
    far = float(read_pfm(Path("stack/disparity.pfm")).min())
    output_of(iibr("screenshot", photo, "-o", "shot.png", f"--focus={far}", *lens))
    stack, shot = (np.asarray(Image.open(name)) for name in ("stack/focus_000.png", "shot.png"))
    np.testing.assert_array_equal(stack, shot)
    output_of(iibr("screenshot", photo, "-o", "disc.png", f"--focus={far}", *lens[:4]))
    assert (stack != np.asarray(Image.open("disc.png"))).any(), "the shape is seen"
    assert "--f-number: not for --to depth" in refusal_of(
        iibr("export", photo, "--to", "depth", "-o", "d.pfm", *lens[:4])
    )


@pytest.mark.parametrize("shrink", [1, 2], ids=["a map of the photo's size", "a map of half its size"])
def test_distances_of_a_map_in_metres_come_out_of_a_field(iibr, photo, shrink):
    """The benchmark's tools compute disparity as focal length * baseline * (1 / distance - 1 / focus distance)."""
    disparity = np.load("scene_disparity.npy")
    Path("scene_disparity.npy").unlink()
    metres = np.where(disparity == disparity.max(), 1.25, 4.0).astype(np.float32)
    np.save("scene_depth.npy", metres[::shrink, ::shrink])
    output_of(iibr("export", photo, "--to", "hci", "-o", "field", "--grid", 3))
    stated = ConfigParser()
    stated.read("field/parameters.cfg")
    lens, scene = stated["intrinsics"], stated["extrinsics"]
    focal_px = lens.getfloat("focal_length_mm") / lens.getfloat("sensor_size_mm") * metres.shape[1]
    step_m = scene.getfloat("baseline_mm") / 1000
    nearness = read_pfm(Path("field/gt_disp_lowres.pfm")) / (focal_px * step_m) + 1 / scene.getfloat("focus_distance_m")
    np.testing.assert_allclose(1 / nearness, metres, rtol=0.01)


def test_gloss_is_the_same_in_all_outputs(iibr, photo):
    words = ("--grid", 3, "--gloss", "gloss.toml")
    output_of(iibr("generate", photo, "--grid", 3, "-o", "plain"))
    output_of(iibr("generate", photo, *words, "-o", "glossy"))
    output_of(iibr("export", photo, "--to", "hci", *words, "-o", "exported"))
    gained = views_of("glossy") - views_of("plain")
    assert gained.min() >= 0
    assert (gained.mean(axis=(1, 2, 3)) > 5).all()
    assert np.array_equal(views_of("glossy"), views_of("exported"))
    output_of(iibr("screenshot", photo, *words, "--view", "1,0", "-o", "shot.png"))
    drawn = np.asarray(Image.open("shot.png")).astype(int)
    assert np.abs(drawn - views_of("glossy")[5]).mean() < 2
    output_of(iibr("screenshot", photo, "--grid", 3, "--like", "shot.png", "-o", "again.png"))
    assert np.array_equal(np.asarray(Image.open("again.png")), drawn)
