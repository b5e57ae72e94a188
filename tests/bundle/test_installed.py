"""The package in systems without Python, used by Ann and by Bob, who has no home folder."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from tests.bundle.conftest import DEMO as DEMO_FOLDER
from tests.bundle.conftest import Checkout
from tests.bundle.desktop import Desktop, Picture
from tests.bundle.systems import CleanSystem
from tests.image_compare import ROUNDING, SAME_RASTERISER, assert_close, read_png

DEMO = "/usr/lib/iibr/_internal/iibr_core/_resources/assets/motorcycle/motorcycle.png"
MIDDLE, CORNER = (450, 450), (1399, 899)
"""Places in the picture and beside the window, in pixels of the screen."""
PICTURE = np.s_[:720, :960]
"""Part of the screen that shows the photo, and neither panel nor notices."""


@pytest.fixture(scope="module")
def demo_window(checkout: Checkout, desktop: Desktop) -> Picture:
    """Return the window of the checkout that shows the demo."""
    desktop.send("mousemove", *CORNER)
    with desktop.window(checkout.start("demo"), "motorcycle - iibr") as program:
        return desktop.settled(program)[PICTURE]


def test_no_python_comes_with_it(system: CleanSystem) -> None:
    names = system.run("dpkg-query", "-W", "-f", "${Package}\n").split()
    assert "iibr" in names
    assert not [name for name in names if "python" in name]
    assert not list((system.folder / "usr/bin").glob("python*"))


@pytest.mark.parametrize("user", ["ann", "bob"])
def test_the_demo_looks_like_the_checkouts_and_follows_a_drag(
    system: CleanSystem, desktop: Desktop, demo_window: Picture, tmp_path: Path, user: str
) -> None:
    desktop.send("mousemove", *CORNER)
    with desktop.window(system.start("iibr", "demo", user=user), "motorcycle - iibr") as program:
        shown = desktop.settled(program)[PICTURE]
        assert_close(shown, demo_window, SAME_RASTERISER, tmp_path, f"{system.name}-demo")
        x, y = MIDDLE
        desktop.send("mousemove", x, y, "mousedown", 1, "mousemove", x + 40, y + 10, "mousemove", x + 80, y + 20)
        desktop.wait(program, lambda: share_changed(desktop.picture()[PICTURE], shown) > 0.1)
        desktop.send("mouseup", 1)


def share_changed(picture: Picture, before: Picture) -> float:
    """Return the share of pixels that changed by more than 8 levels."""
    return float(np.mean(np.abs(picture.astype(int) - before).max(axis=-1) > 8))


@pytest.mark.parametrize("ending", ["jpg", "heic"])
def test_photos_are_opened_and_pictures_saved(system: CleanSystem, desktop: Desktop, ending: str) -> None:
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


def test_another_start_opens_its_photo_in_the_window_that_is_there(system: CleanSystem, desktop: Desktop) -> None:
    shutil.copy(system.photos / "phone.jpg", system.photos / "second.jpg")
    with desktop.window(system.start("iibr", "open", "phone.jpg", user="ann"), "phone - iibr") as program:
        system.run("iibr", "open", "second.jpg", user="ann")
        desktop.wait_for_title(program, "second - iibr")


@pytest.mark.parametrize(
    "words",
    [(DEMO, "--view", "1,-2", "--aperture", "2"), ("phone.heic",), ("phone.jpg", "--depth-model", "./sum.onnx")],
    ids=["demo", "heic", "model"],
)
def test_screenshots_equal_the_checkouts(
    system: CleanSystem, checkout: Checkout, tmp_path: Path, words: tuple[str, ...]
) -> None:
    name = f"shot-{words[-1].replace('/', '')}.png"
    system.run("iibr", "screenshot", *words, "--grid", "5", "-o", name, "--force", user="ann")
    if not (checkout.photos / name).exists():
        here = [word.replace(DEMO, str(DEMO_FOLDER / "motorcycle.png")) for word in words]
        checkout.run("screenshot", *here, "--grid", "5", "-o", name)
    assert_close(read_png(system.photos / name), read_png(checkout.photos / name), ROUNDING, tmp_path, system.name)


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


def test_the_version_is_the_packages(system: CleanSystem) -> None:
    version = system.run("dpkg-query", "-W", "-f", "${Version}", "iibr")
    assert f"iibr {version}" in system.run("iibr", "--version", user="bob").splitlines()


def test_nothing_but_a_users_files_stays(system: CleanSystem) -> None:
    """The last test: the package is removed."""
    system.run("apt-get", "purge", "-y", "-qq", "iibr")
    assert not (system.folder / "usr/lib/iibr").exists()
    left = system.run("find", "/", "-xdev", "-name", "*iibr*", "-not", "-path", "/proc/*").split()
    assert not [path for path in left if not path.startswith(("/home/ann/", "/photos/", "/tmp/"))]
