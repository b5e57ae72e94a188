"""The command line as a whole: help, paths in place of commands, pictures and light fields that are written."""

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.depth.editing.edits import DepthEdits
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.picture_kinds import PictureFormat
from iibr_core.formats.images.resized_light import mean_of_areas
from iibr_core.formats.images.write import write_image
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.inpainting.registry import INPAINTERS
from iibr_core.scenes.scene import Source
from iibr_core.types import TOTAL_PARALLAX, GridShape, ImageSize, ViewOffset
from tests.forked_iibr import run_forked
from tests.iibr_core import red_inpainter
from tests.iibr_core.known_scenes import write_llff_row
from tests.viewer.cli.conftest import output_of, refusal_of
from tests.viewer.conftest import HEIGHT, WIDTH
from viewer.app.picture_files import export_picture, shot_of
from viewer.cli.export_options import budget_from_text
from viewer.cli.main import COMMANDS
from viewer.cli.options import grid_from_text, number_from_text, size_from_text, view_from_text
from viewer.display.offscreen import OffscreenScene
from viewer.model import lens
from viewer.model.action import do

ROOT = Path(__file__).parents[3]


def run_apart(code, **environment):
    """Run Python in a process of its own, without a display."""
    clean = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    env = {**clean, "PYTHONPATH": str(ROOT), **environment}
    return subprocess.run([sys.executable, "-P", "-c", code], capture_output=True, text=True, env=env, timeout=120)


@pytest.mark.parametrize("command", ["", *COMMANDS])
def test_help_describes_every_option_without_absurd_limits(iibr, command):
    text = output_of(iibr(*filter(None, [command]), "--help"))
    assert "Example: iibr " + command in text or not command
    assert not re.search(r"\d{12}", text)
    for line in re.findall(r"(?m)^│\s+(?:\*\s+)?(--\S+.*)│$", text):
        assert len(line.split()) > 2, f"no help: {line}"


def test_without_a_display_help_comes_with_the_reason(tmp_path):
    done = run_forked(cwd=tmp_path, XDG_CONFIG_HOME=str(tmp_path))
    assert "Usage: " in output_of(done)
    (line,) = done.stderr.splitlines()
    assert line.startswith("note: no window can be opened")


def test_the_demo_without_a_display_is_drawn_into_a_new_folder(iibr, photo_path, monkeypatch):
    """A small scene stands in for the demo photo."""
    monkeypatch.chdir(photo_path.parent)
    monkeypatch.setattr("viewer.cli.demo.demo_photo", lambda: photo_path)
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    own = Path("iibr-demo/middle.png")
    own.parent.mkdir()
    own.write_text("the user's")
    done = iibr("demo")
    names = re.findall(r"(?m)^(/.*\.png): ", output_of(done))
    middle, corners, focus = (np.asarray(Image.open(name).convert("RGB"), np.float32) for name in names)
    photo = np.asarray(Image.open(photo_path).convert("RGB"))
    assert np.abs(middle - photo).max() <= 1
    parts = [part for row in np.split(corners, 2) for part in np.split(row, 2, axis=1)]
    assert all(np.abs(part - photo).mean() > 1 for part in parts)
    far, _, near = np.split(focus, 3, axis=1)
    wall, square = np.s_[2:12, 2:90], np.s_[20:44, 36:60]
    for part, sharp, blurred in ((wall, far, near), (square, near, far)):
        assert np.abs(np.diff(sharp[part], axis=1)).max() > 1.5 * np.abs(np.diff(blurred[part], axis=1)).max()
    assert "With a display, `iibr demo` opens a window" in done.stdout
    assert done.stderr.startswith("note: no window can be opened")
    assert own.read_text() == "the user's"


@pytest.mark.parametrize("name", ["scene.png", "missing/photo"])
def test_a_path_in_place_of_a_command_is_viewed(photo_path, name):
    alone, viewed = (refusal_of(run_forked(*words, name, cwd=photo_path.parent)) for words in ((), ("view",)))
    assert alone == viewed
    assert "no such file" in alone if "missing" in name else "iibr screenshot" in alone


def test_a_command_precedes_a_file_of_its_name(iibr, photo_path, monkeypatch):
    monkeypatch.chdir(photo_path.parent)
    Path("plan").write_text("a file")
    assert "argument 'path'" in refusal_of(iibr("plan")).lower()


def test_a_shell_completes_commands():
    words = {"_IIBR_COMPLETE": "complete_bash", "COMP_WORDS": "iibr scr", "COMP_CWORD": "1"}
    code = "import sys; sys.argv = ['iibr']; from viewer.entry import command; command()"
    assert run_apart(code, **words).stdout.split() == ["screenshot"]


