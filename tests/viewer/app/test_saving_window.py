"""Pictures saved in a real window: it stays usable meanwhile; a cancelled picture leaves nothing behind."""

import shutil
import threading
from itertools import product

import numpy as np
import pytest

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.resized_light import mean_of_areas
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError, ViewOffset, image_size
from tests.viewer.conftest import HEIGHT, WIDTH, says, write_scene
from viewer.app.jobs import Jobs
from viewer.app.picture_files import export_picture, read_settings
from viewer.app.saving import OPEN_PHOTO
from viewer.model import lens, messages, saving, viewpoint
from viewer.model.action import do
from viewer.model.saving import WRITING, SavePrompt
from viewer.model.tasks import PlainTask, SaveTask, ask
from viewer.ui.overlays.prompt_rows import BROWSE

SIZE = ScreenSize(150, 100)
LARGE = ScreenSize(1500, 1000)
TINY = ScreenSize(48, 32)


@pytest.fixture
def viewer(open_window, photo_path, monkeypatch):
    """One small step of a picture a turn, and many passes: so there are many turns however fast the machine is."""
    monkeypatch.setattr("viewer.app.side_effects.SAVE_BUDGET_S", 0.0)
    monkeypatch.setattr("viewer.app.main_loop.has_dialogs", lambda: True)
    monkeypatch.setattr("viewer.gpu.refocus.picture_drawing.STEP_S", 1e-4)
    driver = open_window(photo_path).until_idle()
    driver.do(do(lens.move_eye, ViewOffset(0.3, -0.7)), do(lens.set_aperture, 2.0))
    return driver


def save(path, size=TINY, may_replace=False, what="picture"):
    return do(ask, SaveTask(SavePrompt(str(path), size, what=what), may_replace))


def start(viewer, path):
    """Begin a large picture, and wait until some of it is drawn."""
    viewer.do(save(path, LARGE), until=lambda app: bool(app.state.jobs) and app.state.jobs[0].done > 0)


def test_the_window_stays_usable_while_a_picture_is_saved(viewer, tmp_path):
    app, out, asked = viewer.app, tmp_path / "out.exr", viewer.app.state
    light = app.scene_view.renderer.converged_picture(RenderSettings(asked.optics, SIZE, is_linear=True))
    app.do(save(out, SIZE))
    app.step()
    frames, turns, shares = app.frames_shown, 0, []
    while not viewer.texts():
        app.do(do(lens.move_eye, ViewOffset(0.01 * (turns % 50), 0.2)))
        app.step()
        turns += 1
        shares += [job.done for job in app.state.jobs]
    assert viewer.texts() == [f"Saved {out}"]
    assert shares == sorted(shares)
    assert app.frames_shown - frames >= len(set(shares)) > 2
    stored = read_settings(out)
    assert (stored.optics, stored.size_px) == (asked.optics, SIZE), "as it was when it was asked for"
    np.testing.assert_allclose(read_photo(out).pixels, srgb_from_linear(light), atol=1e-6)


def test_cancel_leaves_nothing_behind_and_the_next_is_saved(viewer, tmp_path):
    before, app = set(tmp_path.iterdir()), viewer.app
    start(viewer, tmp_path / "large.png")
    app.do(save(tmp_path / "large.png"))
    asked = SavePrompt(str(tmp_path / "large.png"), TINY, already_there=True)
    viewer.until(lambda app: app.state.prompt == asked)
    app.do(do(messages.show_prompt, None), save(tmp_path / "next.png"))
    viewer.until(lambda app: len(app.state.jobs) == 2)
    for _ in range(3):  # the rows settle
        app.step()
    viewer.press(f"Cancel##job {app.state.jobs[0].id}", "notices", until=lambda app: not app.state.jobs)
    assert viewer.texts() == [f"Saved {tmp_path / 'next.png'}"]
    assert set(tmp_path.iterdir()) - before == {tmp_path / "next.png"}


def test_enter_replaces_no_photo_and_a_failure_is_an_error(viewer, tmp_path, monkeypatch):
    """Enter, Enter: the first asks, the second cancels; the photo is named. A map is saved beside the photo again."""
    other, app = write_scene(tmp_path, "other", seed=1), viewer.app
    kept = other.read_bytes()
    app.do(do(messages.show_prompt, SavePrompt(str(other), TINY)))
    viewer.until_idle()
    viewer.find(BROWSE, "prompt SavePrompt")
    for already_there in (True, False, True):
        viewer.send("key", "Return")
        asked = SavePrompt(str(other), TINY, already_there)
        viewer.settle(lambda app, asked=asked: app.state.prompt == asked)
    assert other.read_bytes() == kept
    viewer.press("Replace other.png", "prompt SavePrompt", until=lambda app: viewer.texts() == [f"Saved {other}"])
    assert other.read_bytes() != kept

    def fail(*_):
        raise InputError("the disk is full")

    with monkeypatch.context() as broken:
        broken.setattr("viewer.app.saving.export_picture", fail)
        viewer.do(do(messages.dismiss), save(tmp_path / "a.png"), until=lambda app: bool(app.state.notices))
    assert [(notice.text, notice.is_error) for notice in app.state.notices] == [("the disk is full", True)]
    path = tmp_path / "scene_disparity.pfm"
    for may_replace in (False, True):
        app.do(do(messages.dismiss), save(path, may_replace=may_replace, what="map"))
        viewer.until(lambda app: len(app.state.notices) > 0)
        assert viewer.texts() == [f"Saved {path}"]


