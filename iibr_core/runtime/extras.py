"""Optional packages, which a plain installation goes without; `pyproject.toml` lists them as extras."""

from __future__ import annotations

from importlib.util import find_spec

from iibr_core.types import InputError


def is_installed(package: str) -> bool:
    """Return whether Python finds a package, without importing it."""
    return find_spec(package) is not None


def require_extra(extra: str, *packages: str) -> None:
    """Raise InputError, with the command that installs them, where packages of an extra are missing."""
    missing = [package for package in packages if not is_installed(package)]
    if missing:
        raise InputError(f"this needs {' and '.join(missing)}; install with: pip install 'iibr[{extra}]'")
