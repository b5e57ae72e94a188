"""`iibr --version`."""

import platform
import subprocess
import sys
import tomllib
from pathlib import Path

from tests.viewer.cli.conftest import output_of, refusal_of
from viewer import version
from viewer.gpu import context

ROOT = Path(__file__).parents[3]


def test_the_version_names_commit_gl_and_python(iibr):
    program, commit, gl, python = output_of(iibr("--version")).splitlines()
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    assert program == f"iibr {project['version']}"
    assert commit == f"commit {version.program_commit()}"
    with_context = context.create_headless()
    assert gl == f"OpenGL {with_context.version}, {with_context.renderer}"
    with_context.release()
    assert python == f"Python {platform.python_version()}"


def test_without_the_libraries_of_a_desktop_each_command_says_why(iibr, monkeypatch, photo_path):
    monkeypatch.setattr(context, "usual_backends", lambda platform: ("osmesa",))
    monkeypatch.setitem(sys.modules, "imgui_bundle", None)
    (line,) = [line for line in output_of(iibr("--version")).splitlines() if line.startswith("OpenGL")]
    assert line.startswith("OpenGL unavailable: no OpenGL 3.3 without a display: osmesa: import of imgui_bundle")
    assert "no window can be opened (import of imgui_bundle" in refusal_of(iibr("view", photo_path))


def test_the_commit_comes_from_the_packaged_file_or_from_git(monkeypatch, tmp_path):
    package = tmp_path / "viewer"
    package.mkdir()
    commit = version.program_commit.__wrapped__  # asked anew each time
    monkeypatch.setattr(version, "PACKAGE", package)
    monkeypatch.setattr(version, "COMMIT_FILE", package / "_commit.txt")
    assert commit() == "unknown"
    author = ("-c", "user.name=somebody", "-c", "user.email=somebody@localhost")
    for words in (("init", "-q"), (*author, "commit", "-q", "--allow-empty", "-m", "Begin")):
        subprocess.run(("git", *words), cwd=tmp_path, check=True)
    head = subprocess.run(("git", "rev-parse", "HEAD"), cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    assert commit() == head[:12]
    (package / "_commit.txt").write_text("0123456789ab\n")
    assert commit() == "0123456789ab"
