"""Pictures of a hard photo by the free camera, against golden ones; `pytest --regenerate-golden` writes them."""

from contextlib import closing
from dataclasses import replace
from threading import Event

import pytest

from iibr_core.scenes.rect import WHOLE
from iibr_core.types import CENTRE
from tests.golden_text import assert_same_text
from tests.image_compare import SAME_RASTERISER, assert_close, assert_golden
from tests.viewer.display.hard_photo import write_hard_photo
from viewer.app.free_camera_view import FreeCameraView
from viewer.display.offscreen import OffscreenScene
from viewer.model import lens, viewpoint
from viewer.model.action import do
from viewer.model.viewpoint import FreeCamera

CAMERAS = {
    "right": FreeCamera(right=0.25), "down": FreeCamera(down=0.2), "ahead": FreeCamera(-0.1, -0.1, 0.4),
    "back": FreeCamera(forward=-0.1),
}  # fmt: skip
DEADLINE_S = 60.0


@pytest.fixture
def viewer(tmp_path):
    with OffscreenScene("egl") as opened:
        opened.open(write_hard_photo(tmp_path))
        yield opened


def show(viewer, view, news):
    """Wait for the camera's view; return whether a draft came before it, and whether progress was told."""
    has_told = False
    previews = viewer.view.previews
    while view.shown is None or view.shown.camera != viewer.state.free_camera:
        actions = view.advance(viewer.state)
        has_told |= any(action.verb is viewpoint.report_camera and action.args[0] is not None for action in actions)
        viewer.do(*actions)
        if view.shown is None:
            assert news.wait(DEADLINE_S)
            news.clear()
    return viewer.view.previews - previews == 2, has_told


@pytest.mark.parametrize("has_draft", [False, True])
def test_cameras_see_the_golden_pictures(viewer, tmp_path, monkeypatch, regenerate_golden, has_draft):
    """In focus or not, as the lens looks through the camera."""
    monkeypatch.setattr("viewer.gpu.refocus.picture_lens.EDGE_PASSES", 2)
    monkeypatch.setattr("viewer.app.free_camera_view.DRAFT_PIXELS", 1000 if has_draft else 10**9)
    news, size, seen = Event(), viewer.scene.size, []
    plain = viewer.picture()
    with closing(FreeCameraView(viewer.view, news.set)) as view:
        for name, camera in CAMERAS.items():
            viewer.state = replace(viewer.state, free_camera=camera)
            is_first = name == next(iter(CAMERAS))
            assert show(viewer, view, news) == (has_draft, is_first), "the photo is prepared once"
            viewer.view.converge(viewer.state, size, WHOLE)
            image = viewer.view.renderer.read_image()
            assert_golden(image, f"viewer/camera-{name}", SAME_RASTERISER, tmp_path, regenerate_golden)
            picks = [viewer.view.pick(CENTRE, x, y) for x, y in ((35.0, 25.0), (50.0, 48.0), (80.0, 10.0))]
            seen.append(f"{name}: " + ", ".join(f"{value:.3f}" for value in picks))
        assert_same_text(seen, "viewer/values", "cameras", regenerate_golden, atol=0.02)
        viewer.do(do(lens.show_before, True))
        viewer.do(*view.advance(viewer.state))
        viewer.view.converge(viewer.state, size, WHOLE)
        assert_close(viewer.view.renderer.read_image(), plain, SAME_RASTERISER, tmp_path, "before")
