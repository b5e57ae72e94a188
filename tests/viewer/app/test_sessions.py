"""Photos open as they were left, in a real window, after the program was killed too."""

import os
from dataclasses import replace
from threading import Event, current_thread, main_thread

import numpy as np
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.editing.canvas import DepthCanvas, apply_edits
from iibr_core.depth.editing.edits import UNEDITED, DepthEdits, Stroke
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import DEADLINE_S, rests, says, shows, write_scene
from viewer.app.session_store import MAX_SESSIONS, SessionStore, key_of
from viewer.model import depth, lens, window
from viewer.model.action import do
from viewer.model.saved_settings import settings_text
from viewer.model.saving import SavedSettings

ONE = GridShape(1, 1)
RESTORED = "as you left it"


@pytest.fixture(autouse=True)
def _soon(monkeypatch):
    monkeypatch.setattr("viewer.app.session_store.QUIET_S", 0.0)


def change(driver):
    """Change all that a session keeps."""
    app = driver.app
    driver.until_idle()
    app.do(do(lens.move_eye, ViewOffset(0.3, -0.2)), do(lens.set_aperture, 1.5), do(lens.set_focus, 0.25))
    app.do(do(depth.set_tone, replace(UNEDITED, gamma=1.5), is_finished=True))
    app.do(
        do(depth.set_brush, replace(app.state.brush, is_on=True)), do(depth.paint, (0.5, 0.5)), do(window.end_gesture)
    )
    driver.until_idle()


def is_restored(driver):
    return any(RESTORED in notice.text.lower() for notice in driver.app.state.notices)


def sessions_in(kept):
    return list((kept / "sessions").glob("*.json"))


def write_session(kept, photo_path, text):
    (kept / "sessions").mkdir(parents=True)
    (kept / "sessions" / f"{key_of(Source(str(photo_path), grid=ONE))}.json").write_text(text, "utf-8")


def test_what_is_changed_while_the_session_is_looked_for_is_kept(open_window, photo_path, tmp_path, monkeypatch):
    may_look = Event()

    def late_key(source):
        may_look.wait(DEADLINE_S)
        return key_of(source)

    monkeypatch.setattr("viewer.app.session_store.key_of", late_key)
    driver = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    change(driver)
    may_look.set()
    driver.until(lambda app: bool(sessions_in(tmp_path / "kept")))


def test_a_photo_left_as_soon_as_its_session_is_found_keeps_it(open_window, photo_path, tmp_path):
    first = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    change(first)
    first.until(lambda app: bool(sessions_in(tmp_path / "kept")) and rests(app))
    first.app.close()
    (session,) = sessions_in(tmp_path / "kept")
    kept = session.read_text("utf-8")
    driver = open_window(photo_path, grid=ONE).until_idle()
    state, other = driver.app.state, Source(str(tmp_path / "other.png"))
    store = SessionStore(tmp_path / "kept", lambda: None)
    while not store.advance(state):
        driver.app.step()
    store.advance(replace(state, source=other, scene=replace(state.scene, source=other)))
    store.keep(state)
    store.close()
    assert session.read_text("utf-8") == kept


def test_a_photo_that_is_left_at_once_for_another_keeps_its_session(open_window, photo_path, tmp_path, monkeypatch):
    monkeypatch.setattr("viewer.app.session_store.QUIET_S", 1e9)
    driver = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE).until_idle()
    change(driver)
    assert not sessions_in(tmp_path / "kept"), "it waits until nothing changes"
    driver.drop(write_scene(tmp_path, "other"), settle=shows("other"))
    driver.until(lambda app: bool(sessions_in(tmp_path / "kept")))
    assert key_of(Source(str(photo_path), grid=ONE)) == sessions_in(tmp_path / "kept")[0].stem


def test_a_session_belongs_to_a_file_as_it_is_now(photo_path, tmp_path):
    source = Source(str(photo_path))
    key = key_of(source)
    chosen_model = DepthChoice(start="model", model="anything")
    assert key_of(replace(source, depth=chosen_model, grid=ONE)) == key, "a model chosen since does not hide it"
    assert key_of(replace(source, depth=DepthChoice(file="map.pfm"))) != key
    os.utime(photo_path, ns=(0, 0))
    assert key_of(source) != key
    folder = key_of(Source(str(tmp_path)))
    (tmp_path / "new").touch()
    assert key_of(Source(str(tmp_path))) == folder


def test_a_damaged_session_is_named_and_replaced(open_window, photo_path, tmp_path):
    text = "[" * 100_000
    write_session(tmp_path / "kept", photo_path, text)
    driver = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    driver.until(says("damaged"))
    change(driver)
    driver.until(lambda app: sessions_in(tmp_path / "kept")[0].read_text() != text)


def test_many_strokes_are_painted_beside_the_window(open_window, photo_path, tmp_path, monkeypatch):
    """The drawing thread paints only what is new: otherwise it would stand still for a minute."""
    paint, painted_here = DepthCanvas._paint, []

    def watched(canvas, stroke):
        painted_here.extend([stroke] if current_thread() is main_thread() else [])
        paint(canvas, stroke)

    monkeypatch.setattr(DepthCanvas, "_paint", watched)
    strokes = tuple(Stroke("nearer", ((k / 40, 0.5),), 0.03, 0.25) for k in range(40))
    settings = SavedSettings(Optics(), 1.0, Source(""), ScreenSize(96, 64), DepthEdits(strokes=strokes))
    write_session(tmp_path / "kept", photo_path, settings_text(settings))
    driver = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    driver.settle(lambda app: is_restored(driver) and app.state.shown_generation == app.state.generation)
    assert painted_here == []
    app = driver.app
    app.do(do(depth.set_brush, replace(app.state.brush, is_on=True)), do(depth.paint, (0.5, 0.5)))
    driver.until(lambda app: len(painted_here) > 0)
    app.do(do(window.end_gesture))
    driver.settle(lambda app: app.state.shown_generation == app.state.generation)
    assert len({stroke.points[0] for stroke in painted_here}) == 1
    loaded = app.scene_view.loaded
    assert len(loaded.depth_settings.edits.strokes) == 41
    wanted = apply_edits(loaded.photo.pixels, loaded.refined.values, loaded.depth_settings.edits)
    assert np.array_equal(loaded.disparity.values, wanted)


def test_of_too_many_sessions_the_oldest_go(open_window, photo_path, tmp_path):
    folder = tmp_path / "kept" / "sessions"
    folder.mkdir(parents=True)
    for number in range(MAX_SESSIONS + 2):
        path = folder / f"{(number * 7) % (MAX_SESSIONS + 2):04d}.json"
        path.write_text("{}")
        os.utime(path, (number, number))
    oldest = {f"{number * 7:04d}.json" for number in range(3)}
    driver = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE)
    change(driver)
    driver.until(lambda app: len(sessions_in(tmp_path / "kept")) == MAX_SESSIONS)
    kept = {path.name for path in sessions_in(tmp_path / "kept")}
    assert not oldest & kept
    assert f"{key_of(Source(str(photo_path), grid=ONE))}.json" in kept


def test_a_folder_that_cannot_be_written_gives_one_notice(open_window, photo_path, tmp_path):
    driver = open_window(photo_path, kept_in=tmp_path / "kept", grid=ONE).until_idle()
    (tmp_path / "kept" / "sessions").write_text("a file is in the way")
    change(driver)
    driver.until(says("not kept"))
