"""The source package and the wheels, as `make dist` builds them, except that no kernels are compiled."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import Distribution, PathDistribution
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.tags import sys_tags
from packaging.utils import parse_wheel_filename
from readme_renderer import markdown

from viewer.version import program_commit

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
REPOSITORY = "https://github.com/iibr/iibr"
SITES = f"{REPOSITORY}/blob/", "https://raw.githubusercontent.com/iibr/iibr/"
"""Addresses of the repository's files, and of their contents."""
FAKE_COMPILER = """
import pathlib, sys
folder = pathlib.Path(sys.argv[1])
folder.mkdir(parents=True)
(folder / "light.nbi").write_text("a kernel")
"""
MAX_SDIST_BYTES = 12_000_000


def run(*words: object, cwd: Path = ROOT, **environment: str) -> str:
    """Return what a module of Python prints; it must succeed."""
    command = (sys.executable, "-P", "-m", *map(str, words))
    env = {**os.environ, "PYTHONPATH": os.pathsep.join(filter(None, sys.path)), "NO_COLOR": "1", **environment}
    done = subprocess.run(command, cwd=cwd, env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout + done.stderr


def build(source: Path, kind: str, target: Path, **environment: str) -> Path:
    run("hatchling", "build", "-t", kind, "-d", target, cwd=source, **environment)
    (package,) = target.glob("*.*")
    return package


@pytest.fixture(scope="module")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(ROOT, "sdist", tmp_path_factory.mktemp("sdist"))


@pytest.fixture(scope="module")
def source(sdist: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return the unpacked source package."""
    folder = tmp_path_factory.mktemp("source")
    shutil.unpack_archive(sdist, folder, filter="data")
    return folder / f"iibr-{PROJECT['version']}"


@pytest.fixture(scope="module")
def wheel(source: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(source, "wheel", tmp_path_factory.mktemp("wheel"), HATCH_BUILD_NO_HOOKS="true")


@pytest.fixture(scope="module")
def distribution(wheel: Path) -> Distribution:
    """Return what a wheel says about itself."""
    return PathDistribution(zipfile.Path(wheel, f"iibr-{PROJECT['version']}.dist-info/"))


def test_an_index_accepts_both(sdist: Path, wheel: Path) -> None:
    assert wheel.name == f"iibr-{PROJECT['version']}-py3-none-any.whl"
    assert run("twine", "check", "--strict", sdist, wheel).count("PASSED") == 2


def test_the_metadata_are_rated_nine_of_ten(source: Path, distribution: Distribution) -> None:
    assert int(re.findall(r"rating: (\d+)/10", run("pyroma", "--min=9", source))[0]) >= 9
    assert distribution.version == PROJECT["version"]
    assert all(address.startswith(REPOSITORY) for address in PROJECT["urls"].values())
    assert all(not Requirement(text).url for text in distribution.requires or ())


def test_links_and_pictures_of_the_package_page_name_files_of_this_version(distribution: Distribution) -> None:
    text = str(distribution.metadata["description"])
    page = markdown.render(text)
    pictures, links = (re.findall(rf'{name}="([^"#][^"]*)"', page) for name in ("src", "href"))
    assert len(pictures) == 2
    assert len(links) > 10
    elsewhere = re.findall(r"\]\((https://[^)]+)\)", (ROOT / "README.md").read_text("utf-8"))
    for address in (*pictures, *(link for link in links if link not in elsewhere)):
        site, file = address.split(f"v{PROJECT['version']}/")
        assert site == SITES[address in pictures]
        assert (ROOT / file).is_file(), address
    assert "pipx install iibr &&" in text
    assert "make run" not in text


def test_the_wheel_has_what_the_program_reads_and_nothing_else(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as archive:
        names = set(archive.namelist())
        assert archive.read("viewer/_commit.txt").decode().strip() == program_commit()
    for folder in ("assets", "shaders", "web"):
        files = (path for path in (ROOT / folder).rglob("*.*") if path.is_file())
        assert {f"iibr_core/_resources/{path.relative_to(ROOT).as_posix()}" for path in files} <= names
    assert {name.partition("/")[0] for name in names} == {"iibr_core", "viewer", f"iibr-{PROJECT['version']}.dist-info"}


def test_the_source_package_builds_and_tests_the_program(sdist: Path, source: Path) -> None:
    assert sdist.stat().st_size < MAX_SDIST_BYTES
    assert {"Makefile", "constraints.txt", "LICENSE", ".ci", "docs", "packaging", "tests"} <= set(os.listdir(source))
    names = {part for path in source.rglob("*") for part in path.relative_to(source).parts}
    assert not names & {".git", ".venv", ".mypy_cache", "__pycache__", "_kernels", "node_modules", "out", "dist"}


def test_commands_lead_to_functions(distribution: Distribution) -> None:
    groups = {command.name: command.group for command in distribution.entry_points}
    assert groups == {"iibr": "console_scripts", "iibr-window": "gui_scripts"}
    assert all(callable(command.load()) for command in distribution.entry_points)


@pytest.mark.parametrize(("compiler", "has_kernels"), [(FAKE_COMPILER, True), ("raise SystemExit(1)", False)])
def test_a_wheel_with_kernels_is_for_the_python_and_system_that_compiled_them(
    source: Path, tmp_path: Path, compiler: str, has_kernels: bool
) -> None:
    changed = shutil.copytree(source, tmp_path / "source")
    (changed / "viewer" / "precompile.py").write_text(compiler)
    wheel = build(changed, "wheel", tmp_path / "dist")
    (tag,) = parse_wheel_filename(wheel.name)[3]
    assert tag in set(sys_tags())
    assert tag.interpreter == (f"cp{sys.version_info.major}{sys.version_info.minor}" if has_kernels else "py3")
    assert (tag.platform == "any") == (not has_kernels)
    assert ("iibr_core/_kernels/light.nbi" in zipfile.ZipFile(wheel).namelist()) == has_kernels
