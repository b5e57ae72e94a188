"""Packages that only evaluation needs; they come with `pip install 'iibr[evaluate]'`."""

from __future__ import annotations

from importlib.util import find_spec

from iibr_core.types import InputError


def require_packages(*names: str) -> None:
    """Raise InputError naming those that are not installed."""
    missing = [name for name in names if find_spec(name) is None]
    if missing:
        raise InputError(f"this needs {' and '.join(missing)}; install them with: pip install 'iibr[evaluate]'")
