"""Add to a package what the sources lack: the commit, and in a wheel the compiled kernels (`viewer/precompile.py`).

Kernels are data, checked against sources, Python, Numba and processor where they are loaded. A wheel with kernels is
tagged for the Python and the system that compiled them. `HATCH_BUILD_NO_HOOKS=true` builds one for all systems.
"""

from __future__ import annotations

import runpy
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface
from packaging import tags

KERNELS = "iibr_core/_kernels"
COMMIT = "viewer/_commit.txt"
"""File that states the commit; a source package has it already."""
PORTABLE_PLATFORM = "manylinux_2_28_x86_64"
"""Platform of Linux wheels: the libraries that iibr needs ask for this glibc."""


class PackageHook(BuildHookInterface[Any]):
    """Adds the commit and the kernels; a wheel goes without kernels where they cannot be compiled."""

    def dependencies(self) -> list[str]:
        """Return what compiling needs: all that iibr itself needs."""
        return self.metadata.core.dependencies if self.target_name == "wheel" else []

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the files before the package is packed; an editable installation is the checkout and needs none."""
        if version == "editable":
            return
        if not Path(self.root, COMMIT).exists():
            self._add_commit(build_data)
        if self.target_name == "wheel":
            self._add_kernels(build_data)

    def _add_commit(self, build_data: dict[str, Any]) -> None:
        commit = runpy.run_path(str(Path(self.root, "viewer/version.py")))["program_commit"]()
        self._scratch = tempfile.TemporaryDirectory()
        file = Path(self._scratch.name, "commit.txt")
        file.write_text(f"{commit}\n", "utf-8")
        build_data["force_include"][str(file)] = COMMIT

    def _add_kernels(self, build_data: dict[str, Any]) -> None:
        done = subprocess.run([sys.executable, "-m", "viewer.precompile", KERNELS], cwd=self.root, check=False)
        if done.returncode == 0:
            build_data["force_include"][KERNELS] = KERNELS
            platforms = list(tags.platform_tags())
            platform = PORTABLE_PLATFORM if PORTABLE_PLATFORM in platforms else platforms[0]
            build_data["tag"] = f"{tags.interpreter_name()}{tags.interpreter_version()}-none-{platform}"
            build_data["pure_python"] = False
        else:
            self.app.display_warning("the kernels could not be compiled: they will be where they are first used")
