"""Exports in a real window: it lives on meanwhile; what is given up leaves nothing behind."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from imgui_bundle import imgui
from PIL import Image, ImageSequence

from iibr_core.depth.editing.edits import DepthEdits
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.images.photo import read_photo
from iibr_core.gloss.settings import Gloss
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset, ViewUpdate
from tests.viewer.conftest import Driver, Opener, write_scene
from viewer.app import job_scene
from viewer.app.main_loop import App
from viewer.background.window_work import Steps
from viewer.display.snapshot import SceneSnapshot
from viewer.model import depth, gesture, lens, messages, opening, saving
from viewer.model.action import Action, ask, do
from viewer.model.state.exporting import ExportPrompt, ExportTask
from viewer.model.state.jobs import WAITING_FOR_VIEWS, CancelJobTask
from viewer.model.state.tasks import SaveTask

SMALL = ExportOptions(size=ScreenSize(96, 64), frames=4)
LARGE = ExportOptions(size=ScreenSize(600, 400), frames=200)


@pytest.fixture
def viewer(open_window: Opener, photo_path: Path) -> Driver:
    driver = open_window(photo_path, grid=GridShape(3, 3))
    driver.until_idle()
    for notice in driver.app.state.notices:
        driver.app.do(do(messages.dismiss, notice))
    return driver


def texts(app: App) -> list[str]:
    return [notice.text for notice in app.state.notices]


def start(viewer: Driver, path: Path, options: ExportOptions = SMALL) -> None:
    """Ask for one, and wait until some of it is drawn."""
    viewer.app.do(do(ask, ExportTask("gif", str(path), options)))
    viewer.until(lambda app: bool(app.state.jobs) and app.state.jobs[0].done > 0)


def test_the_window_lives_on_while_it_exports(viewer: Driver, tmp_path: Path) -> None:
    out = tmp_path / "a.gif"
    app = viewer.app
    start(viewer, tmp_path / "long.gif", LARGE)
    app.do(do(ask, ExportTask("gif", str(out), SMALL)))
    frames, turns = app.frames_shown, 0
    while turns < 10:
        app.do(do(lens.move_eye, ViewOffset(0.05 * turns, 0.2)))
        app.step()
        turns += 1
    assert app.frames_shown - frames >= 5
    assert [job.doing for job in app.state.jobs] == ["drawing frames", ""]
    app.do(do(ask, CancelJobTask(app.state.jobs[0].id)))
    viewer.until(lambda app: bool(texts(app)))
    assert texts(app) == [f"Exported {out}"], "what was cancelled is not spoken of"
    viewer.until(lambda app: not app.state.jobs)
    with Image.open(out) as image:
        assert (image.size, image.n_frames) == ((96, 64), 4)  # type: ignore[attr-defined]
    assert not (tmp_path / "long.gif").exists()


def test_a_light_field_is_made_anew_beside_the_window(viewer: Driver, tmp_path: Path) -> None:
    viewer.app.do(do(ask, ExportTask("hci", str(tmp_path / "field"))))
    viewer.until(lambda app: bool(texts(app)))
    assert texts(viewer.app) == [f"Exported {tmp_path / 'field'}"]
    shown = viewer.app.scene_view.renderer.converged_picture(
        RenderSettings(viewer.app.state.optics, ScreenSize(96, 64))
    ).astype(int)
    view = np.asarray(Image.open(tmp_path / "field" / "input_Cam004.png")).astype(int)
    assert np.abs(view - shown).max() <= 2


def other_photo(folder: Path) -> Action:
    """Opens a photo of another folder."""
    (folder / "elsewhere").mkdir(exist_ok=True)
    return do(
        opening.open_source, Source(str(write_scene(folder / "elsewhere", "other", seed=1)), grid=GridShape(3, 3))
    )


def nine_changes(viewer: Driver, folder: Path) -> list[tuple[Action, ...]]:
    """Of everything that a picture depends on; the last one opens another photo."""
    source = viewer.app.state.source
    assert source is not None
    return [
        (do(lens.move_eye, ViewOffset(0.7, -0.4)),),
        (do(lens.set_focus, 1.5), do(lens.set_aperture, 1.2)),
        (do(lens.set_focus_tilt, (0.5, 0.2)),),
        (do(lens.set_gloss, Gloss()),),
        (do(lens.set_depth_strength, 0.6, is_finished=True),),
        (do(depth.paint, (0.5, 0.5)), do(depth.paint, (0.7, 0.5)), do(gesture.end_gesture)),
        (do(depth.set_tone, DepthEdits(gamma=1.7), is_finished=True),),
        (do(opening.open_source, replace(source, grid=GridShape(5, 5))),),
        (other_photo(folder),),
    ]


def bytes_of(path: Path) -> dict[str, bytes]:
    """Of a file, or of each in a folder; of OpenEXR its light, as the file says when it was written."""
    files = sorted(path.rglob("*")) if path.is_dir() else [path]
    kept = {file.name: file.read_bytes() for file in files if file.suffix != ".exr" and file.is_file()}
    return kept | {file.name: read_photo(file).pixels.tobytes() for file in files if file.suffix == ".exr"}


@pytest.fixture
def gate(monkeypatch: pytest.MonkeyPatch) -> Iterator[threading.Event]:
    """What counts its pictures or views goes no farther than the second while this is not set."""
    gate = threading.Event()

    def holding(counted: Callable[..., Iterator[object]]) -> Callable[..., Iterator[object]]:
        def held(self: ExportSource, *arguments: object) -> Iterator[object]:
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


@pytest.fixture
def slow(monkeypatch: pytest.MonkeyPatch) -> None:
    """One small step of a picture a turn, so that there are many turns however fast the machine is."""
    monkeypatch.setattr("viewer.app.main_loop.SAVE_BUDGET_S", 0.0)


@pytest.mark.parametrize(
    "task",
    [
        ExportTask("gif", "a.gif", SMALL),
        ExportTask("hci", "a"),
        SaveTask("a.png", ScreenSize(900, 600)),
        SaveTask("a.exr", ScreenSize(900, 600)),
    ],
    ids=lambda task: f"{type(task).__name__} {task.path}",
)
def test_what_is_under_way_stays_as_it_was_asked_for_whatever_is_changed(
    viewer: Driver, tmp_path: Path, task: ExportTask | SaveTask, slow: None, gate: threading.Event
) -> None:
    """Ten changes, each seen by the window: the bytes are those of the same without them."""
    app, name = viewer.app, task.path
    app.do(do(lens.set_aperture, 2.0), do(lens.move_eye, ViewOffset(0.3, -0.2)), do(lens.set_focus, 0.5))
    viewer.until_idle()
    for folder in ("alone", "disturbed"):
        (tmp_path / folder).mkdir()
    app.do(do(ask, replace(task, path=str(tmp_path / "alone" / name))))
    viewer.until(lambda app: bool(texts(app)) and not app.state.jobs)
    gate.clear()
    app.do(do(messages.dismiss), do(ask, replace(task, path=str(tmp_path / "disturbed" / name))))
    viewer.until(lambda app: bool(app.state.jobs) and app.state.jobs[0].done > 0)
    for actions in nine_changes(viewer, tmp_path):
        app.do(*actions)
        app.step()
        assert app.state.jobs, "it was done too soon to be disturbed"
    gate.set()
    viewer.until(lambda app: not app.state.jobs and app.state.progress.is_complete)
    assert next(text for text in texts(app) if name in text).split()[0] in ("Exported", "Saved")
    assert app.state.scene is not None
    assert app.state.scene.name == "other"
    alone, disturbed = (bytes_of(tmp_path / folder) for folder in ("alone", "disturbed"))
    assert alone
    assert alone == disturbed


@pytest.mark.parametrize("kind", ["gif", "hci"])
def test_what_is_asked_for_before_all_views_are_there_is_not_lost_with_its_photo(
    open_window: Opener, photo_path: Path, tmp_path: Path, kind: str
) -> None:
    viewer = open_window(photo_path, grid=GridShape(5, 5))
    app = viewer.app
    viewer.until(lambda app: app.state.scene is not None and not app.state.scene.is_sketch)
    options = SMALL if kind == "gif" else ExportOptions()
    app.do(do(lens.set_aperture, 2.0), do(ask, ExportTask(kind, str(tmp_path / f"early.{kind}"), options)))
    app.step()
    assert [job.doing for job in app.state.jobs] == [WAITING_FOR_VIEWS]
    app.do(other_photo(tmp_path))
    viewer.until(lambda app: not app.state.jobs)
    assert f"Exported {tmp_path / f'early.{kind}'}" in texts(app)
    viewer.until_idle()
    app.do(do(opening.open_source, Source(str(photo_path), grid=GridShape(5, 5))))
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.name == "scene")
    viewer.until_idle()
    app.do(
        do(messages.dismiss),
        do(lens.set_aperture, 2.0),
        do(ask, ExportTask(kind, str(tmp_path / f"late.{kind}"), options)),
    )
    viewer.until(lambda app: f"Exported {tmp_path / f'late.{kind}'}" in texts(app))
    early, late = (bytes_of(tmp_path / f"{when}.{kind}") for when in ("early", "late"))
    assert list(early.values()) == list(late.values())


@pytest.mark.parametrize(("kind", "most"), [("anaglyph", 2), ("hci", 0)])
def test_of_a_scene_that_was_left_only_the_views_are_made_that_are_shown(
    open_window: Opener, photo_path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str, most: int
) -> None:
    made, store = list[ViewUpdate](), job_scene._store

    def counted(snapshot: SceneSnapshot, view: ViewUpdate) -> Steps[None]:
        made.append(view)
        return store(snapshot, view)

    monkeypatch.setattr(job_scene, "_store", counted)
    viewer = open_window(photo_path, grid=GridShape(5, 5))
    app = viewer.app
    viewer.until(lambda app: app.state.scene is not None and not app.state.scene.is_sketch)
    path = tmp_path / f"early{'.png' if kind == 'anaglyph' else ''}"
    app.do(do(ask, ExportTask(kind, str(path), ExportOptions())))
    app.step()
    assert [job.doing for job in app.state.jobs] == [WAITING_FOR_VIEWS]
    app.do(other_photo(tmp_path))
    viewer.until(lambda app: not app.state.jobs)
    assert any(text.startswith("Exported") for text in texts(app))
    assert len({(view.row, view.column) for view in made}) == most


def test_waiting_jobs_do_not_hold_the_views_of_scenes_that_were_left(
    viewer: Driver, tmp_path: Path, gate: threading.Event
) -> None:
    """One set of views beside those on the screen at most; and none once all is done."""
    app = viewer.app
    jobs = app._side_effects._jobs._jobs
    gate.clear()
    start(viewer, tmp_path / "a.gif")
    for seed in range(3):
        (tmp_path / str(seed)).mkdir()
        app.do(
            do(
                opening.open_source,
                Source(str(write_scene(tmp_path / str(seed), f"photo{seed}", seed)), grid=GridShape(3, 3)),
            )
        )
        name = f"photo{seed}"
        viewer.until(lambda app, name=name: app.state.scene.name == name and app.state.progress.is_complete)  # type: ignore[misc]
        app.do(do(ask, ExportTask("gif", str(tmp_path / f"{seed}.gif"), SMALL)))
        app.step()
        held = {job.snapshot.field.colors for job in jobs if job.snapshot is not None}
        shown = app.scene_view.renderer.field
        assert shown is not None
        assert len(held - {shown.colors}) <= 1
    gate.set()
    viewer.until(lambda app: not app.state.jobs)
    assert {f"Exported {tmp_path / f'{seed}.gif'}" for seed in range(3)} <= set(texts(app))
    field = app.scene_view.renderer.field
    assert field is not None
    assert not field.is_shared


def test_any_job_of_the_queue_can_be_given_up(viewer: Driver, tmp_path: Path, gate: threading.Event) -> None:
    app = viewer.app
    gate.clear()
    start(viewer, tmp_path / "a.gif")
    for name in "bc":
        app.do(do(ask, ExportTask("gif", str(tmp_path / f"{name}.gif"), SMALL)))
    viewer.until(lambda app: len(app.state.jobs) == 3)
    viewer.until_idle()
    viewer.press(f"Cancel##job {app.state.jobs[1].id}", "notices")
    viewer.until(lambda app: [job.name for job in app.state.jobs] == ["a.gif", "c.gif"])
    viewer.until_idle()  # the rows have moved together
    viewer.press(f"Cancel##job {app.state.jobs[0].id}", "notices")
    viewer.until(lambda app: [job.name for job in app.state.jobs] == ["c.gif"])
    gate.set()
    viewer.until(lambda app: not app.state.jobs)
    assert sorted(path.name for path in tmp_path.glob("*.gif")) == ["c.gif"]


def test_closing_asks_while_something_is_exported(viewer: Driver, tmp_path: Path, gate: threading.Event) -> None:
    app, out = viewer.app, tmp_path / "a.gif"
    gate.clear()
    start(viewer, out)
    app.do(do(saving.quit_window))
    assert app.state.prompt == "quit"
    viewer.press("Cancel", "prompt str")
    viewer.until(lambda app: app.state.prompt is None)
    app.do(do(saving.quit_window))
    viewer.press("Wait, then quit", "prompt str")
    viewer.until(lambda app: app.state.quits_when_done)
    assert not app.state.should_quit
    gate.set()
    viewer.until(lambda app: app.state.should_quit)
    with Image.open(out) as image:
        assert image.n_frames == SMALL.frames  # type: ignore[attr-defined]


def test_closing_gives_up_and_leaves_nothing(viewer: Driver, tmp_path: Path, gate: threading.Event) -> None:
    folder = tmp_path / "out"
    folder.mkdir()
    gate.clear()
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
        app.do(do(messages.show_prompt, None))
        viewer.until_idle()  # or the field that is typed in would keep its own text
        app.do(do(ask, ExportTask(kind, str(path))))
        viewer.until(lambda app: not app.state.tasks)
        asked = app.state.prompt
        assert isinstance(asked, ExportPrompt)
        assert (asked.already_there, bool(asked.problem)) == (kind == "sbs", kind != "sbs")
    assert there.read_text() == "mine"
    app.do(do(ask, ExportTask("sbs", str(tmp_path / "there.png"), replace(SMALL, frames=0), may_replace=True)))
    viewer.until(lambda app: bool(texts(app)))
    assert texts(app) == [f"Exported {there}"]
    assert app.state.prompt is None
    with Image.open(there) as image:
        assert image.size == (192, 64)


def test_where_it_goes_is_typed_at_once_and_seen_whole(
    viewer: Driver, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("viewer.app.pace.TOOLTIP_S", 0.5)  # as usual
    out = tmp_path / ("a" * 60 + ".gif")
    viewer.app.do(do(messages.show_prompt, ExportPrompt("gif", "somewhere.gif")))
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
    app.do(do(messages.show_prompt, ExportPrompt("gif", str(out))))
    window = "prompt ExportPrompt"
    expected = ExportOptions()
    for field, text, said in (
        ("##width", "48", {"size": ScreenSize(48, 32)}),
        ("##seconds", "0.2", {"frames": 3}),
        ("##rate", "10", {"rate": 10.0, "frames": 2}),
    ):
        viewer.press(field, window)
        viewer.type(text)
        viewer.send("key", "Tab")
        expected = replace(expected, **said)  # type: ignore[arg-type]
        asked = ExportPrompt("gif", str(out), expected)
        viewer.until(lambda app, asked=asked: app.state.prompt == asked)  # type: ignore[misc]
    viewer.press("Make it", window)
    viewer.until(lambda app: bool(texts(app)))
    assert texts(app) == [f"Exported {out}"]
    with Image.open(out) as image:
        assert (image.size, image.n_frames) == ((48, 32), 2)  # type: ignore[attr-defined]
        assert sum(frame.info["duration"] for frame in ImageSequence.Iterator(image)) == 200
