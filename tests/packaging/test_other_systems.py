"""Files for systems that the tests do not run on: what they name exists, and they agree with the program."""

from __future__ import annotations

import hashlib
import re
import runpy
import tomllib
from pathlib import Path

import pytest
import yaml
from PIL import Image

from iibr_core.exports.photo_folder import PHOTO_ENDINGS

ROOT = Path(__file__).parents[2]
PACKAGING = ROOT / "packaging"
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]


def test_windows_lists_the_program_for_photos_that_it_opens() -> None:
    script = (PACKAGING / "windows/iibr.iss").read_text("utf-8")
    endings = re.search(r'Endings "(.+) "', script)[1].split()  # type: ignore[index]
    assert set(endings) <= set(PHOTO_ENDINGS)
    winget = yaml.safe_load((PACKAGING / "windows/winget/iibr.iibr.installer.yaml").read_text("utf-8"))
    assert [f".{ending}" for ending in winget["FileExtensions"]] == endings
    assert winget["ProductCode"] == re.search(r"AppId=(.+)", script)[1] + "_is1"  # type: ignore[index]


def test_winget_manifests_get_version_and_hash(tmp_path: Path) -> None:
    installer = tmp_path / "iibr.exe"
    installer.write_bytes(b"installer")
    runpy.run_path(str(PACKAGING / "windows/winget.py"))["fill"](installer, tmp_path / "winget")
    manifests = {path.name: yaml.safe_load(path.read_text("utf-8")) for path in (tmp_path / "winget").iterdir()}
    assert {manifest["PackageVersion"] for manifest in manifests.values()} == {PROJECT["version"]}
    (entry,) = manifests["iibr.iibr.installer.yaml"]["Installers"]
    assert entry["InstallerSha256"] == hashlib.sha256(b"installer").hexdigest().upper()
    assert f"v{PROJECT['version']}/iibr-{PROJECT['version']}-windows" in entry["InstallerUrl"]


@pytest.mark.parametrize("size", [16, 32, 48, 64, 128, 256, 512])
def test_icons_have_the_sizes_in_their_names(size: int) -> None:
    with Image.open(ROOT / f"assets/icon/iibr-{size}.png") as icon:
        assert (icon.size, icon.mode) == ((size, size), "RGBA")
