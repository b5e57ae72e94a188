"""What goes wrong for people: wrong files, absurd options, full disks, programs that are stopped. One line, a code that
says so, nothing half-written, and what was there is as it was.
"""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
import time
import zlib
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.views import read_views
from tests.forked_iibr import run_forked
from tests.viewer.conftest import HEIGHT, WIDTH

ROOT = Path(__file__).parents[3]
DEADLINE_S = 120.0


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def bomb(width: int, height: int) -> bytes:
    """A PNG of a few hundred bytes that claims to be this large."""
    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    data = zlib.compress(bytes(100_000))
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", data) + chunk(b"IEND", b"")


@pytest.fixture
def folder(photo_path: Path) -> Path:
    """A photo with its map, and everything that people point at by mistake."""
    folder = photo_path.parent
    noise = np.random.default_rng(0).integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
    Image.fromarray(noise).save(folder / "whole.jpg")
    jpeg, png = (folder / "whole.jpg").read_bytes(), photo_path.read_bytes()
    for name, content in {
        "text.jpg": b"this is no picture",
        "empty.jpg": b"",
        "page.jpg": b"<!DOCTYPE html><html>404</html>",
        "drawing.svg": b"<svg xmlns='x'/>",
        "film.mp4": b"\0\0\0\x20ftypisom" + bytes(60),
        "film.jpg": b"\0\0\0\x20ftypisom" + bytes(60),
        "raw.dng": b"II*\0\x08\0\0\0" + bytes(60),
        "paper.pdf": b"%PDF-1.7\n" + bytes(60),
        "cut.jpg": jpeg[: len(jpeg) // 2],
        "cut.png": png[: len(png) // 2],
        "bomb.png": bomb(19_000, 20_000),
        "huge.png": bomb(60_000, 60_000),
        "bomb.ppm": b"P6 60000 60000 255\n" + bytes(9),
        "file": b"in the way",
        "cut.npy": (folder / "scene_disparity.npy").read_bytes()[:300],
        "text.npy": b"no map",
    }.items():
        (folder / name).write_bytes(content)
    np.save(folder / "shape.npy", np.zeros((HEIGHT, 3 * WIDTH), np.float32))
    np.save(folder / "nan.npy", np.full((HEIGHT, WIDTH), np.nan, np.float32))
    np.save(folder / "one.npy", np.full((HEIGHT, WIDTH), 3.0, np.float32))
    np.save(folder / "line.npy", np.zeros(WIDTH, np.float32))
    Image.new("RGB", (1, 1), (200, 100, 50)).save(folder / "pixel.png")
    (folder / "empty").mkdir()
    (folder / "full").mkdir()
    (folder / "full" / "notes.txt").touch()
    return folder


def contents(folder: Path) -> dict[str, bytes | None]:
    """Everything below a folder, hidden things too."""
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else None for p in folder.rglob("*")}


def assert_refused(done: subprocess.CompletedProcess[str], named: str, code: int = 2) -> None:
    assert done.returncode == code, done.stderr
    (line,) = [line for line in done.stderr.splitlines() if not line.startswith("libpng ")]  # says so by itself
    assert line.startswith("iibr: ")
    assert named in line
    assert done.stdout == ""


PHOTOS = {
    "gone.png": "gone.png: no such file",
    "gone/a.png": "no such file",
    "text.jpg": "text.jpg: ",
    "empty.jpg": "the file is empty (0 bytes)",
    "page.jpg": "is a web page, not a picture; download the picture itself",
    "drawing.svg": "is a drawing (SVG); save it as PNG",
    "film.mp4": "is a video; save one of its frames as PNG or JPEG",
    "film.jpg": "is a video",
    "raw.dng": "is a camera's RAW file; develop it and save it as TIFF or JPEG",
    "paper.pdf": "paper.pdf: ",
    "cut.jpg": "cut.jpg: ",
    "cut.png": "cut.png: ",
    "bomb.png": "bomb.png: ",
    "huge.png": "huge.png: ",
    "bomb.ppm": "bomb.ppm: ",
    "empty": "empty: ",
}


@pytest.mark.parametrize("name", PHOTOS)
def test_what_is_no_photo_is_refused_in_a_line_that_says_what_it_is(folder: Path, name: str) -> None:
    before = contents(folder)
    assert_refused(run_forked("screenshot", name, "-o", "o.png", cwd=folder), PHOTOS[name])
    assert contents(folder) == before


MAPS = {
    "gone.pfm": "gone.pfm: no such file",
    "shape.npy": "shape.npy: ",
    "line.npy": "line.npy: ",
    "nan.npy": "nan.npy: ",
    "cut.npy": "cut.npy: ",
    "text.npy": "text.npy: ",
    "text.jpg": "text.jpg: ",
    "empty": "empty: ",
}


@pytest.mark.parametrize("name", MAPS)
def test_what_is_no_map_of_the_photo_is_refused(folder: Path, name: str) -> None:
    before = contents(folder)
    words = ("generate", "scene.png", "--disparity", name, "--grid", 3, "--out", "o")
    assert_refused(run_forked(*words, cwd=folder), MAPS[name])
    assert contents(folder) == before


OPTIONS = {
    "generate scene.png --out o --grid 0": "--grid",
    "generate scene.png --out o --grid x": "--grid",
    "generate scene.png --out o --grid 100001": "100001",
    "generate scene.png --out o --max-pixels 0": "--max-pixels",
    "generate scene.png --out o --disparity-scale nan": "--disparity-scale",
    "generate scene.png --out o --depth-strength inf": "--depth-strength",
    "generate scene.png --out o --format mp4": "'mp4' is not a layout that can be written: give hci",
    "generate scene.png --grid 3": "--out",
    "generate scene.png --grid 3 --out file": "file: ",
    "generate scene.png --grid 3 --out file/o": "file",
    "generate scene.png --grid 3 --out .": "holds scene.png, which is read",
    "generate scene.png --grid 3 --out full --force": "holds other files",
    "generate scene.png --grid 3 --out /proc/o": "/proc/o: ",
    "screenshot scene.png -o o.png --size 0x5": "--size",
    "screenshot scene.png -o o.png --size 12": "--size",
    "screenshot scene.png -o o.png --size 99999x99999": "99999",
    "screenshot scene.png -o o.png --view nan,0": "--view",
    "screenshot scene.png -o o.png --view 1": "--view",
    "screenshot scene.png -o o.png --aperture=-1": "--aperture",
    "screenshot scene.png -o o.png --focus nan": "--focus",
    "screenshot scene.png -o none/o.png": "none",
    "screenshot scene.png -o /proc/o.png": "/proc/o.png: ",
    "screenshot scene.png -o o.bmp": "o.bmp: can be written as .png",
    "screenshot scene.png -o empty": "empty",
    "export scene.png --to nothing -o o.png": "nothing",
    "depth scene.png -o o.txt": "o.txt: ",
    "screenshot scene.png --like whole.jpg -o o.png": "whole.jpg: ",
    "view gone.png": "gone.png: no such file",
    "view scene.png --disparity gone.pfm": "gone.pfm: no such file",
    "plan scene.png --fly": "--fly",
    "fly": "fly",
}


@pytest.mark.parametrize("words", OPTIONS)
def test_absurd_options_are_refused_before_anything_is_written(folder: Path, words: str) -> None:
    before = contents(folder)
    assert_refused(run_forked(*words.split(), cwd=folder), OPTIONS[words])
    assert contents(folder) == before


WRITERS = {
    "screenshot": ("screenshot", "scene.png", "--grid", 1, "-o", "o.png"),
    "generate": ("generate", "scene.png", "--grid", 1, "--out", "o"),
    "depth": ("depth", "scene.png", "-o", "o.pfm"),
    "export": ("export", "scene.png", "--grid", 3, "--to", "sbs", "-o", "o.png"),
    "web": ("export", "scene.png", "--grid", 3, "--to", "web", "-o", "o.html"),
}


@pytest.mark.parametrize("words", WRITERS.values(), ids=WRITERS)
def test_a_full_disk_and_what_is_there_already(folder: Path, words: tuple[object, ...]) -> None:
    """A disk that fills up leaves nothing, or what was there; what was there is replaced by --force only."""
    before = contents(folder)
    assert_refused(run_forked(*words, cwd=folder, most_bytes=2000), "cannot be written")
    assert contents(folder) == before
    assert run_forked(*words, cwd=folder).returncode == 0
    before = contents(folder)
    assert_refused(run_forked(*words, cwd=folder), "already exists; give --force")
    assert_refused(run_forked(*words, "--force", cwd=folder, most_bytes=2000), "cannot be written")
    assert contents(folder) == before


def test_a_full_disk_is_told_of_the_folder_that_was_asked_for(folder: Path) -> None:
    assert_refused(run_forked(*WRITERS["generate"], cwd=folder, most_bytes=2000), "iibr: o")


@pytest.mark.parametrize("name", ["screenshot", "generate", "depth"])
def test_the_photo_is_never_written_onto(folder: Path, name: str) -> None:
    before = contents(folder)
    command, photo, *options = WRITERS[name]
    assert_refused(run_forked(command, photo, *options[:-1], "scene.png", "--force", cwd=folder), "scene.png")
    assert contents(folder) == before


@pytest.mark.parametrize("name", ["pixel.png", "scene.png"])
def test_a_photo_of_one_pixel_and_a_map_of_one_value_are_flat(folder: Path, name: str) -> None:
    """No error: every view is the photo."""
    (folder / "one.npy").replace(folder / "scene_disparity.npy")
    done = run_forked("generate", name, "--grid", 3, "--out", "o", cwd=folder)
    assert (done.returncode, "Traceback" in done.stderr) == (0, False), done.stderr
    photo = np.asarray(Image.open(folder / name).convert("RGB"))
    for view in (folder / "o").glob("input_Cam*.png"):
        np.testing.assert_array_equal(np.asarray(Image.open(view)), photo)


def generating(folder: Path, *options: object) -> subprocess.Popen[str]:
    """`iibr generate` in a process of its own, in the midst of its views."""
    words = ["generate", "whole.jpg", "--grid", 61, "--out", "field", "--depth", "flat", *options]
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "viewer", *map(str, words)],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        stderr=subprocess.PIPE,
        text=True,
    )
    end = time.monotonic() + DEADLINE_S
    while not list(folder.glob(".iibr-*/new/field/input_Cam*.png")):
        assert process.poll() is None
        assert time.monotonic() < end
    return process


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_program_that_is_asked_to_end_leaves_nothing(folder: Path, number: signal.Signals) -> None:
    before = contents(folder)
    process = generating(folder)
    process.send_signal(number)
    said = process.communicate(timeout=DEADLINE_S)[1]
    assert (process.returncode, said) == (130, "iibr: interrupted\n")
    assert contents(folder) == before


def test_a_program_that_is_killed_leaves_what_was_there_and_runs_again(folder: Path) -> None:
    small = ("generate", "scene.png", "--grid", 1, "--out", "field")
    assert run_forked(*small, cwd=folder).returncode == 0
    before = contents(folder / "field")
    process = generating(folder, "--force")
    process.kill()
    process.communicate()
    assert contents(folder / "field") == before
    assert len(list(read_views(open_light_field(folder / "field"))[1])) == 1
    assert run_forked(*small, "--force", cwd=folder).returncode == 0
    assert not list(folder.glob(".iibr-*")), "the next run removes what the killed one left"
    assert contents(folder / "field").keys() == before.keys()
