"""Files as they are found: what is no ordinary file is named as what it is, and nothing is waited for."""

from __future__ import annotations

import os
import socket
from pathlib import Path

import pytest

from iibr_core.formats.files import open_binary, read_text, require_file
from iibr_core.types import InputError


@pytest.mark.parametrize(
    ("name", "says"),
    [
        ("gone", "no such file"),
        ("loop", "no such file"),
        ("folder", "is a folder"),
        ("empty", "the file is empty"),
        ("pipe", "is a pipe, not an ordinary file"),
        ("socket", "is a socket, not an ordinary file"),
        ("device", "is a device, not an ordinary file"),
    ],
)
def test_what_is_no_file_to_read_is_named_as_what_it_is(tmp_path: Path, name: str, says: str) -> None:
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "folder").mkdir()
    (tmp_path / "empty").touch()
    (tmp_path / "device").symlink_to("/dev/zero")
    os.mkfifo(tmp_path / "pipe")
    with socket.socket(socket.AF_UNIX) as place:
        descriptor = os.open(tmp_path, os.O_RDONLY)
        place.bind(f"/proc/self/fd/{descriptor}/socket")
        os.close(descriptor)
        with pytest.raises(InputError, match=says):
            require_file(tmp_path / name)
        with pytest.raises(InputError, match=says), open_binary(tmp_path / name):
            pass


def test_a_pipe_that_takes_a_files_place_is_not_waited_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    os.mkfifo(tmp_path / "pipe")
    monkeypatch.setattr("iibr_core.formats.files.require_file", lambda path: None)
    with open_binary(tmp_path / "pipe") as file:
        assert not file.read(1)


def test_text_is_bounded_and_its_byte_order_mark_goes(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(b"\xef\xbb\xbf" + "größe\xff".encode() + b"\xff")
    assert read_text(path, 100) == "größeÿ\ufffd"
    with pytest.raises(InputError, match="larger than 5 bytes"):
        read_text(path, 5)
