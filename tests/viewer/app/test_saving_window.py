"""Pictures saved in a real window: it lives on meanwhile; what is given up leaves nothing behind."""

from __future__ import annotations

import shutil
import threading
import time
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from iibr_core.beyond.resized_light import mean_of_areas
from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.exports.full_picture import FullPicture
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.formats.images.photo import read_photo
from iibr_core.runtime.work import Cancelled, is_stopped
from iibr_core.types import (
    GridShape,
    InputError,
    ViewOffset,
    ViewUpdate,
    image_size,
)
from tests.viewer.conftest import HEIGHT, WIDTH, Driver, Opener, write_scene
from viewer.app.image_export import export_picture
from viewer.app.job_queue import JobQueue
from viewer.app.pace import SETTLING_FRAMES
from viewer.model import lens, messages, saving
from viewer.model.action import ask, do
from viewer.model.saved_settings import read_settings
from viewer.model.state.jobs import WAITING_FOR_VIEWS, WRITING, CancelJobTask, JobProgress
from viewer.model.state.prompts import Saved, SavePrompt
from viewer.model.state.tasks import ReadMaskTask, SaveTask

SIZE = 150, 100
LARGER = 600, 400
LARGE = 1500, 1000


@pytest.fixture
def viewer(open_window: Opener, photo_path: Path, monkeypatch: pytest.MonkeyPatch) -> Driver:
    """One small step of a picture a turn, and many passes: so there are many turns however fast the machine is."""
    monkeypatch.setattr("viewer.gpu.refocus.picture_lens.MIN_CAMERAS", 64)
    monkeypatch.setattr("viewer.gpu.refocus.picture_lens.MAX_CAMERAS", 64)
    monkeypatch.setattr("viewer.app.main_loop.SAVE_BUDGET_S", 0.0)
    monkeypatch.setattr("viewer.gpu.refocus.picture_drawing.STEP_S", 1e-4)
    driver = open_window(photo_path, grid=GridShape(3, 3))
    driver.until_idle()
    driver.send("mousemove", *driver.position(0.1, 0.1))
    driver.app.do(do(lens.move_eye, ViewOffset(0.3, -0.7)), do(lens.set_aperture, 2.0))
    driver.until_idle()
    return driver


def start(viewer: Driver, path: Path, size_px: tuple[int, int] = LARGE) -> None:
    """Ask for a picture, and wait until some of it is drawn."""
    viewer.app.do(do(ask, SaveTask(str(path), size_px)))
    viewer.until(lambda app: bool(app.state.jobs) and app.state.jobs[0].done > 0)


def job_of(viewer: Driver) -> JobProgress:
    """The one that was asked for first."""
    return viewer.app.state.jobs[0]


def texts(viewer: Driver) -> list[str]:
    return [notice.text for notice in viewer.app.state.notices]


@pytest.mark.parametrize("name", ["out.png", "out.exr"])
def test_the_window_lives_on_while_a_picture_is_saved(viewer: Driver, tmp_path: Path, name: str) -> None:
    app, out = viewer.app, tmp_path / name
    asked = app.state
    expected = app.scene_view.renderer.converged_picture(
        RenderSettings(asked.optics, SIZE, is_linear=name.endswith("exr"))
    )
    expected = srgb_from_linear(expected) if name.endswith("exr") else expected
    app.do(do(ask, SaveTask(str(out), SIZE)))
    app.step()
    frames, drawn, turns, shares = app.frames_shown, app.scene_view.pictures_drawn, 0, []
    while not texts(viewer):
        app.do(do(lens.move_eye, ViewOffset(0.01 * (turns % 50), 0.2)))
        app.step()
        turns += 1
        if app.state.jobs:
            shares.append(job_of(viewer).done)
            assert job_of(viewer).done in (0, 1) or app.wait_s == 0.0
    assert texts(viewer) == [f"Saved {out}"]
    assert not app.state.jobs
    assert shares == sorted(shares)
    assert len(set(shares)) > 5
    assert min(app.frames_shown - frames, app.scene_view.pictures_drawn - drawn) > len(set(shares))
    settings = read_settings(out)
    assert (settings.optics, settings.size_px) == (asked.optics, SIZE), "as it was when it was asked for"
    shade = 0.51 / 255 if name.endswith("png") else 1e-6
    np.testing.assert_allclose(read_photo(out).pixels, expected / (255 if name.endswith("png") else 1), atol=shade)


def test_views_that_come_again_wait_until_the_picture_is_drawn(viewer: Driver, tmp_path: Path) -> None:
    """Else each would make it begin again."""
    app, out = viewer.app, tmp_path / "large.png"
    start(viewer, out, LARGER)
    uploaded = app.scene_view.views_uploaded
    again = ViewUpdate(0, 0, np.zeros((HEIGHT, WIDTH, 3), np.uint8), np.zeros((HEIGHT, WIDTH), np.float32))
    app.scene_view.add(again)
    app.step()
    assert app.scene_view.views_uploaded == uploaded
    assert app.wait_s == 0.0
    viewer.until(lambda app: bool(texts(viewer)))
    viewer.until(lambda app: app.scene_view.views_uploaded == uploaded + 1)


