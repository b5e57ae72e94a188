"""Opening, saving, prompts, keys, preferences and what goes wrong, in a real window."""

import numpy as np
import pytest
from imgui_bundle import imgui

from iibr_core.beyond.optics import Optics
from iibr_core.formats.images.metadata import SETTINGS_KEY
from iibr_core.formats.images.write import write_image
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import rests
from viewer.app.preferences_store import load_preferences
from viewer.model import lens, opening
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.commands import PalettePrompt
from viewer.model.saving import ExportPrompt, SavePrompt
from viewer.model.tasks import PlainTask, SaveTask, ask

pytestmark = pytest.mark.usefixtures("no_dialogs")


def test_a_dropped_saved_picture_offers_its_settings(viewer, tmp_path):
    out = tmp_path / "saved.png"
    viewer.app.do(
        do(lens.move_eye, ViewOffset(1, 1)),
        do(lens.set_aperture, 1.5),
        do(ask, SaveTask(SavePrompt(str(out), ScreenSize(96, 64)))),
    )
    viewer.until(lambda app: out.exists())
    wanted = viewer.app.state.optics
    np.save(tmp_path / "saved_disparity.npy", np.load(tmp_path / "scene_disparity.npy"))
    viewer.app.window.on_drop(None, [str(out)])
    viewer.settle(lambda app: app.state.scene is not None and app.state.scene.name == "saved")
    assert viewer.app.state.optics == Optics()
    viewer.press("Use its settings", "notices")
    viewer.until(lambda app: app.state.optics == wanted)
    assert not any(notice.offer for notice in viewer.app.state.notices)
    damaged = tmp_path / "damaged.png"
    write_image(damaged, np.full((64, 96, 3), 100, np.uint8), {SETTINGS_KEY: '{"format": 1, "optics": {}}'})
    viewer.app.window.on_drop(None, [str(damaged)])
    viewer.until(lambda app: app.state.scene is not None and app.state.scene.name == "damaged")
    assert viewer.app.state.optics == Optics()
    assert [notice.is_error for notice in viewer.app.state.notices if "settings" in notice.text] == [True]


def test_a_mask_is_asked_for_read_and_shapes_the_aperture(viewer, tmp_path):
    mask = tmp_path / "star.png"
    write_image(mask, np.eye(9, dtype=np.uint8) * 200)
    viewer.press("##mask")
    viewer.settle(lambda app: app.state.prompt is not None)
    viewer.type(mask.name)
    viewer.send("key", "Return")
    viewer.until(lambda app: app.state.optics.aperture_shape.mask is not None)
    shape = viewer.app.state.optics.aperture_shape
    assert shape.kind == "mask"
    assert (shape.mask.name, shape.mask.rows, shape.mask.columns) == ("star.png", 9, 9)
    write_image(tmp_path / "dark.png", np.zeros((8, 8), np.uint8))
    viewer.app.do(do(ask, PlainTask("read mask", str(tmp_path / "dark.png"))))
    viewer.until(lambda app: any("dark.png" in notice.text for notice in app.state.notices))
    assert viewer.app.state.optics.aperture_shape == shape, "a mask without light changes nothing"


def test_what_was_chosen_is_there_again_the_next_time(open_window, photo_path, tmp_path):
    kept = tmp_path / "kept"
    first = open_window(photo_path, kept_in=kept, grid=GridShape(1, 1))
    first.until_idle()
    first.press("###section More")
    first.settle(lambda app: "more" in app.state.preferences.open_sections)
    preferences = first.app.state.preferences
    assert load_preferences(AppState(), kept).preferences.open_sections == preferences.open_sections, "after a crash"
    first.close()
    second = open_window(None, kept_in=kept)
    second.until(lambda app: app.frames_shown > 0)
    assert second.app.state.preferences == preferences
    assert second.app.state.recent == (str(photo_path),)


def test_stopping_keeps_the_views_that_are_there(open_window, photo_path):
    driver = open_window(photo_path, grid=GridShape(41, 41))
    driver.until(lambda app: app.state.progress.done > 3)
    driver.app.do(do(opening.stop))
    driver.until(lambda app: rests(app))
    made = driver.app.scene_view.field.present.sum()
    assert 3 < made < 41 * 41
    assert driver.app.scene_view.field.present.sum() == made == len(driver.app.state.views_there)
    assert "stopped at" in driver.app.state.progress.doing


def test_the_panel_says_how_the_photo_was_taken(open_window, tmp_path):
    from PIL import Image

    exif = Image.Exif()
    exif[0x010F] = "Maker"
    exif.get_ifd(0x8769).update({0x829A: 1 / 60, 0x8827: 200})
    Image.fromarray(np.full((48, 64, 3), 90, np.uint8)).save(tmp_path / "a.jpg", exif=exif)
    driver = open_window(tmp_path / "a.jpg", grid=GridShape(1, 1))
    driver.until(lambda app: app.state.facts is not None)
    assert driver.app.state.facts.facts == (("Camera", "Maker"), ("Exposure", "1/60 s, ISO 200"))


def test_about_opens_the_page_of_releases_only_when_that_is_asked_for(viewer, monkeypatch):
    opened = []
    pages = {"Releases": "https://example.org/releases", "Documentation": "https://example.org/docs"}
    monkeypatch.setattr("viewer.ui.overlays.prompt_overlay.program_pages", lambda: pages)
    monkeypatch.setattr("viewer.app.side_effects.typer.launch", lambda place, locate: opened.append(place))
    viewer.send("key", "F1")
    viewer.until(lambda app: app.state.prompt == "help")
    viewer.press("About", "prompt str")
    viewer.settle(lambda app: app.state.prompt == "about")
    assert not opened
    viewer.press("Look for a newer version", "prompt str")
    viewer.until(lambda app: bool(opened))
    viewer.press("Libraries and licences", "prompt str")
    viewer.until(lambda app: len(opened) == 2)
    assert opened == ["https://example.org/releases", "https://example.org/docs/licences.md"]


def test_keys_for_help_palette_text_size_and_exports(viewer):
    viewer.send("key", "F1")
    viewer.settle(lambda app: app.state.prompt == "help")
    viewer.send("key", "Escape")
    viewer.until(lambda app: app.state.prompt is None)
    assert not viewer.app.state.should_quit
    viewer.send("key", "ctrl+p")
    viewer.settle(lambda app: isinstance(app.state.prompt, PalettePrompt))
    viewer.send("key", "Escape")
    viewer.until(lambda app: app.state.prompt is None)
    before = viewer.app.layout().panel.width
    viewer.send("key", "ctrl+equal", "key", "ctrl+equal")
    viewer.until(lambda app: app.layout().panel.width > 1.2 * before)
    viewer.send("key", "ctrl+minus", "key", "ctrl+0")
    viewer.until(lambda app: app.layout().panel.width == before)
    viewer.send("keydown", "ctrl")
    viewer.until(lambda app: imgui.get_io().key_ctrl)
    viewer.send("keydown", "e", "keyup", "e", "keyup", "ctrl")
    viewer.until(lambda app: isinstance(app.state.prompt, ExportPrompt))
    assert not viewer.app.state.inspection.shows_epis
