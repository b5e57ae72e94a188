"""What made a report: the command and the commit, for the line at its top."""

from __future__ import annotations

import shlex
import subprocess
import sys
from pathlib import Path

WITH_CHANGES = " (with changes)"
"""After a commit's name: the files were not what that commit has."""


def made_by(module: str) -> str:
    """The run in words: `python -m module ...` with its options, and the commit where it is known; no full stop."""
    command = shlex.join(["python", "-m", module, *sys.argv[1:]])
    commit = current_commit()
    return f"Made by `{command}`" + (f" at commit {commit}" if commit else "")


def current_commit() -> str:
    """The commit checked out, short; "" outside a checkout. Changes that are not committed are said."""
    command = ["git", "describe", "--always", "--exclude=*", f"--dirty={WITH_CHANGES}"]
    try:
        run = subprocess.run(command, cwd=Path(__file__).parent, capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        return ""
    return run.stdout.strip()
