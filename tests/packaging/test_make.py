"""The environment of `make` in a checkout, with a package that is there already in place of those from the network."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.mark.skipif(shutil.which("make") is None, reason="there is no make")
def test_packages_are_compiled_where_they_are_installed(tmp_path: Path) -> None:
    package, environment = tmp_path / "package.py", tmp_path / "venv"
    package.write_text("answer = 42\n")
    install = f"cp {package} {environment}/lib/python3.{sys.version_info.minor}/site-packages #"
    command = ["make", f"{environment}/.ready", f"VENV={environment}", f"PYTHON={sys.executable}", f"PIP={install}"]
    env = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    subprocess.run(command, cwd=ROOT, env=env, check=True, capture_output=True)
    code = "import package; from pathlib import Path; print(Path(package.__cached__).is_file())"
    done = subprocess.run([environment / "bin/python", "-c", code], env=env, capture_output=True, text=True, check=True)
    assert done.stdout == "True\n"
