"""What stands on the screen while views come: drawn a bit a frame, and never softer than it was."""

from dataclasses import replace

import numpy as np
import pytest

from iibr_core.gloss.settings import Gloss
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.scene import SceneReady, SceneRequest, Source
from iibr_core.scenes.scene_gloss import make_maps
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import CENTRE, GridShape, InputError, ViewOffset
from tests.viewer.conftest import headless_with_scene, write_scene
from viewer.display import scene_view
from viewer.display.offscreen import OffscreenScene
from viewer.model import lens, opening
from viewer.model.action import do

SIZE = ScreenSize(384, 256)
WORSE_DB = 1.0
"""Largest loss from a frame to a later frame at the same settings, in dB."""


@pytest.fixture
def opened(tmp_path, monkeypatch):
    """A picture that has got every pass; views are shown as soon as they come, and no frame has time for more than one
    sample.
    """
    monkeypatch.setattr(scene_view, "VIEW_REFRESH_S", 0.0)
    with headless_with_scene(tmp_path) as viewer:
        viewer.do(do(lens.set_aperture, 3.0))
        monkeypatch.setattr(type(viewer.gl), "frame_budget_s", 1e-9)
        viewer.view.converge(viewer.state, SIZE)
        yield viewer


def a_view_comes(view):
    centre = view.centre
    view.add(replace(centre, row=0, column=1, colors=np.full_like(centre.colors, 255)))
    view.upload_all()


@pytest.mark.parametrize(
    ("edits", "draws"),
    [
        ((), False),
        ((do(lens.move_eye, ViewOffset(-0.5, 0.0)),), True),
        ((do(lens.set_aperture, 3.0), do(lens.move_eye, ViewOffset(-0.5, 0.0))), True),
    ],
    ids=["one view", "between views", "a lens"],
)
def test_a_picture_that_is_one_view_is_not_drawn_for_others(opened, edits, draws):
    view = opened.view
    opened.do(do(lens.set_aperture, 0.0), *edits)
    view.converge(opened.state, SIZE)
    pictures, shown, record = view.pictures_drawn, view.renderer.read_image(), view.picture_drawn
    a_view_comes(view)
    view.converge(opened.state, SIZE)
    assert view.pictures_drawn == pictures + draws
    assert (view.picture_drawn != record) == draws, "else a frame would be shown for it"
    assert np.array_equal(view.renderer.read_image(), shown) != draws
    assert view.shows_all_views()


def test_a_view_that_is_there_as_a_draft_is_drawn_again(opened):
    view, at = opened.view, (0, 1)
    view._is_final[at] = False
    opened.do(do(lens.set_aperture, 0.0), do(lens.move_eye, opened.state.scene.grid.offset(*at)))
    view.converge(opened.state, SIZE)
    pictures = view.pictures_drawn
    for _ in range(2):
        a_view_comes(view)
        view.converge(opened.state, SIZE)
    assert view.pictures_drawn == pictures + 1


def test_a_view_stands_in_before_the_second_view_of_the_scene_has_come(opened):
    view, scene = opened.view, opened.state.scene
    view.open(SceneReady(view.generation, scene, view.loaded, view.centre))
    view.show_fallback(replace(view.centre, colors=np.full_like(view.centre.colors, 255)))
    view.converge(opened.state, SIZE)
    assert view.renderer.read_image().min() == 255
    view.add(replace(view.centre, row=0, column=1))
    view.upload_all()
    view.converge(opened.state, SIZE)
    assert view.renderer.read_image().min() == 255


def test_a_scene_too_large_for_the_driver_leaves_the_old_one(opened):
    view, scene = opened.view, opened.state.scene
    before = view.renderer.read_image()
    with pytest.raises(InputError, match=r"px exceed"):
        view.open(SceneReady(2, replace(scene, width=opened.gl.max_texture_size + 1), view.loaded, view.centre))
    view.converge(opened.state, SIZE)
    assert view.generation < 2
    assert np.array_equal(view.renderer.read_image(), before)


