"""Mistakes of people: wrong files, absurd options, full disks, programs that are stopped.

Each is one line and exit code 2 (130 for Ctrl-C), nothing is half-written, and what was there is as it was.
"""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.views import read_views
from tests.forked_iibr import run_forked
from tests.iibr_core.known_scenes import write_grid, write_hci
from tests.viewer.cli.conftest import contents, output_of, refusal_of
from tests.viewer.conftest import HEIGHT, WIDTH, write_scene

ROOT = Path(__file__).parents[3]
DEADLINE_S = 120.0


@pytest.fixture
def folder(photo_path, monkeypatch):
    """The working folder: a photo with its map, and one without."""
    monkeypatch.chdir(photo_path.parent)
    noise = np.random.default_rng(0).integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
    Image.fromarray(noise).save("whole.jpg")
    return photo_path.parent


@pytest.fixture(scope="module")
def mistakes(tmp_path_factory):
    """A folder with everything that people point at by mistake."""
    folder = tmp_path_factory.mktemp("mistakes")
    photo = write_scene(folder)
    Image.open(photo).convert("RGB").save(folder / "whole.jpg")
    jpeg, png, disparity = ((folder / name).read_bytes() for name in ("whole.jpg", photo, "scene_disparity.npy"))
    write_hci(folder / "data", 1, 3)
    (write_grid(folder / "broken") / "gt_disp_u01_v01.npy").unlink()
    for name in ("empty", "full", "photos"):
        (folder / name).mkdir()
    for name, content in {
        "text.jpg": b"this is no picture",
        "empty.jpg": b"",
        "page.jpg": b"<!DOCTYPE html><html>404</html>",
        "film.mp4": b"\0\0\0\x20ftypisom" + bytes(60),
        "raw.dng": b"II*\0\x08\0\0\0" + bytes(60),
        "cut.jpg": jpeg[:99],
        "cut.png": png[: len(png) // 2],
        "bomb.ppm": b"P6 60000 60000 255\n" + bytes(9),
        "file": b"in the way",
        "cut.npy": disparity[:300],
        "text.npy": b"no map",
        "full/notes.txt": b"mine",
        "photos/0.png": png,
        "broken/views/v00_u01.png": b"\x89PNG\r\n\x1a\n",
    }.items():
        (folder / name).write_bytes(content)
    np.save(folder / "shape.npy", np.zeros((HEIGHT, 3 * WIDTH), np.float32))
    np.save(folder / "nan.npy", np.full((HEIGHT, WIDTH), np.nan, np.float32))
    np.save(folder / "one.npy", np.full((HEIGHT, WIDTH), 3.0, np.float32))
    np.save(folder / "line.npy", np.zeros(WIDTH, np.float32))
    return folder


PHOTOS = {
    "gone/a.png": "no such file",
    "text.jpg": "text.jpg: ",
    "empty.jpg": "the file is empty (0 bytes)",
    "page.jpg": "is a web page, not a picture; download the picture itself",
    "film.mp4": "is a video; save one of its frames as PNG or JPEG",
    "raw.dng": "is a camera's RAW file; develop it and save it as TIFF or JPEG",
    "cut.jpg": "cut.jpg: ",
    "cut.png": "cut.png: ",
    "bomb.ppm": "bomb.ppm: ",
    "empty": "empty: ",
}
MAPS = ("gone.pfm: no such file", "shape.npy", "line.npy", "nan.npy", "cut.npy", "text.npy", "text.jpg", "empty")
COMMANDS = {
    **{f"screenshot {name} -o o.png": message for name, message in PHOTOS.items()},
    **{f"generate scene.png --disparity {m.partition(':')[0]} --grid 3 -o o": m for m in MAPS},
    "generate scene.png -o o --grid 0": "--grid",
    "generate scene.png -o o --grid 100001": "100001",
    "generate scene.png -o o --grid 3 --max-pixels 0": "--max-pixels",
    "generate scene.png --disparity one.npy --grid 3 -o o --disparity-scale nan": "disparity scale nan",
    "generate scene.png -o o --grid 3 --depth-strength inf": "depth strength inf",
    "generate scene.png -o o --format mp4": "'mp4' is not known: give hci",
    "generate scene.png -o o": "--grid",
    "generate scene.png --grid 3": "--output",
    "generate scene.png --grid 3 -o full --force": "holds other files",
    "generate scene.png --grid 3 -o /proc/o": "/proc/o: ",
    "generate scene.png --poses . -o o --grid 3": "--grid: for light fields only",
    "generate scene.png --grid 3 --photo-pose 1 -o o": "--poses",
    "screenshot scene.png -o o.png --size 0x5": "--size",
    "screenshot scene.png -o o.png --view nan,0": "--view",
    "screenshot scene.png -o o.png --aperture=-1": "--aperture",
    "screenshot scene.png -o o.png --depth foggy": "'foggy' is not one of 'auto'",
    "screenshot scene.png -o o.png --depth flat --depth-model a": "leave out --depth-model",
    "screenshot scene.png -o /proc/o.png": "/proc/o.png: ",
    "screenshot scene.png -o empty": "empty",
    "screenshot scene.png --like whole.jpg -o o.png": "whole.jpg: ",
    "screenshot scene.png --calibration gone.json -o o.png": "gone.json: no such file",
    "screenshot scene.png --calibration empty -o o.png": "empty: ",
    "screenshot scene.png --calibration scene.png -o o.png": "scene.png: is no calibration",
    "screenshot scene.png --calibration scene.png -o o.jpg": "o.jpg: each subpixel belongs to a view of its own",
    "screenshot scene.png --calibration scene.png --size 9x9 -o o.png": "--size: the screen of --calibration",
    "screenshot scene.png --full --size 8x8 -o o.png": "--full",
    "export scene.png --to nothing -o o.png": "'nothing' is not known: give quilt, ",
    "export scene.png --to depth --frames 3 -o o.pfm": "--frames: not for --to depth",
    "export scene.png --to web --budget 0MB -o o.html": "is not the size of a file",
    "export scene.png --to hci -o o --literal": "--grid",
    "export scene.png --to matte -o o.png": "which surface? give a place",
    "export scene.png --to blur -o o.exr --blades 5": "--blades: not for --to blur",
    "export scene.png --to depth -o o.pfm --f-number 2": "--f-number: not for --to depth",
    "export scene.png --to quilt -o o.png --for headset": "--for: not for --to quilt",
    "export scene.png --to web -o o.html --for fridge": "'fridge' is not",
    "export scene.png --to gif -o o.png": "o.png: must end in .gif",
    "screenshot scene.png --grid 3 -o o.png --view 5,0": "--view: S is 5; scene has -1 to 1",
    "screenshot scene.png --grid 3 -o o.png --rotation 30": "rotation 30: turns blades or a mask",
    "plan data --grid 5x7": "do not fill a grid of 5x7",
    "depth scene.png -o o.txt": "o.txt: ",
    "view scene.png --stereo sbs --calibration visual.json": "leave out one of both",
    "view scene.png --tracker tcp:4242": "'tcp:4242' is no tracker: give udp:PORT or udp:HOST:PORT",
    "view gone.png": "gone.png: no such file",
    "view scene.png --calibration gone.json": "gone.json: no such file",
    "view scene.png --disparity gone.pfm": "gone.pfm: no such file",
    "plan scene.png --fly": "--fly",
    "veiw": "Did you mean 'view'",
    "batch empty --to depth -o out": "no photos",
    "batch missing --to depth -o out": "missing: no such folder",
    "batch photos --to depth -o photos/out": "in the input",
    "batch photos --to depth -o file": "file is a file",
    "batch photos --to depth -o full": "full: already exists",
    "batch photos --to depth -o out --workers 2 --dask tcp://127.0.0.1:1": "leave out one",
    "evaluate gone -o o": "gone",
    "evaluate data -o file": "file",
    "evaluate data -o o --disparity guess": "--disparity guess: no such file",
    "evaluate data -o o --disparity file": "file",
    "evaluate data -o o --without gaps": "outpainting",
    "evaluate data -o o --lpips empty": "alexnet",
    "evaluate broken -o o": "v00_u01.png",
    "train --steps 0 -o w.safetensors": "--steps",
    "train --steps 2 -o w.safetensors --learning-rate 1e39": "--learning-rate",
    "train --steps 2 -o w.safetensors --device abacus": "abacus",
    "train --steps 2 -o w.pt": "w.pt",
    "train --steps 2 -o nowhere/w.safetensors": "nowhere",
    "train --steps 2 -o w.safetensors --resume": "w.checkpoint.pt",
    # outputs are refused before the photo is read
    "screenshot text.jpg -o o.gif": "o.gif: can be written as .png, .jpg, .jpeg, .tif, .tiff, .exr, .webp, .avif only",
    "screenshot text.jpg -o o.jpg --bits 16": "o.jpg: JPEG is written with 8 bits a channel, not 16",
    "screenshot text.jpg -o o.png --depth-model gone.onnx": "gone.onnx",
    "export text.jpg --to epi -o cut.png": "cut.png: already exists",
    "evaluate data -o o --depth-model gone.onnx": "gone.onnx",
    "screenshot text.jpg -o none/o.png": "the folder none does not exist",
    "screenshot text.jpg -o o.png --size 16384x16384": "16384x16384 px",
    f"generate text.jpg --grid 3 -o {'n' * 299}": "File name too long",
    "generate text.jpg --grid 3 -o file/field": "file is a file",
    "generate text.jpg --grid 3 -o .": "holds the input text.jpg",
}


@pytest.mark.parametrize("words", COMMANDS)
def test_mistakes_are_refused_in_a_line_before_anything_is_written(iibr, mistakes, monkeypatch, words):
    monkeypatch.chdir(mistakes)
    for variable in ("PYTHONWARNINGS", "PYTHONSAFEPATH"):  # a batch sets them for its processes
        monkeypatch.setenv(variable, os.environ.get(variable, ""))
    before = contents(mistakes)
    assert COMMANDS[words] in refusal_of(iibr(*words.split()))
    assert contents(mistakes) == before


WRITERS = {
    "screenshot": ("screenshot", "scene.png", "--grid", 1, "-o", "o.png"),
    "generate": ("generate", "scene.png", "--grid", 1, "-o", "o"),
    "web": ("export", "scene.png", "--grid", 3, "--to", "web", "-o", "o.html"),
}


@pytest.mark.parametrize("words", WRITERS.values(), ids=WRITERS)
def test_a_full_disk_leaves_what_was_there(iibr, folder, words):
    """What was there is replaced with --force only."""
    before = contents(folder)
    assert "cannot be written" in refusal_of(run_forked(*words, cwd=folder, max_bytes=2000))
    assert contents(folder) == before
    output_of(iibr(*words))
    before = contents(folder)
    assert "already exists; give --force" in refusal_of(iibr(*words))
    assert "cannot be written" in refusal_of(run_forked(*words, "--force", cwd=folder, max_bytes=2000))
    assert contents(folder) == before


def generating(folder, *options):
    """Start `iibr generate` in a process of its own and wait until it has written views."""
    words = ["generate", "whole.jpg", "--grid", 61, "-o", "field", "--depth", "flat", *options]
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


def test_a_program_that_is_asked_to_end_leaves_nothing(folder):
    before = contents(folder)
    process = generating(folder)
    process.send_signal(signal.SIGTERM)
    errors = process.communicate(timeout=DEADLINE_S)[1]
    assert (process.returncode, errors) == (130, "iibr: interrupted\n")
    assert contents(folder) == before


def test_a_killed_program_leaves_what_was_there_and_runs_again(iibr, folder):
    small = ("generate", "scene.png", "--grid", 1, "-o", "field")
    output_of(iibr(*small))
    before = contents(folder / "field")
    process = generating(folder, "--force")
    process.kill()
    process.communicate()
    assert contents(folder / "field") == before
    assert len(list(read_views(open_light_field(folder / "field"))[1])) == 1
    output_of(iibr(*small, "--force"))
    assert contents(folder / "field").keys() == before.keys()
    assert not list(folder.glob(".iibr-*")), "the next run removes what the killed one left"
