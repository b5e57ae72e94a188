"""A plain installation without any of the extras: what it does, and what it says about the rest."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.viewer.cli.conftest import Iibr, contents, output_of, refusal_of

ROOT = Path(__file__).parents[3]
EXTRAS = (
    "torch", "transformers", "scipy", "skimage", "jinja2", "flip_evaluator", "matplotlib", "cv2", "distributed",
)  # fmt: skip


def run_plain(*words: object) -> subprocess.CompletedProcess[str]:
    """Run `iibr` in a process of its own in which these packages cannot be imported."""
    code = f"import sys; sys.modules.update(dict.fromkeys({EXTRAS!r})); from viewer.entry import command; command()"
    command = [sys.executable, "-P", "-c", code, *map(str, words)]
    return subprocess.run(command, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True)


def test_viewing_needs_no_extra(photo_path: Path, tmp_path: Path) -> None:
    output_of(run_plain("screenshot", photo_path, "--view", "1,0", "--size", "96x64", "-o", tmp_path / "picture.png"))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("train --steps 1 -o w.safetensors", "torch; install with: pip install 'iibr[train]'"),
        ("evaluate . -o report", "flip_evaluator; install with: pip install 'iibr[evaluate]'"),
        ("batch . --to depth -o out --dask tcp://127.0.0.1:1", "pip install 'iibr[batch]'"),
        ("plan scene.png --depth-model depth-pro", "pip install 'iibr[depth]'"),
    ],
)
def test_a_missing_package_is_named_in_one_line(
    iibr: Iibr, monkeypatch: pytest.MonkeyPatch, photo_path: Path, words: str, message: str
) -> None:
    monkeypatch.chdir(photo_path.parent)
    monkeypatch.setattr("iibr_core.runtime.extras.find_spec", lambda name: None if name in EXTRAS else object())
    before = contents(Path())
    assert message in refusal_of(iibr(*words.split()))
    assert contents(Path()) == before
