"""Compile the kernels while a wheel is built, for it to bring along (`viewer/precompile.py`).

They are data, checked against sources, Python, Numba and processor where they are loaded: the wheel fits all machines.
"""

from __future__ import annotations

import subprocess
import sys
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

KERNELS = "iibr_core/_kernels"


class KernelsHook(BuildHookInterface[Any]):
    """Add the kernels to a wheel; a wheel where they cannot be compiled goes without."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Compile before the wheel is packed. An editable installation is the checkout, which compiles them itself."""
        if version == "editable":
            return
        done = subprocess.run([sys.executable, "-m", "viewer.precompile", KERNELS], cwd=self.root, check=False)
        if done.returncode == 0:
            build_data["force_include"][KERNELS] = KERNELS
        else:
            self.app.display_warning("the kernels could not be compiled: they will be where they are first used")
