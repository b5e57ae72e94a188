"""The depth section, drawn without a window: what is told, what edits change in it, whole at any size of text."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from iibr_core.beyond.optics import CENTRE
from iibr_core.depth.choice import DepthOrigin
from iibr_core.depth.editing.edits import DepthEdits, Stroke
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from tests.viewer.conftest import WIDTH, headless_with_scene
from viewer.display.depth_preview import DepthPreview
from viewer.display.offscreen import OffscreenScene
from viewer.model import depth, inspection, lens
from viewer.model.action import do
from viewer.model.layout import PANEL_WIDTH
from viewer.model.state.app_state import Hover
from viewer.model.state.depth import Brush, DepthSample
from viewer.model.window import layout_for

SIZE = 640, 800
PANEL = np.s_[:, -int(PANEL_WIDTH) :]
PICTURE = np.s_[:, : -int(PANEL_WIDTH)]


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[OffscreenScene]:
    with headless_with_scene(tmp_path_factory.mktemp("depth"), "depth") as viewer:
        yield viewer


def differs(before: np.ndarray, after: np.ndarray) -> np.ndarray:
    """(H, W) bool."""
    return np.abs(before.astype(int) - after).max(axis=2) > 24


def test_clips_show_in_the_histogram_and_sliders_only(viewer: OffscreenScene) -> None:
    before = viewer.screen(SIZE)
    viewer.do(do(depth.set_tone, DepthEdits(far_clip=0.3, near_clip=0.6), is_finished=False))
    changed = differs(before, viewer.screen(SIZE))
    assert changed[PANEL].sum() > 500
    assert not changed[PICTURE].any()


def test_poor_depth_is_told_with_advice_and_what_failed(viewer: OffscreenScene) -> None:
    before = viewer.screen(SIZE)
    scene = viewer.state.scene
    assert scene is not None
    poor = DepthOrigin("rough", "rough, guessed without a model", ("The photo's own depth was not used.",))
    viewer.state = replace(viewer.state, scene=replace(scene, depth_origin=poor))
    assert differs(before, viewer.screen(SIZE))[PANEL].sum() > 2000


def test_the_brush_brings_its_sliders_and_a_ring_over_the_picture(viewer: OffscreenScene) -> None:
    viewer.do(do(inspection.set_hover, Hover(48.0, 32.0, 1.5)))
    before = viewer.screen(SIZE)
    viewer.do(do(depth.set_brush, Brush(radius=0.1, is_on=True)))
    changed = differs(before, viewer.screen(SIZE))
    assert changed[PANEL].sum() > 500
    before = viewer.screen(SIZE)
    viewer.do(do(depth.set_brush, replace(viewer.state.brush, radius=0.15)))
    changed = differs(before, viewer.screen(SIZE))
    ring, picture = np.argwhere(changed[PICTURE]), layout_for(viewer.state, ScreenSize(*SIZE), 1.0, 1.0).picture
    assert picture is not None
    middle = picture.y + picture.height / 2, picture.x + picture.width / 2
    np.testing.assert_allclose((ring.min(axis=0) + ring.max(axis=0)) / 2, middle, atol=3)
    np.testing.assert_allclose(np.ptp(ring, axis=0), 2 * 0.15 * picture.width, atol=4)


@pytest.mark.parametrize("eye", [CENTRE, ViewOffset(0.6, -0.8)])
def test_the_ring_of_a_picked_depth_stays_on_its_surface(viewer: OffscreenScene, eye: ViewOffset) -> None:
    """The place in the middle of the scene is picked: a surface that moves by 20 px a view step."""
    viewer.do(do(lens.move_eye, eye))
    viewer.do(do(depth.set_brush, Brush(tool="level", is_on=True)))
    before = viewer.screen(SIZE)
    viewer.do(do(depth.set_brush, Brush(tool="level", is_on=True, sample=DepthSample((0.5, 0.5), 20.0))))
    ring = np.argwhere(differs(before, viewer.screen(SIZE))[PICTURE])
    picture = layout_for(viewer.state, ScreenSize(*SIZE), 1.0, 1.0).picture
    assert picture is not None
    px = picture.width / WIDTH
    middle = picture.y + picture.height / 2 - 20 * eye.t * px, picture.x + picture.width / 2 - 20 * eye.s * px
    np.testing.assert_allclose((ring.min(axis=0) + ring.max(axis=0)) / 2, middle, atol=2)


def test_a_stroke_under_way_is_seen_in_colours(viewer: OffscreenScene) -> None:
    viewer.do(do(inspection.set_overlay, "disparity"), do(inspection.set_opacity, 1.0))
    preview, before = DepthPreview(viewer.view), viewer.screen(SIZE)
    for stroke, is_seen in ((Stroke("farther", ((0.5, 0.5),), 0.1, 1.0), True), (None, False)):
        viewer.state = replace(viewer.state, stroke=stroke)
        preview.update(viewer.state)
        assert (differs(before, viewer.screen(SIZE))[PICTURE].sum() > 200) == is_seen
