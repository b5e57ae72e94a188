"""Exports in a real window: it stays usable meanwhile; a cancelled export leaves nothing behind."""

import threading
from dataclasses import replace

import glfw
import numpy as np
import pytest
from PIL import Image, ImageSequence

from iibr_core.depth.editing.edits import DepthEdits
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.source import ExportSource
from iibr_core.formats.images.photo import read_photo
from iibr_core.gloss.settings import Gloss
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import says, shows, write_scene
from viewer.model import depth, lens, messages, opening, saving, window
from viewer.model.action import do
from viewer.model.saving import WAITING_FOR_VIEWS, ExportPrompt, SavePrompt
from viewer.model.tasks import CancelJobTask, SaveTask, ask

SMALL = ExportOptions(size=ScreenSize(96, 64), frames=4)
LARGE = ExportOptions(size=ScreenSize(600, 400), frames=200)


@pytest.fixture
def viewer(open_window, photo_path):
    driver = open_window(photo_path).until_idle()
    driver.app.do(do(messages.dismiss))
    return driver


def export(kind, path, options=SMALL, may_replace=False):
    return do(ask, SaveTask(ExportPrompt(kind, str(path), options), may_replace))


def start(viewer, path, options=SMALL):
    """Begin an export, and wait until some of it is drawn."""
    viewer.do(export("gif", path, options), until=lambda app: bool(app.state.jobs) and app.state.jobs[0].done > 0)


@pytest.fixture
def gate(monkeypatch):
    """Exports stop after their second picture or view while this is not set."""
    gate = threading.Event()

    def holding(counted):
        def held(self, *arguments):
            for number, item in enumerate(counted(self, *arguments)):
                if number == 1:
                    while not gate.wait(0.01):
                        raise_if_stopped()
                yield item

        return held

    for name in ("watched", "views"):
        monkeypatch.setattr(ExportSource, name, holding(getattr(ExportSource, name)))
    gate.set()
    yield gate
    gate.set()


def test_the_window_stays_usable_and_the_next_export_follows_a_cancelled_one(viewer, tmp_path):
    out, app = tmp_path / "a.gif", viewer.app
    start(viewer, tmp_path / "long.gif", LARGE)
    app.do(export("gif", out))
    frames = app.frames_shown
    for turn in range(10):
        app.do(do(lens.move_eye, ViewOffset(0.05 * turn, 0.2)))
        app.step()
    assert app.frames_shown - frames >= 5
    assert [job.doing for job in app.state.jobs] == ["drawing frames", ""]
    app.do(do(ask, CancelJobTask(app.state.jobs[0].id)))
    viewer.until(lambda app: bool(viewer.texts()) and not app.state.jobs)
    assert viewer.texts() == [f"Exported {out}"]
    with Image.open(out) as image:
        assert (image.size, image.n_frames) == ((96, 64), 4)
    assert not (tmp_path / "long.gif").exists()


def other_photo(folder):
    (folder / "elsewhere").mkdir(exist_ok=True)
    return do(
        opening.open_source, Source(str(write_scene(folder / "elsewhere", "other", seed=1)), grid=GridShape(3, 3))
    )


def nine_changes(viewer, folder):
    """One of everything that a picture depends on; the last opens another photo."""
    source = viewer.app.state.source
    return [
        (do(lens.move_eye, ViewOffset(0.7, -0.4)),),
        (do(lens.set_focus, 1.5), do(lens.set_aperture, 1.2)),
        (do(lens.set_focus_tilt, (0.5, 0.2)),),
        (do(lens.set_gloss, Gloss()),),
        (do(lens.set_depth_strength, 0.6, is_finished=True),),
        (do(depth.paint, (0.5, 0.5)), do(depth.paint, (0.7, 0.5)), do(window.end_gesture)),
        (do(depth.set_tone, DepthEdits(gamma=1.7), is_finished=True),),
        (do(opening.open_source, replace(source, grid=GridShape(5, 5))),),
        (other_photo(folder),),
    ]


def bytes_of(path):
    """Contents of a file, or of each file in a folder; the pixels of OpenEXR, which states its time."""
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    exr = [read_photo(file).pixels.tobytes() for file in files if file.suffix == ".exr"]
    return exr or [file.read_bytes() for file in files if file.is_file()]