def test_values_from_text():
    assert (grid_from_text("9"), grid_from_text("3x10")) == (GridShape(9, 9), GridShape(3, 10))
    assert size_from_text("1280x800") == (1280, 800)
    assert view_from_text("2,-1.5") == ViewOffset(t=-1.5, s=2.0)
    assert view_from_text("-0, 1e1") == ViewOffset(t=10.0, s=0.0)
    assert number_from_text("-1e-3") == -0.001
    assert [budget_from_text(text) for text in ("3MB", "500kB", "1.5 M", "70000")] == [3e6, 5e5, 1.5e6, 7e4]


def test_generate_writes_a_light_field_that_opens(iibr, photo_path, tmp_path):
    """Options of earlier versions are understood or ignored."""
    out, former = tmp_path / "field", ("--quality", "fast", "--memory=1GB", "--out")
    words = ("generate", photo_path, "--grid", 3, "--with-disparity", *former, out)
    (line,) = output_of(iibr(*words)).splitlines()
    assert re.fullmatch(rf"9 views of 96x64 in [\d.]+ s: {re.escape(str(out))}", line)
    assert len(list(out.glob("input_Cam*.png"))) == len(list(out.glob("disp_Cam*.pfm"))) == 9
    output_of(iibr("screenshot", out, "-o", tmp_path / "field.png", "--view", "-1,1"))


@pytest.mark.parametrize(
    ("words", "times"),
    [
        ((), 1.0),
        (("--depth-strength", 0.5), 0.5),
        (("--literal",), None),
        (("--disparity", "{map}"), None),
        (("--disparity", "{map}", "--planned"), 1.0),
    ],
)
def test_a_named_map_is_taken_as_it_is(iibr, photo_path, tmp_path, words, times):
    """As given, the square moves by 3 px from view to view: 12 of 96 from the first to the last. times: the parallax of
    the window, None where it is as given.
    """
    out, given = tmp_path / "field", photo_path.with_name("scene_disparity.npy")
    words = (str(word).replace("{map}", str(given)) for word in words)
    done = iibr("generate", photo_path, "--grid", 5, "--refine", "off", "-o", out, *words)
    values = read_pfm(out / "gt_disp_lowres.pfm")
    if times is None:
        np.testing.assert_array_equal(values, np.load(given))
    else:
        assert 4 * float(np.ptp(values)) == pytest.approx(times * TOTAL_PARALLAX * WIDTH)
    assert ("In the window it is 4%" in done.stderr) == (times is None)


def test_inpaint_names_the_method_for_generate_and_screenshot(iibr, monkeypatch, photo_path, tmp_path):
    monkeypatch.setitem(INPAINTERS, "red", red_inpainter.ENTRY)
    pictures = {}
    for name in ("background", "red"):
        out, image, words = tmp_path / name, tmp_path / f"{name}.png", ("--grid", 3, "--inpaint", name)
        output_of(iibr("generate", photo_path, "-o", out, *words))
        output_of(iibr("screenshot", photo_path, "--view", "-1,-1", "-o", image, *words))
        pictures[name] = [read_photo(path).pixels for path in (out / "input_Cam000.png", image)]
    for background, red in zip(*pictures.values()):
        changed = (red != background).any(axis=2)
        assert 0 < changed.mean() < 0.5
        r, g, b = np.moveaxis(red[changed], -1, 0)
        assert (r > np.maximum(g, b)).mean() > 0.5


