"""The pass that sums up light: both searches, mirror images, draws in parts; nothing is made again for an edit."""

import numpy as np
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.gpu.scenes import TwoPlanes, rms, settled
from viewer.gpu.refocus import passes

GRID = GridShape(5, 5)
SCENE = TwoPlanes(width=160, height=96, background=-4.0, foreground=5.0, radius_px=25.0)


@pytest.mark.parametrize(
    "optics",
    [Optics(ViewOffset(0.4, -0.7)), Optics(ViewOffset(0.4, -0.7), focus_disparity=5.0, aperture_diameter=3.0)],
)
def test_three_steps_find_the_same_surfaces_as_the_whole_search(renderer, monkeypatch, optics):
    """Up to a view step away, and 8 px of parallax: they differ only beside edges, which the whole search avoids."""
    SCENE.fill(renderer, GRID)
    images, programs = [], []
    for near_px in (100.0, 0.0):
        monkeypatch.setattr(passes, "NEAR_PX", near_px)
        images.append(settled(renderer, optics, SCENE))
        programs.append(len(renderer.programs))
    assert programs[0] < programs[1], "another program has drawn it"
    assert np.mean(np.abs(images[0].astype(int) - images[1]).max(-1) > 2) < 0.04
    assert rms(images[0], images[1]) < 0.006


def test_outside_all_views_mirror_images_stand_in(renderer):
    """Seen from far beside the grid, a flat scene goes on as its mirror image: no streaks."""
    scene = TwoPlanes(width=96, height=64, background=6.0, foreground=6.0)
    grid = GridShape(3, 3)
    scene.fill(renderer, grid)
    renderer.render(Optics(ViewOffset(0.0, 3.0)), (96, 64))
    photo = scene.view(ViewOffset(0.0, 1.0))[0]
    mirrored = np.concatenate([photo, photo[:, ::-1]], axis=1)[:, 12 : 12 + 96]
    assert rms(renderer.read_image(), mirrored, border=2) < 0.01
