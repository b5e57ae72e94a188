"""Unusual photos, files of several views, models and poses, opened by the commands that take them."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import uniform_filter

import iibr_core
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.write import write_image
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.types import ViewOffset
from tests.iibr_core.depth.onnx_graphs import of_channels
from tests.iibr_core.known_scenes import FOREGROUND, WALL, disparity_of_square, view_of_square
from tests.viewer.cli.conftest import output_of, refusal_of
from tests.viewer.conftest import HEIGHT, NEAR, WIDTH


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working folder, without depth models on this machine."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("reduced_for", ["nothing", "time", "memory"])
def test_depth_of_a_pair_is_the_left_views(iibr, folder, monkeypatch, reduced_for):
    """Where it is found from smaller copies, it is enlarged again, and its values with it."""
    times = {"nothing": 1, "time": 2, "memory": 5}[reduced_for]
    eyes = [np.rint(view_of_square(ViewOffset(0, s)) * 255).astype(np.uint8) for s in (0.0, 2.0)]
    Image.fromarray(np.kron(np.hstack(eyes), np.ones((times, times, 1), np.uint8))).save("square_SBS.png")
    if reduced_for == "time":
        monkeypatch.setattr("iibr_core.scenes.light_fields.MATCHED_PIXELS", eyes[0][..., 0].size)
    elif reduced_for == "memory":
        monkeypatch.setattr("iibr_core.method.memory.free_memory_bytes", lambda: 8 * 2**20)
    done = iibr("depth", "square_SBS.png", "-o", "a.pfm")
    output_of(done)
    assert ("note: Found from views reduced to " in done.stderr) == (reduced_for != "nothing")
    error = np.abs(read_pfm(Path("a.pfm"))[::times, ::times] / (2 * times) - disparity_of_square())[4:-4, 4:-4]
    assert np.mean(error < 0.2 * (FOREGROUND - WALL)) > 0.7
    if reduced_for == "nothing":
        for name, eye in zip(("left.png", "other.png"), eyes):
            Image.fromarray(eye).save(name)
        output_of(iibr("depth", "left.png", "other.png", "-o", "b.pfm"))
        assert np.mean(np.abs(read_pfm(Path("b.pfm")) - read_pfm(Path("a.pfm"))) < 0.2) > 0.9


@pytest.mark.parametrize(
    ("options", "is_nearer_below"),
    [
        ([], True),
        (["--depth", "rough", "--invert-depth"], False),
        (["--depth-model", "red.onnx"], True),
        (["--depth-model", "red.onnx", "--metric"], False),
    ],
)
def test_a_photo_without_depth_gets_a_guess_or_a_models(iibr, folder, options, is_nearer_below):
    """The photo is redder further down."""
    write_image(Path("photo.png"), np.tile(np.linspace(0.2, 0.9, 60, dtype=np.float32)[:, None, None], (1, 80, 3)))
    of_channels(Path("red.onnx"))
    output_of(iibr("depth", "photo.png", *options, "-o", "map.npy"))
    disparity = np.load("map.npy")
    assert disparity.shape == (60, 80)
    assert (np.median(disparity[-12:]) > np.median(disparity[:12])) == is_nearer_below
    inverse = iibr_core.estimate_depth("photo.png", "red.onnx")
    assert np.median(inverse[-12:]) > np.median(inverse[:12]), "in Python, too"
    Path("config.json").write_text('{"depth_estimation_type": "metric"}')
    bright = np.tile(np.linspace(0.6, 0.9, 60, dtype=np.float32)[:, None, None], (1, 80, 3))
    inverse = iibr_core.estimate_depth(bright, "red.onnx")
    assert np.median(inverse[-12:]) < np.median(inverse[:12]), "distances are turned into inverse depth"


def test_python_and_commands_give_the_same_numbers(iibr, photo_path, folder):
    given = photo_path.with_name("scene_disparity.npy")
    np.save(given, uniform_filter(np.load(given), 5))  # so that its edges are refined
    field = iibr_core.open(photo_path).light_field(3)
    output_of(iibr("generate", photo_path, "--grid", 3, "-o", "field", "--with-disparity"))
    written = iibr_core.open("field").light_field()
    np.testing.assert_array_equal(written.views, field.views)
    np.testing.assert_array_equal(written.disparity, field.disparity)
    output_of(iibr("depth", photo_path, "--refine", "off", "-o", "map.npy"))
    np.testing.assert_allclose(np.load("map.npy"), iibr_core.open(photo_path, refine=False).disparity, rtol=1e-5)


def pixels_of(path):
    return read_photo(path, 10**9).pixels


def write_poses(*places):
    """Write transforms.json with cameras that look ahead: y up, z backwards."""
    matrices = [np.block([[np.eye(3), np.array(place)[:, None]], [0, 0, 0, 1]]) for place in places]
    frames = [{"transform_matrix": matrix.tolist()} for matrix in matrices]
    Path("poses.json").write_text(json.dumps({"w": WIDTH, "h": HEIGHT, "fl_x": 1.2 * WIDTH, "frames": frames}))
    return "poses.json"


@pytest.mark.parametrize("kind", ["nerfstudio", "llff", "colmap"])
def test_the_cameras_of_a_light_field_see_its_views(iibr, photo_path, folder, kind):
    output_of(iibr("export", photo_path, "--to", kind, "--grid", "3", "-o", "field"))
    output_of(iibr("generate", photo_path, "--poses", "field", "-o", "new"))
    views, known = sorted(Path("new").iterdir()), sorted(Path("field/images").iterdir())
    assert [path.name for path in views] == [f"view_{number:04d}.png" for number in range(1, 10)]
    for view, other in zip(views, known):
        assert np.sqrt(np.mean((pixels_of(view) - pixels_of(other)) ** 2)) < 0.02


@pytest.mark.parametrize(("words", "nearest"), [((), 1.0), (("--literal",), 1.2 * WIDTH / (NEAR + 3))])
def test_a_step_forward_makes_the_photo_larger(iibr, photo_path, folder, words, nearest):
    """By a quarter of the distance of the nearest surface, which is 1, or literally the focal length / disparity."""
    np.save(photo_path.with_name("scene_disparity.npy"), np.load(photo_path.with_name("scene_disparity.npy")) + 3)
    poses = write_poses((0, 0, 0), (0, 0, -nearest / 4))
    output_of(iibr("generate", photo_path, "--poses", poses, "--photo-pose", "1", *words, "-o", "new"))
    still, forward = (pixels_of(path) for path in sorted(Path("new").iterdir()))
    np.testing.assert_array_equal(still, pixels_of(photo_path))
    red = [(image[..., 0] > image[..., 1] + 0.2).sum() for image in (still, forward)]
    assert red[1] / red[0] == pytest.approx(1 / 0.75**2, rel=0.1)


def test_poses_that_show_mostly_inpainted_areas_are_named(iibr, photo_path, folder):
    words = ("generate", photo_path, "--poses", write_poses((0, 0, 0), (0, 0, 20)), "--photo-pose", "1", "-o", "new")
    done = iibr(*words)
    output_of(done)
    assert "show mostly inpainted areas, which the photo does not show: 2 (" in done.stderr
    assert "already exists" in refusal_of(iibr(*words))
    output_of(iibr(*words, "--force"))
    assert "poses.json has 2 poses" in refusal_of(iibr(*words[:-3], "3", "-o", "o"))
