"""Batches in this process: which photos are exported, skipped and listed as failed. Nothing is written to inputs."""

import csv
import os
from concurrent.futures import Future, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from iibr_core.exports import batch
from iibr_core.exports.batch import BatchCount, BatchSettings, check_batch_folder, photos_in, run_batch
from iibr_core.scenes.scene import Source
from iibr_core.types import InputError

DEPTH, RGBD = BatchSettings("depth", Source("")), BatchSettings("rgbd", Source(""))


class OneThread(ThreadPoolExecutor):
    """Runs tasks in this process. A photo named "killer" breaks the pool, as a killed process does."""

    def __init__(self, *_: Any) -> None:
        super().__init__(1)
        self.is_broken = False

    def submit(self, work: Any, /, *arguments: Any, **options: Any) -> Any:
        if self.is_broken:
            raise BrokenProcessPool
        if arguments[0].photo.stem != "killer":
            return super().submit(work, *arguments)
        self.is_broken = True
        future: Future[Any] = Future()
        future.set_exception(BrokenProcessPool())
        return future


@pytest.fixture(autouse=True)
def in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(batch, "ProcessPoolExecutor", OneThread)
    for variable in ("IIBR_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        monkeypatch.setenv(variable, "2")


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    folder = tmp_path / "photos"
    write_photos(folder, "a.png", "sub/b.png")
    return folder


def write_photos(folder: Path, *names: str) -> None:
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        pixels = np.random.default_rng(0).integers(0, 255, (24, 32, 3)).astype(np.uint8)
        Image.fromarray(pixels).save(folder / name)


def write_map(path: Path) -> None:
    Image.fromarray(np.tile(np.arange(0, 256, 8, dtype=np.uint8), (24, 1))).save(path)


def export(archive: Path, settings: BatchSettings = DEPTH, force: bool = False) -> BatchCount:
    out = archive.with_name("out")
    check_batch_folder(out, [archive], force)
    return run_batch(photos_in([archive]), settings, out, [archive], workers=2, force=force)


def failures(out: Path) -> dict[str, str]:
    rows = csv.DictReader((out / "failures.csv").read_text().splitlines())
    return {Path(row["photo"]).name: row["reason"] for row in rows}


def files(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*") if path.is_file()}


def test_a_second_run_exports_what_is_missing_or_older_than_its_photo_or_map(archive: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert export(archive) == BatchCount(written=2, guessed=2)
    assert files(out) == {"a_depth.pfm", "sub/b_depth.pfm", "failures.csv"}
    assert export(archive) == BatchCount(there_before=2)
    (out / "a_depth.pfm").unlink()
    assert export(archive) == BatchCount(written=1, there_before=1, guessed=1)
    write_photos(archive, "a.png")
    assert export(archive) == BatchCount(written=1, there_before=1, guessed=1)
    write_map(archive / "a_disparity.png")
    assert export(archive) == BatchCount(written=1, there_before=1)
    assert export(archive, force=True) == BatchCount(written=2, guessed=1)


def test_every_photo_of_a_mixed_folder_is_exported_and_no_map(archive: Path, tmp_path: Path) -> None:
    """Photos named like maps are exported, and photos that share a name get names of their own."""
    write_photos(archive, "b.jpg", "b.png", "c.jpg", "shallow_depth.jpg")
    write_map(archive / "c_depth.jpg")
    (archive / "broken.jpg").write_bytes(b"\xff\xd8\xff\xe0oops")
    (archive / "notes.txt").write_text("x")
    assert export(archive, RGBD) == BatchCount(written=6, failed=1, guessed=5)
    written = {name for name in files(tmp_path / "out") if name.endswith(".png")}
    assert written == {"a.png", "b.jpg.png", "b.png.png", "c.png", "shallow_depth.png", "sub/b.png"}
    assert list(failures(tmp_path / "out")) == ["broken.jpg"]


def test_names_of_outputs_repeat_subfolders_and_differ(tmp_path: Path) -> None:
    one, two = tmp_path / "one", tmp_path / "two"
    write_photos(one, "a.jpg", "A.tif", "c.png", "c.png.png", "d.x.png", ".hidden.png", ".h/x.png")
    write_photos(two, "sub/a.png")
    (two / "round").symlink_to(two)
    names = [name for _, name in photos_in([one, two])]
    assert {"one/A.tif", "one/a.jpg", "one/d.x", "two/sub/a"} < set(names)
    assert len({name.casefold() for name in names}) == len(names) == 6
    assert [name for _, name in photos_in([two])] == ["sub/a"]
    for folders, message in (([one, tmp_path / "other" / "one"], "one: two folders"), ([tmp_path / "gone"], "no such")):
        folders[-1].mkdir(parents=True) if len(folders) > 1 else None
        with pytest.raises(InputError, match=message):
            photos_in(folders)


def test_an_unexpected_error_fails_its_photo_and_leaves_a_traceback(
    monkeypatch: pytest.MonkeyPatch, archive: Path, tmp_path: Path
) -> None:
    open_for_export = batch.open_for_export

    def fail(kind: Any, options: Any, source: Source, *arguments: Any) -> Any:
        if source.path.endswith("a.png"):
            raise ZeroDivisionError("a bug")
        return open_for_export(kind, options, source, *arguments)

    with monkeypatch.context() as patch:
        patch.setattr(batch, "open_for_export", fail)
        assert export(archive) == BatchCount(written=1, failed=1, guessed=1)
    assert failures(tmp_path / "out")["a.png"].startswith("unexpected ZeroDivisionError: a bug")
    assert "Traceback" in (tmp_path / "out" / "failures.log").read_text()
    assert export(archive) == BatchCount(written=1, there_before=1, guessed=1)
    assert not failures(tmp_path / "out")
    assert not (tmp_path / "out" / "failures.log").exists()


@pytest.mark.parametrize("force", [False, True])
def test_photos_are_not_overwritten_through_links(archive: Path, tmp_path: Path, force: bool) -> None:
    before = {name: (archive / name).read_bytes() for name in files(archive)}
    (tmp_path / "out").mkdir()
    for name, photo in (("failures.csv", "a.png"), ("a_depth.pfm", "sub/b.png"), ("sub", "sub")):
        (tmp_path / "out" / name).symlink_to(archive / photo)
    os.utime(archive / "a.png", (4e9, 4e9))  # newer than what its output leads to
    assert export(archive, force=force).failed == 2
    assert {name: (archive / name).read_bytes() for name in files(archive)} == before


def test_outputs_go_into_an_empty_folder_or_one_of_a_batch_unless_forced(archive: Path, tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "mine.txt").touch()
    with pytest.raises(InputError, match="already exists"):
        export(archive)
    with pytest.raises(InputError, match="in the input"):
        check_batch_folder(archive / "out", [archive], force=True)
    assert export(archive, force=True).written == 2
