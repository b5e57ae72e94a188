"""An installation that brings its kernels along: nothing is compiled on the ways that users take first."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.images.photo import write_image
from iibr_core.runtime import kernel_cache
from tests.viewer.conftest import write_scene
from viewer.precompile import MADE_OF, digest_of_sources, write_kernels

ROOT = Path(__file__).parents[2]


def run_in(site: Path, *words: object, **environment: str) -> str:
    """Run a module of the package in `site`; what it prints. Nothing that this process was told about Numba counts."""
    own = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA_")}
    command = [sys.executable, "-P", "-m", *(str(word) for word in words)]
    env = own | {"PYTHONPATH": str(site)} | environment
    done = subprocess.run(command, env=env, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The package at a place where it was not compiled, and never wrote to."""
    folder = tmp_path_factory.mktemp("site")
    for name in ("iibr_core", "viewer", "shaders", "assets"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", "_kernels"))
    run_in(ROOT, "viewer.precompile", folder / "iibr_core" / "_kernels")
    return folder


def kernels_in(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.rglob("*.nb?"))


def test_they_are_few_and_small(site: Path) -> None:
    files = [path for path in (site / "iibr_core" / "_kernels").rglob("*") if path.is_file()]
    assert 100 < len(files) < 400
    assert {path.suffix for path in files} == {".nbi", ".nbc", ".sha256"}
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


def test_a_copy_that_was_cut_off_does_not_count(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    kept, copy = tmp_path / "kept", tmp_path / "copy"
    kept.mkdir()
    (kept / MADE_OF).write_text(digest_of_sources())
    (kept / "a.nbi").symlink_to("nowhere")
    monkeypatch.setattr(kernel_cache, "PRECOMPILED", kept)
    with pytest.raises(shutil.Error):
        write_kernels(copy)
    assert not (copy / MADE_OF).exists()
    (kept / "a.nbi").unlink()
    (kept / "a.nbi").write_bytes(b"code")
    write_kernels(copy)
    assert {path.name: path.read_text() for path in copy.iterdir()} == {"a.nbi": "code", MADE_OF: digest_of_sources()}


DEMO = ROOT / "assets" / "motorcycle" / "motorcycle.png"


@pytest.mark.parametrize(
    "words",
    [
        ("screenshot", DEMO, "--max-pixels", 60000, "--aperture", 4, "--size", "160x100", "-o", "picture.png"),
        ("generate", DEMO, "--max-pixels", 60000, "--grid", 3, "--out", "field", "--with-disparity"),
        ("generate", "scene.png", "--grid", 3, "--out", "field", "--quality", "exact"),
        ("screenshot", "unmapped.png", "--view", "1,1", "-o", "picture.png"),
        ("screenshot", DEMO, "--max-pixels", 250000, "--gloss", "gloss.toml", "-o", "picture.png"),
        ("screenshot", "scene.png", "--max-pixels", 3000, "--full", "--aperture", 3, "-o", "picture.png"),
        ("depth", "views", "-o", "map.pfm"),
    ],
    ids=["screenshot", "generate", "exact", "guessed", "gloss", "full", "depth"],
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


def test_another_processor_compiles_its_own(site: Path, tmp_path: Path) -> None:
    write_scene(tmp_path)
    words = ("generate", tmp_path / "scene.png", "--grid", 1, "--refine", "off", "--quality", "fast")
    kept = tmp_path / "kept"
    run_in(site, "viewer", *words, "--out", tmp_path / "field", NUMBA_CACHE_DIR=str(kept), NUMBA_CPU_NAME="generic")
    assert kernels_in(kept) != []
