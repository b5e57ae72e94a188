"""One click from a guess to better depth, in a real window: a hub on this machine stands in for the network."""

from dataclasses import replace
from threading import Event

import numpy as np
import pytest

from iibr_core.depth.models import cache as estimate_cache
from iibr_core.depth.models.catalog import fetch, known_model, model_here, register
from iibr_core.formats.images.write import write_image
from iibr_core.runtime.work import Cancelled, is_stopped
from iibr_core.scenes.scene import Source, source_beside
from iibr_core.types import GridShape, ViewOffset
from tests.iibr_core.depth.onnx_graphs import published, weighing
from tests.local_hub import local_hub
from viewer.background.depth_models import OFFLINE, list_models
from viewer.model import depth, depth_models, history, lens, opening, preferences, window
from viewer.model.action import do
from viewer.model.depth import Brush
from viewer.model.depth_models import offered_model
from viewer.model.focal_plane import place_of, sharp_disparity

MODEL = known_model("depth-anything-v2-small")
GRID = GridShape(3, 3)
GET, ESTIMATE = "Get better depth", "Estimate depth"


def write_photo(path, seed=0):
    """A light square before a dark wall, the square in the upper half, where a guess by height has it far away."""
    pixels = np.full((64, 96, 3), 60, np.uint8)
    pixels[8:28, 36:66] = 220
    pixels[60:, :4] = seed
    write_image(path, pixels)
    return path


@pytest.fixture
def hub(tmp_path, monkeypatch):
    with local_hub(MODEL.commit, published(tmp_path / "network")) as server:
        server.may_finish.clear()
        # read once, at import: HF_ENDPOINT and HF_HOME come too late here
        monkeypatch.setattr("huggingface_hub.constants.ENDPOINT", server.address)
        template = f"{server.address}/{{repo_id}}/resolve/{{revision}}/{{filename}}"
        monkeypatch.setattr("huggingface_hub.constants.HUGGINGFACE_CO_URL_TEMPLATE", template)
        monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path / "hub"))
        monkeypatch.setattr(estimate_cache, "cache_folder", lambda: tmp_path / "estimates")
        yield server


@pytest.fixture
def downloaded(hub):
    """The model is here already."""
    hub.may_finish.set()
    fetch(MODEL)
    hub.asked.clear()
    return hub


@pytest.fixture
def viewer(hub, open_window, tmp_path):
    """A photo without depth, and what to do about that."""
    return with_offer(open_window(write_photo(tmp_path / "photo.png")))


def with_offer(driver):
    driver.settle(lambda app: offered_model(app.state) is not None)
    return driver


def is_deep(app):
    scene = app.state.scene
    origin = scene.depth_origin if scene is not None and scene.source is app.state.source else None
    return origin is not None and origin.kind == "model"


def depth_kind(app):
    scene = app.state.scene
    return scene.depth_origin.kind if scene is not None and scene.depth_origin is not None else None


def wall_slope(viewer):
    """How much nearer the wall is below than above, px a view."""
    above, below = (viewer.app.scene_view.pick(ViewOffset(0, 0), 90, y) for y in (3, 58))
    return below - above


def test_one_click_deepens_the_picture_as_it_is_seen_and_edited(viewer, hub):
    assert depth_kind(viewer.app) == "rough"
    assert not hub.asked, "nothing is fetched unasked"
    at = place_of(50, 20, viewer.app.state.scene)
    before = viewer.app.scene_view.pick(ViewOffset(0, 0), 50, 20)
    viewer.app.do(do(lens.move_eye, ViewOffset(0.5, -0.5)), do(window.end_gesture))
    viewer.app.do(do(lens.focus_on, at, before or 0.0), do(lens.set_aperture, 1.0))
    viewer.app.do(do(depth.set_brush, Brush(radius=0.1, strength=1.0)), do(depth.paint, (0.1, 0.9)))
    viewer.do(do(window.end_gesture))
    edits = viewer.app.state.depth.edits
    assert wall_slope(viewer) > 0.5, "a guess has what is low near"
    viewer.press(GET, "notices", until=lambda app: app.state.models.downloading is not None)
    assert viewer.app.state.prompt is None, "the click was the consent"
    hub.may_finish.set()
    progress = set()

    def is_done(app):
        progress.add(app.state.models.downloading)
        return is_deep(app)

    viewer.settle(is_done)
    assert all(shown.done <= shown.total for shown in progress - {None}), "megabytes"
    state = viewer.app.state
    assert model_here(MODEL) is not None
    assert wall_slope(viewer) < 0.05, "all of the wall is as dark, and so as far away"
    square = viewer.app.scene_view.pick(ViewOffset(0, 0), 50, 20)
    assert square != pytest.approx(before, abs=0.05)
    assert state.optics.eye == ViewOffset(0.5, -0.5)
    assert state.optics.aperture_diameter == pytest.approx(1.0, rel=0.2), "discs stay as wide as they were"
    assert sharp_disparity(state.optics, at) == pytest.approx(square, abs=0.02), "what was sharp is sharp"
    assert state.depth.edits == edits == viewer.app.scene_view.loaded.depth_settings.edits
    assert offered_model(state) is None
    viewer.do(do(history.undo), do(history.undo))
    assert is_deep(viewer.app), "the estimate is no edit"


