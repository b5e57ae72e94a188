"""`iibr export`, as a person runs it: files, messages, refusals. Gloss, too."""

from configparser import ConfigParser
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image, ImageSequence

from iibr_core.formats.images.color_profile import icc_profile
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.types import DISPLAY_P3, SRGB, TOTAL_PARALLAX
from tests.viewer.cli.conftest import output_of, refusal_of
from tests.viewer.conftest import WIDTH

GLOSS = "roughness = 0.5\nreflectance = 0.5\n[light]\ndirection = [0, 0, -1]\n"


@pytest.fixture
def photo(photo_path, monkeypatch):
    """A photo in the working folder, with a gloss."""
    monkeypatch.chdir(photo_path.parent)
    Path("gloss.toml").write_text(GLOSS)
    return photo_path


def views_of(folder):
    return np.stack([np.asarray(Image.open(path)) for path in sorted(Path(folder).glob("input_Cam*.png"))]).astype(int)


def test_a_drawn_kind(iibr, photo):
    words = ("--to", "gif", "-o", "a.gif", "--grid", 3, "--frames", 6, "--motion", "swing", "--size", "30x20")
    done = iibr("export", photo, *words, "--rate", 100)
    assert output_of(done) == "a.gif\n"
    assert "animations of 100 frames a second; the same 0.06 s have 3 frames instead" in done.stderr
    with Image.open("a.gif") as image:
        assert (image.size, image.n_frames) == ((30, 20), 3)
    Path("keys.txt").write_text("1 0\n1 0\n")
    output_of(iibr("export", photo, "--to", "gif", "-o", "still.gif", "--grid", 3, "--frames", 4, "--path", "keys.txt"))
    with Image.open("still.gif") as image:
        frames = [np.asarray(frame.convert("RGB")).astype(int) for frame in ImageSequence.Iterator(image)]
    assert all(np.array_equal(frame, frames[0]) for frame in frames), "the camera stands still"
    red = np.nonzero(frames[0][..., 0] > frames[0][..., 1] + 60)[1].mean()
    assert red < WIDTH / 2 - 1, "to the right of the middle"


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


def test_maps_for_editors_take_the_lens_but_no_shape(iibr, photo):
    lens = ("--focus-at", "48,32", "--f-number", 2)
    done = iibr("export", photo, "--to", "blur", "-o", "blur.exr", *lens)
    assert output_of(done) == "blur.exr\n"
    assert "Values are the radius of the disc of defocus in pixels, positive before the focus" in done.stderr
    assert "--blades: not for --to blur" in refusal_of(
        iibr("export", photo, "--to", "blur", "-o", "b.exr", *lens, "--blades", 5)
    )
    done = iibr("export", photo, "--to", "depth-mask", "-o", "mask.png", "--focus-range", 0.1, "--soft", 0.2)
    assert (output_of(done), "closed lens" in done.stderr) == ("mask.png\n", False)
    assert "which surface? give a place" in refusal_of(iibr("export", photo, "--to", "matte", "-o", "m.png"))
    output_of(iibr("export", photo, "--to", "matte", "-o", "m.png", "--at", "48,32", "--tolerance", 2))
    assert np.asarray(Image.open("m.png"))[32, 48] > 65000


def test_a_page_for_headsets_has_a_finer_grid_unless_one_is_given(iibr, photo):
    words = ("export", photo, "-o", "a.html", "--for", "headset", "--to")
    for grid, views in (((), 45), (("--grid", 3), 9)):
        assert f"note: {views} views of 96x64 px" in iibr(*words, "web", *grid, "--force").stderr
    assert "--for: not for --to quilt" in refusal_of(iibr(*words, "quilt"))
    assert "'fridge' is not" in refusal_of(iibr(*words[:-2], "fridge", "--to", "web"))


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


def test_the_name_with_its_tag_must_not_exist(iibr, photo):
    words = ("export", photo, "--to", "half-sbs", "-o", "a.png", "--grid", 3)
    assert output_of(iibr(*words)) == "a_LRF_Half_SBS.png\n"
    before = Path("a_LRF_Half_SBS.png").read_bytes()
    assert "--force" in refusal_of(iibr(*words))
    assert Path("a_LRF_Half_SBS.png").read_bytes() == before
    assert not Path("a.png").exists()


