"""The command line: what it writes, and one line with exit code 2 for bad input."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.inpainting.registry import INPAINTERS
from iibr_core.types import TOTAL_PARALLAX
from tests.forked_iibr import run_forked
from tests.iibr_core import red_inpainter
from tests.viewer.conftest import HEIGHT, WIDTH
from viewer import entry

ROOT = Path(__file__).parents[3]


def run(monkeypatch: pytest.MonkeyPatch, *words: object) -> int:
    """Exit code of `iibr` with these arguments, run in this process."""
    monkeypatch.setattr(sys, "argv", ["iibr", *map(str, words)])
    return entry.run()


def run_apart(code: str, *words: object, cwd: Path = ROOT, **environment: str) -> subprocess.CompletedProcess[str]:
    """Python in a process of its own, without a display."""
    environment = {"PYTHONPATH": str(ROOT), **environment}
    clean = {name: value for name, value in os.environ.items() if name not in ("DISPLAY", "WAYLAND_DISPLAY")}
    command = [sys.executable, "-P", "-c", code, *map(str, words)]
    return subprocess.run(command, capture_output=True, text=True, cwd=cwd, env={**clean, **environment}, timeout=120)


@pytest.mark.parametrize("command", ["", "view", "generate", "export", "depth", "batch", "evaluate", "train"])
def test_help_has_an_example(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], command: str) -> None:
    assert run(monkeypatch, *[command] if command else [], "--help") == 0
    text = capsys.readouterr().out
    assert ("Example: iibr " + command in text) or not command
    for line in re.findall(r"(?m)^│\s+(?:\*\s+)?(--\S+.*)│$", text):
        assert len(line.split()) > 2, f"no help: {line}"


def test_without_a_display_help_comes_without_asking_and_one_line_says_why() -> None:
    done = run_apart("from viewer.entry import command; command()")
    assert ("Usage: " in done.stdout, done.returncode) == (True, 0)
    (line,) = done.stderr.splitlines()
    assert line.startswith("note: no window can be opened")


def test_help_lists_commands_in_the_order_in_which_people_use_them() -> None:
    words = [line.split()[1] for line in run_forked("-h", cwd=ROOT).stdout.splitlines() if re.match(r"│ [a-z]+ ", line)]
    assert (words[:3], words[-2:]) == (["view", "export", "screenshot"], ["evaluate", "train"])
    assert {"generate", "depth", "batch", "plan", "demo", "models"} == set(words[3:-2])


@pytest.mark.parametrize("name", ["scene.png", "missing/photo"])
def test_a_path_in_place_of_a_command_is_viewed(photo_path: Path, name: str) -> None:
    """Here as far as the window that cannot be opened, or the file that is not there."""
    alone, viewed = (run_forked(*words, name, cwd=photo_path.parent) for words in ((), ("view",)))
    assert (alone.returncode, alone.stderr) == (viewed.returncode, viewed.stderr)
    assert "no such file" in alone.stderr if "missing" in name else "no window can be opened" in alone.stderr


def test_a_command_goes_before_a_file_of_its_name_and_a_typo_is_no_path(photo_path: Path) -> None:
    (photo_path.parent / "plan").write_text("a file")
    assert "argument 'photo'" in run_forked("plan", cwd=photo_path.parent).stderr
    assert "Did you mean 'view'" in run_forked("veiw", cwd=photo_path.parent).stderr


def test_a_shell_completes_commands() -> None:
    """By the installed command's name; what the shell asks for comes in the environment."""
    words = {"_IIBR_COMPLETE": "complete_bash", "COMP_WORDS": "iibr scr", "COMP_CWORD": "1"}
    code = "import sys; sys.argv = ['iibr']; from viewer.entry import command; command()"
    assert run_apart(code, **words).stdout.split() == ["screenshot"]


def test_generate_writes_a_light_field_that_opens(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path, tmp_path: Path
) -> None:
    disparity = photo_path.with_name("scene_disparity.npy")
    out = tmp_path / "field"
    words = ("generate", photo_path, "--disparity", disparity, "--grid", 3, "--out", out, "--format", "hci")
    assert run(monkeypatch, *words, "--with-disparity") == 0
    (line,) = capsys.readouterr().out.splitlines()
    assert re.fullmatch(rf"9 views of 96x64 in [\d.]+ s \([\d.]+ ms per view\): {re.escape(str(out))}", line)
    assert len(list(out.glob("input_Cam*.png"))) == len(list(out.glob("disp_Cam*.pfm"))) == 9
    assert run(monkeypatch, "screenshot", out, "-o", tmp_path / "field.png", "--view", "-1,1") == 0


