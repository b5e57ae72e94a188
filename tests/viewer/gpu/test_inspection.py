"""An EPI and an overlay against plain numpy; `test_golden_optics.py` looks at the other images of inspection."""

import numpy as np
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.gpu.scenes import TwoPlanes, eyes_of_pixels
from viewer.gpu.inspection_passes import InspectionPasses, Line, OverlayStyle
from viewer.model.colormap import VIRIDIS

GRID = GridShape(5, 7)
SCENE = TwoPlanes()
SIZE = SCENE.width, SCENE.height
BAND = 4


@pytest.fixture
def passes(gl, renderer):
    made = InspectionPasses(gl.ctx, renderer.programs)
    yield made
    made.release()


def full(renderer):
    SCENE.fill(renderer, GRID)
    return renderer.field


def test_an_upright_epi_is_one_column_of_every_view_of_its_column(renderer, passes):
    line = Line(4, (50 + 0.5) / SCENE.width, is_upright=True)
    passes.draw_epi(full(renderer), line, (BAND * GRID.rows, SCENE.height), 1.0)
    epi = passes.read("upright")[..., :3].reshape(SCENE.height, GRID.rows, BAND, 3)[:, :, 1]
    expected = [SCENE.view(GRID.offset(v, 4))[0][:, 50] for v in range(GRID.rows)]
    np.testing.assert_allclose(epi.transpose(1, 0, 2), expected, atol=1)


LOOK = OverlayStyle(VIRIDIS, (-1.0, 2.0), opacity=0.5)


@pytest.mark.parametrize(
    "optics", [Optics(ViewOffset(0.4, -0.3)), Optics(ViewOffset(-2.7, 3.4)), Optics(ViewOffset(0.2, 0.0), dolly=4.0)]
)
def test_between_views_the_overlay_lies_where_the_eye_sees_the_surfaces(renderer, passes, optics):
    view = min(4, max(0, round(optics.eye.t) + 2)), min(6, max(0, round(optics.eye.s) + 3))
    passes.draw_overlay(full(renderer), optics, view, SIZE, LOOK)
    near = passes.read("overlay")[..., 0].astype(int) > 128  # viridis: only its light end is red
    assert near.any()
    assert (near != (SCENE.view(ViewOffset(*eyes_of_pixels(optics, SCENE)))[1] > 0)).mean() < 0.01
