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


def workflow_steps() -> list[dict[str, str]]:
    """All steps of the hosted jobs."""
    workflow = yaml.safe_load((ROOT / ".github/workflows/bundles.yml").read_text("utf-8"))
    return [step for job in workflow["jobs"].values() for step in job["steps"]]


def test_hosted_jobs_use_fixed_actions_and_no_secrets() -> None:
    actions = [step["uses"] for step in workflow_steps() if "uses" in step]
    assert len(actions) >= 9
    assert [action for action in actions if not re.search(r"@[0-9a-f]{40}$", action)] == []
    assert "secrets" not in str(workflow_steps())


def test_hosted_jobs_run_what_exists() -> None:
    commands = "\n".join(step.get("run", "") for step in workflow_steps()).replace("\\", "/")
    paths = set(re.findall(r"\b(?:packaging|assets|out|dist)/[\w./-]+", commands))
    assert {"packaging/iibr.spec", "packaging/windows/iibr.iss", "packaging/windows/winget.py"} <= paths
    assert [path for path in paths if not path.startswith(("out/", "dist/")) and not (ROOT / path).exists()] == []
    targets = {word for line in re.findall(r"\bmake ([a-z ]+)", commands) for word in line.split()}
    makefile = (ROOT / "Makefile").read_text("utf-8")
    assert [target for target in targets if not re.search(rf"^\.PHONY:.* {target}\b", makefile, re.MULTILINE)] == []
    extras = set(re.findall(r"\.\[(\w+)\]", commands))
    assert set() < extras <= set(PROJECT["optional-dependencies"])


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


def test_the_flatpak_installs_what_exists_for_the_python_of_its_runtime() -> None:
    manifest = yaml.safe_load((PACKAGING / "flathub/io.github.iibr.iibr.yml").read_text("utf-8"))
    commands = "\n".join(command for module in manifest["modules"] for command in module["build-commands"])
    files = re.findall(r"\b(?:packaging|assets)/\S+", commands)
    assert len(files) == 3
    assert [path for path in files if not (ROOT / path).exists()] == []
    sources = runpy.run_path(str(PACKAGING / "flathub/sources.py"))
    assert f"python{sources['PYTHON']}/" in str(manifest["modules"])
    assert set(PROJECT["dependencies"]) <= set(sources["requirements"]())


def test_the_flatpak_takes_no_package_from_this_machine() -> None:
    sources = runpy.run_path(str(PACKAGING / "flathub/sources.py"))["sources"]
    package = {"download_info": {"url": "https://example.org/a.whl", "archive_info": {"hashes": {"sha256": "12"}}}}
    assert sources({"install": [package]}) == [{"type": "file", "url": "https://example.org/a.whl", "sha256": "12"}]
    package["download_info"]["url"] = "file:///a.whl"
    with pytest.raises(ValueError, match="can be downloaded by nobody"):
        sources({"install": [package]})


@pytest.mark.parametrize("size", [16, 32, 48, 64, 128, 256, 512])
def test_icons_have_the_sizes_in_their_names(size: int) -> None:
    with Image.open(ROOT / f"assets/icon/iibr-{size}.png") as icon:
        assert (icon.size, icon.mode) == ((size, size), "RGBA")
