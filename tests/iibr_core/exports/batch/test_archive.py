"""Photos of an archive and the names of their exports."""

from __future__ import annotations

from pathlib import Path

import pytest

from iibr_core.exports.batch.archive import photos_in
from iibr_core.types import InputError


def touch(*paths: Path) -> None:
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()


def names(*folders: Path) -> list[str]:
    return [photo.name for photo in photos_in(folders)]


def test_folders_are_repeated_and_maps_are_no_photos(tmp_path: Path) -> None:
    touch(tmp_path / "b.png", tmp_path / "b_disparity.png", tmp_path / "b_depth.exr", tmp_path / "notes.txt")
    touch(tmp_path / "sub" / "deep" / "a.jpg", tmp_path / ".hidden" / "x.png", tmp_path / "sub" / ".y.png")
    assert names(tmp_path) == ["b", "sub/deep/a"]


def test_no_two_photos_write_one_name(tmp_path: Path) -> None:
    touch(*(tmp_path / name for name in ("a.jpg", "A.heic", "b.png", "c.png", "c.png.png", "d.x.png")))
    found = names(tmp_path)
    assert len({name.casefold() for name in found}) == 6
    assert {"A.heic", "a.jpg", "b", "d.x"} <= set(found)


def test_several_folders_keep_apart(tmp_path: Path) -> None:
    touch(tmp_path / "one" / "a.png", tmp_path / "two" / "a.png", tmp_path / "other" / "one" / "a.png")
    assert names(tmp_path / "one", tmp_path / "two") == ["one/a", "two/a"]
    with pytest.raises(InputError, match="one: two folders"):
        names(tmp_path / "one", tmp_path / "other" / "one")


def test_what_is_no_folder_is_said(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"missing: no such folder"):
        names(tmp_path / "missing")


def test_links_in_a_circle_end(tmp_path: Path) -> None:
    touch(tmp_path / "a.png")
    (tmp_path / "round").symlink_to(tmp_path)
    assert names(tmp_path) == ["a"]
