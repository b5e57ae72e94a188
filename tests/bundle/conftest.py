"""Systems with the package installed, and what the checkout draws and writes in its place."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pillow_heif
import pytest
from PIL import Image

from tests.bundle.desktop import Desktop
from tests.bundle.systems import SYSTEMS, CleanSystem
from tests.iibr_core.depth.onnx_graphs import weighing
from tests.xvfb import x_server

CHECKOUT = Path(__file__).parents[2]
DEMO = CHECKOUT / "assets" / "motorcycle"
CACHE = CHECKOUT / "out" / "chroots"
"""Folder of base systems and of packages that were downloaded for them."""


def package(ending: str) -> Path:
    """Return the newest package that `make deb` or `make rpm` has written."""
    found = sorted((CHECKOUT / "dist").glob(f"iibr[_-]*.{ending}"), key=lambda path: path.stat().st_mtime)
    assert found, f"no dist/iibr*.{ending}: run `make {ending}`"
    return found[-1]


@pytest.fixture(scope="session")
def desktop() -> Iterator[Desktop]:
    """A screen for all windows, one after the other."""
    with x_server() as name:
        yield Desktop(name)


@pytest.fixture(scope="session", params=SYSTEMS)
def system(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory, desktop: Desktop
) -> Iterator[CleanSystem]:
    """A system with the package installed."""
    clean = CleanSystem(request.param, tmp_path_factory.mktemp(request.param), CACHE, desktop.display).unpack()
    assert not list((clean.folder / "usr/bin").glob("python*"))
    clean.install(str(package("deb")))
    fill(clean.photos)
    yield clean
    shutil.rmtree(clean.folder)


@dataclass(frozen=True)
class Checkout:
    """The program of this checkout, run in a folder of photos by a user who never ran it before."""

    photos: Path
    display: str

    def run(self, *words: str) -> None:
        """Run a command."""
        subprocess.run(self._words(words), cwd=self.photos, env=self._environment(), check=True)

    def start(self, *words: str) -> subprocess.Popen[bytes]:
        """Start a command."""
        return subprocess.Popen(self._words(words), cwd=self.photos, env=self._environment())

    def _words(self, words: tuple[str, ...]) -> list[str]:
        return [sys.executable, "-P", "-m", "viewer", *words]

    def _environment(self) -> dict[str, str]:
        names = ("HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME", "XDG_RUNTIME_DIR")
        home = dict.fromkeys(names, str(self.photos / "home"))
        return {**os.environ, **home, "DISPLAY": self.display, "PYTHONPATH": str(CHECKOUT)}


@pytest.fixture(scope="session")
def checkout(desktop: Desktop, tmp_path_factory: pytest.TempPathFactory) -> Checkout:
    """The program of this checkout."""
    folder = tmp_path_factory.mktemp("checkout")
    (folder / "home").mkdir(mode=0o700)
    fill(folder)
    return Checkout(folder, desktop.display)


def fill(folder: Path) -> None:
    """Write a JPEG, a HEIC, a folder of three photos and a depth model into a folder that everybody may write to."""
    with Image.open(DEMO / "motorcycle.png") as demo:
        photo = demo.convert("RGB").resize((480, 320))
    photo.save(folder / "phone.jpg", quality=95)
    pillow_heif.from_pillow(photo).save(folder / "phone.heic", quality=90)
    (folder / "three").mkdir()
    for k in range(3):
        photo.crop((80 * k, 0, 80 * k + 160, 120)).save(folder / "three" / f"{k}.png")
    weighing(folder / "sum.onnx", (1.0, 1.0, 1.0))
    for path in (folder, folder / "three"):
        path.chmod(0o777)