@pytest.mark.usefixtures("no_dialogs")
def test_a_bare_name_goes_to_the_folder_that_the_field_showed_and_stays_in_the_list(
    viewer, photo_path, tmp_path, monkeypatch
):
    """Also after an error, for which the field keeps the cursor."""
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    viewer.key("ctrl+s", settle=lambda app: isinstance(app.state.prompt, SavePrompt))
    for name in (" small.xyz", " small.png"):
        viewer.enter(name)
        viewer.until_idle()
    viewer.until(lambda app: bool(app.state.files))
    saved = photo_path.with_name("small.png")
    assert viewer.app.state.files[0].path == str(saved)
    assert read_settings(saved).optics == viewer.app.state.optics
    assert viewer.texts() == [f"Saved {saved}"]
    viewer.app.do(do(messages.dismiss))
    viewer.press("###files", settle=lambda app: app.state.prompt == "files")
    viewer.find("Show in folder##0", "prompt str")


def test_nothing_is_saved_onto_what_the_window_reads(viewer, photo_path):
    """The photo, the map beside it, an aperture: a reason, and no question whether to replace it."""
    shutil.copy(photo_path, photo_path.with_name("mask.png"))
    viewer.app.do(do(ask, PlainTask("read mask", str(photo_path.with_name("mask.png")))))
    viewer.until(lambda app: app.state.optics.aperture_shape.mask is not None)
    whats = ("picture", "map")
    for what, name in product(whats, ("scene.png", "scene_disparity.npy", "mask.png")):
        path = photo_path.with_name(name)
        before = path.read_bytes()
        viewer.app.do(do(messages.show_prompt, None))
        viewer.until_idle()  # an active field keeps its text
        viewer.do(save(path, may_replace=True, what=what), until=lambda app: isinstance(app.state.prompt, SavePrompt))
        prompt = viewer.app.state.prompt
        assert (prompt.path, prompt.already_there) == (str(path), False)
        assert prompt.problem
        assert (name == "scene.png") == (prompt.problem == OPEN_PHOTO)
        viewer.until_idle()
        assert path.read_bytes() == before, (what, name)


def test_closing_the_window_waits_for_what_is_being_written(viewer, tmp_path, monkeypatch):
    out, closes = tmp_path / "out.png", threading.Event()

    def write(*arguments):
        assert closes.wait(120)
        return export_picture(*arguments)

    def close(jobs):
        closes.set()
        close_jobs(jobs)

    close_jobs = Jobs.close
    monkeypatch.setattr("viewer.app.saving.export_picture", write)
    monkeypatch.setattr(Jobs, "close", close)
    viewer.do(save(out, SIZE), until=lambda app: bool(app.state.jobs) and app.state.jobs[0].doing == WRITING)
    viewer.close()
    assert read_photo(out).pixels.shape == (*SIZE[::-1], 3)
    assert not list(tmp_path.glob(".iibr-*"))


@pytest.fixture
def large(open_window, photo_path):
    """The photo is four times as large as its views."""
    driver = open_window(photo_path, max_pixels=WIDTH * HEIGHT // 4).until_idle()
    return driver


@pytest.mark.parametrize("aperture", [0.0, 2.5])
def test_a_picture_is_saved_at_the_photos_own_size(large, photo_path, tmp_path, aperture):
    """By default it has all of the photo's pixels; what is out of focus is as in the views."""
    app, out = large.app, tmp_path / "out.png"
    app.do(do(lens.set_aperture, aperture), do(saving.ask_to_save))
    prompt = app.state.prompt
    assert prompt.size_px == (WIDTH, HEIGHT)
    app.do(save(out, prompt.size_px))
    large.until(says(f"Saved {out}"))
    saved, photo = read_photo(out).pixels, read_photo(photo_path).pixels
    assert saved.shape == photo.shape
    if aperture == 0:
        np.testing.assert_allclose(saved, photo, atol=1.01 / 255)
    shown = app.scene_view.renderer.converged_picture(RenderSettings(app.state.optics, app.state.scene.size))
    shown = linear_from_srgb(shown / np.float32(255))
    smaller = mean_of_areas(linear_from_srgb(saved), image_size(shown))
    assert np.abs(smaller - shown).mean() < 0.01


def test_a_free_cameras_picture_is_the_windows_at_any_size(large, tmp_path):
    app, out = large.app, tmp_path / "out.png"
    large.do(do(viewpoint.move_camera, 0.2, 0.1, 0.2), until=lambda app: app.free_camera_view.shown is not None)
    large.until_idle()
    shown = large.red_place()[0] / large.image().shape[1], large.red_place()[1] / large.image().shape[0]
    app.do(save(out, ScreenSize(WIDTH, HEIGHT)))
    large.until(says(f"Saved {out}"))
    saved = read_photo(out).pixels
    rows, columns = np.nonzero(saved[..., 0] > saved[..., 1] + 60 / 255)
    assert (columns.mean() / WIDTH, rows.mean() / HEIGHT) == pytest.approx(shown, abs=0.02)
    assert shown[0] < 0.45, "the camera looks aside"


def test_a_photo_that_was_replaced_meanwhile_is_noticed(large, photo_path, tmp_path):
    out = tmp_path / "out.png"
    shutil.copy(write_scene(tmp_path, "other", seed=3), photo_path)
    large.app.do(save(out, ScreenSize(WIDTH, HEIGHT)))
    large.until(says("was changed since it was opened"))
    assert not out.exists()
