"""Opening, prompts, keys, preferences, notices and what goes wrong, in a real window."""

from dataclasses import replace

import glfw
import numpy as np
import pytest
from imgui_bundle import imgui

from iibr_core.beyond.optics import Optics
from iibr_core.formats.images.metadata import SETTINGS_KEY
from iibr_core.formats.images.write import write_image
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import rests, says, shows
from viewer.app.pace import NoticeClock
from viewer.app.preferences_store import load_preferences
from viewer.model import lens, messages, opening, preferences, saving
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.browsing import PathPrompt
from viewer.model.commands import BY_NAME, COMMANDS, PalettePrompt
from viewer.model.layout import PANEL_WIDTH
from viewer.model.messages import RESULT_S, Notice
from viewer.model.saving import ExportPrompt, SavePrompt
from viewer.model.tasks import PlainTask, SaveTask, ask
from viewer.ui.overlays.path_prompt import browsed_paths

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
    viewer.drop(out, settle=shows("saved"))
    assert viewer.app.state.optics == Optics()
    viewer.press("Use its settings", "notices", until=lambda app: app.state.optics == wanted)
    assert not any(notice.offer for notice in viewer.app.state.notices)
    damaged = tmp_path / "damaged.png"
    write_image(damaged, np.full((64, 96, 3), 100, np.uint8), {SETTINGS_KEY: '{"format": 1, "optics": {}}'})
    viewer.drop(damaged, until=shows("damaged"))
    assert viewer.app.state.optics == Optics()
    assert [notice.is_error for notice in viewer.app.state.notices if "settings" in notice.text] == [True]


def test_a_mask_is_asked_for_read_and_shapes_the_aperture(viewer, tmp_path):
    mask = tmp_path / "star.png"
    write_image(mask, np.eye(9, dtype=np.uint8) * 200)
    viewer.press("##mask", settle=lambda app: app.state.prompt is not None)
    viewer.enter(mask.name, until=lambda app: app.state.optics.aperture_shape.mask is not None)
    shape = viewer.app.state.optics.aperture_shape
    assert shape.kind == "mask"
    assert (shape.mask.name, shape.mask.rows, shape.mask.columns) == ("star.png", 9, 9)
    write_image(tmp_path / "dark.png", np.zeros((8, 8), np.uint8))
    viewer.do(do(ask, PlainTask("read mask", str(tmp_path / "dark.png"))), until=says("dark.png"))
    assert viewer.app.state.optics.aperture_shape == shape, "a mask without light changes nothing"


def test_what_was_chosen_is_there_again_the_next_time(open_window, photo_path, tmp_path):
    kept = tmp_path / "kept"
    first = open_window(photo_path, kept_in=kept, grid=GridShape(1, 1)).until_idle()
    first.press("###section More", settle=lambda app: "more" in app.state.preferences.open_sections)
    preferences = first.app.state.preferences
    assert load_preferences(AppState(), kept).preferences.open_sections == preferences.open_sections, "after a crash"
    glfw.set_window_pos(first.app.window.handle, 40, 50)
    first.until(lambda app: app.state.preferences.window[:2] == (40, 50))
    preferences = first.app.state.preferences
    first.close()
    second = open_window(None, kept_in=kept)
    second.until(lambda app: app.frames_shown > 0)
    assert second.app.state.preferences == preferences
    assert second.app.state.recent == (str(photo_path),)


def test_stopping_keeps_the_views_that_are_there(open_window, photo_path):
    driver = open_window(photo_path, grid=GridShape(41, 41))
    driver.until(lambda app: app.state.progress.done > 3)
    driver.do(do(opening.stop), until=lambda app: rests(app))
    made = driver.app.scene_view.field.present.sum()
    assert 3 < made < 41 * 41
    assert driver.app.scene_view.field.present.sum() == made == len(driver.app.state.views_there)
    assert "stopped at" in driver.app.state.progress.doing


def test_about_opens_the_page_of_releases_only_when_that_is_asked_for(viewer, monkeypatch):
    opened = []
    pages = {"Releases": "https://example.org/releases", "Documentation": "https://example.org/docs"}
    monkeypatch.setattr("viewer.ui.overlays.prompt_overlay.program_pages", lambda: pages)
    monkeypatch.setattr("viewer.app.side_effects.typer.launch", lambda place, locate: opened.append(place))
    viewer.key("F1", until=lambda app: app.state.prompt == "help")
    viewer.press("About", "prompt str", settle=lambda app: app.state.prompt == "about")
    assert not opened
    viewer.press("Look for a newer version", "prompt str", until=lambda app: bool(opened))
    viewer.press("Libraries and licences", "prompt str", until=lambda app: len(opened) == 2)
    assert opened == ["https://example.org/releases", "https://example.org/docs/licences.md"]


