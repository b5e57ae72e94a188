"""Requests of the window to the outside world, without a window: files, folders and dialogs that are not there."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.images.write import write_image
from iibr_core.scenes.scene import Source
from tests.golden_text import assert_same_text
from tests.viewer.conftest import headless_with_scene
from tests.viewer.model.told import EXACT, changes, title, words
from viewer.app.side_effects import SideEffects
from viewer.model import tasks
from viewer.model.browsing import PathPrompt
from viewer.model.demo_photo import demo_photo
from viewer.model.tasks import ChooseTask, FocusTask, ListTask, PlainTask, TakePathTask

KINDS = "photo", "mask", "map", "model"
ASKED = (
    *(ChooseTask(what) for what in ("photo", "folder", "mask")),
    *(TakePathTask(PathPrompt(what, "inner/../scene.png")) for what in KINDS),
    *(TakePathTask(PathPrompt("photo", path)) for path in ("inner/", " ~/inner ", "inner/othr.png", "")),
    *(ListTask(PathPrompt(what, "inner/")) for what in KINDS),
    *(ListTask(PathPrompt("photo", path)) for path in ("", "~/", "gone/")),
    *(PlainTask("read mask", name) for name in ("~/star.png", "dark.png", "gone.png")),
    *(PlainTask("read facts", name) for name in ("photo.jpg", "scene.png", "gone.jpg")),
    PlainTask("list folder", "gone"), PlainTask("find recent"),
    *map(FocusTask, ((0.32, 0.0), (0.36, 0.0), (0.0, -0.47), (0.0, -0.55))),
)  # fmt: skip


@pytest.fixture
def folder(tmp_path, monkeypatch, no_dialogs):
    """Photos, maps, masks and folders; it is the home and the working directory, too."""
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.chdir(tmp_path)
    exif = Image.Exif()
    exif[0x010F], exif[0x0110] = "Maker", "Model 7"
    exif.get_ifd(0x8769).update({0x829A: 1 / 60, 0x829D: 2.8, 0x8827: 200, 0x920A: 35.0, 0xA405: 52})
    Image.fromarray(np.full((48, 64, 3), 90, np.uint8)).save(tmp_path / "photo.jpg", exif=exif)
    write_image(tmp_path / "star.png", np.arange(12, dtype=np.uint8).reshape(3, 4) * 20)
    write_image(tmp_path / "dark.png", np.zeros((8, 8), np.uint8))
    for name in ("IMG_10.jpg", "IMG_9.JPG", "IMG_9_depth.png", ".hidden.jpg", "notes.txt", "net.onnx", "a.pfm"):
        (tmp_path / "inner" / "deep").mkdir(parents=True, exist_ok=True)
        (tmp_path / "inner" / name).touch()
    return tmp_path


def answers(effects, state, task):
    """Return the actions that come of a task."""
    actions = effects.advance(tasks.ask(replace(state, tasks=()), task))[1:]
    while effects._results:
        actions += effects.advance(replace(state, tasks=()))
    return actions


def test_each_task_is_answered(folder, regenerate_golden):
    lines = []
    with headless_with_scene(folder) as viewer:
        effects = SideEffects(viewer.view, lambda: None, lambda: "")
        recent = (str(folder / "gone.png"), str(folder / "scene.png"))
        opened = replace(viewer.state, recent=recent)
        elsewhere = replace(opened, source=Source(str(folder / "inner" / "IMG_10.jpg")), scene=None)
        inner = replace(opened.preferences, opened_folder=str(folder / "inner"))
        states = {
            "open": opened, "elsewhere": elsewhere, "empty": replace(opened, source=None, scene=None),
            "demo": replace(opened, source=Source(str(demo_photo())), preferences=inner),
        }  # fmt: skip
        for name, state in states.items():
            for task in ASKED:
                state_now = replace(state, tasks=())
                for action in answers(effects, state, task):
                    what = [title(action)] if action.verb.__module__.startswith("viewer.model") else []
                    what = what or list(changes(state_now, action.apply(state_now)))
                    lines += [f"{name}, {words(task)}: {each}" for each in what]
        effects.close()
    told = [line.replace(str(folder), "<folder>") for line in lines]
    assert_same_text(told, "viewer/stories", "outside world", regenerate_golden, *EXACT)
