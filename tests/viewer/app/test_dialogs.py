"""The system's file dialogs: what they are asked to show. They themselves wait for a person."""

from __future__ import annotations

import os

import pytest
from imgui_bundle import portable_file_dialogs

from iibr_core.scenes.screen_size import ScreenSize
from viewer.app.dialogs import Dialog, SaveDialog
from viewer.model.state.prompts import SavePrompt


@pytest.mark.parametrize(("what", "kind"), [("photo", "open_file"), ("folder", "select_folder")])
def test_a_dialog_begins_beside_what_is_open_and_shows_names_in_capitals(
    monkeypatch: pytest.MonkeyPatch, what: str, kind: str
) -> None:
    asked: list[tuple[object, ...]] = []
    monkeypatch.setattr(portable_file_dialogs, kind, lambda *words: asked.append(words))
    Dialog(what, "photos/one.jpg")  # type: ignore[arg-type]
    Dialog(what)  # type: ignore[arg-type]
    (_, start, *filters), (_, anywhere, *_) = asked
    assert start == os.path.join(os.getcwd(), "photos", "")
    assert anywhere == ""
    for patterns in filters:
        assert {"*.jpg", "*.JPG", "*.HEIC", "*.hif"} <= set(patterns[1].split())


def test_where_to_save_is_asked_with_what_was_typed(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: list[tuple[object, ...]] = []
    monkeypatch.setattr(portable_file_dialogs, "save_file", lambda *words: asked.append(words))
    SaveDialog(SavePrompt("photos/one-iibr.png", ScreenSize(3, 2)))
    assert asked[0][:2] == ("Save the picture", os.path.join(os.getcwd(), "photos", "one-iibr.png"))