def test_a_light_field_of_disparity_as_given(iibr, photo):
    done = iibr("export", photo, "--to", "hci", "-o", "field", "--literal", "--grid", 5)
    assert output_of(done) == "field\n"
    assert "In the window it is 4%" in done.stderr
    assert len(views_of("field")) == 25
    output_of(iibr("export", photo, "--to", "hci", "--grid", 5, "--depth-strength", 0.5, "-o", "flat"))
    assert 4 * np.ptp(read_pfm(Path("flat/gt_disp_lowres.pfm"))) == pytest.approx(
        0.5 * TOTAL_PARALLAX * WIDTH, rel=0.01
    )
    output_of(iibr("export", "field", "--to", "eslf", "-o", "a_eslf.png"))
    with Image.open("a_eslf.png") as image:
        assert image.size == (5 * 96, 5 * 64)


def test_disparity_is_found_for_a_light_field_without_it(iibr, photo):
    output_of(iibr("generate", photo, "--grid", 3, "--literal", "-o", "field"))
    given = read_pfm(Path("field/gt_disp_lowres.pfm"))
    for path in (*Path("field").glob("*.pfm"), Path("field/parameters.cfg")):
        path.unlink()
    output_of(iibr("export", "field", "--to", "disparity", "-o", "a.pfm"))
    assert np.median(np.abs(read_pfm(Path("a.pfm")) - given)) < 0.3
    output_of(iibr("export", "field", "--to", "hci", "-o", "hci"))
    assert sorted(path.suffix for path in Path("hci").iterdir()) == [".cfg"] + 10 * [".pfm"] + 9 * [".png"]


@pytest.mark.parametrize("kind", ["cross-eyed", "focal-stack", "quilt"])
def test_pictures_have_the_photos_colours_and_metadata(iibr, monkeypatch, tmp_path, kind):
    """A Display P3 photo is exported in Display P3, unless displays ignore profiles; its GPS position never is."""
    monkeypatch.chdir(tmp_path)
    exif = Image.Exif()
    exif[0x010F] = "Maker"
    exif.get_ifd(0x8825).update({1: "N", 2: (1.0, 2.0, 3.0)})
    plain = Image.new("RGB", (48, 32), (200, 80, 60))
    plain.save("photo.jpg", exif=exif, icc_profile=icc_profile(DISPLAY_P3), quality=100, subsampling=0)
    is_stack = kind == "focal-stack"
    words = ("export", "photo.jpg", "--to", kind, "-o", "out" if is_stack else "out.png", "--grid", 3)
    output_of(iibr(*words, "--depth", "flat", *(("--bits", 16) if is_stack else ())))
    picture = Path("out/all_in_focus.png") if is_stack else next(Path().glob("out*.png"))
    with Image.open(picture) as image:
        metadata, profile = image.getexif(), image.info["icc_profile"]
    assert metadata[0x010F] == "Maker"
    assert not metadata.get_ifd(0x8825)
    is_wide = kind in ("cross-eyed", "focal-stack")
    assert profile == icc_profile(DISPLAY_P3 if is_wide else SRGB)
    pixels = oiio.ImageBuf(str(picture)).get_pixels(oiio.FLOAT) * 255
    np.testing.assert_allclose(pixels[16, 4], (200, 80, 60) if is_wide else (216, 69, 50), atol=2.5)


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


def test_views_from_disk_take_gloss_if_their_disparity_is_negative(iibr, photo):
    output_of(iibr("generate", photo, "--grid", 3, "-o", "field", "--with-disparity"))
    output_of(iibr("screenshot", "field", "-o", "plain.png"))
    output_of(iibr("screenshot", "field", "--gloss", "gloss.toml", "-o", "glossy.png"))
    gained = np.asarray(Image.open("glossy.png")).astype(int) - np.asarray(Image.open("plain.png"))
    assert gained.min() >= -2
    assert gained.mean() > 5