@pytest.mark.parametrize("name", ["field", "a.exr"])
def test_a_file_shows_what_was_asked_for_whatever_is_changed_meanwhile(viewer, tmp_path, gate, monkeypatch, name):
    monkeypatch.setattr("viewer.app.side_effects.SAVE_BUDGET_S", 0.0)
    app = viewer.app

    def task(folder):
        path = tmp_path / folder / name
        if name == "a.exr":
            return do(ask, SaveTask(SavePrompt(str(path), ScreenSize(900, 600))))
        return export("hci", path, ExportOptions())

    app.do(do(lens.set_aperture, 2.0), do(lens.move_eye, ViewOffset(0.3, -0.2)), do(lens.set_focus, 0.5))
    viewer.until_idle()
    for folder in ("alone", "disturbed"):
        (tmp_path / folder).mkdir()
    app.do(task("alone"))
    viewer.until(lambda app: bool(viewer.texts()) and not app.state.jobs)
    gate.clear()
    app.do(do(messages.dismiss), task("disturbed"))
    viewer.until(lambda app: bool(app.state.jobs) and app.state.jobs[0].done > 0)
    for actions in nine_changes(viewer, tmp_path):
        app.do(*actions)
        app.step()
        assert app.state.jobs, "it was done too soon to be disturbed"
    gate.set()
    viewer.until(lambda app: not app.state.jobs and app.state.progress.is_complete)
    assert app.state.scene.name == "other"
    alone, disturbed = (bytes_of(tmp_path / folder / name) for folder in ("alone", "disturbed"))
    assert alone
    assert alone == disturbed


def test_an_export_asked_for_before_its_views_are_there_outlives_its_photo(open_window, photo_path, tmp_path):
    viewer = open_window(photo_path, grid=GridShape(5, 5))
    app = viewer.app
    viewer.until(lambda app: app.state.scene is not None and not app.state.scene.is_sketch)
    early, late = (tmp_path / f"{when}.gif" for when in ("early", "late"))
    app.do(do(lens.set_aperture, 2.0), export("gif", early))
    app.step()
    assert [job.doing for job in app.state.jobs] == [WAITING_FOR_VIEWS]
    app.do(other_photo(tmp_path))
    viewer.until(lambda app: not app.state.jobs)
    assert f"Exported {early}" in viewer.texts()
    viewer.until_idle()
    app.do(do(opening.open_source, Source(str(photo_path), grid=GridShape(5, 5))))
    viewer.settle(shows("scene"))
    app.do(do(messages.dismiss), do(lens.set_aperture, 2.0), export("gif", late))
    viewer.until(says(f"Exported {late}"))
    assert bytes_of(early) == bytes_of(late)
    app.do(do(opening.open_source, Source(str(photo_path), grid=GridShape(5, 5))))
    viewer.until(lambda app: app.state.scene.source is app.state.source and app.state.progress.done > 0)
    app.do(do(opening.stop), do(lens.set_aperture, 2.0), export("gif", tmp_path / "stopped.gif"))
    viewer.until(says("stopped.gif"))
    assert bytes_of(tmp_path / "stopped.gif") == bytes_of(late), "it makes the views that were not made"


def test_an_export_asked_for_right_after_an_edit_of_the_depth_shows_it(viewer, tmp_path):
    app = viewer.app
    before, early, late = (tmp_path / f"{when}.gif" for when in ("before", "early", "late"))
    inverted = do(depth.set_tone, DepthEdits(is_inverted=True), is_finished=True)
    for out, actions in ((before, ()), (early, (inverted,)), (late, ())):
        app.do(*actions, export("gif", out))
        viewer.settle(says(f"Exported {out}"))
    assert bytes_of(before) != bytes_of(early) == bytes_of(late)


def test_a_rack_goes_from_the_last_click_but_one_to_the_last(viewer, tmp_path):
    """Two clicks side by side: nearly a still picture. Without clicks, it goes through all depths."""
    moved = []
    for name, clicks in (("all", ()), ("near", (do(lens.focus_on, (0, 0), 0.0), do(lens.focus_on, (0, 0), 0.02)))):
        out = tmp_path / f"{name}.gif"
        viewer.app.do(do(lens.set_aperture, 3.0), *clicks, export("gif", out, replace(SMALL, motion="rack")))
        viewer.settle(says(f"Exported {out}"))
        with Image.open(out) as image:
            frames = [np.asarray(frame.convert("L"), float) for frame in ImageSequence.Iterator(image)]
        moved.append(max(np.abs(frame - frames[0]).mean() for frame in frames))
    assert moved[0] > 2
    assert moved[1] < 0.5


