"""The command line as a whole: help, paths in place of commands, pictures and light fields that are written."""

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
from iibr_core.inpainting.registry import INPAINTERS
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, ImageSize, ViewOffset
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


def test_like_repeats_edits_of_the_depth(iibr, photo_path, tmp_path):
    first, again = tmp_path / "first.png", tmp_path / "again.png"
    with OffscreenScene("egl") as viewer:
        viewer.open(Source(str(photo_path), grid=GridShape(3, 3)), edits=DepthEdits(is_inverted=True))
        viewer.do(do(lens.move_eye, ViewOffset(-1, 0.5)))
        export_picture(first, viewer.picture(), shot_of(viewer.state, viewer.scene.size, PictureFormat()))
    output_of(iibr("screenshot", photo_path, "--like", first, "-o", again))
    np.testing.assert_allclose(read_photo(again).pixels, read_photo(first).pixels, atol=1.01 / 255)


def test_plan_says_where_views_fill_no_grid(iibr, tmp_path):
    folder = write_llff_row(tmp_path / "row")
    poses = np.load(folder / "poses_bounds.npy")
    poses[1, 3] += 0.4  # its camera's place
    np.save(folder / "poses_bounds.npy", poses)
    first, second, *_ = output_of(iibr("plan", folder)).splitlines()
    assert first.endswith("disparity from no map")
    assert second == "- 3 views, which fill no regular grid: only `iibr evaluate` reads them."


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
