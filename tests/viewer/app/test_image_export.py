"""Pictures on disk: larger than the graphics card draws at once, with more than 8 bits where the file holds them."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest

from iibr_core.color import srgb_from_linear
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.formats.images.picture_kinds import KINDS, PictureFormat, is_float
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, InputError, ViewOffset
from tests.viewer.conftest import HEIGHT, WIDTH, headless_with_scene
from viewer.app.image_export import export_picture, shot_of
from viewer.app.job_queue import JobQueue
from viewer.app.picture_saver import add_save
from viewer.display.offscreen import OffscreenScene
from viewer.model import lens, messages, preferences, saving
from viewer.model.action import Action, do
from viewer.model.saved_settings import read_settings
from viewer.model.state.tasks import SaveTask


@pytest.fixture(scope="module")
def photo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from iibr_core.formats.images.write import write_image

    folder = tmp_path_factory.mktemp("saving")
    y, x = np.indices((HEIGHT, WIDTH))
    pixels = np.stack([x * 255 / WIDTH, y * 255 / HEIGHT, (x + y) % 256], axis=-1)
    write_image(folder / "photo.png", pixels.astype(np.uint8))
    np.save(folder / "photo_disparity.npy", np.hypot(x - WIDTH / 2, y - HEIGHT / 2).astype(np.float32) < 25)
    return folder / "photo.png"


@pytest.fixture(scope="module")
def opened(photo: Path) -> Iterator[OffscreenScene]:
    try:
        viewer = OffscreenScene("egl")
    except InputError as error:
        pytest.skip(str(error))
    with viewer:
        viewer.open(Source(str(photo), grid=GridShape(3, 3)))
        viewer.do(do(lens.move_eye, ViewOffset(0.3, -0.4)), do(lens.set_aperture, 2.0), do(lens.set_focus, 0.2))
        yield viewer


def saved(viewer: OffscreenScene, path: Path, size_px: tuple[int, int]) -> np.ndarray:
    shot = shot_of(viewer.state, size_px, PictureFormat())
    export_picture(path, viewer.picture(size_px, is_float(path), shot.color_space), shot)
    return np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT))[..., :3]


def test_exr_holds_light_finer_than_png(opened: OffscreenScene, tmp_path: Path) -> None:
    png = saved(opened, tmp_path / "a.png", (WIDTH, HEIGHT)) * 255
    light = saved(opened, tmp_path / "a.exr", (WIDTH, HEIGHT))
    assert oiio.ImageBuf(str(tmp_path / "a.exr")).spec().format == oiio.FLOAT
    encoded = srgb_from_linear(light) * 255
    assert np.abs(encoded - png).max() <= 0.51, "the same picture"
    assert np.mean(np.abs(encoded - np.rint(encoded)) > 0.05) > 0.5, "not rounded to 8 bits on the way"


@pytest.mark.parametrize("name", [f"a{ending}" for ending in KINDS])
def test_settings_are_inside(opened: OffscreenScene, tmp_path: Path, name: str) -> None:
    saved(opened, tmp_path / name, (70, 50))
    settings = read_settings(tmp_path / name)
    assert settings.optics == opened.state.optics
    assert settings.size_px == (70, 50)


def test_pictures_beyond_the_graphics_cards_limit_are_drawn_in_parts(
    opened: OffscreenScene, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    large = 4 * WIDTH, 4 * HEIGHT
    at_once = saved(opened, tmp_path / "once.png", large) * 255
    monkeypatch.setattr(opened.gl, "max_texture_size", 192)
    in_parts = saved(opened, tmp_path / "parts.png", large) * 255
    assert in_parts.shape == (4 * HEIGHT, 4 * WIDTH, 3)
    assert np.mean(np.abs(in_parts - at_once).max(-1) > 3) < 0.005


def test_the_window_keeps_its_own_picture(opened: OffscreenScene) -> None:
    scene_view, size_px = opened.view, (WIDTH, HEIGHT)
    scene_view.converge(opened.state, size_px)
    shown, drawn = scene_view.renderer.read_image(), scene_view.pictures_drawn
    scene_view.renderer.converged_picture(RenderSettings(opened.state.optics, (40, 30)))
    assert np.array_equal(scene_view.renderer.read_image(), shown)
    scene_view.converge(opened.state, size_px)
    assert scene_view.pictures_drawn == drawn
    assert np.array_equal(scene_view.renderer.read_image(), shown)


def test_a_place_that_cannot_be_written_is_told(opened: OffscreenScene, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"missing-folder.* does not exist"):
        saved(opened, tmp_path / "missing-folder" / "a.png", (8, 8))


def test_a_picture_is_as_it_was_when_edited_depth_is_shown_meanwhile(tmp_path: Path) -> None:
    out = tmp_path / "out.png"
    with headless_with_scene(tmp_path) as viewer:
        viewer.do(do(lens.move_eye, ViewOffset(0.3, -0.7)))
        scene_view, state, woken = viewer.view, viewer.state, threading.Event()
        expected = scene_view.renderer.converged_picture(RenderSettings(state.optics, (90, 60)))
        jobs = JobQueue(scene_view, woken.set)
        actions: list[Action] = []
        assert add_save(SaveTask(str(out), (90, 60)), state, (), jobs) == [
            do(preferences.set_last_folder, str(tmp_path))
        ]
        scene_view.show_disparity(np.zeros((HEIGHT, WIDTH), np.float32))
        assert not np.array_equal(
            scene_view.renderer.converged_picture(RenderSettings(state.optics, (90, 60))), expected
        )
        while do(saving.set_jobs, ()) not in actions:
            actions += jobs.advance(state, 0.0)
            assert woken.wait(60)
        jobs.close()
    assert [action.args[0].text for action in actions if action.verb is messages.notify] == [f"Saved {out}"]
    np.testing.assert_array_equal(oiio.ImageBuf(str(out)).get_pixels(oiio.UINT8), expected)