def test_cancel_leaves_nothing_behind_and_the_next_is_saved(viewer: Driver, tmp_path: Path) -> None:
    before = set(tmp_path.iterdir())
    start(viewer, tmp_path / "large.png")
    viewer.app.do(do(ask, SaveTask(str(tmp_path / "next.png"), (48, 32))))
    viewer.until(lambda app: len(app.state.jobs) == 2)
    for _ in range(SETTLING_FRAMES):  # the first row moves up
        viewer.app.step()
    viewer.press(f"Cancel##job {job_of(viewer).id}", "notices")
    viewer.until(lambda app: [job.name for job in app.state.jobs] in ([], ["next.png"]))
    viewer.until(lambda app: not app.state.jobs)
    assert texts(viewer) == [f"Saved {tmp_path / 'next.png'}"]
    assert set(tmp_path.iterdir()) - before == {tmp_path / "next.png"}
    viewer.app.do(do(ask, CancelJobTask(1)))
    viewer.until_idle()


def test_pictures_are_saved_in_the_order_in_which_they_were_asked_for(viewer: Driver, tmp_path: Path) -> None:
    eyes = [ViewOffset(0.0, s) for s in (-1.0, 0.0, 1.0)]
    for i, eye in enumerate(eyes):
        viewer.app.do(do(lens.move_eye, eye), do(ask, SaveTask(str(tmp_path / f"{i}.png"), (48, 32))))
        viewer.app.step()
    viewer.until(lambda app: len(app.state.notices) == 3 and not app.state.jobs)
    assert texts(viewer) == [f"Saved {tmp_path / f'{i}.png'}" for i in range(3)]
    assert [read_settings(tmp_path / f"{i}.png").optics.eye for i in range(3)] == eyes


def test_a_file_that_waits_to_be_written_is_replaced_only_when_that_is_said(viewer: Driver, tmp_path: Path) -> None:
    out = tmp_path / "large.png"
    start(viewer, out)
    viewer.app.do(do(ask, SaveTask(str(out), (48, 32))))
    viewer.until(lambda app: app.state.prompt == SavePrompt(str(out), (48, 32), already_there=True))
    assert not out.exists()


def test_nothing_is_saved_onto_what_the_window_reads(viewer: Driver, photo_path: Path) -> None:
    """The photo, the map beside it, an aperture: a notice, and no question whether to replace it."""
    shutil.copy(photo_path, photo_path.with_name("mask.png"))
    viewer.app.do(do(ask, ReadMaskTask(str(photo_path.with_name("mask.png")))))
    viewer.until(lambda app: app.state.optics.aperture_shape.mask is not None)
    whats: tuple[Saved, ...] = ("picture", "map")
    for what, name in product(whats, ("scene.png", "scene_disparity.npy", "mask.png")):
        path = photo_path.with_name(name)
        before = path.read_bytes()
        viewer.app.do(do(messages.dismiss), do(ask, SaveTask(str(path), (48, 32), may_replace=True, what=what)))
        viewer.until(lambda app: bool(app.state.notices))
        expected = "can be written as .png, .jpg" if (what, path.suffix) == ("picture", ".npy") else "is read here"
        assert expected in texts(viewer)[0], (what, name)
        viewer.until_idle()
        assert path.read_bytes() == before, (what, name)


def test_a_map_that_was_saved_may_be_saved_again(viewer: Driver, tmp_path: Path) -> None:
    """It lies beside the photo, but was not read; it is replaced where that is said."""
    path = tmp_path / "scene_disparity.pfm"
    for may_replace in (False, True):
        viewer.app.do(do(ask, SaveTask(str(path), (48, 32), may_replace, "map")))
        viewer.until(lambda app: len(app.state.notices) > 0)
        assert texts(viewer) == [f"Saved {path}."]
        viewer.app.do(do(messages.dismiss, viewer.app.state.notices[0]))
    viewer.app.do(do(ask, SaveTask(str(path), (48, 32), what="map")))
    viewer.until(lambda app: app.state.prompt == SavePrompt(str(path), (48, 32), already_there=True, what="map"))


def test_a_picture_waits_for_the_views(open_window: Opener, photo_path: Path, tmp_path: Path) -> None:
    viewer = open_window(photo_path, grid=GridShape(9, 9))
    app, out = viewer.app, tmp_path / "out.png"
    viewer.until(lambda app: app.state.scene is not None and not app.state.scene.is_sketch)
    app.do(do(lens.move_eye, ViewOffset(0.3, -0.7)), do(lens.set_aperture, 2.0), do(ask, SaveTask(str(out), SIZE)))
    app.step()
    assert job_of(viewer).doing == WAITING_FOR_VIEWS
    asked = app.state.optics
    viewer.until(lambda app: not app.state.jobs)
    assert app.state.progress.is_complete
    expected = app.scene_view.renderer.converged_picture(RenderSettings(asked, SIZE))
    np.testing.assert_array_equal(np.rint(read_photo(out).pixels * 255), expected)


