import os
import subprocess
import sys
from contextlib import suppress
from itertools import product
from pathlib import Path

import pytest

from iibr_core.formats.files import open_binary, read_text, require_file
from iibr_core.formats.outputs import AlreadyThereError, check_output, check_output_folder, write_file, write_folder
from iibr_core.types import InputError


@pytest.mark.parametrize(
    ("name", "says"),
    [("gone", "no such file"), ("loop", "cannot be read"), ("folder", "is a folder"),
     ("empty", "the file is empty"), ("pipe", "is a pipe or a device"), ("device", "is a pipe or a device")],
)  # fmt: skip
def test_what_is_no_file_to_read_is_named_as_what_it_is(tmp_path, name, says) -> None:
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "folder").mkdir()
    (tmp_path / "empty").touch()
    (tmp_path / "device").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match=says):
        require_file(tmp_path / name)
    with pytest.raises(InputError, match=says), open_binary(tmp_path / name):
        pass


def test_text_is_bounded_and_its_byte_order_mark_goes(tmp_path) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbf" + "größe\xff".encode() + b"\xff")
    assert read_text(path, 100) == "größeÿ\ufffd"
    with pytest.raises(InputError, match="larger than 5 bytes"):
        read_text(path, 5)


@pytest.fixture
def photo(tmp_path) -> Path:
    path = tmp_path / "in" / "photo.png"
    path.parent.mkdir()
    path.write_text("photo")
    (tmp_path / "link.png").symlink_to(path)
    (tmp_path / "folder").symlink_to(path.parent)
    os.link(path, tmp_path / "hard.png")
    return path


@pytest.mark.parametrize("name", ["in/photo.png", "link.png", "folder/photo.png", "hard.png", "in/../in/photo.png"])
def test_no_input_is_overwritten_whatever_its_name(photo, tmp_path, name) -> None:
    with pytest.raises(InputError, match="never overwritten"):
        check_output(tmp_path / name, [photo], may_replace=True)
    for new, check in product(("in/new.png", "folder/new.png"), (check_output, check_output_folder)):
        with pytest.raises(InputError, match="input"):
            check(tmp_path / new, [photo.parent])


def test_what_exists_is_replaced_only_where_that_is_allowed(photo, tmp_path) -> None:
    with pytest.raises(AlreadyThereError, match="already exists"):
        check_output(photo)
    with pytest.raises(AlreadyThereError, match="already exists"):
        check_output_folder(photo.parent)
    check_output(photo, may_replace=True)
    check_output_folder(photo.parent, may_replace=True, own_files=r"photo\.png")
    with pytest.raises(InputError, match=r"other files \(photo\.png\)"):
        check_output_folder(photo.parent, may_replace=True, own_files=r"view_\d+\.png")
    (tmp_path / "empty").mkdir()
    check_output_folder(tmp_path / "empty")


@pytest.mark.parametrize(
    ("name", "reason"),
    [("in", "is a folder"), ("gone/a.png", "does not exist"), ("in/photo.png/a.png", "does not exist"),
     ("a\0.png", "no place to write to"), ("/dev/null", "device or a pipe")],
)  # fmt: skip
def test_places_where_no_file_can_be(photo, tmp_path, name, reason) -> None:
    with pytest.raises(InputError, match=reason):
        check_output(tmp_path / name, may_replace=True)


def test_half_a_file_leaves_what_was_there_and_nothing_beside_it(tmp_path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("before")
    with suppress(ZeroDivisionError), write_file(path) as unfinished:
        unfinished.write_text("half")
        _ = 1 / 0
    assert path.read_text() == "before"
    with write_file(path) as unfinished:
        unfinished.write_text("after")
    assert path.read_text() == "after"
    assert list(tmp_path.iterdir()) == [path]
    with pytest.raises(InputError, match="gone does not exist"), write_file(tmp_path / "gone" / "a.txt"):
        pass


def test_the_next_output_of_a_folder_removes_what_a_killed_process_left(tmp_path) -> None:
    code = "import os, sys; from pathlib import Path; from iibr_core.formats.outputs import write_file\n"
    code += "with write_file(Path(sys.argv[1])) as path: path.write_text('half'); os.kill(os.getpid(), 9)"
    with write_file(tmp_path / "a.txt") as unfinished:
        subprocess.run([sys.executable, "-c", code, tmp_path / "b.txt"], check=False)
        unfinished.write_text("of a process that lives")
        with write_file(tmp_path / "c.txt") as other:
            other.write_text("at the same time")
    assert {path.name for path in tmp_path.iterdir()} == {"a.txt", "c.txt"}


def test_a_folder_is_replaced_whole_or_not_at_all(tmp_path) -> None:
    folder = tmp_path / "above" / "field"
    for text in ("first", "second"):
        with write_folder(folder) as unfinished:
            (unfinished / f"{text}.txt").write_text(text)
        assert [path.name for path in folder.iterdir()] == [f"{text}.txt"]
    with suppress(ZeroDivisionError), write_folder(folder):
        _ = 1 / 0
    with pytest.raises(InputError, match="cannot be written"), write_folder(folder) as unfinished:
        unfinished.rmdir()  # the old folder has made way when the new one cannot take its place
    assert [path.name for path in folder.iterdir()] == ["second.txt"]
    assert list(folder.parent.iterdir()) == [folder]


def test_links_are_followed_and_stay(tmp_path) -> None:
    (tmp_path / "disk").mkdir()
    (tmp_path / "a.txt").symlink_to(tmp_path / "disk" / "b.txt")
    check_output(tmp_path / "a.txt")
    with write_file(tmp_path / "a.txt") as unfinished:
        unfinished.write_text("text")
    assert (tmp_path / "a.txt").is_symlink()
    assert (tmp_path / "disk" / "b.txt").read_text() == "text"
