"""The version and the commit of the program, as a person reports them, its licence and its pages in the web."""

from __future__ import annotations

import subprocess
from functools import cache
from importlib.metadata import metadata, version
from pathlib import Path

PACKAGE = Path(__file__).resolve().parent
COMMIT_FILE = PACKAGE / "_commit.txt"
"""File that a packaged copy has (`.ci/hatch_build.py`); a checkout asks git."""
UNKNOWN = "unknown"


@cache
def program_version() -> str:
    """Return the version, which only `pyproject.toml` states."""
    return version("iibr")


@cache
def program_commit() -> str:
    """Return the commit, with `-dirty` after it where a checkout differs from it; "unknown" without git."""
    if COMMIT_FILE.is_file():
        return COMMIT_FILE.read_text("utf-8").strip()
    if not (PACKAGE.parent / ".git").exists():
        return UNKNOWN
    command = ("git", "-C", PACKAGE.parent, "describe", "--always", "--dirty", "--abbrev=12", "--exclude=*")
    try:
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.strip()
    except (OSError, subprocess.CalledProcessError):
        return UNKNOWN


@cache
def program_licence() -> str:
    """Return the licence as an SPDX expression."""
    return metadata("iibr")["License-Expression"]


@cache
def program_pages() -> dict[str, str]:
    """Return the addresses of the program's pages by name: those of `project.urls` in `pyproject.toml`."""
    pages = (page.partition(", ") for page in metadata("iibr").get_all("Project-URL") or ())
    return {name: address for name, _, address in pages}
