"""The wheel, installed by uv and by pipx, in Debian 12 with its own Python."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator

import pytest

from tests.bundle.conftest import CHECKOUT, fill
from tests.bundle.systems import CleanSystem, clean_system

PROGRAMS = "/home/ann/.local/bin"


@pytest.fixture(scope="module")
def with_python() -> Iterator[CleanSystem]:
    """Debian 12 with Python, pipx and uv, and a wheel without kernels."""
    with clean_system("bookworm") as clean:
        clean.install("python3-venv", "pipx")
        fill(clean.photos)
        words = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(clean.photos), str(CHECKOUT)]
        subprocess.run(words, check=True, env={**os.environ, "HATCH_BUILD_NO_HOOKS": "true"})
        clean.run("pipx", "install", "uv", user="ann")
        yield clean


@pytest.mark.parametrize("tool", [(f"{PROGRAMS}/uv", "tool"), ("pipx",)], ids=["uv", "pipx"])
def test_the_wheel_is_installed_and_removed(with_python: CleanSystem, tool: tuple[str, ...]) -> None:
    (wheel,) = with_python.photos.glob("*.whl")
    iibr = f"{PROGRAMS}/iibr"
    with_python.run(*tool, "install", f"./{wheel.name}", user="ann")
    assert "iibr" in with_python.run(iibr, "--version", user="ann")
    assert "views" in with_python.run(iibr, "plan", "phone.heic", user="ann")
    with_python.run(*tool, "uninstall", "iibr", user="ann")
    assert not (with_python.folder / iibr.lstrip("/")).is_symlink()
