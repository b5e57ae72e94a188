"""Copying and pasting with the system's clipboard, in a real window."""

from __future__ import annotations

import subprocess
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.types import GridShape, InputError
from tests.viewer.conftest import Driver, Opener, write_scene
from viewer.app.clipboard import MAX_PASTED, paste_picture
from viewer.model import lens
from viewer.model.action import do

CLIPBOARD = ["xclip", "-selection", "clipboard"]


def a_picture() -> bytes:
    """A PNG file."""
    data = BytesIO()
    Image.fromarray(np.random.default_rng(0).integers(0, 256, (30, 40, 3), np.uint8)).save(data, "PNG")
    return data.getvalue()


@pytest.fixture
def viewer(open_window: Opener, photo_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Driver:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    driver = open_window(photo_path, grid=GridShape(3, 3))
    driver.until_idle()
    return driver


def put(data: bytes, kind: str = "UTF8_STRING") -> None:
    """Into the clipboard, by another program."""
    quiet = subprocess.DEVNULL
    subprocess.run([*CLIPBOARD, "-t", kind, "-i"], input=data, stdout=quiet, stderr=quiet, check=True)


def says(driver: Driver, text: str) -> None:
    driver.until(lambda app: any(text in notice.text for notice in app.state.notices))


def test_the_picture_is_copied_as_it_is_drawn_and_pasted_again(viewer: Driver) -> None:
    viewer.app.do(do(lens.set_aperture, 2.0))
    viewer.until_idle()
    viewer.send("key", "ctrl+c")
    says(viewer, "Copied")
    data = subprocess.run([*CLIPBOARD, "-t", "image/png", "-o"], capture_output=True, check=True).stdout
    copied = np.asarray(Image.open(BytesIO(data)).convert("RGB"))
    assert copied.shape == (64, 96, 3)
    assert not viewer.app.state.jobs
    viewer.until_idle()
    viewer.send("key", "ctrl+v")
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.name.startswith("pasted-"))
    assert viewer.app.state.source is not None
    with Image.open(viewer.app.state.source.path) as pasted:
        assert np.array_equal(np.asarray(pasted.convert("RGB")), copied)


def test_what_is_pasted_at_once_waits_until_it_is_copied(viewer: Driver) -> None:
    put(b"some words")
    viewer.send("key", "ctrl+c", "key", "ctrl+v")
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.name.startswith("pasted-"))
    assert not any(notice.is_error for notice in viewer.app.state.notices)


def test_a_path_in_the_clipboard_opens_and_words_do_not(viewer: Driver, tmp_path: Path) -> None:
    for name, form in (("other", "{}"), ("third", "file://{}\r\n")):
        path = write_scene(tmp_path, name, seed=1)
        put(form.format(path).encode())
        viewer.send("key", "ctrl+v")
        viewer.until(lambda app, name=name: app.state.scene is not None and app.state.scene.name == name)  # type: ignore[misc]
        assert viewer.app.state.source is not None
        assert viewer.app.state.source.path == str(path)
    put(b"some words")
    before = viewer.app.state.source
    viewer.send("key", "ctrl+v")
    says(viewer, "neither a picture")
    assert viewer.app.state.source is before


@pytest.mark.parametrize("data", [b"", b"\x00\xff\xfe" * 9, a_picture()[:-40]])
def test_damaged_pictures_are_one_line(display: str, data: bytes) -> None:
    put(data, "image/png")
    with pytest.raises(InputError, match="neither a picture"):
        paste_picture("/no/such/file")


def test_old_pasted_pictures_go(display: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    put(a_picture(), "image/png")
    pasted = [paste_picture("") for _ in range(MAX_PASTED + 2)]
    assert [Path(path).exists() for path in pasted] == [False] * 2 + [True] * MAX_PASTED
