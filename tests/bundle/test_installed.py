"""The package in systems without Python, used by Ann and by Bob, who has no home folder."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.bundle import desktop
from tests.bundle.conftest import start
from tests.bundle.systems import CleanSystem
from tests.image_compare import ROUNDING, SAME_RASTERISER, assert_close, read_png

X, Y = 450, 450
"""Place in the picture, in pixels of the screen."""
PICTURE = np.s_[:720, :960]
"""Part of the screen that shows the photo, and neither panel nor notices."""


@pytest.fixture(scope="module")
def demo_window(checkout: Path) -> desktop.Picture:
    """Return the window of the checkout that shows the demo."""
    with desktop.window(start(checkout, "demo"), "motorcycle - iibr") as program:
        return desktop.settled(program)[PICTURE]


def test_no_python_comes_with_it_and_its_version_is_the_packages(system: CleanSystem) -> None:
    packages = system.run("dpkg-query", "-W", "-f", "${Package} ${Version}\n").splitlines()
    (version,) = [package for package in packages if package.startswith("iibr ")]
    assert version in system.run("iibr", "--version", user="bob").splitlines()
    assert not [package for package in packages if "python" in package]
    assert not list((system.folder / "usr/bin").glob("python*"))


@pytest.mark.parametrize("user", ["ann", "bob"])
def test_the_demo_looks_like_the_checkouts_and_follows_a_drag(
    system: CleanSystem, demo_window: desktop.Picture, tmp_path: Path, user: str
) -> None:
    with desktop.window(system.start("iibr", "demo", user=user), "motorcycle - iibr") as program:
        shown = desktop.settled(program)[PICTURE].astype(int)
        assert_close(shown, demo_window, SAME_RASTERISER, tmp_path, f"{system.name}-demo")
        desktop.send("mousemove", X, Y, "mousedown", 1, "mousemove", X + 40, Y + 10, "mousemove", X + 80, Y + 20)
        desktop.wait(program, lambda: np.mean(abs(desktop.picture()[PICTURE] - shown).max(axis=-1) > 8) > 0.1)
        desktop.send("mouseup", 1)


@pytest.mark.parametrize("ending", ["jpg", "heic"])
def test_photos_are_opened_and_pictures_saved(system: CleanSystem, ending: str) -> None:
    place = system.photos / "phone-iibr.png"
    place.unlink(missing_ok=True)
    with desktop.window(system.start("iibr", f"phone.{ending}", user="bob"), "phone - iibr") as program:
        desktop.settled(program)
        desktop.send("key", "ctrl+s", "key", "Return")
        desktop.wait(program, place.exists)
        desktop.settled(program)
    with Image.open(place) as picture, Image.open(system.photos / "phone.jpg") as photo:
        assert picture.size == photo.size
        assert np.abs(np.asarray(picture.convert("RGB")).astype(int) - np.asarray(photo)).mean() < 8


def test_another_start_opens_its_photo_in_the_window_that_is_there(system: CleanSystem) -> None:
    shutil.copy(system.photos / "phone.jpg", system.photos / "second.jpg")
    with desktop.window(system.start("iibr", "open", "phone.jpg", user="ann"), "phone - iibr") as program:
        system.run("iibr", "open", "second.jpg", user="ann")
        desktop.wait_for_title(program, "second - iibr")


@pytest.mark.parametrize(
    "words", ["demo/motorcycle.png --view 1,-2 --aperture 2", "phone.heic", "phone.jpg --depth-model ./sum.onnx"]
)
def test_screenshots_equal_the_checkouts(system: CleanSystem, checkout: Path, tmp_path: Path, words: str) -> None:
    name = f"shot-{words.replace('/', '')}.png"
    command = ["screenshot", *words.split(), "--grid", "5", "-o", name]
    system.run("iibr", *command, user="ann")
    if not (checkout / name).exists():
        assert start(checkout, *command).wait() == 0
    assert_close(read_png(system.photos / name), read_png(checkout / name), ROUNDING, tmp_path, system.name)


def test_two_processes_export_three_photos(system: CleanSystem) -> None:
    report = system.run("iibr", "batch", "three", "--to", "depth", "--workers", "2", "-o", "maps", user="bob")
    assert "3 written, 0 there before, 0 failed" in report
    assert len(list((system.photos / "maps").glob("*_depth.pfm"))) == 3


def test_pages_and_animations_are_exported_and_missing_parts_named(system: CleanSystem) -> None:
    export = ["iibr", "export", "phone.jpg", "--grid", "3", "--to"]
    system.run(*export, "gif", "--frames", "4", "-o", "loop.gif", user="ann")
    with Image.open(system.photos / "loop.gif") as loop:
        assert loop.n_frames == 4
    system.run(*export, "web", "-o", "page.html", user="ann")
    assert (system.photos / "page.html").read_bytes().startswith(b"<!doctype html>")
    refusal = system.run(*export, "mp4", "-o", "film.mp4", user="ann", code=2)
    assert "pip install" not in refusal
    assert "nothing can be added to this package" in refusal


def test_nothing_but_a_users_files_stays(system: CleanSystem) -> None:
    """The last test: the package is removed."""
    system.run("apt-get", "purge", "-y", "-qq", "iibr")
    assert not (system.folder / "usr/lib/iibr").exists()
    left = system.run("find", "/", "-xdev", "-name", "*iibr*", "-not", "-path", "/proc/*").split()
    users = "/home/ann/", "/photos/", "/tmp/runtime-", "/tmp/iibr.deb"
    assert not [path for path in left if not path.startswith(users)]
