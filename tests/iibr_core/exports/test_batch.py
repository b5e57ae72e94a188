import csv
import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from iibr_core.exports import batch
from iibr_core.exports.batch import BatchCount, BatchSettings, check_batch_folder, photos_in, run_batch
from iibr_core.exports.photo_folder import FolderPhoto, first_photo, in_order, list_photos
from iibr_core.formats.images.write import write_image
from iibr_core.scenes.scene import Source
from iibr_core.types import InputError

DEPTH, RGBD = BatchSettings("depth", Source("")), BatchSettings("rgbd", Source(""))


@pytest.fixture(autouse=True)
def in_this_process(monkeypatch) -> None:
    monkeypatch.setattr(batch, "ProcessPoolExecutor", lambda *_: ThreadPoolExecutor(1))
    for variable in ("IIBR_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
        monkeypatch.setenv(variable, "2")


@pytest.fixture
def archive(tmp_path) -> Path:
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


def test_a_second_run_exports_what_is_missing_or_older_than_its_photo_or_map(archive, tmp_path) -> None:
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


def test_every_photo_of_a_mixed_folder_is_exported_and_no_map(archive, tmp_path) -> None:
    write_photos(archive, "b.jpg", "b.png", "c.jpg", "shallow_depth.jpg")
    write_map(archive / "c_depth.jpg")
    (archive / "broken.jpg").write_bytes(b"\xff\xd8\xff\xe0oops")
    (archive / "notes.txt").write_text("x")
    assert export(archive, RGBD) == BatchCount(written=6, failed=1, guessed=5)
    written = {name for name in files(tmp_path / "out") if name.endswith(".png")}
    assert written == {"a.png", "b.jpg.png", "b.png.png", "c.png", "shallow_depth.png", "sub/b.png"}
    assert list(failures(tmp_path / "out")) == ["broken.jpg"]


def test_names_of_outputs_repeat_subfolders_and_differ(tmp_path) -> None:
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


def test_an_unexpected_error_fails_its_photo_and_leaves_a_traceback(monkeypatch, archive, tmp_path) -> None:
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
def test_photos_are_not_overwritten_through_links(archive, tmp_path, force) -> None:
    before = {name: (archive / name).read_bytes() for name in files(archive)}
    (tmp_path / "out").mkdir()
    for name, photo in (("failures.csv", "a.png"), ("a_depth.pfm", "sub/b.png"), ("sub", "sub")):
        (tmp_path / "out" / name).symlink_to(archive / photo)
    os.utime(archive / "a.png", (4e9, 4e9))  # newer than what its output leads to
    assert export(archive, force=force).failed == 2
    assert {name: (archive / name).read_bytes() for name in files(archive)} == before


GREY = np.full((4, 6, 3), 100, np.uint8)


def test_maps_folders_of_maps_hidden_files_and_others_are_no_photos(tmp_path) -> None:
    """Nor is what was saved or exported of a photo."""
    photos = {"A.JPG", "b_rgb.png", "low_depth.jpg", "A-b.png", "gone-iibr.png", "A-iibre.png", "-iibr.png"}
    maps = {"A-Depth (1).PNG", "A_depth.exr", "A_disparity.png", "b_depth.png", ".c.png", "d.txt"}
    made = {"A-iibr.png", "A-quilt_qs8x6a1.482.png", "A-sbs_2x1.png", "A-rgbd.jpg", "A-b-anaglyph.jpg"}
    below = {"rgb/1.png", "deep/depth/1.png"}
    for name in (*photos, *maps, *made, *below, "depth/1.png", "folder.jpg/x.txt"):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(b"-")
    assert {photo.name for photo in list_photos(str(tmp_path))} == photos
    assert {str(path.relative_to(tmp_path)) for path, _ in photos_in([tmp_path])} == photos | below
    assert list_photos(str(tmp_path / "gone")) == ()
    shots = [FolderPhoto("IMG_10.png", 2.0), FolderPhoto("IMG_9.png", 3.0), FolderPhoto("a.png", 1.0)]
    assert [photo.name for photo in in_order(shots, "name")] == ["a.png", "IMG_9.png", "IMG_10.png"]
    assert [photo.name for photo in in_order(shots, "time")] == ["a.png", "IMG_10.png", "IMG_9.png"]


@pytest.mark.parametrize("inside", ["", "views"])
def test_a_light_field_is_no_folder_of_photos_also_in_views(tmp_path, inside) -> None:
    assert first_photo(tmp_path) is None
    (tmp_path / inside).mkdir(exist_ok=True)
    for v, u in np.ndindex(2, 2):
        write_image(tmp_path / inside / f"v{v:02d}_u{u:02d}.png", GREY)
    assert first_photo(tmp_path) is None


@pytest.mark.parametrize("names", [[f"DSC_{i:04d}.jpg" for i in range(4)], ["beach.png", "sea.png", "view.png"]])
def test_pictures_of_a_camera_and_others_that_are_no_grid_are_photos(tmp_path, names) -> None:
    for name in names:
        Image.fromarray(GREY).save(tmp_path / name)
    assert first_photo(tmp_path) == tmp_path / names[0]
