"""Packages for Linux: what lies beside the program agrees with it."""

from __future__ import annotations

import gzip
import os
import subprocess
import sys
import tomllib
from configparser import ConfigParser
from pathlib import Path
from xml.etree import ElementTree

import pytest
import typer
import yaml

from iibr_core.exports.photo_folder import PHOTO_ENDINGS
from iibr_core.runtime.extras import require_extra
from iibr_core.types import InputError
from viewer import entry
from viewer.cli.main import app

ROOT = Path(__file__).parents[2]
LINUX = ROOT / "packaging" / "linux"
APP_ID = "io.github.iibr.iibr"
MIME_TYPES = {
    "image/jpeg": ".jpg .jpeg .mpo .jps .lif",
    "image/png": ".png .pns",
    "image/tiff": ".tif .tiff",
    "image/x-exr image/aces": ".exr",
    "image/vnd.radiance": ".hdr",
    "image/webp": ".webp",
    "image/bmp": ".bmp",
    "image/heic image/heif": ".heic .heif .hif",
    "image/avif": ".avif",
    "image/jxl": ".jxl",
    "image/jp2": ".jp2",
    "image/gif": ".gif",
    "image/vnd.adobe.photoshop": ".psd",
    "image/x-tga": ".tga",
}
"""MIME types, and the endings of their files; desktops that do not know an ending look at the first bytes."""


@pytest.fixture(scope="module")
def pages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("pages")
    command = [sys.executable, "-P", LINUX / "pages.py", folder]
    subprocess.run(command, env=os.environ | {"PYTHONPATH": str(ROOT)}, check=True)
    return folder


def test_desktops_offer_the_program_for_every_kind_of_photo_that_it_opens() -> None:
    desktop = ConfigParser(interpolation=None)
    desktop.optionxform = str  # type: ignore[assignment,method-assign]
    desktop.read(LINUX / f"{APP_ID}.desktop", "utf-8")
    entries = desktop["Desktop Entry"]
    assert set(entries["MimeType"].rstrip(";").split(";")) == set(" ".join(MIME_TYPES).split())
    assert set(" ".join(MIME_TYPES.values()).split()) == set(PHOTO_ENDINGS)
    assert entries["Exec"].split()[:2] == ["iibr", "open"]
    assert "open" in typer.main.get_command(app).commands  # type: ignore[attr-defined]


def test_the_store_page_states_the_version_and_shows_pictures_of_the_repository(pages: Path) -> None:
    record = ElementTree.parse(pages / f"{APP_ID}.metainfo.xml").getroot()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert [release.get("version") for release in record.iter("release")] == [project["version"]]
    assert record.findtext("project_license") == project["license"]
    for image in record.iter("image"):
        assert (ROOT / (image.text or "").partition("/main/")[2]).is_file()


def test_the_manual_has_every_command_and_option(pages: Path) -> None:
    manual = gzip.decompress((pages / "iibr.1.gz").read_bytes()).decode().replace("\\-", "-")
    for name, command in typer.main.get_command(app).commands.items():  # type: ignore[attr-defined]
        section = manual.partition(f".SS iibr {name}")[2].partition("\n.SS ")[0]
        assert all(max(option.opts, key=len) in section for option in command.params if option.opts[0].startswith("-"))
        assert section, name


def test_packages_hold_every_icon_and_nothing_that_lacks() -> None:
    contents = yaml.safe_load((LINUX / "nfpm.yaml").read_text("utf-8"))["contents"]
    sources = [entry["src"] for entry in contents if "src" in entry]
    assert {f"assets/icon/{path.name}" for path in (ROOT / "assets/icon").glob("iibr-[0-9]*.png")} <= set(sources)
    assert all((ROOT / source).is_file() for source in sources if not source.startswith(("out/", "/")))


def test_a_packaged_program_says_that_nothing_can_be_added_to_it(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "frozen", True, raising=False)
    with pytest.raises(InputError, match=r"pipx install 'iibr\[batch\]': nothing can be added"):
        require_extra("batch", "a_package_that_is_nowhere")


@pytest.mark.parametrize("before", [None, "/opt/lib"])
def test_child_programs_of_a_packaged_program_get_the_systems_libraries(
    before: str | None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "frozen", True, raising=False)
    monkeypatch.setattr(sys, "argv", ["iibr", "--version"])
    monkeypatch.setenv("LD_LIBRARY_PATH", "/usr/lib/iibr/_internal")
    monkeypatch.delenv("LD_LIBRARY_PATH_ORIG", raising=False)
    if before:
        monkeypatch.setenv("LD_LIBRARY_PATH_ORIG", before)
    entry.run()
    assert os.environ.get("LD_LIBRARY_PATH") == before
