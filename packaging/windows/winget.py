"""Write the winget manifests of an installer: python -P packaging/windows/winget.py INSTALLER FOLDER

They are sent to https://github.com/microsoft/winget-pkgs once the installer can be downloaded.
"""

import hashlib
import sys
import tomllib
from pathlib import Path
from string import Template

HERE = Path(__file__).parent


def fill(installer: Path, folder: Path) -> None:
    """Write the manifests in `winget/` to a folder, with the program's version and the installer's hash."""
    project = tomllib.loads((HERE.parents[1] / "pyproject.toml").read_text("utf-8"))["project"]
    values = {"version": project["version"], "sha256": hashlib.sha256(installer.read_bytes()).hexdigest().upper()}
    folder.mkdir(parents=True, exist_ok=True)
    for manifest in (HERE / "winget").glob("*.yaml"):
        text = Template(manifest.read_text("utf-8")).safe_substitute(values)  # "$schema" stays
        (folder / manifest.name).write_text(text, "utf-8")


if __name__ == "__main__":
    fill(*map(Path, sys.argv[1:]))
