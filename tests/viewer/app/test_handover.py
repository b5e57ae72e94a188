"""Paths handed over to the open window: one window listens, and nothing that any program sends disturbs it."""

import json
import os
import socket
import struct
import tempfile
import time
from contextlib import ExitStack, closing, suppress
from pathlib import Path

import pytest

from viewer.app.handover import MAX_BYTES, MAX_PATHS, Receiver, hand_over, window_address

DEADLINE_S = 30.0
SHORT = struct.Struct("!i")
"""Length before each message."""


@pytest.fixture(autouse=True)
def runtime_folder(monkeypatch):
    """A folder with a short name: the system limits the length of a socket's path."""
    with tempfile.TemporaryDirectory() as folder:
        monkeypatch.setenv("XDG_RUNTIME_DIR", folder)
        monkeypatch.setenv("DISPLAY", ":77")
        yield Path(folder)


@pytest.fixture
def receiver():
    with closing(listening()) as window:
        yield window


def listening():
    window = Receiver(lambda: None)
    window.listen()
    return window


def hand_over_when_heard(*paths):
    """A thread takes its time to begin to listen."""
    end = time.monotonic() + DEADLINE_S
    while not hand_over(list(paths)):
        assert time.monotonic() < end


def test_the_latest_paths_are_received_once(receiver):
    assert receiver.take() is None
    hand_over_when_heard("/photos/a.png")
    hand_over_when_heard("/photos/ä.png", "/photos/\udcff.png")
    assert receiver.take() == ("/photos/ä.png", "/photos/\udcff.png")
    assert receiver.take() is None
    hand_over_when_heard()
    assert receiver.take() == (), "a start without paths brings the window to the front"


def test_one_of_two_windows_listens_and_the_other_after_it_although_a_killed_one_left_its_socket():
    with socket.socket(socket.AF_UNIX) as left:
        left.bind(window_address() or "")
    with closing(listening()) as first:
        hand_over_when_heard("/a.png")
        listening().close()  # at once, although it waits to listen
        with closing(listening()) as second:
            assert second.has_another()
            assert first.take() == ("/a.png",)
            assert second.take() is None
            first.close()
            hand_over_when_heard("/b.png")
            assert second.take() == ("/b.png",)
            assert first.take() is None
    assert not hand_over(["/c.png"])
    assert not Receiver(lambda: None).has_another()


NOT_PATHS = b"\x80\x04N.", b"[" * 100_000, b'{"/a.png": 1}', b'["a.png"]', b"[[]]", b'["/\\ud800"]', b'["/\\u0000"]'
MANY_PATHS = json.dumps(["/a.png"] * (MAX_PATHS + 1)).encode()
MESSAGES = [SHORT.pack(len(text)) + text for text in (*NOT_PATHS, MANY_PATHS)]
CUT_MESSAGE = SHORT.pack(100) + b"half"


@pytest.mark.parametrize("sent", [b"", b"GET / HTTP/1.1\r\n\r\n", CUT_MESSAGE, SHORT.pack(MAX_BYTES + 1), *MESSAGES])
def test_other_bytes_change_nothing(receiver, sent):
    hand_over_when_heard("/a.png")
    receiver.take()
    with socket.socket(socket.AF_UNIX) as stranger:
        stranger.connect(window_address() or "")
        stranger.sendall(sent)
        if sent != CUT_MESSAGE:
            stranger.shutdown(socket.SHUT_WR)
        with suppress(ConnectionResetError):  # not all of it was read
            assert stranger.recv(64) == b"", "it is answered by the end alone"
    assert receiver.take() is None
    assert hand_over(["/b.png"])
    assert receiver.take() == ("/b.png",)


def test_a_window_closes_although_senders_hold_it_up(receiver):
    hand_over_when_heard("/a.png")
    with ExitStack() as strangers:
        for _ in range(8):
            strangers.enter_context(socket.socket(socket.AF_UNIX)).connect(window_address() or "")
        receiver.close()


def test_displays_have_their_own_windows_and_a_foreign_folder_has_none(monkeypatch):
    first = window_address()
    monkeypatch.setenv("DISPLAY", ":7/7")
    assert window_address() not in (first, None)
    assert Path(window_address() or "").parent.stat().st_mode & 0o777 == 0o700
    monkeypatch.setattr(os, "getuid", lambda: 12345)
    assert window_address() is None
