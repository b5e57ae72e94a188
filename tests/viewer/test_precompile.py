"""An installation that brings its kernels along compiles nothing for the commands that people use first."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np

from iibr_core.formats.images.write import write_image
from tests.viewer.conftest import write_scene

ROOT = Path(__file__).parents[2]
SHIPPED = ROOT / "iibr_core" / "_kernels"
DEMO = ROOT / "assets" / "motorcycle" / "motorcycle.png"
COMMANDS = (
    f"screenshot {DEMO} --max-pixels 60000 --aperture 4 --size 160x100 -o picture.png",
    f"generate {DEMO} --max-pixels 60000 --grid 3 -o field --with-disparity",
    "screenshot unmapped.png --view 1,1 -o unmapped_picture.png",
    f"screenshot {DEMO} --max-pixels 250000 --gloss gloss.toml -o glossy.png",
    "screenshot scene.png --max-pixels 3000 --full --aperture 3 -o full.png",
    "depth views -o map.pfm",
)
RUN = """
import sys
from viewer import entry
for command in sys.argv[1:]:
    sys.argv = ["iibr", *command.split()]
    if entry.run():
        sys.exit(command)
"""


def kernels_in(folder):
    return {path.name: path.stat().st_mtime_ns for path in folder.rglob("*.nb?")}


def test_the_first_runs_compile_nothing(tmp_path):
    """In one process, without the settings of Numba of this one."""
    write_scene(tmp_path)
    random = np.random.default_rng(0)
    write_image(tmp_path / "unmapped.png", random.integers(0, 255, (90, 120, 3), np.uint8))
    (tmp_path / "gloss.toml").write_text("roughness = 0.5")
    (tmp_path / "views").mkdir()
    for row, column in np.ndindex(3, 3):
        write_image(tmp_path / "views" / f"v{row}_u{column}.png", random.integers(0, 255, (90, 120, 3), np.uint8))
    kernels = tmp_path / "kernels"
    shutil.copytree(SHIPPED, kernels)
    before = kernels_in(kernels)
    clean = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    env = clean | {"PYTHONPATH": str(ROOT), "IIBR_KERNELS": str(kernels)}
    done = subprocess.run(
        [sys.executable, "-P", "-c", RUN, *COMMANDS], cwd=tmp_path, env=env, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert kernels_in(kernels) == before, "compile them with: make kernels"