def test_closing_the_window_gives_up_what_is_being_drawn(viewer: Driver, tmp_path: Path) -> None:
    before = set(tmp_path.iterdir())
    start(viewer, tmp_path / "large.png")
    viewer.close()
    assert set(tmp_path.iterdir()) == before


def test_closing_the_window_waits_for_what_is_being_written(
    viewer: Driver, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    out, closes = tmp_path / "out.png", threading.Event()

    def write(*arguments: Any) -> Path:
        """Once the window is closing, not before."""
        assert closes.wait(120)
        return export_picture(*arguments)

    def close(queue: JobQueue) -> None:
        closes.set()
        close_queue(queue)

    close_queue = JobQueue.close
    monkeypatch.setattr("viewer.app.picture_saver.export_picture", write)
    monkeypatch.setattr(JobQueue, "close", close)
    viewer.app.do(do(ask, SaveTask(str(out), SIZE)))
    viewer.until(lambda app: bool(app.state.jobs) and app.state.jobs[0].doing == WRITING)
    viewer.close()
    assert read_photo(out).pixels.shape == (*SIZE[::-1], 3)
    assert not list(tmp_path.glob(".iibr-*"))


@pytest.mark.parametrize("error", [InputError("the disk is full"), SystemExit("a library tried to end the program")])
def test_a_file_that_cannot_be_written_is_a_notice_and_the_next_is_saved(
    viewer: Driver, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    with monkeypatch.context() as broken:
        broken.setattr("viewer.app.picture_saver.export_picture", fail)
        viewer.app.do(do(ask, SaveTask(str(tmp_path / "a.png"), (48, 32))))
        viewer.until(lambda app: bool(app.state.notices))
    assert [notice.is_error for notice in viewer.app.state.notices] == [True]
    viewer.app.do(do(ask, SaveTask(str(tmp_path / "a.png"), (48, 32))))
    viewer.until(lambda app: f"Saved {tmp_path / 'a.png'}" in texts(viewer))


@pytest.fixture
def large(open_window: Opener, photo_path: Path) -> Driver:
    """The photo is four times as large as its views."""
    driver = open_window(photo_path, grid=GridShape(3, 3), max_pixels=WIDTH * HEIGHT // 4)
    driver.until_idle()
    return driver


@pytest.mark.parametrize("aperture", [0.0, 2.5])
def test_a_picture_is_saved_at_the_photos_own_size(
    large: Driver, photo_path: Path, tmp_path: Path, aperture: float
) -> None:
    """Asked for no other size it has all of the photo's pixels; what is out of focus is as in the views."""
    app, out = large.app, tmp_path / "out.png"
    app.do(do(lens.set_aperture, aperture), do(saving.ask_to_save))
    prompt = app.state.prompt
    assert isinstance(prompt, SavePrompt)
    assert prompt.size_px == (WIDTH, HEIGHT)
    app.do(do(ask, SaveTask(str(out), prompt.size_px)))
    large.until(lambda app: f"Saved {out}" in texts(large))
    saved, photo = read_photo(out).pixels, read_photo(photo_path).pixels
    assert saved.shape == photo.shape
    if aperture == 0:
        np.testing.assert_allclose(saved, photo, atol=1.01 / 255)
    assert app.state.scene is not None
    shown = app.scene_view.renderer.converged_picture(RenderSettings(app.state.optics, app.state.scene.size))
    shown = linear_from_srgb(shown / np.float32(255))
    smaller = mean_of_areas(linear_from_srgb(saved), image_size(shown))
    assert np.abs(smaller - shown).mean() < 0.01


def test_a_picture_at_the_photos_own_size_can_be_given_up(
    large: Driver, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun, before = threading.Event(), set(tmp_path.iterdir())

    def draw_full(picture: FullPicture, draw: object) -> None:
        begun.set()
        while not is_stopped():
            time.sleep(0.001)
        raise Cancelled

    with monkeypatch.context() as endless:
        endless.setattr("iibr_core.exports.full_drawing.draw_full", draw_full)
        large.app.do(do(ask, SaveTask(str(tmp_path / "out.png"), (WIDTH, HEIGHT))))
        large.until(lambda app: begun.is_set())
        large.app.do(do(ask, CancelJobTask(job_of(large).id)), do(ask, SaveTask(str(tmp_path / "next.png"), (16, 12))))
        large.until(lambda app: f"Saved {tmp_path / 'next.png'}" in texts(large))
    assert set(tmp_path.iterdir()) - before == {tmp_path / "next.png"}


def test_a_photo_that_was_replaced_meanwhile_is_noticed(large: Driver, photo_path: Path, tmp_path: Path) -> None:
    out = tmp_path / "out.png"
    shutil.copy(write_scene(tmp_path, "other", seed=3), photo_path)
    large.app.do(do(ask, SaveTask(str(out), (WIDTH, HEIGHT))))
    large.until(lambda app: any("was changed since it was opened" in text for text in texts(large)))
    assert not out.exists()
