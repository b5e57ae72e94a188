"""A plain installation without any of the extras: what it does, and what it says about the rest."""

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pillow_heif
import pytest
from PIL import Image

from tests.viewer.cli.conftest import contents, output_of, refusal_of

ROOT = Path(__file__).parents[3]
EXTRAS = (
    "torch", "transformers", "scipy", "skimage", "jinja2", "flip_evaluator", "matplotlib", "cv2", "distributed", "av",
    "pillow_heif", "lzfse",
)  # fmt: skip


RUN = """
import sys
sys.modules.update(dict.fromkeys({extras!r}))
from viewer.entry import run
for sys.argv[1:] in {commands!r}:
    if code := run():
        sys.exit(code)
"""


def run_plain(*commands):
    """Run `iibr` with these words, in a process of its own in which packages of extras cannot be imported."""
    command = [sys.executable, "-P", "-c", RUN.format(extras=EXTRAS, commands=commands)]
    return subprocess.run(command, env=os.environ | {"PYTHONPATH": str(ROOT)}, capture_output=True, text=True)


def test_heic_photos_are_viewed_and_become_loops_and_pages_without_an_extra(tmp_path):
    photo, files = str(tmp_path / "photo.heic"), {kind: tmp_path / f"a.{kind}" for kind in ("png", "gif", "webp")}
    files["web"] = tmp_path / "a.html"
    pillow_heif.from_pillow(Image.radial_gradient("L").resize((96, 64)).convert("RGB")).save(photo)
    np.save(tmp_path / "photo_disparity.npy", np.linspace(-1, 1, 96 * 64, dtype=np.float32).reshape(64, 96))
    commands = [["export", photo, "--grid", "3", "--to", kind, "-o", str(file)] for kind, file in files.items()]
    commands[0] = ["screenshot", photo, "--view", "1,0", "--size", "96x64", "-o", str(files["png"])]
    output_of(run_plain(*commands))
    assert all(file.stat().st_size > 1000 for file in files.values())


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("train --steps 1 -o w.safetensors", "torch; install with: pip install 'iibr[train]'"),
        ("evaluate . -o report", "flip_evaluator; install with: pip install 'iibr[evaluate]'"),
        ("batch . --to depth -o out --dask tcp://127.0.0.1:1", "pip install 'iibr[batch]'"),
        ("export scene.png --to mp4 -o a.mp4", "av; install with: pip install 'iibr[export]' (PyAV and pillow-heif"),
        ("export scene.png --to spatial-photo -o a.heic", "this needs pillow_heif; install with: pip install"),
        ("export scene.png --to webm -o a.webm", "encoders under the GPL, x264 and x265"),
        ("plan scene.png --depth-model depth-pro", "pip install 'iibr[depth]'"),
    ],
)
def test_a_missing_package_is_named_in_one_line(iibr, monkeypatch, photo_path, words, message):
    monkeypatch.chdir(photo_path.parent)
    monkeypatch.setattr("iibr_core.runtime.extras.find_spec", lambda name: None if name in EXTRAS else object())
    before = contents(Path())
    assert message in refusal_of(iibr(*words.split()))
    assert contents(Path()) == before
