"""Outputs of commands: inputs are never overwritten, other files with --force only; refused before any work."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.viewer.cli.conftest import contents, output_of, refusal_of

VIEW = "field/input_Cam000.png"


@pytest.fixture
def folder(iibr, photo_path, monkeypatch):
    """The working folder: a light field, a picture of this program, a map, a model."""
    folder = photo_path.parent
    monkeypatch.chdir(folder)
    output_of(iibr("generate", photo_path, "--grid", 1, "-o", "field"))
    output_of(iibr("screenshot", photo_path, "--grid", 1, "-o", "saved.png"))
    Path("linked-field").symlink_to("field")
    for name in ("map.png", "mapped.png", "mapped_depth.png"):
        Path(name).write_bytes(Path(VIEW).read_bytes())
    Path("model").mkdir()
    Path("gloss.png").write_text("roughness = 0.3")
    Path("field/gloss.toml").write_text("roughness = 0.3")
    Path("keys.gif").write_text("0 0\n1 0\n")
    frame = {"transform_matrix": np.eye(4).tolist(), "w": 32, "h": 24, "fl_x": 50.0}
    Path("cameras").mkdir()
    Path("cameras/transforms.json").write_text(json.dumps({"frames": [frame]}))
    return folder


def test_no_command_writes_onto_what_it_reads(iibr, folder):
    commands = [
        f"screenshot {VIEW} -o {VIEW}",
        "screenshot field -o field/new.png",
        f"screenshot linked-field -o {VIEW}",
        "screenshot scene.png --like saved.png -o saved.png",
        "screenshot scene.png --disparity map.png -o map.png",
        "screenshot mapped.png -o mapped_depth.png",
        "screenshot scene.png --depth-model model -o model/new.png",
        "generate scene.png --disparity field/gt_disp_lowres.pfm --grid 1 -o field",
        "screenshot scene.png --gloss gloss.png -o gloss.png",
        "screenshot scene.png --inpaint diffusion:model -o model/new.png",
        "export scene.png --to anaglyph --gloss gloss.png -o gloss.png",
        "export scene.png --to gif --path keys.gif -o keys.gif",
        "generate scene.png --grid 1 --gloss field/gloss.toml -o field",
        "generate scene.png --poses cameras/transforms.json -o cameras",
        "depth field -o field/gt_disp_lowres.pfm",
        "evaluate field --lpips model -o model",
        "evaluate field -o field",
        "evaluate field -o .",
        "evaluate linked-field -o field/report",
    ]
    before = contents(folder)
    for command in commands:
        line = refusal_of(iibr(*command.split(), "--force"))
        assert re.search("is an input|never overwritten|nothing is written|holds other files", line), command
        assert contents(folder) == before, command


def test_notes_come_after_the_result_and_not_with_an_error(iibr, monkeypatch, photo_path, tmp_path):
    words = ("generate", photo_path, "--grid", 3, "--depth", "rough", "--refine", "off", "-o", tmp_path / "field")
    with monkeypatch.context() as small:
        small.setattr("iibr_core.method.memory.free_memory_bytes", lambda: 10**5)
        assert refusal_of(iibr(*words)).endswith("lower --grid, or --max-pixels for a photo")
    done = iibr(*words)
    output_of(done)
    assert all(line.startswith("note: ") for line in done.stderr.splitlines())
    assert "note: Depth: rough, guessed without a model. Better: " in done.stderr
