"""A plain installation, without any of the extras: what it does, and what it says about the rest."""

from __future__ import annotations

import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from tests.viewer.conftest import write_scene

ROOT = Path(__file__).parents[3]
EXTRAS = (
    "torch",
    "transformers",
    "scipy",
    "skimage",
    "jinja2",
    "flip_evaluator",
    "matplotlib",
    "cv2",
    "distributed",
)
START = f"""
import sys
sys.modules.update(dict.fromkeys({EXTRAS!r}))  # None: there is no such module
from viewer.entry import command
command()
"""


def run_plain(*words: object) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-P", "-c", START, *(str(word) for word in words)]
    return subprocess.run(command, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True)


@pytest.mark.parametrize(
    "words",
    [
        ("generate", "{photo}", "--grid", 3, "--out", "{dir}/field"),
        ("screenshot", "{photo}", "--view", "1,0", "--size", "96x64", "-o", "{dir}/picture.png"),
        ("batch", "{dir}", "--to", "depth", "-o", "{dir}/../depths"),
    ],
    ids=lambda words: words[0],
)
def test_viewing_needs_no_extra(tmp_path: Path, words: tuple[object, ...]) -> None:
    photo = write_scene(tmp_path)
    done = run_plain(*(str(word).format(photo=photo, dir=tmp_path) for word in words))
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("train", "--steps", 1, "--out", "{dir}/w.safetensors"), "torch; install with: pip install 'iibr[train]'"),
        (("evaluate", "{dir}", "--out", "{dir}/report"), "flip_evaluator; install with: pip install 'iibr[evaluate]'"),
        (
            ("batch", "{dir}", "--to", "depth", "-o", "{dir}/out", "--dask", "tcp://127.0.0.1:1"),
            "pip install 'iibr[batch]'",
        ),
        (("plan", "{photo}", "--depth-model", "depth-pro"), "pip install 'iibr[depth]'"),
    ],
    ids=["train", "evaluate", "batch", "depth model"],
)
def test_what_needs_one_names_it_in_one_line(tmp_path: Path, words: tuple[object, ...], said: str) -> None:
    photo = write_scene(tmp_path)
    before = sorted(tmp_path.iterdir())
    done = run_plain(*(str(word).format(photo=photo, dir=tmp_path) for word in words))
    (line,) = done.stderr.splitlines()
    assert (done.returncode, line.startswith("iibr: "), said in line) == (2, True, True), line
    assert sorted(tmp_path.iterdir()) == before


def test_the_extras_are_no_dependencies() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    assert not [need for need in project["dependencies"] if need.startswith(EXTRAS)]
    assert {"depth", "train", "evaluate"} <= set(project["optional-dependencies"])
