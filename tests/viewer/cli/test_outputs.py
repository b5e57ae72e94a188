"""What commands write: never onto what they read, over other things by --force only; refused before any work."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.forked_iibr import run_forked
from tests.viewer.cli.test_cli import run

INPUTS = (
    "{dir}/field/input_Cam000.png",
    "{dir}/link.png",
    "{dir}/hard.png",
    "{dir}/../{dir.name}/field/input_Cam000.png",
)


@pytest.fixture
def folder(photo_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A light field whose first view has two more names, a picture of this program, a map, a model's folder."""
    folder = photo_path.parent
    assert run(monkeypatch, "generate", photo_path, "--grid", 1, "--out", folder / "field") == 0
    assert run(monkeypatch, "screenshot", photo_path, "--grid", 1, "-o", folder / "saved.png") == 0
    view = folder / "field" / "input_Cam000.png"
    (folder / "link.png").symlink_to(view)
    (folder / "hard.png").hardlink_to(view)
    (folder / "linked-field").symlink_to("field")
    (folder / "map.png").write_bytes(view.read_bytes())
    (folder / "scene_depth.png").write_bytes(view.read_bytes())
    (folder / "model").mkdir()
    (folder / "gloss.png").write_text("roughness = 0.3")
    (folder / "keys.gif").write_text("0 0\n1 0\n")
    frame = {"transform_matrix": np.eye(4).tolist(), "w": 32, "h": 24, "fl_x": 50.0}
    (folder / "cameras").mkdir()
    (folder / "cameras" / "transforms.json").write_text(json.dumps({"frames": [frame]}))
    return folder


@pytest.mark.parametrize(
    "words",
    [
        *(("screenshot", INPUTS[0], "-o", target) for target in INPUTS),
        ("screenshot", INPUTS[1], "-o", INPUTS[2]),
        ("screenshot", "{dir}/field", "-o", "{dir}/field/new.png"),
        ("screenshot", "{dir}/linked-field", "-o", "{dir}/field/input_Cam000.png"),
        ("screenshot", "{photo}", "--like", "{dir}/saved.png", "-o", "{dir}/saved.png"),
        ("screenshot", "{photo}", "--disparity", "{dir}/map.png", "-o", "{dir}/map.png"),
        ("screenshot", "{photo}", "--depth-model", "{dir}/model", "-o", "{dir}/model/new.png"),
        ("generate", INPUTS[1], "--grid", "1", "--out", "{dir}/field"),
        ("generate", "{photo}", "--disparity", "{dir}/field/gt_disp_lowres.pfm", "--grid", "1", "--out", "{dir}/field"),
        ("generate", "{dir}/link.png", "--grid", "1", "--out", "{dir}/linked-field"),
        ("screenshot", "{photo}", "--gloss", "{dir}/gloss.png", "-o", "{dir}/gloss.png"),
        ("screenshot", "{photo}", "--inpaint", "diffusion:{dir}/model", "-o", "{dir}/model/new.png"),
        ("export", "{photo}", "--to", "anaglyph", "--gloss", "{dir}/gloss.png", "-o", "{dir}/gloss.png"),
        ("export", "{photo}", "--to", "gif", "--path", "{dir}/keys.gif", "-o", "{dir}/keys.gif"),
        ("generate", "{photo}", "--grid", "1", "--gloss", "{dir}/field/gloss.toml", "--out", "{dir}/field"),
        ("generate", "{photo}", "--poses", "{dir}/cameras/transforms.json", "--out", "{dir}/cameras"),
        ("depth", "{dir}/field", "-o", "{dir}/field/gt_disp_lowres.pfm"),
        ("evaluate", "{dir}/field", "--lpips", "{dir}/model", "--out", "{dir}/model"),
        ("evaluate", "{dir}/field", "--out", "{dir}/field"),
        ("evaluate", "{dir}/linked-field", "--out", "{dir}/field/report"),
        ("evaluate", "{dir}/field", "--out", "{dir}"),
        ("evaluate", "{dir}/field", "--disparity", "{dir}/link.png", "--out", "{dir}/linked-field"),
    ],
)
def test_no_command_writes_onto_what_it_reads(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    photo_path: Path,
    folder: Path,
    words: tuple[str, ...],
) -> None:
    if "field/gloss.toml" in str(words):
        (folder / "field" / "gloss.toml").write_text("roughness = 0.3")
    before = {path: path.is_file() and path.read_bytes() for path in folder.rglob("*")}
    capsys.readouterr()
    assert run(monkeypatch, *(word.format(dir=folder, photo=photo_path) for word in words), "--force") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("iibr: ")
    assert re.search("is read|are read|holds other files", line)
    assert {path: path.is_file() and path.read_bytes() for path in folder.rglob("*")} == before


