"""The picture against the scene itself: pinhole view, lens, exposure, and every state in between."""

from dataclasses import replace

import numpy as np
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.beyond.picture_quality import QUALITY_LEVELS
from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import CENTRE, GridShape, ViewOffset
from tests.image_compare import ROUNDING, assert_close
from tests.viewer.gpu.scenes import TwoPlanes, open_field, psnr, rms, settled, through_lens

GRID = GridShape(5, 5)
SCENE = TwoPlanes()
GROWTH = 0.004
"""How much a view that arrives may worsen the picture (rms, 1 = white): one more view moves a depth edge by a pixel."""


def picture(renderer, scene=SCENE, **optics):
    renderer.render(Optics(**optics), (scene.width, scene.height))
    return renderer.read_image()


@pytest.mark.parametrize("with_disparity", [True, False])
def test_pinhole_at_stored_views_is_those_views(renderer, tmp_path, with_disparity):
    SCENE.fill(renderer, GRID, with_disparity)
    for row, column in [(0, 0), (4, 1)]:
        eye = GRID.offset(row, column)
        assert_close(picture(renderer, eye=eye), SCENE.view(eye)[0], ROUNDING, tmp_path, f"view_{row}_{column}")


@pytest.mark.parametrize(
    ("focus", "diameter", "eye", "row_step"),
    [(-1.0, 2.0, CENTRE, 1.0), (2.0, 8.0, CENTRE, 1.0), (2.0, 4.0, ViewOffset(2.0, -0.5), 0.5)],
)
def test_lens_against_brute_force(renderer, focus, diameter, eye, row_step):
    """Beside the middle, and where rows are closer than columns, what lies behind the photo is seen elsewhere."""
    SCENE.fill(renderer, GRID, row_step=row_step)
    optics = Optics(eye, focus_disparity=focus, aperture_diameter=diameter)
    image = settled(renderer, optics, SCENE)
    seen = replace(optics, eye=ViewOffset(row_step * eye.t, eye.s))
    likeness = psnr(image, through_lens(SCENE, seen), border=14)
    assert likeness > 38
    for wrong in (replace(seen, focus_disparity=-focus), replace(seen, aperture_diameter=min(diameter, 5.0) / 2)):
        assert psnr(image, through_lens(SCENE, wrong), border=14) < likeness - 3


def test_error_never_grows_while_the_field_fills(renderer):
    SCENE.fill(renderer, GRID)
    optics, size = Optics(ViewOffset(1.2, -0.6)), (SCENE.width, SCENE.height)
    renderer.render(optics, size)
    final = renderer.read_image()
    SCENE.open(renderer, GRID)
    renderer.render(optics, size)
    assert renderer.read_image().max() == 0, "black before the first view"
    corners_then_inner = sorted(np.ndindex(*GRID), key=lambda at: (at != (2, 2), -np.hypot(at[0] - 2, at[1] - 2)))
    errors = []
    for row, column in corners_then_inner:
        SCENE.upload(renderer, GRID, row, column)
        renderer.render(optics, size)
        errors.append(rms(renderer.read_image(), final, border=1))
    assert errors[-1] == 0
    assert errors[0] < 0.12
    assert max(after - min(errors[: k + 1]) for k, after in enumerate(errors)) < GROWTH, errors


def test_exposure_and_srgb_of_hdr(renderer):
    ramp = np.geomspace(0.001, 30, 48).astype(np.float16)
    colors = np.repeat(ramp[None, :, None], 4, axis=0).repeat(3, axis=2)
    open_field(renderer, GridShape(1, 1), 48, 4, hdr=True, with_disparity=False)
    renderer.field.upload(0, 0, colors, None)
    for stops in (-4.0, 0.0, 2.5):
        renderer.render(Optics(exposure_stops=stops), (48, 4))
        expected = np.clip(srgb_from_linear(linear_from_srgb(ramp.astype(np.float32)) * 2**stops), 0, 1) * 255
        assert np.abs(renderer.read_image()[2, :, 0] - expected).max() <= 1


def test_what_is_in_focus_is_never_black_however_few_samples_the_lens_has(renderer):
    """At this eye and aperture none of the few samples is one of every other."""
    scene = TwoPlanes(width=192, height=144, background=0.0, foreground=8.0)
    scene.fill(renderer, GridShape(5, 5))
    renderer.render(Optics(ViewOffset(-1.25, 1.0), aperture_diameter=2.0), ScreenSize(384, 288), QUALITY_LEVELS[-1])
    assert renderer.read_image().min() > 0
