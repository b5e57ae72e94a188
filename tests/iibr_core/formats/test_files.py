"""Files that are read: anything but an ordinary file is refused by name."""

import os
from pathlib import Path

import pytest

from iibr_core.formats.files import open_binary, read_text, require_file
from iibr_core.types import InputError


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("gone", "no such file"),
        ("loop", "cannot be read"),
        ("folder", "is a folder"),
        ("empty", "the file is empty"),
        ("pipe", "is a pipe or a device"),
        ("device", "is a pipe or a device"),
    ],
)
def test_what_is_no_file_to_read_is_named_as_what_it_is(tmp_path: Path, name: str, says: str) -> None:
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "folder").mkdir()
    (tmp_path / "empty").touch()
    (tmp_path / "device").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe")
    with pytest.raises(InputError, match=says):
        require_file(tmp_path / name)
    with pytest.raises(InputError, match=says), open_binary(tmp_path / name):
        pass


def test_text_is_bounded_and_its_byte_order_mark_goes(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbf" + "größe\xff".encode() + b"\xff")
    assert read_text(path, 100) == "größeÿ\ufffd"
    with pytest.raises(InputError, match="larger than 5 bytes"):
        read_text(path, 5)
