"""The system's file dialogs: what they are asked to show. They themselves wait for a person."""

import os
import subprocess
import sys

import pytest
from imgui_bundle import portable_file_dialogs

from iibr_core.scenes.screen_size import ScreenSize
from viewer.app.dialogs import ask_for_path, ask_for_place
from viewer.model.saving import ExportPrompt, SavePrompt


@pytest.fixture
def asked(monkeypatch):
    """What the system's dialogs are asked to show."""
    words = []
    for kind in ("open_file", "select_folder", "save_file"):
        monkeypatch.setattr(portable_file_dialogs, kind, lambda *each: words.append(each))
    return words


@pytest.mark.parametrize("beside", ["photos/one.jpg", "photos/", "~/photos/"])
def test_a_dialog_begins_beside_what_is_open_and_shows_names_in_capitals(asked, monkeypatch, beside):
    monkeypatch.setenv("HOME", os.getcwd())
    ask_for_path("photo", beside)
    ask_for_path("folder", beside)
    assert [words[1] for words in asked] == [os.path.join(os.getcwd(), "photos", "")] * 2
    assert {"*.jpg", "*.JPG", "*.HEIC", "*.hif"} <= set(asked[0][2][1].split())


def test_a_place_is_asked_for_with_the_typed_name(asked):
    ask_for_place(SavePrompt("photos/one-iibr.png", ScreenSize(3, 2)))
    assert ask_for_place(ExportPrompt("hci", "photos/field")).name == "field"
    assert asked[0][:2] == ("Save the picture", os.path.join(os.getcwd(), "photos", "one-iibr.png"))
    assert asked[1][1] == os.path.join(os.getcwd(), "photos")


@pytest.mark.skipif(sys.platform != "linux", reason="other systems show their dialog without a program")
def test_an_open_dialog_ends_with_the_program(tmp_path):
    """The dialog's program waits for a person, longer than the test may take."""
    program, started = tmp_path / "zenity", tmp_path / "started"
    program.write_text(f"#!/bin/sh\ntouch {started}\nexec sleep 600\n")
    program.chmod(0o755)
    code = f"""
import time
from pathlib import Path
from viewer.app.dialogs import ask_for_path
dialog = ask_for_path("photo")
while not Path({str(started)!r}).exists():
    time.sleep(0.01)
assert dialog.answer() is None
dialog.close()
"""
    environment = {**os.environ, "PATH": f"{tmp_path}{os.pathsep}{os.environ['PATH']}"}
    subprocess.run([sys.executable, "-c", code], env=environment, check=True, timeout=60)
