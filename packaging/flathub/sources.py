"""List the Python packages of the Flatpak with addresses and hashes: python -P packaging/flathub/sources.py FILE

pip chooses the wheels for the Python of the Flatpak's runtime, at the versions in constraints.txt.
"""

import json
import subprocess
import sys
import tomllib
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
PYTHON = "3.13"
PLATFORMS = ("manylinux_2_28_x86_64", "manylinux_2_27_x86_64", "manylinux2014_x86_64", "manylinux2010_x86_64")


def requirements() -> list[str]:
    """Return what iibr needs in order to run and to be built."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))
    return settings["project"]["dependencies"] + settings["build-system"]["requires"]


def chosen_wheels(packages: list[str]) -> dict[str, Any]:
    """Return pip's report about the wheels that it would install."""
    words = [sys.executable, "-m", "pip", "--isolated", "--quiet", "install", "--dry-run", "--ignore-installed"]
    words += ["--only-binary=:all:", "--target=unused", "--report=-", f"--python-version={PYTHON}"]
    words += [f"--platform={name}" for name in PLATFORMS]
    done = subprocess.run([*words, "-c", ROOT / "constraints.txt", *packages], check=True, stdout=subprocess.PIPE)
    return json.loads(done.stdout)


def sources(report: dict[str, Any]) -> list[dict[str, str]]:
    """Return the sources of a Flatpak's module. Raises ValueError if a package is not on a server."""
    entries = []
    for package in report["install"]:
        origin = package["download_info"]
        if not origin["url"].startswith("https://"):
            raise ValueError(f"{origin['url']} can be downloaded by nobody else: ask pip without local packages")
        entries.append({"type": "file", "url": origin["url"], "sha256": origin["archive_info"]["hashes"]["sha256"]})
    return entries


if __name__ == "__main__":
    text = json.dumps(sources(chosen_wheels(requirements())), indent=1)
    Path(sys.argv[1]).write_text(text + "\n", "utf-8")
