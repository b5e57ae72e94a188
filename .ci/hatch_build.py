"""Has the kernels compiled while a wheel is built, for it to bring along (`viewer/precompile.py`).

They are data, checked against sources, Python, Numba and processor where they are loaded: the wheel stays one for all.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class KernelsHook(BuildHookInterface[Any]):
    """A wheel where they cannot be compiled goes without."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Before the wheel is packed. An editable installation is the checkout, where `make install` compiles them."""
        if version == "editable":
            return
        self._scratch = tempfile.TemporaryDirectory()
        kernels = Path(self._scratch.name) / "kernels"
        # From the sources' folder, not by PYTHONPATH: what isolates the build may take that off again.
        command = [sys.executable, "-m", "viewer.precompile", str(kernels)]
        done = subprocess.run(command, cwd=self.root, check=False)
        if done.returncode == 0:
            build_data["force_include"][str(kernels)] = "iibr_core/_kernels"
        else:
            self.app.display_warning("the kernels could not be compiled: they will be where they are first used")