def test_the_list_of_exports_cancels_each_and_repeats_one(viewer, tmp_path, gate):
    app = viewer.app
    gate.clear()
    start(viewer, tmp_path / "a.gif")
    for name in "bc":
        app.do(export("gif", tmp_path / f"{name}.gif"))
    app.do(do(messages.show_prompt, "files"))
    viewer.until(lambda app: len(app.state.jobs) == 3)
    for index, left in ((1, ["a.gif", "c.gif"]), (0, ["c.gif"])):
        viewer.until_idle()
        viewer.press(f"Cancel##job {app.state.jobs[index].id}", "prompt str")
        viewer.until(lambda app, left=left: [job.name for job in app.state.jobs] == left)
    gate.set()
    viewer.until(lambda app: not app.state.jobs)
    assert sorted(path.name for path in tmp_path.glob("*.gif")) == ["c.gif"]
    viewer.until_idle()
    viewer.press("Again…##0", "prompt str")
    viewer.until(lambda app: app.state.prompt == ExportPrompt("gif", str(tmp_path / "c.gif"), SMALL))


def test_closing_asks_while_something_is_exported(viewer, tmp_path, gate):
    app, out = viewer.app, tmp_path / "a.gif"
    gate.clear()
    start(viewer, out)
    glfw.set_window_should_close(app.window.handle, True)
    viewer.until(lambda app: app.state.prompt == "quit")
    viewer.press("Wait, then quit", "prompt str", until=lambda app: app.state.quits_when_done)
    assert app.state.prompt is None, "it asks once"
    assert not app.state.should_quit
    gate.set()
    viewer.until(lambda app: app.state.should_quit)
    with Image.open(out) as image:
        assert image.n_frames == SMALL.frames


def test_closing_cancels_and_leaves_nothing(viewer, tmp_path, gate):
    folder = tmp_path / "out"
    folder.mkdir()
    gate.clear()
    start(viewer, folder / "a.gif")
    viewer.close()
    assert list(folder.iterdir()) == []


def test_the_prompt_stays_where_a_place_is_impossible_or_taken(viewer, tmp_path):
    """The tag that players read is known before a file is replaced."""
    app, there = viewer.app, tmp_path / "there_LRF_Full_SBS.png"
    for kind, name in (("gif", "a.png"), ("anaglyph", "scene.png"), ("gif", "no folder/a.gif")):
        wrong = ExportPrompt(kind, str(tmp_path / name))
        app.do(do(messages.show_prompt, None))
        viewer.until_idle()  # an active field keeps its text
        app.do(do(ask, SaveTask(wrong)))
        viewer.until(lambda app: isinstance(app.state.prompt, ExportPrompt))
        assert app.state.prompt == replace(wrong, problem=app.state.prompt.problem or "a reason")
    there.write_text("mine")
    prompt = ExportPrompt("sbs", str(tmp_path / "there.png"), replace(SMALL, frames=0))
    app.do(do(ask, SaveTask(prompt)))
    viewer.until(lambda app: app.state.prompt == replace(prompt, already_there=True))
    assert there.read_text() == "mine"
    viewer.press(f"Replace {there.name}", "prompt ExportPrompt", until=lambda app: bool(viewer.texts()))
    assert viewer.texts() == [f"Exported {there}"]
    assert app.state.prompt is None
    with Image.open(there) as image:
        assert image.size == (192, 64)


def test_the_options_of_a_kind_are_typed_and_kept_for_the_next(viewer, tmp_path):
    out, app, window = tmp_path / "a.gif", viewer.app, "prompt ExportPrompt"
    app.do(do(messages.show_prompt, ExportPrompt("gif", str(out), ExportOptions(frames=2, rate=10.0))))
    viewer.press("##width", window)
    viewer.type("48")
    viewer.send("key", "Tab")
    expected = ExportOptions(size=ScreenSize(48, 32), frames=2, rate=10.0)
    viewer.until(lambda app: app.state.prompt == ExportPrompt("gif", str(out), expected))
    viewer.press("Export", window, until=lambda app: bool(viewer.texts()))
    with Image.open(out) as image:
        assert (image.size, image.n_frames) == ((48, 32), 2)
        assert sum(frame.info["duration"] for frame in ImageSequence.Iterator(image)) == 200
    app.do(do(saving.ask_to_export))
    assert app.state.prompt == ExportPrompt("gif", str(tmp_path / "scene-iibr.gif"), expected)
