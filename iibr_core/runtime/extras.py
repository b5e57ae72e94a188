"""Optional packages, which a plain installation goes without; `pyproject.toml` lists them as extras."""

from __future__ import annotations

import sys
from importlib.util import find_spec

from iibr_core.types import InputError

LICENCES = {"export": " (PyAV and pillow-heif, which hold encoders under the GPL, x264 and x265)"}
"""Remarks on the licences of an extra."""


def is_installed(package: str) -> bool:
    """Return whether Python finds a package, without importing it."""
    return find_spec(package) is not None


def require_extra(extra: str, *packages: str) -> None:
    """Raise InputError, with how to install them, where packages of an extra are missing."""
    missing = [package for package in packages if not is_installed(package)]
    if missing:
        raise InputError(f"this needs {' and '.join(missing)}; {how_to_install(extra)}")


def how_to_install(extra: str) -> str:
    """Return how a person installs an extra, as a clause of a sentence."""
    return f"install with: {install_command(extra)}"


def install_command(extra: str) -> str:
    """Return the command that installs an extra. Nothing can be added to a packaged program."""
    command = f"install 'iibr[{extra}]'{LICENCES.get(extra, '')}"
    is_packaged = getattr(sys, "frozen", False)
    return f"pipx {command}: nothing can be added to this package of iibr" if is_packaged else f"pip {command}"