def test_a_download_is_cancelled_fails_and_is_tried_again_by_one_click_each(viewer, hub):
    before, model = viewer.app.state.source, hub.files["onnx/model.onnx"]
    viewer.press(GET, "notices", until=lambda app: app.state.models.downloading is not None)
    viewer.press("Cancel##download", "notices", until=lambda app: app.state.models.downloading is None)
    hub.files["onnx/model.onnx"] = model[::-1]
    hub.may_finish.set()
    viewer.until_idle()
    assert model_here(MODEL) is None
    assert viewer.app.state.source is before
    viewer.press(GET, "notices", until=lambda app: any(notice.is_error for notice in app.state.notices))
    assert depth_kind(viewer.app) == "rough"
    hub.files["onnx/model.onnx"] = model
    viewer.press("Try again", "notices")
    viewer.until(is_deep)


def test_without_a_connection_a_download_says_so_with_details(viewer, monkeypatch):
    nowhere = "http://127.0.0.1:9"
    monkeypatch.setattr("huggingface_hub.constants.ENDPOINT", nowhere)
    template = f"{nowhere}/{{repo_id}}/resolve/{{revision}}/{{filename}}"
    monkeypatch.setattr("huggingface_hub.constants.HUGGINGFACE_CO_URL_TEMPLATE", template)
    viewer.press(GET, "notices", until=lambda app: any(notice.text == OFFLINE for notice in app.state.notices))
    viewer.press("Details", "notices", until=lambda app: "127.0.0.1:9 cannot be reached" in app.state.notices[-1].text)
    assert viewer.app.state.models.downloading is None


def test_a_model_that_is_here_is_used_unasked_unless_that_is_switched_off(downloaded, open_window, tmp_path):
    driver = open_window(write_photo(tmp_path / "photo.png"))
    driver.settle(is_deep)
    assert offered_model(driver.app.state) is None
    source = source_beside(driver.app.state.source, str(write_photo(tmp_path / "other.png", seed=9)))
    seen = []
    driver.app.do(do(opening.open_source, source))

    def is_next_deep(app):
        is_open = app.state.scene is not None and app.state.scene.source is source
        seen.extend([depth_kind(app)] if is_open else [])
        return is_open and is_deep(app)

    driver.until(is_next_deep)
    assert seen[0] == "rough", "the guess comes first"
    assert not downloaded.asked
    driver.app.do(do(preferences.guess_depth_always, True))
    third = source_beside(source, str(write_photo(tmp_path / "third.png", seed=99)))
    driver.app.do(do(opening.open_source, third))
    with_offer(driver)
    assert depth_kind(driver.app) == "rough"
    driver.press(ESTIMATE, "notices")
    driver.until(is_deep)


def open_another(driver, path):
    """Open a photo by its name, and wait until it is all there."""
    driver.app.do(do(opening.open_source, Source(str(path), grid=GRID)))
    driver.settle(lambda app: app.state.scene is not None and app.state.scene.source.path == str(path))


def test_a_model_is_offered_once_in_a_run_and_comes_back_by_the_badge(viewer, tmp_path):
    open_another(viewer, write_photo(tmp_path / "other.png", seed=9))
    assert offered_model(viewer.app.state) is None
    viewer.press("Depth guessed", "Depth guessed", until=lambda app: offered_model(app.state) is not None)
    viewer.press("×##offer", "notices", until=lambda app: offered_model(app.state) is None)
    viewer.press("Depth guessed", "Depth guessed", until=lambda app: offered_model(app.state) is not None)
    viewer.press("Don't offer again", "notices", until=lambda app: not app.state.preferences.offers_models)
    assert offered_model(viewer.app.state) is None
    viewer.press("Depth guessed", "Depth guessed", until=lambda app: offered_model(app.state) is not None)
    viewer.do(do(preferences.set_font_scale, 2.3))
    viewer.find(GET, "notices")


