"""A picture drawn in a hurry becomes better while it stands still, and ends at one result."""

import gc

import moderngl
import numpy as np
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.beyond.picture_quality import EDGE_PASSES, MAX_SOURCES
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.gpu.scenes import TwoPlanes, psnr

GRID = GridShape(5, 5)
SCENE = TwoPlanes(width=160, height=120, background=-6.0, foreground=0.0, radius_px=25.0)
SIZE = SCENE.width, SCENE.height
WIDE = Optics(aperture_diameter=4.0)


def converged(renderer, optics):
    renderer.render(optics, SIZE)
    renderer.refine()
    return renderer.read_image()


@pytest.mark.parametrize(
    "optics", [WIDE, Optics(ViewOffset(0.5, 0.3), aperture_diameter=3.0)], ids=["stored", "between"]
)
def test_a_hurried_picture_is_refined_in_small_steps_to_the_one_drawn_at_once(renderer, optics):
    SCENE.fill(renderer, GRID)
    at_once = converged(renderer, optics)
    renderer.render_in_time(optics, SIZE, 1e-6)
    hurried, steps = psnr(renderer.read_image(), at_once, border=20), 0
    while not renderer.is_converged:
        renderer.refine(1e-6)
        steps += 1
    assert steps >= 2
    assert 30 < hurried < 50
    assert np.abs(renderer.read_image().astype(int) - at_once).max() <= 1


def test_edges_of_a_warped_view_become_smooth_and_stored_views_stay(renderer):
    """A hard edge between two colours takes colours in between, as in a finely sampled picture."""
    scene = TwoPlanes(contrast=0.0)
    scene.fill(renderer, GRID)
    size = scene.width, scene.height
    renderer.render(Optics(ViewOffset(0.5, 0.3)), size)
    tones = len(np.unique(renderer.read_image().reshape(-1, 3), axis=0))
    renderer.refine()
    assert renderer.samples == EDGE_PASSES * MAX_SOURCES
    assert len(np.unique(renderer.read_image().reshape(-1, 3), axis=0)) >= tones + EDGE_PASSES - 3
    renderer.render(Optics(ViewOffset(1.0, -2.0)), size)
    assert renderer.is_converged
    assert np.abs(renderer.read_image().astype(int) - scene.view(ViewOffset(1.0, -2.0))[0]).max() <= 1


def test_switching_scenes_sizes_and_apertures_leaves_no_gl_objects(renderer):
    ctx = renderer.ctx
    ctx.gc_mode = "context_gc"  # what is dropped without being released is kept in a list
    for k in range(8):
        scene = TwoPlanes(48 + 16 * (k % 2), 40)
        scene.fill(renderer, GridShape(2 + k % 3, 3), with_disparity=k % 5 > 0)
        optics = Optics(ViewOffset(0.1, 0.0), dolly=0.5 * (k % 2), aperture_diameter=float(k % 4))
        renderer.render_in_time(optics, (60 + 20 * (k % 4), 50), 0.01)
        renderer.refine(0.0)
    gc.collect()
    assert all(isinstance(thing, moderngl.mgl.InvalidObject) for thing in ctx.objects), "dropped, but not released"
    ctx.gc_mode = None


@pytest.mark.parametrize("optics", [WIDE, Optics()], ids=("open", "pinhole"))
def test_a_draft_is_never_reported_as_final(renderer, optics):
    """A pinhole needs one sample: the smaller picture of a moment without time has that many, too."""
    SCENE.fill(renderer, GRID)
    for _ in range(3):
        renderer.render_in_time(optics, SIZE, 1e-6)
        assert not renderer.is_converged
    renderer.refine()
    assert renderer.is_converged
