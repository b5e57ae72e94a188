"""The passes of inspection against plain numpy: EPIs, sheet, overlays, views read background, who sees a surface."""

import numpy as np
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.gpu.scenes import TwoPlanes, eyes_of_pixels
from viewer.gpu.inspection_passes import InspectionPasses, Line, OverlayStyle
from viewer.model.colormap import VIRIDIS, map_color
from viewer.model.layout import PixelRect

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


@pytest.mark.parametrize("stops", [-2.0, 1.5])
def test_exposure_is_a_factor_of_light(renderer, passes, stops):
    field = full(renderer)
    passes.draw_view(field, 1, 2, "photo", 2.0**stops)
    light = linear_from_srgb(SCENE.view(GRID.offset(1, 2))[0] / 255) * 2.0**stops
    expected = srgb_from_linear(np.clip(light, 0, 1)) * 255
    np.testing.assert_allclose(passes.read("photo")[..., :3], expected, atol=2)


def test_the_sheet_shows_each_view_in_its_cell_and_grey_where_none_is(renderer, passes):
    SCENE.open(renderer, GRID)
    SCENE.upload(renderer, GRID, *GRID.centre)
    field = renderer.field
    cells = PixelRect(2, 3, 48, 36), PixelRect(60, 3, 48, 36)
    passes.start_sheet((110, 60))
    passes.draw_on_sheet(field, *GRID.centre, cells[0], 1.0)
    passes.draw_on_sheet(field, 0, 0, cells[1], 1.0)
    sheet = passes.read("sheet")[..., :3].astype(float)
    light = linear_from_srgb(SCENE.view(ViewOffset(0, 0))[0] / 255)
    halved = srgb_from_linear(light.reshape(36, 2, 48, 2, 3).mean(axis=(1, 3))) * 255
    np.testing.assert_allclose(sheet[3:39, 2:50], halved, atol=4)
    missing = sheet[3:39, 60:108]
    assert np.ptp(missing, axis=-1).max() == 0
    assert missing.min() > 0
    outside = np.ones(sheet.shape[:2], bool)
    outside[3:39, 2:50] = outside[3:39, 60:108] = False
    assert not sheet[outside].any()


LOOK = OverlayStyle(VIRIDIS, (-1.0, 2.0), opacity=0.5)


def test_the_disparity_overlay_at_a_stored_view_is_its_map_in_colours(renderer, passes):
    view = (1, 5)
    passes.draw_overlay(full(renderer), Optics(eye=GRID.offset(*view)), view, SIZE, LOOK)
    overlay = passes.read("overlay")
    disparity = SCENE.view(GRID.offset(*view))[1]
    expected = [[map_color((d + 1) / 3) for d in row] for row in disparity]
    np.testing.assert_allclose(overlay[..., :3], np.multiply(expected, 255), atol=1)
    np.testing.assert_allclose(overlay[..., 3], 127.5, atol=1)


@pytest.mark.parametrize(
    "optics", [Optics(ViewOffset(0.4, -0.3)), Optics(ViewOffset(-2.7, 3.4)), Optics(ViewOffset(0.2, 0.0), dolly=4.0)]
)
def test_between_views_the_overlay_lies_where_the_eye_sees_the_surfaces(renderer, passes, optics):
    view = min(4, max(0, round(optics.eye.t) + 2)), min(6, max(0, round(optics.eye.s) + 3))
    passes.draw_overlay(full(renderer), optics, view, SIZE, LOOK)
    near = passes.read("overlay")[..., 0].astype(int) > 128  # viridis: only its light end is red
    assert near.any()
    assert (near != (SCENE.view(ViewOffset(*eyes_of_pixels(optics, SCENE)))[1] > 0)).mean() < 0.01


def test_values_are_laid_over_the_surface_they_belong_to(renderer, passes):
    """A mask of the disc, known in the middle view, covers the disc from another eye."""
    mask = (SCENE.view(ViewOffset(0, 0))[1] > 0).astype(np.uint8) * 255
    eye = ViewOffset(1.0, -2.0)
    amber = OverlayStyle(((255, 184, 60),) * len(VIRIDIS), (0.0, 1.0), 1.0, is_mask=True)
    passes.draw_overlay(full(renderer), Optics(eye=eye), GRID.centre, SIZE, amber, mask)
    overlay = passes.read("overlay")
    covered = overlay[..., 3] == 255
    assert (covered != (SCENE.view(eye)[1] > 0)).mean() < 0.02
    np.testing.assert_array_equal(np.unique(overlay[covered][:, :3], axis=0), [[255, 184, 60]])
    assert not overlay[~covered][:, 3].any()
