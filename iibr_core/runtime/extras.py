"""Packages that a plain installation goes without: few need them, and they are large or not to be had everywhere.

`pyproject.toml` lists them as extras. Whoever needs one asks here before any work.
"""

from __future__ import annotations

from importlib.util import find_spec

from iibr_core.types import InputError

MOST_SAID_CHARACTERS = 160


def is_installed(package: str) -> bool:
    """Whether Python finds a package, without importing it."""
    return find_spec(package) is not None


def require_extra(extra: str, *packages: str) -> None:
    """Raise InputError, naming those packages of an extra that are not installed and the command that brings them."""
    missing = [package for package in packages if not is_installed(package)]
    if missing:
        raise InputError(f"this needs {' and '.join(missing)}; install with: pip install 'iibr[{extra}]'")


def said_by(error: Exception) -> str:
    """What a package that is not ours says of its failure, for the brackets in an InputError: one line, its start."""
    return " ".join(str(error).split())[:MOST_SAID_CHARACTERS] or type(error).__name__