@pytest.mark.parametrize("options", [(), ("--view", "0.5,-0.7"), ("--aperture", 3, "--focus", "-0.2")], ids=str)
def test_a_picture_at_the_photos_own_size_equals_the_usual_one_made_smaller(iibr, photo_path, tmp_path, options):
    full, usual, half = (tmp_path / f"{name}.png" for name in ("full", "usual", "half"))
    words = ("screenshot", photo_path, "--max-pixels", 32 * 48, "--grid", 3, *options)
    done = iibr(*words, "--full", "-o", full)
    assert output_of(done).strip() == str(full)
    assert "Made smaller" not in done.stderr, "all of the photo's pixels are used"
    assert "Made smaller by area averaging, from 96x64 to 48x32" in iibr(*words, "-o", usual).stderr
    assert read_photo(full).size == (HEIGHT, WIDTH)
    expected = read_photo(usual).pixels
    assert expected.shape == (HEIGHT // 2, WIDTH // 2, 3)
    smaller = srgb_from_linear(mean_of_areas(linear_from_srgb(read_photo(full).pixels), ImageSize(32, 48)))
    assert np.abs(smaller - expected)[2:-2, 2:-2].mean() < 0.01
    if not options:
        np.testing.assert_allclose(read_photo(full).pixels, read_photo(photo_path).pixels, atol=1.01 / 255)
    output_of(iibr(*words, "--size", "80x60", "-o", half))
    assert read_photo(half).size == (60, 80), "any size up to it is made of the same"


def test_full_needs_memory(iibr, monkeypatch, photo_path, tmp_path):
    out, large = tmp_path / "o.png", tmp_path / "large.png"
    write_image(large, np.zeros((2000, 3000, 3), np.uint8))
    monkeypatch.setattr("iibr_core.exports.full_picture.OWN_SIZE_BYTES", 10**9)
    assert "own size" in refusal_of(iibr("screenshot", large, "--depth", "flat", "--full", "-o", out))
    monkeypatch.setattr("viewer.cli.screenshot.MAX_PIXELS", 10**6)
    assert "--size 1224x816" in refusal_of(iibr("screenshot", large, "--depth", "flat", "--full", "-o", out))
    assert not out.exists()


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_like_repeats_a_saved_picture_except_for_given_options(iibr, photo_path, tmp_path, suffix):
    first, again, other = (tmp_path / f"{name}{suffix}" for name in ("first", "again", "other"))
    options = ("--grid", 3, "--view", "-1,0.5", "--focus", "-0.5", "--aperture", 2, "--depth-strength", 1.5)
    output_of(iibr("screenshot", photo_path, *options, "--size", "150x100", "-o", first))
    output_of(iibr("screenshot", photo_path, "--like", first, "-o", again))
    np.testing.assert_array_equal(read_photo(again).pixels, read_photo(first).pixels)
    output_of(iibr("screenshot", photo_path, "--like", first, "--aperture", 0, "-o", other))
    assert read_photo(other).size == (100, 150)
    assert (read_photo(other).pixels != read_photo(first).pixels).any()


def test_like_repeats_edits_of_the_depth(iibr, photo_path, tmp_path):
    first, again = tmp_path / "first.png", tmp_path / "again.png"
    with OffscreenScene("egl") as viewer:
        viewer.open(Source(str(photo_path), grid=GridShape(3, 3)), edits=DepthEdits(is_inverted=True))
        viewer.do(do(lens.move_eye, ViewOffset(-1, 0.5)))
        export_picture(first, viewer.picture(), shot_of(viewer.state, viewer.scene.size, PictureFormat()))
    output_of(iibr("screenshot", photo_path, "--like", first, "-o", again))
    np.testing.assert_allclose(read_photo(again).pixels, read_photo(first).pixels, atol=1.01 / 255)


def test_a_screenshot_is_woven_for_a_display(iibr, photo_path, tmp_path):
    values = {"pitch": 50, "slope": -7, "center": 0.2, "DPI": 300, "screenW": 90, "screenH": 120, "invView": 1}
    (tmp_path / "visual.json").write_text(json.dumps({key: {"value": value} for key, value in values.items()}))
    words = ("screenshot", photo_path, "--grid", 3, "--calibration", tmp_path / "visual.json")
    output_of(iibr(*words, "-o", tmp_path / "woven.png"))
    woven = read_photo(tmp_path / "woven.png").pixels
    assert woven.shape == (120, 90, 3)
    top = (120 - round(90 * HEIGHT / WIDTH)) // 2
    assert not woven[: top - 1].any(), "the photo is broader than the screen"
    green, blue = woven[..., 1], woven[..., 2]  # equal in the photo, hence in every view
    assert (np.abs(green - blue) > 0.1).any(), "the subpixels of a pixel belong to different views"


def test_values_beyond_the_scene_are_refused_or_limited_with_a_note(iibr, photo_path, tmp_path):
    words = ("screenshot", photo_path, "--grid", 3, "-o", tmp_path / "o.png")
    assert "--view: S is 5; scene has -1 to 1" in refusal_of(iibr(*words, "--view", "5,0"))
    assert "note: --aperture 99 exceeds what the scene has; 15 is used." in iibr(*words, "--aperture", 99).stderr
    assert "note: --tilt down, 99 exceeds" in iibr(*words, "--force", "--tilt", "0,99", "--aperture", 1).stderr
    assert "rotation 30: turns blades or a mask" in refusal_of(iibr(*words, "--force", "--rotation", 30))
    assert "note: A closed lens shows nothing of shape;" in iibr(*words, "--force", "--blades", 5).stderr


def test_plan_names_size_depth_and_reasons(iibr, photo_path):
    first, *reasons = output_of(iibr("plan", photo_path)).splitlines()
    assert first == "scene: 96x64 px, disparity from scene_disparity.npy"
    deeper = output_of(iibr("plan", photo_path, "--depth-strength", 2))
    for words, moves in ((" ".join(reasons), 4), (deeper, 8)):
        assert f"The nearest moves {moves} px against the farthest" in words


@pytest.mark.parametrize(
    ("name", "layout", "views"),
    [
        ("field", "grid folder, 3x3, 96x64", "3 across, 3 down"),
        ("a_qs3x2a1.5 (1).png", "quilt, 3x2 views, 96x64", "6 across, 1 down"),
        ("a_eslf.png", "lenslet image, 8x8 of 14x14 views, 12x8", "8 across, 8 down"),
    ],
)
def test_plan_names_what_views_are_recognised_as(iibr, photo_path, tmp_path, name, layout, views):
    photo, path = Image.open(photo_path).convert("RGB"), tmp_path / name
    if name == "field":
        path.mkdir()
        for row, column in np.ndindex(3, 3):
            photo.save(path / f"v{row}_u{column}.png")
        np.save(path / "disp_est_u01_v01.npy", np.full((64, 96), 1.25, np.float32))
    else:
        photo.resize((168, 112) if "eslf" in name else (288, 128)).save(path)
    first, *reasons = output_of(iibr("plan", path)).splitlines()
    origin = "the maps of 1 of 9 views" if name == "field" else "the views themselves, when they are opened"
    assert first.split(": ", 1)[1] == f"{layout} px a view, disparity from {origin}"
    assert f"- Views: {views}." in reasons
    assert ("- Disparity goes from 1.25 to 1.25 px per view step." in reasons) == (name == "field")
    assert "do not fill a grid of 5x7" in refusal_of(iibr("plan", path, "--grid", "5x7"))
    if name == "field":
        given = "--disparity", photo_path.with_name("scene_disparity.npy"), "--disparity-scale", 2
        assert "- Disparity goes from -2.00 to 4.00 px per view step." in output_of(iibr("plan", path, *given))


def test_plan_says_where_views_fill_no_grid(iibr, tmp_path):
    folder = write_llff_row(tmp_path / "row")
    poses = np.load(folder / "poses_bounds.npy")
    poses[1, 3] += 0.4  # its camera's place
    np.save(folder / "poses_bounds.npy", poses)
    first, second, *_ = output_of(iibr("plan", folder)).splitlines()
    assert first.endswith("disparity from no map")
    assert second == "- 3 views, which fill no regular grid: only `iibr evaluate` reads them."


CASES = {"pair.jps": 1, "x.left-right.jpg": 1, "x.top-bottom.jpg": 0}
"""Stereo photos by their names, and the axis that their two pictures lie along."""


@pytest.mark.parametrize("name", CASES)
def test_plan_takes_the_depth_of_stereo_photos_from_their_two_views(iibr, photo_path, tmp_path, name):
    photo, path = np.asarray(Image.open(photo_path).convert("RGB")), tmp_path / name
    eyes = (np.roll(photo, -2, 1), photo) if name.endswith("jps") else (photo, np.roll(photo, -2, 1))
    Image.fromarray(np.concatenate(eyes, CASES[name])).save(path, "JPEG", quality=95)
    assert "96x64 px, disparity from the photo's two views (side-by-side stereo)" in output_of(iibr("plan", path))


WINDOW_FIRST = """
import sys
from viewer.app.main_loop import App
app = App()
while not app.frames_shown:
    app.step()
print([name for name in ("torch", "numba", "OpenImageIO", "msgspec") if name in sys.modules])
copies = {line.split()[-1] for line in open("/proc/self/maps") if "libglfw" in line}
print(len(copies))
app.close()
"""


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_the_window_comes_before_heavy_imports_and_with_one_glfw(display):
    done = run_apart(WINDOW_FIRST, DISPLAY=display)
    assert done.stdout.splitlines() == ["[]", "1"], done.stderr


LIGHT = """
import sys
from viewer.entry import run
for words in (["models"], ["view", "missing.png"], ["--help"], *([name, "--help"] for name in %r)):
    sys.argv = ["iibr", *words]
    run()
print([name for name in %r if name in sys.modules])
"""


def test_commands_that_compute_nothing_import_nothing_heavy(tmp_path):
    heavy = "torch", "numba", "moderngl", "imgui_bundle", "scipy", "skimage", "matplotlib", "OpenImageIO", "msgspec"
    done = run_apart(LIGHT % (list(COMMANDS), heavy), XDG_DATA_HOME=str(tmp_path))
    assert done.stdout.splitlines()[-1] == "[]", done.stderr
