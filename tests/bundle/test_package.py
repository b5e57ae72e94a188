"""The .deb and the .rpm: what they hold, what they ask of a system, how large they are."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.bundle.conftest import CHECKOUT, package

MAX_DEB_MB, MAX_INSTALLED_MB = 120, 360
GLIBC = re.compile(rb"\bGLIBC_(\d+)\.(\d+)\b")


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the unpacked .deb."""
    folder = tmp_path_factory.mktemp("deb")
    subprocess.run(["dpkg-deb", "-x", str(package("deb")), str(folder)], check=True)
    return folder


def files_below(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_symlink() or not path.is_dir()}


def test_sizes(unpacked: Path) -> None:
    used = subprocess.run(["du", "-sm", str(unpacked)], capture_output=True, text=True, check=True).stdout
    assert package("deb").stat().st_size <= MAX_DEB_MB * 1e6
    assert int(used.split()[0]) <= MAX_INSTALLED_MB


def test_the_bundle_asks_for_the_glibc_that_is_stated(unpacked: Path) -> None:
    libraries = [path for path in unpacked.rglob("*") if path.is_file() and path.read_bytes()[:4] == b"\x7fELF"]
    assert len(libraries) > 50
    asked = [subprocess.run(["objdump", "-T", str(path)], capture_output=True).stdout for path in libraries]
    newest = max((int(major), int(minor)) for text in asked for major, minor in GLIBC.findall(text))
    name = f"glibc {newest[0]}.{newest[1]}"
    assert name in (CHECKOUT / "docs" / "install.md").read_text("utf-8")
    depends = subprocess.run(["dpkg-deb", "-f", str(package("deb")), "Depends"], capture_output=True, text=True).stdout
    assert f"libc6 (>= {newest[0]}.{newest[1]})" in depends


def test_no_library_is_under_the_gpl(unpacked: Path) -> None:
    script = CHECKOUT / "packaging" / "licences.py"
    subprocess.run([sys.executable, "-P", str(script), "--check", str(unpacked)], check=True)


def test_files_name_no_place_of_the_machine_that_built_them(unpacked: Path) -> None:
    home = str(CHECKOUT).encode()
    assert not [path for path in unpacked.rglob("*") if path.is_file() and home in path.read_bytes()]


def test_the_rpm_holds_the_same_files(unpacked: Path, tmp_path: Path) -> None:
    archive = subprocess.run(["rpm2cpio", str(package("rpm"))], capture_output=True, check=True).stdout
    subprocess.run(["cpio", "-idm", "--quiet"], input=archive, cwd=tmp_path, check=True)
    assert files_below(tmp_path) == files_below(unpacked)


def test_the_rpm_needs_libraries_and_no_python() -> None:
    words = ["rpm", "-qp", "--requires", str(package("rpm"))]
    needs = subprocess.run(words, capture_output=True, text=True, check=True).stdout
    assert "libEGL.so.1" in needs
    assert "python" not in needs