def test_keys_for_help_palette_text_size_and_exports(viewer):
    viewer.key("F1", settle=lambda app: app.state.prompt == "help")
    viewer.key("Escape", until=lambda app: app.state.prompt is None)
    assert not viewer.app.state.should_quit
    viewer.key("ctrl+p", settle=lambda app: isinstance(app.state.prompt, PalettePrompt))
    viewer.key("Escape", until=lambda app: app.state.prompt is None)
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


@pytest.fixture
def usual_tooltips(soon, monkeypatch):
    """Tooltips come when they usually do."""
    monkeypatch.setattr("viewer.app.pace.TOOLTIP_S", 0.5)


def test_the_palette_loses_nothing_that_is_typed_early_and_arrows_and_enter_run_a_command(viewer):
    """In slow frames: a letter for each of those that it takes to come up. The command is far down the list."""
    viewer.app.do(do(messages.show_prompt, PalettePrompt()))
    for typed in ("d", "i", "f", "f", "er"):
        imgui.get_io().add_input_characters_utf8(typed)
        viewer.app.step()
    viewer.until_idle()
    assert viewer.app.state.prompt == PalettePrompt("differ")
    place = [command.name for command in COMMANDS].index("Preset: macro")
    assert place > 12, "else nothing scrolls"
    viewer.do(do(messages.show_prompt, None))
    viewer.do(do(messages.show_prompt, PalettePrompt("", place - 3)))
    for _ in range(3):
        viewer.send("key", "Down")
        viewer.app.step()
    viewer.settle(lambda app: app.state.prompt == PalettePrompt("", place))
    viewer.key("Return", until=lambda app: app.state.optics.aperture_diameter > 3)
    assert viewer.app.state.prompt is None


def test_the_help_stands_in_the_panels_place_and_leaves_the_picture_to_be_seen(viewer):
    for hides_panel in (False, True):
        viewer.app.state = replace(viewer.app.state, hides_panel=hides_panel)
        viewer.do(do(messages.show_prompt, "help"))
        pad, window = imgui.internal.find_window_by_name("prompt str"), viewer.app.layout().window
        assert (pad.pos.x + pad.size.x, pad.size.y) == (window.width, window.height)
        assert pad.scroll_max.x == pad.scroll_max.y == 0, "its rows scroll, its button stays"
        assert pad.size.x == PANEL_WIDTH
        viewer.press("Close", "prompt str", until=lambda app: app.state.prompt is None)


@pytest.mark.usefixtures("usual_tooltips")
def test_tooltips_come_up_before_the_window_sleeps(viewer):
    for button in ("Portrait", "Macro"):
        viewer.find(button)
        viewer.until_idle()
        tip = imgui.internal.find_window_by_name("##Tooltip_00")
        assert tip is not None, button
        assert tip.active, button
        assert tip.hidden_frames_can_skip_items <= 0, button
        viewer.send("mousemove", *viewer.position(0.1, 0.1))
        viewer.until_idle()


@pytest.mark.usefixtures("wide_window", "usual_tooltips")
def test_tooltips_of_a_prompt_leave_it_to_be_seen(viewer):
    viewer.do(do(preferences.set_font_scale, 2.0), do(messages.show_prompt, ExportPrompt("sbs", "a.png")))
    viewer.find("##3D strength", "prompt ExportPrompt")
    viewer.until_idle()
    tip, prompt = (imgui.internal.find_window_by_name(name) for name in ("##Tooltip_00", "prompt ExportPrompt"))
    assert tip.active
    is_beside = tip.pos.x + tip.size.x <= prompt.pos.x
    assert is_beside or tip.pos.y >= prompt.pos.y + prompt.size.y or tip.pos.y + tip.size.y <= prompt.pos.y
    assert 0 <= tip.pos.x <= viewer.app.layout().window.width - tip.size.x


def test_another_purpose_of_an_export_shows_its_rows_at_once(viewer):
    viewer.do(do(saving.ask_to_export))
    viewer.until_idle()
    window = imgui.internal.find_window_by_name("prompt ExportPrompt")
    heights = [window.size.y]
    viewer.find("3D displays", "prompt ExportPrompt")
    viewer.send("click", 1)
    viewer.until(lambda app: heights.append(window.size.y) or app.state.prompt.kind == "quilt")
    for _ in range(5):
        viewer.app.step()
        heights.append(window.size.y)
    assert min(heights) >= min(heights[0], heights[-1]), "no frame without rows"


def test_escape_closes_a_drop_down_and_then_the_prompt_under_it(viewer):
    viewer.do(do(saving.ask_to_export))
    viewer.press("##kind", "prompt ExportPrompt", until=lambda app: is_menu_open())
    viewer.key("Escape", settle=lambda app: not is_menu_open())
    assert isinstance(viewer.app.state.prompt, ExportPrompt)
    viewer.key("Escape", until=lambda app: app.state.prompt is None)


def is_menu_open():
    return bool(imgui.is_popup_open("", imgui.PopupFlags_.any_popup))


