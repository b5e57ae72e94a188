"""Systems with the package installed, and what the checkout draws and writes in its place."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pillow_heif
import pytest
from PIL import Image

from tests.bundle.systems import SYSTEMS, CleanSystem, clean_system
from tests.iibr_core.depth.onnx_graphs import weighing
from tests.xvfb import private_display

CHECKOUT = Path(__file__).parents[2]


def package(ending: str) -> Path:
    """Return the newest package that `make deb` or `make rpm` has written."""
    packages = list((CHECKOUT / "dist").glob(f"iibr[_-]*.{ending}"))
    assert packages, f"no dist/iibr*.{ending}: run `make {ending}`"
    return max(packages, key=lambda path: path.stat().st_mtime)


@pytest.fixture(scope="session")
def display() -> Iterator[None]:
    """A screen for all windows; DISPLAY names it."""
    with private_display():
        yield


@pytest.fixture(scope="session", params=SYSTEMS)
def system(request: pytest.FixtureRequest, display: None) -> Iterator[CleanSystem]:
    """A system with the package installed."""
    with clean_system(request.param) as clean:
        shutil.copy(package("deb"), clean.folder / "tmp" / "iibr.deb")
        clean.install("/tmp/iibr.deb")
        fill(clean.photos)
        yield clean


@pytest.fixture(scope="session")
def checkout(display: None, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of photos for the program of this checkout."""
    folder = tmp_path_factory.mktemp("checkout")
    fill(folder)
    (folder / "home").mkdir(mode=0o700)
    return folder


def start(folder: Path, *words: str) -> subprocess.Popen[bytes]:
    """Start the program of this checkout in a folder of photos, as a user who never ran it before."""
    names = ("HOME", "XDG_CACHE_HOME", "XDG_CONFIG_HOME", "XDG_DATA_HOME", "XDG_STATE_HOME", "XDG_RUNTIME_DIR")
    environment = {**os.environ, **dict.fromkeys(names, str(folder / "home")), "PYTHONPATH": str(CHECKOUT)}
    return subprocess.Popen([sys.executable, "-P", "-m", "viewer", *words], cwd=folder, env=environment)


def fill(folder: Path) -> None:
    """Write the demo, a JPEG, a HEIC, three photos and a depth model into a folder for everybody."""
    demo = shutil.copytree(CHECKOUT / "assets" / "motorcycle", folder / "demo") / "motorcycle.png"
    with Image.open(demo) as picture:
        photo = picture.convert("RGB").resize((480, 320))
    photo.save(folder / "phone.jpg", quality=95)
    pillow_heif.from_pillow(photo).save(folder / "phone.heic", quality=90)
    (folder / "three").mkdir()
    for k in range(3):
        photo.crop((80 * k, 0, 80 * k + 160, 120)).save(folder / "three" / f"{k}.png")
    weighing(folder / "sum.onnx", (1.0, 1.0, 1.0))
    for path in (folder, folder / "three"):
        path.chmod(0o777)
