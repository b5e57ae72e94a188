"""Copying and pasting with the system's clipboard, in a real window."""

import subprocess
from io import BytesIO
from pathlib import Path
from urllib.parse import quote

import numpy as np
import pytest
from PIL import Image

from iibr_core.types import InputError
from tests.viewer.conftest import says, write_scene
from viewer.app.clipboard import MAX_PASTED, paste_picture
from viewer.model import lens
from viewer.model.action import do

CLIPBOARD = ["xclip", "-selection", "clipboard"]


def a_picture():
    """A PNG file."""
    data = BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (30, 40, 3), np.uint8)).save(data, "PNG")
    return data.getvalue()


def put(data, kind="UTF8_STRING"):
    """Into the clipboard, by another program."""
    quiet = subprocess.DEVNULL
    subprocess.run([*CLIPBOARD, "-t", kind, "-i"], input=data, stdout=quiet, stderr=quiet, check=True)
    while subprocess.run([*CLIPBOARD, "-t", kind, "-o"], stdout=subprocess.PIPE, stderr=quiet).stdout != data:
        pass  # the program before may still answer


@pytest.mark.parametrize("data", [b"", b"\x00\xff\xfe" * 9, a_picture()[:-40]])
def test_damaged_pictures_are_one_line(display, data):
    put(data, "image/png")
    with pytest.raises(InputError, match="neither a picture"):
        paste_picture("/no/such/file")


def test_old_pasted_pictures_go(display, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    put(a_picture(), "image/png")
    pasted = [paste_picture("") for _ in range(MAX_PASTED + 2)]
    assert [Path(path).exists() for path in pasted] == [False] * 2 + [True] * MAX_PASTED


FORMS = "{}", " {}\n", "'{}'", '"{}"', "file://{url}", "file://{url}\r\nfile:///other", "{}\nmore", "~/{name}"


@pytest.mark.parametrize("form", FORMS)
def test_paths_are_taken_as_file_managers_and_terminals_copy_them(tmp_path, monkeypatch, form):
    monkeypatch.setenv("HOME", str(tmp_path))
    path = tmp_path / "a photö 100%.png"
    path.touch()
    assert paste_picture(form.format(path, url=quote(str(path)), name=path.name)) == str(path)


def test_pictures_and_paths_are_copied_and_pasted(open_window, photo_path, tmp_path, monkeypatch):
    """What is pasted at once waits until it is copied; words change nothing."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    viewer = open_window(photo_path).until_idle()
    viewer.app.do(do(lens.set_aperture, 2.0))
    put(b"some words")
    viewer.send("key", "ctrl+c", "key", "ctrl+v")
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.name.startswith("pasted-"))
    assert viewer.texts() == ["Copied the picture."]
    assert not viewer.app.state.jobs
    data = subprocess.run([*CLIPBOARD, "-t", "image/png", "-o"], capture_output=True, check=True).stdout
    copied = np.asarray(Image.open(BytesIO(data)).convert("RGB"))
    assert copied.shape == (64, 96, 3)
    with Image.open(viewer.app.state.source.path) as pasted:
        assert np.array_equal(np.asarray(pasted.convert("RGB")), copied)
    viewer.until_idle()
    path = write_scene(tmp_path, "other", seed=1)
    put(str(path).encode())
    viewer.key("ctrl+v", settle=lambda app: app.state.source.path == str(path))
    put(b"some words")
    before = viewer.app.state.source
    viewer.key("ctrl+v", until=says("neither a picture"))
    assert viewer.app.state.source is before
