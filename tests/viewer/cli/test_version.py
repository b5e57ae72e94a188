"""`iibr --version`."""

from __future__ import annotations

import platform
import subprocess
import tomllib
from pathlib import Path

import pytest

from tests.viewer.cli.conftest import Iibr, output_of
from viewer.gpu import context
from viewer.model import version

ROOT = Path(__file__).parents[3]


def test_the_version_names_commit_gl_and_python(iibr: Iibr) -> None:
    program, commit, gl, python = output_of(iibr("--version")).splitlines()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert program == f"iibr {project['version']}"
    assert commit == f"commit {version.program_commit()}"
    with_context = context.create_headless()
    assert gl == f"OpenGL {with_context.version}, {with_context.renderer}"
    with_context.release()
    assert python == f"Python {platform.python_version()}"


def test_the_version_says_why_there_is_no_gl(iibr: Iibr, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(context, "usual_backends", lambda platform: ("osmesa",))
    monkeypatch.setattr(context, "_null_window", lambda: None)
    (line,) = [line for line in output_of(iibr("--version")).splitlines() if line.startswith("OpenGL")]
    assert line.startswith("OpenGL unavailable: no OpenGL 3.3 without a display: osmesa: libOSMesa not found")


def test_the_commit_comes_from_the_packaged_file_or_from_git(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    package = tmp_path / "viewer"
    package.mkdir()
    monkeypatch.setattr(version, "PACKAGE", package)
    monkeypatch.setattr(version, "COMMIT_FILE", package / "_commit.txt")
    assert version.program_commit() == "unknown"
    author = ("-c", "user.name=somebody", "-c", "user.email=somebody@localhost")
    for words in (("init", "-q"), (*author, "commit", "-q", "--allow-empty", "-m", "Begin")):
        subprocess.run(("git", *words), cwd=tmp_path, check=True)
    head = subprocess.run(("git", "rev-parse", "HEAD"), cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert version.program_commit() == head[:12]
    (package / "_commit.txt").write_text("0123456789ab\n")
    assert version.program_commit() == "0123456789ab"
