"""An installation that brings its kernels along: nothing is compiled on the ways that users take first."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from functools import partial
from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.images.photo import write_image
from iibr_core.runtime.compiling import COMPILING
from iibr_core.runtime.tiling import Cancelled
from tests.viewer.compile_one import compile_one
from tests.viewer.conftest import write_scene
from viewer import precompile
from viewer.precompile import MADE_OF, digest_of_sources, write_kernels

ROOT = Path(__file__).parents[2]


def run_in(site: Path, *words: object, **environment: str) -> str:
    """Run a module of the package in `site`; what it says. Nothing that this process was told about Numba counts."""
    own = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    command = [sys.executable, "-P", "-m", *(str(word) for word in words)]
    env = own | {"PYTHONPATH": str(site)} | environment
    done = subprocess.run(command, env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package at a place where nothing but its kernels was compiled: they come from here where they are complete,
    and of just these sources; else they are compiled, which takes minutes.
    """
    folder = tmp_path_factory.mktemp("site")
    for name in ("iibr_core", "viewer", "shaders", "assets"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "_kernels"))
    kernels = ROOT / "iibr_core" / "_kernels"
    mark = kernels / MADE_OF
    if mark.is_file() and mark.read_text().startswith(digest_of_sources()):
        shutil.copytree(kernels, folder / "iibr_core" / "_kernels")
    run_in(folder, "viewer.precompile", folder / "iibr_core" / "_kernels")
    return folder


def kernels_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*.nb?"))


def test_they_are_few_and_small(site: Path) -> None:
    files = [path for path in (site / "iibr_core" / "_kernels").rglob("*") if path.is_file()]
    assert 100 < len(files) < 400
    assert {path.suffix for path in files} == {".nbi", ".nbc", Path(MADE_OF).suffix}
    assert sum(path.stat().st_size for path in files) < 12e6


def test_they_count_for_their_sources_only(tmp_path: Path) -> None:
    """What an installation has is taken where nothing has changed, and nowhere else."""
    source = tmp_path / "iibr_core" / "rendering" / "rays.py"
    source.parent.mkdir(parents=True)
    source.write_text("STEPS = 1")
    before = digest_of_sources(tmp_path)
    assert digest_of_sources(tmp_path) == before != digest_of_sources(ROOT)
    source.write_text("STEPS = 2")
    assert digest_of_sources(tmp_path) != before


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


@pytest.fixture
def one_step(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(precompile, "STEPS", (compile_one,))


@pytest.mark.usefixtures("one_step")
def test_those_of_other_pythons_stay_where_the_sources_are_the_same(tmp_path: Path) -> None:
    made_of = {"py398": "other sources", "py399": digest_of_sources()}
    for python, text in made_of.items():
        (tmp_path / f"made_of.{python}").write_text(f"{text}\n{python}")
        (tmp_path / f"jit.linear.{python}.nbi").write_text("code")
    (tmp_path / f"jit.gone.{MADE_OF.partition('.')[2]}.nbi").write_text("of a kernel that is no more")
    write_kernels(tmp_path)
    assert {path.name for path in tmp_path.iterdir()} == {"made_of.py399", "jit.linear.py399.nbi", MADE_OF, "runtime"}
    assert any(name.startswith("jit.linear_scalar.") for name in kernels_in(tmp_path / "runtime"))


@pytest.mark.usefixtures("one_step")
def test_what_is_complete_is_left_alone(tmp_path: Path) -> None:
    write_kernels(tmp_path)
    before = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")}
    begun: list[int] = []
    write_kernels(tmp_path, lambda: begun.append(1))
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*")} == before
    assert begun == [1]


@pytest.mark.usefixtures("one_step")
def test_what_was_left_half_done_goes_on(tmp_path: Path) -> None:
    begun: list[list[str]] = []
    with pytest.raises(Cancelled):
        write_kernels(tmp_path, lambda: begun.append(kernels_in(tmp_path)), lambda: bool(begun))
    there = {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nb?")}
    assert len(begun) == 1
    assert [path.name for path in sorted(there, key=lambda path: path.name)] == begun[0] != []
    assert not (tmp_path / MADE_OF).exists()
    write_kernels(tmp_path)
    assert {path: path.stat().st_mtime_ns for path in tmp_path.rglob("*.nb?")} == there
    assert (tmp_path / MADE_OF).exists()


def test_a_command_tells_how_it_ended(site: Path) -> None:
    words = (sys.executable, "-m", "viewer.precompile", site / "iibr_core" / "_kernels")
    command = (sys.executable, "-c", "import os, sys; sys.exit(int(os.environ['NUMBA_OF_MINE']))")
    environment = os.environ | {"NUMBA_OF_MINE": "7"}
    assert subprocess.run([*words, *command], cwd=ROOT, env=environment, check=False).returncode == 7


DEMO = ROOT / "assets" / "motorcycle" / "motorcycle.png"


@pytest.mark.parametrize(
    "words",
    [
        ("screenshot", DEMO, "--max-pixels", 60000, "--aperture", 4, "--size", "160x100", "-o", "picture.png"),
        ("generate", DEMO, "--max-pixels", 60000, "--grid", 3, "--out", "field", "--with-disparity"),
        ("generate", "scene.png", "--grid", 3, "--out", "field", "--quality", "balanced"),
        ("screenshot", "unmapped.png", "--view", "1,1", "-o", "picture.png"),
        ("screenshot", DEMO, "--max-pixels", 250000, "--gloss", "gloss.toml", "-o", "picture.png"),
        ("screenshot", "scene.png", "--max-pixels", 3000, "--full", "--aperture", 3, "-o", "picture.png"),
        ("depth", "views", "-o", "map.pfm"),
    ],
    ids=["screenshot", "generate", "balanced", "guessed", "gloss", "full", "depth"],
)
def test_the_first_run_compiles_nothing(site: Path, tmp_path: Path, words: tuple[object, ...]) -> None:
    write_scene(tmp_path)
    random = np.random.default_rng(0)
    write_image(tmp_path / "unmapped.png", random.integers(0, 255, (90, 120, 3), np.uint8))
    (tmp_path / "gloss.toml").write_text("photo_shines = true\nlight.color = [0, 0, 0]")
    views = random.integers(0, 255, (3, 3, 90, 120, 3), np.uint8)
    (tmp_path / "views").mkdir()
    for row, column in np.ndindex(3, 3):
        write_image(tmp_path / "views" / f"v{row}_u{column}.png", views[row, column])
    made = ("field", "gloss.toml", "map.pfm", "picture.png", "scene.png", "unmapped.png", "views")
    places = [tmp_path / word if word in made else word for word in words]
    run_in(site, "viewer", *places, NUMBA_CACHE_DIR=str(tmp_path / "kept"))
    assert kernels_in(tmp_path / "kept") == []


TERMINAL = {"FORCE_COLOR": "1"}
"""What makes rich take stderr for one."""


def test_another_processor_compiles_its_own_and_says_so(site: Path, tmp_path: Path) -> None:
    write_scene(tmp_path)
    words = ("generate", tmp_path / "scene.png", "--grid", 1, "--depth", "flat", "--quality", "fast")
    kept = {"NUMBA_CACHE_DIR": str(tmp_path / "kept")}
    run = partial(run_in, site, "viewer", *words, **kept, **TERMINAL)
    assert COMPILING not in run("--out", tmp_path / "field")
    assert kernels_in(tmp_path / "kept") == []
    assert COMPILING in run("--out", tmp_path / "another", NUMBA_CPU_NAME="generic")
    assert kernels_in(tmp_path / "kept") != []
