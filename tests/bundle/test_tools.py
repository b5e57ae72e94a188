"""The wheel, installed by uv and by pipx, in Debian 12 with its own Python."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.bundle.conftest import CACHE, CHECKOUT, fill
from tests.bundle.systems import CleanSystem


@pytest.fixture(scope="module")
def with_python(tmp_path_factory: pytest.TempPathFactory) -> Iterator[CleanSystem]:
    """Debian 12 with Python, pipx and uv, and a wheel without kernels."""
    clean = CleanSystem("bookworm", tmp_path_factory.mktemp("tools"), CACHE).unpack()
    clean.install("python3-venv", "pipx")
    fill(clean.photos)
    words = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(clean.photos), str(CHECKOUT)]
    subprocess.run(words, check=True, env={**os.environ, "HATCH_BUILD_NO_HOOKS": "true"})
    clean.run("pipx", "install", "uv", user="ann")
    yield clean
    shutil.rmtree(clean.folder)


@pytest.mark.parametrize("tool", ["uv", "pipx"])
def test_the_wheel_is_installed_and_removed(with_python: CleanSystem, tool: str) -> None:
    (wheel,) = with_python.photos.glob("*.whl")
    programs = Path("/home/ann/.local/bin")
    begin = {"uv": [str(programs / "uv"), "tool"], "pipx": ["pipx"]}[tool]
    with_python.run(*begin, "install", f"./{wheel.name}", user="ann")
    iibr = str(programs / "iibr")
    assert "iibr" in with_python.run(iibr, "--version", user="ann")
    assert "views" in with_python.run(iibr, "plan", "phone.heic", user="ann")
    with_python.run(*begin, "uninstall", "iibr", user="ann")
    assert not (with_python.folder / iibr.lstrip("/")).is_symlink()
