"""Exports in a real window: it lives on meanwhile; what is given up leaves nothing behind."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from imgui_bundle import imgui
from PIL import Image, ImageSequence

from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import Driver, Opener, write_scene
from viewer.app.main_loop import App
from viewer.gpu.refocus.render_settings import RenderSettings
from viewer.model.actions import DismissNotice, DoTask, ShowPrompt
from viewer.model.layout import ScreenSize
from viewer.model.state.exporting import ExportOptions, ExportPrompt, ExportTask
from viewer.model.state.jobs import CancelJobTask
from viewer.model.state.optics import MoveEye
from viewer.model.state.scene import Source

SMALL = ExportOptions(size=ScreenSize(96, 64), frames=4)
LARGE = ExportOptions(size=ScreenSize(600, 400), frames=200)


@pytest.fixture
def viewer(open_window: Opener, photo_path: Path) -> Driver:
    driver = open_window(photo_path, grid=GridShape(3, 3))
    driver.until_idle()
    for notice in driver.app.state.notices:
        driver.app.do(DismissNotice(notice))
    return driver


def texts(app: App) -> list[str]:
    return [notice.text for notice in app.state.notices]


def start(viewer: Driver, path: Path) -> None:
    """Ask for a long one, and wait until some of it is drawn."""
    viewer.app.do(DoTask(ExportTask("gif", str(path), LARGE)))
    viewer.until(lambda app: bool(app.state.jobs) and app.state.jobs[0].done > 0)


def test_the_window_lives_on_while_it_exports(viewer: Driver, tmp_path: Path) -> None:
    out = tmp_path / "a.gif"
    app = viewer.app
    start(viewer, tmp_path / "long.gif")
    app.do(DoTask(ExportTask("gif", str(out), SMALL)))
    frames, turns = app.frames_shown, 0
    while turns < 10:
        app.do(MoveEye(ViewOffset(0.05 * turns, 0.2)))
        app.step()
        turns += 1
    assert app.frames_shown - frames >= 5
    assert [job.doing for job in app.state.jobs] == ["drawing frames", ""]
    app.do(DoTask(CancelJobTask(app.state.jobs[0].id)))
    viewer.until(lambda app: bool(texts(app)))
    assert texts(app) == [f"Exported {out}"], "what was cancelled is not spoken of"
    viewer.until(lambda app: not app.state.jobs)
    with Image.open(out) as image:
        assert (image.size, image.n_frames) == ((96, 64), 4)  # type: ignore[attr-defined]
    assert not (tmp_path / "long.gif").exists()


def test_a_light_field_is_made_anew_beside_the_window(viewer: Driver, tmp_path: Path) -> None:
    viewer.app.do(DoTask(ExportTask("numbered-grid", str(tmp_path / "field"))))
    viewer.until(lambda app: bool(texts(app)))
    assert texts(viewer.app) == [f"Exported {tmp_path / 'field'}"]
    shown = viewer.app.scene_view.picture(RenderSettings(viewer.app.state.optics, ScreenSize(96, 64))).astype(int)
    view = np.asarray(Image.open(tmp_path / "field" / "v01_u01.png")).astype(int)
    assert np.abs(view - shown).max() <= 2


def test_closing_gives_up_and_leaves_nothing(viewer: Driver, tmp_path: Path) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    start(viewer, folder / "a.gif")
    viewer.close()
    assert list(folder.iterdir()) == []


def test_it_is_asked_for_by_key_and_says_what_is_wrong(viewer: Driver, tmp_path: Path) -> None:
    app = viewer.app
    viewer.send("key", "ctrl+e")
    viewer.until(lambda app: isinstance(app.state.prompt, ExportPrompt))
    prompt = app.state.prompt
    assert isinstance(prompt, ExportPrompt)
    there = tmp_path / "there_LRF_Full_SBS.png"
    there.write_text("mine")
    for path, kind in (
        (tmp_path / "there.png", "sbs"),
        (tmp_path / "a.png", "gif"),
        (tmp_path / "scene.png", "anaglyph"),
    ):
        app.do(ShowPrompt(None))
        viewer.until_idle()  # or the field that is typed in would keep its own text
        app.do(DoTask(ExportTask(kind, str(path))))
        viewer.until(lambda app: not app.state.tasks)
        asked = app.state.prompt
        assert isinstance(asked, ExportPrompt)
        assert (asked.already_there, bool(asked.problem)) == (kind == "sbs", kind != "sbs")
    assert there.read_text() == "mine"
    app.do(DoTask(ExportTask("sbs", str(tmp_path / "there.png"), replace(SMALL, frames=None), may_replace=True)))
    viewer.until(lambda app: bool(texts(app)))
    assert texts(app) == [f"Exported {there}"]
    assert app.state.prompt is None
    with Image.open(there) as image:
        assert image.size == (192, 64)


def test_where_it_goes_is_typed_at_once_and_seen_whole(viewer: Driver, tmp_path: Path) -> None:
    out = tmp_path / ("a" * 60 + ".gif")
    viewer.app.do(ShowPrompt(ExportPrompt("gif", "somewhere.gif")))
    viewer.until_idle()
    viewer.type(str(out))
    viewer.until(lambda app: app.state.prompt == ExportPrompt("gif", str(out)))
    viewer.find("##path", "prompt ExportPrompt")
    viewer.until_idle()
    tip = imgui.internal.find_window_by_name("##Tooltip_00")
    assert tip is not None
    assert tip.active


def test_the_window_asks_for_what_a_kind_can_be_told(viewer: Driver, tmp_path: Path) -> None:
    out = tmp_path / "a.gif"
    app = viewer.app
    app.do(ShowPrompt(ExportPrompt("gif", str(out))))
    window = "prompt ExportPrompt"
    expected = ExportOptions()
    for field, text, said in (
        ("##width", "48", {"size": ScreenSize(48, 32)}),
        ("##frames", "3", {"frames": 3}),
        ("##rate", "12.5", {"rate": 12.5}),
    ):
        viewer.press(field, window)
        viewer.type(text)
        viewer.send("key", "Tab")
        expected = replace(expected, **said)  # type: ignore[arg-type]
        asked = ExportPrompt("gif", str(out), expected)
        viewer.until(lambda app, asked=asked: app.state.prompt == asked)  # type: ignore[misc]
    viewer.press("Export", window)
    viewer.until(lambda app: bool(texts(app)))
    assert texts(app) == [f"Exported {out}"]
    with Image.open(out) as image:
        assert (image.size, image.n_frames) == ((48, 32), 3)  # type: ignore[attr-defined]
        assert sum(frame.info["duration"] for frame in ImageSequence.Iterator(image)) == 240
