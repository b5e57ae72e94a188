"""Photos open as they were left, in a real window: moved, renamed, and after the program was killed too."""

from __future__ import annotations

import os
import shutil
from dataclasses import replace
from pathlib import Path
from threading import current_thread, main_thread

import numpy as np
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.editing.canvas import DepthCanvas, apply_edits
from iibr_core.depth.editing.edits import UNEDITED, DepthEdits, Stroke
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import Driver, Opener, rests
from viewer.app.session_store import EDITS_KEPT, key_of, sidecar_of
from viewer.model import messages, saving
from viewer.model.action import ask, do
from viewer.model.actions import Undo
from viewer.model.saved_settings import settings_text
from viewer.model.state.depth_editing import Paint, SetBrush, SetTone
from viewer.model.state.optics_actions import MoveEye, SetAperture, SetFocus
from viewer.model.state.saving import SavedSettings, WriteSidecarTask

ONE = GridShape(1, 1)
AS_LEFT = "As you left it"


@pytest.fixture(autouse=True)
def _soon(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("viewer.app.session_store.QUIET_S", 0.0)


def change(driver: Driver) -> None:
    """All that is kept."""
    app = driver.app
    driver.until_idle()
    app.do(MoveEye(ViewOffset(0.3, -0.2)), SetAperture(1.5), SetFocus(0.25))
    app.do(SetTone(replace(UNEDITED, gamma=1.5), is_finished=True))
    app.do(SetBrush(replace(app.state.brush, is_on=True)), Paint((0.5, 0.5)))
    app.do(*_end())
    driver.until_idle()


def _end() -> list[object]:
    from viewer.model.actions import EndGesture

    return [EndGesture()]


def left_with(driver: Driver) -> tuple[object, ...]:
    state = driver.app.state
    return state.optics, state.depth, state.depth_strength


def told(driver: Driver) -> bool:
    return any(AS_LEFT in notice.text for notice in driver.app.state.notices)


def kept_files(kept: Path) -> list[Path]:
    return list((kept / "sessions").glob("*.json"))


def test_a_photo_opens_as_it_was_left(open_window: Opener, photo_path: Path, tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    first = open_window(photo_path, kept_in=kept, grid=ONE)
    change(first)
    left = left_with(first)
    first.app.close()
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    for path in photo_path.parent.glob(f"{photo_path.stem}*"):
        shutil.move(path, elsewhere / path.name.replace(photo_path.stem, "renamed"))
    second = open_window(elsewhere / f"renamed{photo_path.suffix}", kept_in=kept, grid=ONE)
    second.until(lambda app: told(second))
    second.until_idle()
    assert left_with(second) == left
    assert isinstance(second.app.state.depth.edits.strokes[0], Stroke)
    assert not second.app.state.has_unsaved_edits
    assert second.app.scene_view.loaded.depth_settings == second.app.state.depth
    second.app.do(Undo())
    second.until_idle()
    assert second.app.state.depth.edits == UNEDITED


def test_a_depth_model_chosen_since_does_not_hide_what_was_kept(
    open_window: Opener, photo_path: Path, tmp_path: Path
) -> None:
    """Choosing a model in the window says that the search for depth begins with it."""
    first = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    change(first)
    first.app.close()
    source = Source(str(photo_path), depth=DepthChoice(start="model", model="anything"), grid=ONE)
    assert (tmp_path / "kept" / "sessions" / f"{key_of(source)}.json").is_file()


def test_after_a_crash_too(open_window: Opener, photo_path: Path, tmp_path: Path) -> None:
    """What was written while the window was used must do."""
    first = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    change(first)
    first.until(lambda app: bool(kept_files(tmp_path / "kept")) and rests(app))
    shutil.copytree(tmp_path / "kept" / "sessions", tmp_path / "of the dead" / "sessions")
    left = left_with(first)
    first.app.close()
    second = open_window(photo_path, kept_in=tmp_path / "of the dead", grid=ONE)
    second.until(lambda app: told(second))
    assert left_with(second) == left


def test_what_was_only_looked_at_leaves_nothing(open_window: Opener, photo_path: Path, tmp_path: Path) -> None:
    driver = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    driver.until_idle()
    driver.app.close()
    assert not kept_files(tmp_path / "kept")
    again = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    again.until_idle()
    assert not told(again)


def test_beside_the_photo_if_asked(open_window: Opener, photo_path: Path, tmp_path: Path) -> None:
    first = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    change(first)
    first.app.do(do(ask, WriteSidecarTask()))
    first.until(lambda app: sidecar_of(photo_path).is_file())
    left = left_with(first)
    first.app.close()
    second = open_window(photo_path, kept_in=tmp_path / "another machine", grid=ONE)
    second.until(lambda app: told(second))
    assert left_with(second) == left


@pytest.mark.parametrize("text", ["", "{", '{"format": 99}', '{"format": 1}', "\x00\xff", "[" * 100_000])
def test_damaged_ones_are_told(open_window: Opener, photo_path: Path, tmp_path: Path, text: str) -> None:
    sidecar_of(photo_path).write_text(text, "utf-8")
    driver = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    driver.until(lambda app: any("damaged" in notice.text for notice in app.state.notices))
    driver.until_idle()
    change(driver)
    driver.until(lambda app: bool(kept_files(tmp_path / "kept")))


@pytest.mark.parametrize("kind", ["link", "huge"])
def test_a_sidecar_that_is_no_file_is_not_read(
    open_window: Opener, photo_path: Path, tmp_path: Path, kind: str
) -> None:
    path = sidecar_of(photo_path)
    if kind == "huge":
        path.touch()
        os.truncate(path, 2**40)
    else:
        path.symlink_to(photo_path)
    driver = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    driver.until(lambda app: any(path.name in notice.text for notice in app.state.notices))
    driver.until_idle()
    assert not told(driver)
    change(driver)
    driver.until(lambda app: bool(kept_files(tmp_path / "kept")))


def test_many_strokes_are_painted_beside_the_window(
    open_window: Opener, photo_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The drawing thread paints what is new, and no more: it would stand still for a minute."""
    paint, painted_here = DepthCanvas._paint, []

    def watched(canvas: DepthCanvas, stroke: Stroke) -> None:
        painted_here.extend([stroke] if current_thread() is main_thread() else [])
        paint(canvas, stroke)

    monkeypatch.setattr(DepthCanvas, "_paint", watched)
    strokes = tuple(Stroke("nearer", ((k / 40, 0.5),), 0.03, 0.25) for k in range(40))
    settings = SavedSettings(Optics(), 1.0, Source(""), ScreenSize(96, 64), DepthEdits(strokes=strokes))
    sidecar_of(photo_path).write_text(settings_text(settings))
    driver = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    driver.until(lambda app: told(driver) and app.state.shown_generation == app.state.generation)
    driver.until_idle()
    assert painted_here == []
    app = driver.app
    app.do(SetBrush(replace(app.state.brush, is_on=True)), Paint((0.5, 0.5)))
    driver.until(lambda app: len(painted_here) > 0)
    app.do(*_end())
    driver.until_idle()
    assert len({stroke.points[0] for stroke in painted_here}) == 1
    loaded = app.scene_view.loaded
    assert len(loaded.depth_settings.edits.strokes) == 41
    wanted = apply_edits(loaded.photo.pixels, loaded.refined.values, loaded.depth_settings.edits)
    assert np.array_equal(loaded.disparity.values, wanted)


def test_a_folder_that_cannot_be_written_is_told_once(open_window: Opener, photo_path: Path, tmp_path: Path) -> None:
    driver = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    driver.until_idle()
    (tmp_path / "kept" / "sessions").write_text("a file is in the way")
    change(driver)
    driver.until(lambda app: any("not kept" in notice.text for notice in app.state.notices))


def test_closing_asks_nothing_where_the_edits_are_kept_and_says_so_once(
    open_window: Opener, photo_path: Path, tmp_path: Path
) -> None:
    kept = tmp_path / "kept"
    first = open_window(photo_path, kept_in=kept, grid=ONE)
    first.until(lambda app: app.state.keeps_sessions)
    first.app.do(do(messages.show_prompt, None), SetTone(replace(UNEDITED, gamma=1.5), is_finished=True))
    first.until(lambda app: any(notice.text == EDITS_KEPT for notice in app.state.notices))
    first.app.do(do(saving.quit_window))
    assert first.app.state.should_quit
    first.app.close()
    second = open_window(photo_path, kept_in=kept, grid=ONE)
    second.until(lambda app: told(second) and app.state.keeps_sessions)
    assert second.app.state.depth.edits.gamma == 1.5
    second.app.do(SetTone(replace(UNEDITED, gamma=2.0), is_finished=True))
    second.until_idle()
    assert second.app.state.preferences.told_sessions
    assert not any(notice.text == EDITS_KEPT for notice in second.app.state.notices)


def test_closing_asks_where_the_edits_cannot_be_kept(open_window: Opener, photo_path: Path, tmp_path: Path) -> None:
    (tmp_path / "kept").mkdir()
    (tmp_path / "kept" / "sessions").write_text("a file is in the way")
    driver = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    driver.until_idle()
    driver.app.do(SetTone(replace(UNEDITED, gamma=1.5), is_finished=True))
    driver.until_idle()
    driver.app.do(do(saving.quit_window))
    assert driver.app.state.prompt == "quit"
    assert not driver.app.state.should_quit