def test_a_running_estimate_is_given_up_by_one_click(downloaded, open_window, tmp_path, monkeypatch):
    def wait_to_be_stopped(source, loaded, refine):
        while not is_stopped():
            is_running.set()
        raise Cancelled

    is_running = Event()
    with monkeypatch.context() as patched:
        patched.setattr("iibr_core.scenes.photo.deepen", wait_to_be_stopped)
        viewer = open_window(write_photo(tmp_path / "photo.png"))
        viewer.until(lambda app: is_running.is_set())
        viewer.press("Cancel##estimate", "notices", until=lambda app: depth_models.wanted_model(app.state) is None)
        viewer.press("Depth guessed", "Depth guessed")
        with_offer(viewer)
    assert depth_kind(viewer.app) == "rough"
    assert not viewer.app.state.notices
    viewer.press(ESTIMATE, "notices")
    viewer.until(is_deep)


def test_a_model_file_of_ones_own_is_used_in_place_and_a_broken_one_leaves_the_depth(viewer, tmp_path):
    (tmp_path / "broken.onnx").write_bytes(b"no model")
    viewer.app.do(do(depth_models.use_model, str(tmp_path / "broken.onnx")))
    viewer.settle(lambda app: any(notice.is_error for notice in app.state.notices))
    assert depth_kind(viewer.app) == "rough"
    file = weighing(tmp_path / "own.onnx", (1, 1, 1))
    viewer.app.do(do(lens.move_eye, ViewOffset(0.5, 0.5)), do(window.end_gesture))
    viewer.app.do(do(depth_models.use_model, str(file)))
    viewer.until(is_deep)
    assert viewer.app.state.optics.eye == ViewOffset(0.5, 0.5)
    assert viewer.app.state.source.depth.model == str(file)
    assert not viewer.app.state.notices, "what failed before is no news"
    for name, seed in (("second.png", 9), ("third.png", 99)):
        open_another(viewer, write_photo(tmp_path / name, seed=seed))
        viewer.until(is_deep)
        assert viewer.app.state.scene.depth_model == str(file)


def test_a_copied_model_is_listed_and_used_for_photos_without_depth(hub, open_window, tmp_path, monkeypatch):
    """As after `iibr models get FILE.onnx`."""
    monkeypatch.setattr("iibr_core.depth.models.catalog.own_models_folder", lambda: tmp_path / "copied")
    register(weighing(tmp_path / "mine.onnx", (1, 1, 1)))
    driver = open_window(write_photo(tmp_path / "photo.png"))
    driver.until(is_deep)
    assert driver.app.state.scene.depth_model == "mine"
    driver.do(do(depth_models.show_models))
    assert any(model.name == "mine" and model.is_ready for model in driver.app.state.models.known)
    monkeypatch.setattr("iibr_core.depth.models.known.is_installed", lambda name: False)
    assert all(offer.lacks.startswith("needs the package ") for offer in list_models())


@pytest.mark.parametrize("is_lost", [False, True])
def test_a_photo_opens_with_the_model_and_the_focus_that_it_was_left_with(
    hub, open_window, tmp_path, monkeypatch, is_lost
):
    """If the model's file is gone, the message says so, and the place in focus stays sharp."""
    monkeypatch.setattr("viewer.app.session_store.QUIET_S", 0.0)
    photo, kept = write_photo(tmp_path / "photo.png"), tmp_path / "kept"
    file = weighing(tmp_path / "own.onnx", (1, 1, 1))
    first = with_offer(open_window(photo, kept_in=kept))
    first.app.do(do(depth_models.use_model, str(file)))
    first.until(is_deep)
    first.until(lambda app: bool(list((kept / "sessions").glob("*.json"))))
    at = place_of(50, 20, first.app.state.scene)
    sharp = first.app.scene_view.pick(ViewOffset(0, 0), 50, 20)
    first.do(do(lens.focus_on, at, sharp or 0.0), do(window.end_gesture))
    left = first.app.state.optics
    first.app.do(do(depth_models.use_model, MODEL.name))  # chosen for all photos, but it never comes
    first.app.close()
    if is_lost:
        file.unlink()
    second = open_window(photo, kept_in=kept)
    second.app.state = replace(second.app.state, preferences=replace(second.app.state.preferences, depth_model=""))
    second.until(lambda app: bool(app.state.notices))
    (notice,) = second.app.state.notices
    assert ("own.onnx" in notice.text) == is_lost
    if not is_lost:
        second.settle(is_deep)
        assert second.app.state.optics == left
        return
    second.until(lambda app: app.state.chosen_focus is not None)
    assert depth_kind(second.app) == "rough"
    now = second.app.scene_view.pick(ViewOffset(0, 0), 50, 20)
    assert sharp_disparity(second.app.state.optics, at) == pytest.approx(now, abs=0.02)