@pytest.mark.parametrize(
    ("words", "is_literal"),
    [
        ((), False),
        (("--literal",), True),
        (("--disparity", "{map}"), True),
        (("--disparity", "{map}", "--planned"), False),
        (("--disparity", "{map}", "--literal"), True),
    ],
)
def test_a_map_that_is_named_counts_as_it_is_unless_said_otherwise(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    photo_path: Path,
    tmp_path: Path,
    words: tuple[str, ...],
    is_literal: bool,
) -> None:
    """As given, the square moves by 3 px from view to view: 12 of 96 from the first to the last."""
    out, given = tmp_path / "field", photo_path.with_name("scene_disparity.npy")
    words = tuple(word.replace("{map}", str(given)) for word in words)
    assert run(monkeypatch, "generate", photo_path, "--grid", 5, "--refine", "off", "--out", out, *words) == 0
    values = read_pfm(out / "gt_disp_lowres.pfm")
    if is_literal:
        np.testing.assert_array_equal(values, np.load(given))
    else:
        assert 4 * float(values.max() - values.min()) == pytest.approx(TOTAL_PARALLAX * WIDTH)
    assert ("In the window it is 4%" in capsys.readouterr().err) == is_literal


def test_options_of_earlier_versions_are_ignored_with_their_values(
    monkeypatch: pytest.MonkeyPatch, photo_path: Path, tmp_path: Path
) -> None:
    words = ("generate", photo_path, "--grid", 1, "--quality", "fast", "--memory=1GB", "--out", tmp_path / "field")
    assert run(monkeypatch, *words) == 0
    assert (tmp_path / "field" / "input_Cam000.png").exists()


def test_inpaint_says_what_fills_the_holes(monkeypatch: pytest.MonkeyPatch, photo_path: Path, tmp_path: Path) -> None:
    """Made with generate and seen in a screenshot alike; background is what fills them unasked."""
    from iibr_core.formats.images.photo import read_photo

    monkeypatch.setitem(INPAINTERS, "red", red_inpainter.ENTRY)
    made, shown = {}, {}
    for name, words in {"unasked": (), "background": ("--inpaint", "background"), "red": ("--inpaint", "red")}.items():
        out, image = tmp_path / name, tmp_path / f"{name}.png"
        assert run(monkeypatch, "generate", photo_path, "--grid", 3, "--out", out, *words) == 0
        made[name] = read_photo(out / "input_Cam000.png").pixels
        assert run(monkeypatch, "screenshot", photo_path, "--grid", 3, "--view", "-1,-1", "-o", image, *words) == 0
        shown[name] = read_photo(image).pixels
    for pictures in (made, shown):
        assert (pictures["unasked"] == pictures["background"]).all()
        changed = (pictures["red"] != pictures["background"]).any(axis=2)
        assert 0 < changed.mean() < 0.5
        red, green, blue = np.moveaxis(pictures["red"][changed], -1, 0)
        assert (red > np.maximum(green, blue)).mean() > 0.5


def test_screenshot_writes_an_image_of_the_size_asked_for(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path, tmp_path: Path
) -> None:
    from iibr_core.formats.images.photo import read_photo

    out = tmp_path / "out.png"
    options = ("--grid", 3, "--view", "-1,0.5", "--focus", "-0.5", "--aperture", 2)
    assert run(monkeypatch, "screenshot", photo_path, *options, "-o", out) == 0
    assert capsys.readouterr().out.strip() == str(out)
    assert read_photo(out).size == (HEIGHT, WIDTH)
    assert run(monkeypatch, "screenshot", photo_path, *options, "--ui", "--size", "700x500", "-o", out, "--force") == 0
    assert read_photo(out).size == (500, 700)