def test_the_map_beside_the_photo_is_read_too(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path, folder: Path
) -> None:
    (folder / "scene_disparity.npy").unlink()
    assert run(monkeypatch, "screenshot", photo_path, "-o", folder / "scene_depth.png", "--force") == 2
    assert "is read here" in capsys.readouterr().err


def test_an_empty_folder_and_links_are_written_to(
    monkeypatch: pytest.MonkeyPatch, photo_path: Path, tmp_path: Path
) -> None:
    (tmp_path / "disk" / "empty").mkdir(parents=True)
    for name in ("empty", "dangling", "picture.png"):
        (tmp_path / name).symlink_to(Path("disk") / name)
    for name in ("empty", "dangling"):
        assert run(monkeypatch, "generate", photo_path, "--grid", 1, "--out", tmp_path / name) == 0
    assert run(monkeypatch, "screenshot", photo_path, "--grid", 1, "-o", tmp_path / "picture.png") == 0
    assert sorted(path.name for path in (tmp_path / "disk").iterdir()) == ["dangling", "empty", "picture.png"]
    assert all((tmp_path / name).is_symlink() for name in ("empty", "dangling", "picture.png"))
    assert not list(tmp_path.glob(".*"))


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (
            ("screenshot", "-o", "o.gif"),
            "o.gif: can be written as .png, .jpg, .jpeg, .tif, .tiff, .exr, .webp, .avif only",
        ),
        (("screenshot", "-o", "o.jpg", "--bits", "16"), "o.jpg: JPEG is written with 8 bits a channel, not 16"),
        (("screenshot", "-o", "none/o.png"), "the folder none does not exist"),
        (("screenshot", "-o", "o.png", "--size", "16384x16384"), "16384x16384 px"),
        (("screenshot", "-o", "{long}.png"), "File name too long"),
        (("generate", "--grid", "3", "--out", "{long}"), "File name too long"),
        (("generate", "--grid", "3", "--out", "file/field"), "file is a file"),
        (("generate", "--grid", "3", "--out", "."), "holds photo.png"),
    ],
)
def test_what_can_be_refused_is_refused_before_the_photo_is_read(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    words: tuple[str, ...],
    named: str,
) -> None:
    """It is none, which nobody finds out."""
    monkeypatch.chdir(tmp_path)
    Path("photo.png").write_text("no photo")
    Path("file").touch()
    command, *options = (word.format(long="n" * 299) for word in words)
    assert run(monkeypatch, command, "photo.png", *options) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert named in line


@pytest.mark.parametrize("is_file", [True, False])
def test_demo_says_in_one_line_where_it_cannot_write(tmp_path: Path, is_file: bool) -> None:
    if is_file:
        (tmp_path / "out").touch()
    else:
        (tmp_path / "out").symlink_to("gone/out")
    done = run_forked("demo", cwd=tmp_path)
    assert (done.returncode, done.stdout, len(done.stderr.splitlines())) == (2, "", 1)
    assert done.stderr.startswith("iibr: out: ")


def test_notes_come_after_the_result_or_not_at_all(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], photo_path: Path, tmp_path: Path
) -> None:
    words = ("--grid", 3, "--depth", "rough", "--refine", "off")
    with monkeypatch.context() as small:
        small.setattr("iibr_core.method.memory.free_memory_bytes", lambda: 10**5)
        assert run(monkeypatch, "generate", photo_path, *words, "--out", tmp_path / "f") == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "lower --grid" in line
    assert run(monkeypatch, "generate", photo_path, *words, "--out", tmp_path / "f") == 0
    assert all(line.startswith("note: ") for line in capsys.readouterr().err.splitlines())
