"""The .deb and the .rpm: what they hold, what they ask of a system, how large they are."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from PIL import Image

from tests.bundle.conftest import CHECKOUT, fill, package
from tests.bundle.systems import clean_system

MAX_DEB_MB, MAX_INSTALLED_MB = 120, 360
GLIBC = re.compile(r"\bGLIBC_(\d+)\.(\d+)\b")


@pytest.fixture(scope="module")
def unpacked(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the folder of the unpacked .deb."""
    folder = tmp_path_factory.mktemp("deb")
    output("dpkg-deb", "-x", package("deb"), folder)
    return folder


def output(*words: object) -> str:
    """Return what a program prints."""
    return subprocess.run(list(map(str, words)), capture_output=True, text=True, check=True).stdout


def files_below(folder: Path) -> dict[Path, bytes]:
    """Return the contents of files by their paths; links have none."""
    paths = (path for path in folder.rglob("*") if path.is_symlink() or not path.is_dir())
    return {path.relative_to(folder): b"" if path.is_symlink() else path.read_bytes() for path in paths}


def test_sizes(unpacked: Path) -> None:
    assert package("deb").stat().st_size <= MAX_DEB_MB * 1e6
    assert int(output("du", "-sm", unpacked).split()[0]) <= MAX_INSTALLED_MB


def test_the_bundle_asks_for_the_glibc_that_is_stated(unpacked: Path) -> None:
    libraries = [unpacked / path for path, content in files_below(unpacked).items() if content[:4] == b"\x7fELF"]
    assert len(libraries) > 50
    asked = GLIBC.findall(output("objdump", "-T", *libraries))
    major, minor = max((int(major), int(minor)) for major, minor in asked)
    assert f"glibc {major}.{minor}" in (CHECKOUT / "docs" / "install.md").read_text("utf-8")
    assert f"libc6 (>= {major}.{minor})" in output("dpkg-deb", "-f", package("deb"), "Depends")


def test_no_library_is_under_the_gpl(unpacked: Path) -> None:
    output(sys.executable, "-P", CHECKOUT / "packaging" / "licences.py", "--check", unpacked)


def test_files_name_no_place_of_the_machine_that_built_them(unpacked: Path) -> None:
    found = [path for path, content in files_below(unpacked).items() if str(CHECKOUT).encode() in content]
    assert not [path for path in found if path.suffix != ".nbc"], "Numba names the source in each kernel, others do not"


def test_the_rpm_holds_the_same_files_and_needs_no_python(unpacked: Path, tmp_path: Path) -> None:
    output("bash", "-o", "pipefail", "-c", 'rpm2cpio "$0" | cpio -idm --quiet -D "$1"', package("rpm"), tmp_path)
    assert files_below(tmp_path).keys() == files_below(unpacked).keys()
    needs = output("rpm", "-qp", "--requires", package("rpm"))
    assert "libEGL.so.1" in needs
    assert "python" not in needs


def test_the_rpm_can_be_installed_used_and_removed(display: None) -> None:
    needs = output("dpkg-deb", "-f", package("deb"), "Depends").split(", ")
    with clean_system("trixie") as system:
        fill(system.photos)
        shutil.copy(package("rpm"), system.folder / "tmp" / "iibr.rpm")
        system.install("rpm", *(name.split()[0] for name in needs))
        system.run("rpm", "--install", "--nodeps", "/tmp/iibr.rpm")  # rpm does not know what Debian's packages bring
        system.run("iibr", "screenshot", "phone.jpg", "-o", "drawn.png", user="ann")
        with Image.open(system.photos / "drawn.png") as drawn:
            assert drawn.size == (480, 320)
        system.run("rpm", "--erase", "iibr")
        assert not list(system.folder.glob("usr/**/iibr*"))