@pytest.mark.parametrize("options", [(), ("--view", "0.5,-0.7"), ("--aperture", 3, "--focus", "-0.2")], ids=str)
def test_a_picture_at_the_photos_own_size_equals_the_usual_one_made_smaller(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    photo_path: Path,
    tmp_path: Path,
    options: tuple[object, ...],
) -> None:
    from iibr_core.beyond.resized_light import mean_of_areas
    from iibr_core.color import linear_from_srgb, srgb_from_linear
    from iibr_core.formats.images.photo import read_photo
    from iibr_core.types import ImageSize

    full, usual, half = (tmp_path / f"{name}.png" for name in ("full", "usual", "half"))
    words = ("--max-pixels", 32 * 48, "--grid", 3, *options)
    assert run(monkeypatch, "screenshot", photo_path, "--full", *words, "-o", full) == 0
    assert "--max-pixels" not in capsys.readouterr().err, "all of the photo's pixels count"
    assert run(monkeypatch, "screenshot", photo_path, *words, "-o", usual) == 0
    assert "--max-pixels" in capsys.readouterr().err
    assert read_photo(full).size == (HEIGHT, WIDTH)
    expected = read_photo(usual).pixels
    assert expected.shape == (HEIGHT // 2, WIDTH // 2, 3)
    smaller = srgb_from_linear(mean_of_areas(linear_from_srgb(read_photo(full).pixels), ImageSize(32, 48)))
    error = np.abs(smaller - expected)[2:-2, 2:-2]
    assert error.mean() < 0.01
    if not options:
        np.testing.assert_allclose(read_photo(full).pixels, read_photo(photo_path).pixels, atol=1.01 / 255)
    # Any size up to it is made of the same.
    assert run(monkeypatch, "screenshot", photo_path, "--size", "80x60", *words, "-o", half) == 0
    assert read_photo(half).size == (60, 80)


def test_full_gives_the_size_and_needs_memory(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path, tmp_path: Path
) -> None:
    from iibr_core.formats.images.write import write_image

    out = tmp_path / "o.png"
    assert run(monkeypatch, "screenshot", photo_path, "--full", "--size", "8x8", "-o", out) == 2
    assert "--full" in capsys.readouterr().err
    large = tmp_path / "large.png"
    write_image(large, np.zeros((2000, 3000, 3), np.uint8))
    monkeypatch.setattr("iibr_core.exports.full_picture.OWN_SIZE_BYTES", 10**9)
    assert run(monkeypatch, "screenshot", large, "--depth", "flat", "--full", "-o", out) == 2
    assert "own size" in capsys.readouterr().err
    assert not out.exists()


@pytest.mark.parametrize("suffix", [".png", ".exr"])
def test_like_repeats_a_saved_picture_exactly_but_for_what_is_given(
    monkeypatch: pytest.MonkeyPatch, photo_path: Path, tmp_path: Path, suffix: str
) -> None:
    from iibr_core.formats.images.photo import read_photo

    first, again, other = (tmp_path / f"{name}{suffix}" for name in ("first", "again", "other"))
    options = ("--grid", 3, "--view", "-1,0.5", "--focus", "-0.5", "--aperture", 2, "--depth-strength", 1.5)
    assert run(monkeypatch, "screenshot", photo_path, *options, "--size", "150x100", "-o", first) == 0
    assert run(monkeypatch, "screenshot", photo_path, "--like", first, "-o", again) == 0
    np.testing.assert_array_equal(read_photo(again).pixels, read_photo(first).pixels)
    assert run(monkeypatch, "screenshot", photo_path, "--like", first, "--aperture", 0, "-o", other) == 0
    assert read_photo(other).size == (100, 150)
    assert (read_photo(other).pixels != read_photo(first).pixels).any()


def test_plan_says_what_and_why(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path
) -> None:
    assert run(monkeypatch, "plan", photo_path) == 0
    first, *reasons = capsys.readouterr().out.splitlines()
    assert first == "scene: 96x64 px, disparity from scene_disparity.npy"
    assert reasons


def test_without_a_display_view_names_the_headless_way(photo_path: Path) -> None:
    done = run_forked("view", photo_path, cwd=ROOT)
    assert done.returncode == 2
    assert len(done.stderr.splitlines()) == 1
    assert "iibr screenshot" in done.stderr


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
def test_the_window_comes_before_heavy_imports_and_with_one_glfw(display: str) -> None:
    done = run_apart(WINDOW_FIRST, DISPLAY=display)
    assert done.stdout.splitlines() == ["[]", "1"], done.stderr


def test_help_imports_nothing_heavy() -> None:
    heavy = ("torch", "numba", "moderngl", "imgui_bundle", "scipy", "skimage", "matplotlib")
    code = f"import sys, viewer.cli.main; print([name for name in {heavy} if name in sys.modules])"
    assert run_apart(code).stdout.strip() == "[]"