def test_a_wrong_ending_keeps_what_was_typed_and_a_problem_moves_neither_the_prompt_nor_its_buttons(viewer, tmp_path):
    viewer.do(do(saving.ask_to_save))
    viewer.enter("a.jqg", until=lambda app: isinstance(app.state.prompt, SavePrompt) and bool(app.state.prompt.problem))
    prompt = viewer.app.state.prompt
    assert prompt.path == str(tmp_path / "a.jqg")
    assert ".png" in prompt.problem
    viewer.until_idle()
    viewer.key("Escape", settle=lambda app: app.state.prompt is None)
    places = []
    for problem in ("", "This is the open photo. Choose another name."):
        viewer.do(do(messages.show_prompt, SavePrompt("scene.png", ScreenSize(48, 32), problem=problem)))
        window = imgui.internal.find_window_by_name("prompt SavePrompt")
        places.append((window.pos.y, viewer.find("Save", "prompt SavePrompt")))
    assert places[0] == places[1]


def test_one_notice_is_shown_at_a_time_and_all_are_closed_at_once(viewer, monkeypatch):
    heights = []
    for number in range(3):
        viewer.do(do(messages.notify, Notice(f"Notice {number}, as long as the others are.")))
        heights.append(imgui.internal.find_window_by_name("notices").size.y)
    assert heights[2] == heights[1], "they do not pile up"
    viewer.press("Close all (3)", "notices", until=lambda app: not app.state.notices)
    viewer.do(do(messages.notify, Notice("A message that goes with the first click.")))
    monkeypatch.setattr("viewer.app.pointer.PANEL_CLICK_S", 60.0)
    viewer.press("×", "notices", until=lambda app: not app.state.notices)
    for button, is_down in (("mousedown", True), ("mouseup", False)):
        viewer.send(button, 1)
        viewer.until(lambda app, is_down=is_down: imgui.get_io().mouse_down[0] == is_down)
    viewer.until_idle()
    assert viewer.app.state.focused_at is None, "a double click on a message never reaches the picture"
    assert not viewer.app.state.history.past


def test_results_go_unless_the_pointer_rests_on_them_and_errors_stay():
    clock, error, result = NoticeClock(), Notice("It failed.", is_error=True), Notice("Saved", is_result=True)
    state = AppState(notices=(error, result))
    for now_s, is_held in ((0.0, False), (RESULT_S, True), (1.9 * RESULT_S, False)):
        assert clock.expire(state, now_s, is_held) == []
    assert clock.expire(state, 2.1 * RESULT_S, False) == [do(messages.dismiss, result)]
    state = AppState(notices=(error,))
    assert clock.expire(state, 0.0, False) == clock.expire(state, 1e9, False) == []


def test_a_typed_path_opens_and_a_typo_keeps_the_prompt(viewer, tmp_path):
    (tmp_path / "inner").mkdir()
    write_image(tmp_path / "inner" / "other.png", np.full((64, 96, 3), 100, np.uint8))
    viewer.do(BY_NAME["Open a photo…"].action(viewer.app.state), settle=lambda app: typed_path(app) == f"{tmp_path}/")
    viewer.enter("inner/othr.png")
    viewer.settle(lambda app: isinstance(app.state.prompt, PathPrompt) and bool(app.state.prompt.problem))
    before = viewer.app.state
    viewer.send("type", "fkvtg")
    viewer.until_idle()
    assert viewer.app.state.preferences == before.preferences, "letters are no commands now"
    assert viewer.app.state.inspection == before.inspection
    viewer.press("##path", "prompt PathPrompt")
    viewer.enter("inner/other.png", until=shows("other"))
    assert viewer.app.state.prompt is None


def typed_path(app):
    return app.state.prompt.path if isinstance(app.state.prompt, PathPrompt) else None


def cells(viewer):
    """The name of the part of the prompt that shows what a folder holds."""
    viewer.settle(lambda app: bool(browsed_paths(app.state)))
    prompt = imgui.internal.find_window_by_name("prompt PathPrompt")
    return f"prompt PathPrompt/entries_{prompt.get_id('entries'):08X}"


def test_a_folder_is_walked_through_by_clicks_and_tab_completes_names(viewer, tmp_path):
    (tmp_path / "Inner" / "deep").mkdir(parents=True)
    for name in ("deep/one.png", "other.png"):
        write_image(tmp_path / "Inner" / name, np.full((64, 96, 3), 100, np.uint8))
    viewer.app.do(BY_NAME["Open a photo…"].action(viewer.app.state))
    viewer.press("photo Inner/", cells(viewer))
    viewer.press("photo deep/", cells(viewer))
    viewer.until(lambda app: set(browsed_paths(app.state)) == {str(tmp_path / "Inner" / "deep" / "one.png")})
    viewer.press("photo ..", cells(viewer))
    viewer.press("##path", "prompt PathPrompt")
    viewer.type(f"{tmp_path}/in")
    viewer.key("Tab", until=lambda app: typed_path(app) == f"{tmp_path}/Inner/")
    viewer.press("photo other.png", cells(viewer), until=shows("other"))
    assert viewer.app.state.prompt is None
