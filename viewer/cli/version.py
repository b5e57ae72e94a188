"""`iibr --version`: the lines that a report of a fault begins with."""

from __future__ import annotations

import platform

import typer

from iibr_core.types import InputError


def print_version(is_wanted: bool) -> None:
    """Print the versions and end the program if that is wanted."""
    if is_wanted:
        from viewer.version import program_commit, program_version

        print(f"iibr {program_version()}")
        print(f"commit {program_commit()}")
        print(f"OpenGL {_gl_version()}")
        print(f"Python {platform.python_version()}")
        raise typer.Exit


def _gl_version() -> str:
    """Return version and renderer of a context without a window, or why there is none."""
    from viewer.gpu.context import create_headless

    try:
        context = create_headless()
    except InputError as error:
        return f"unavailable: {error}"
    words = f"{context.version}, {context.renderer}"
    context.release()
    return words
