"""An installation that brings its kernels along: nothing is compiled on the ways that users take first."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.images.write import write_image
from tests.viewer.conftest import write_scene

ROOT = Path(__file__).parents[2]
SHIPPED = ROOT / "iibr_core" / "_kernels"


def run(*words: object, **environment: str) -> str:
    """Run a module of the package; returns its output. Settings of Numba in this process do not count."""
    clean = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    command = [sys.executable, "-P", "-m", *(str(word) for word in words)]
    env = clean | {"PYTHONPATH": str(ROOT)} | environment
    done = subprocess.run(command, env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def kernels_in(folder: Path) -> dict[str, int]:
    return {path.name: path.stat().st_mtime_ns for path in folder.rglob("*.nb?")}


def test_a_folder_of_other_files_is_refused_and_left_alone(tmp_path: Path) -> None:
    photo = tmp_path / "holiday" / "photo.jpg"
    photo.parent.mkdir()
    photo.write_bytes(b"dear")
    command = [sys.executable, "-P", "-m", "viewer.precompile", str(tmp_path)]
    done = subprocess.run(
        command, cwd=ROOT, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True
    )
    assert done.returncode == 2
    assert "holds other files (photo.jpg); give an empty folder" in done.stderr
    assert photo.read_bytes() == b"dear"


DEMO = ROOT / "assets" / "motorcycle" / "motorcycle.png"


@pytest.mark.parametrize(
    "words",
    [
        ("screenshot", DEMO, "--max-pixels", 60000, "--aperture", 4, "--size", "160x100", "-o", "picture.png"),
        ("generate", DEMO, "--max-pixels", 60000, "--grid", 3, "--out", "field", "--with-disparity"),
        ("screenshot", "unmapped.png", "--view", "1,1", "-o", "picture.png"),
        ("screenshot", DEMO, "--max-pixels", 250000, "--gloss", "gloss.toml", "-o", "picture.png"),
        ("screenshot", "scene.png", "--max-pixels", 3000, "--full", "--aperture", 3, "-o", "picture.png"),
        ("depth", "views", "-o", "map.pfm"),
    ],
    ids=["screenshot", "generate", "guessed", "gloss", "full", "depth"],
)
def test_the_first_run_compiles_nothing(tmp_path: Path, words: tuple[object, ...]) -> None:
    write_scene(tmp_path)
    random = np.random.default_rng(0)
    write_image(tmp_path / "unmapped.png", random.integers(0, 255, (90, 120, 3), np.uint8))
    (tmp_path / "gloss.toml").write_text("roughness = 0.5")
    views = random.integers(0, 255, (3, 3, 90, 120, 3), np.uint8)
    (tmp_path / "views").mkdir()
    for row, column in np.ndindex(3, 3):
        write_image(tmp_path / "views" / f"v{row}_u{column}.png", views[row, column])
    made = ("field", "gloss.toml", "map.pfm", "picture.png", "scene.png", "unmapped.png", "views")
    places = [tmp_path / word if word in made else word for word in words]
    kernels = tmp_path / "kernels"
    shutil.copytree(SHIPPED, kernels)
    before = kernels_in(kernels)
    run("viewer", *places, IIBR_KERNELS=str(kernels))
    assert kernels_in(kernels) == before, "compile them with: make kernels"