def psnr_db(image, other):
    return float(10 * np.log10(255**2 / max(np.square(image.astype(float) - other).mean(), 1e-3)))


def frames_of(view, state, most):
    """Draw frames, at most that number; yield the picture on the screen after each."""
    for _ in range(most):
        view.draw(state, SIZE)
        yield view.renderer.read_image()


@pytest.mark.parametrize("frames_a_view", [3, 60], ids=["views come quickly", "views come slowly"])
@pytest.mark.parametrize("edit", [do(lens.apply_preset, "macro"), do(lens.move_eye, ViewOffset(0.4, 0.7))])
def test_a_still_picture_never_gets_worse_while_views_come(tmp_path, monkeypatch, edit, frames_a_view):
    monkeypatch.setattr(scene_view, "VIEW_REFRESH_S", 0.0)
    source, frames = Source(str(write_scene(tmp_path)), grid=GridShape(3, 3)), []
    with OffscreenScene("egl") as viewer:
        monkeypatch.setattr(type(viewer.gl), "frame_budget_s", 1e-9)
        viewer.do(do(opening.open_source, source))
        for result in results_of(SceneRequest(viewer.state.generation, source, 3.0), lambda: CENTRE):
            if isinstance(result, SceneReady):
                viewer.do(do(opening.show_scene, result.generation, result.scene), edit)
                viewer.view.open(result)
            else:
                viewer.view.add(result.view)
                viewer.view.upload_all()
                viewer.do(do(opening.set_progress, result.generation, result.progress))
            frames += frames_of(viewer.view, viewer.state, frames_a_view)
            assert frames_a_view == 3 or not viewer.view.report.is_draft
        assert not viewer.state.is_making_views
        frames += frames_of(viewer.view, viewer.state, 40)
        viewer.view.converge(viewer.state, SIZE)
        settled = viewer.view.renderer.read_image()
    quality = np.array([psnr_db(frame, settled) for frame in frames])
    assert (quality >= np.maximum.accumulate(quality) - WORSE_DB).all(), quality.round(1).tolist()
    assert quality[0] < quality[-1] - 3, "the first frame is a draft"


def test_the_picture_of_a_photo_stays_until_that_of_its_next_scene_is_fine(opened):
    view, scene = opened.view, opened.state.scene
    opened.do(do(lens.set_aperture, 0.0), do(lens.move_eye, ViewOffset(-0.5, 0.3)))
    view.converge(opened.state, SIZE)
    before = view.renderer.read_image()
    white = replace(view.centre, colors=np.full_like(view.centre.colors, 255))
    view.open(SceneReady(view.generation + 1, scene, view.loaded, white))
    shown = list(frames_of(view, opened.state, 40))
    assert np.array_equal(shown[0], before)
    assert {int(frame.min()) for frame in shown} == {int(before.min()), 255}, "no draft between"


def test_gloss_other_cameras_and_previews_are_seen_when_they_come(opened):
    view, gloss = opened.view, Gloss(roughness=0.5, reflectance=0.5)
    white = replace(view.centre, colors=np.full_like(view.centre.colors, 255))
    opened.do(do(lens.set_gloss, gloss), do(lens.move_eye, ViewOffset(0.0, 1.0)))
    images = []
    for change in (
        lambda: None,
        lambda: view.take_gloss(make_maps(view.gloss_request(gloss))),
        lambda: view.show_fallback(white),
        lambda: view.show_fallback(None),
        lambda: view.show_disparity(np.zeros_like(view.centre.disparity)),
    ):
        change()
        view.converge(opened.state, SIZE)
        images.append(view.renderer.read_image().astype(int))
    matt, glossy, fallback, again, flat = images
    assert glossy.mean() > matt.mean() + 1
    assert fallback.mean() > 250
    assert np.abs(again - glossy).max() <= 1
    assert np.abs(flat - again).mean() > 1
