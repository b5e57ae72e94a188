"""The views that are said to be seen are all that any pass of a picture asks for, and not many more."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from iibr_core.beyond.optics import ApertureMask, ApertureShape, Optics
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.gpu.scenes import TwoPlanes
from viewer.gpu.refocus.picture_lens import lens_of
from viewer.gpu.refocus.picture_renderer import Renderer
from viewer.gpu.refocus.view_sampling import pinhole_sources
from viewer.gpu.refocus.views_seen import views_seen

SCENE = TwoPlanes(width=8, height=6)
MASK = ApertureShape("mask", mask=ApertureMask("corner", 2, 2, bytes([255, 255, 255, 0])))
SHAPES = [ApertureShape(), ApertureShape("polygon", blades=3), ApertureShape("ring", ring_inner=0.9), MASK]


def asked_for(renderer: Renderer, optics: Optics, width_px: int = 400) -> set[ViewOffset]:
    """By all passes of the picture."""
    field = renderer.field
    assert field is not None
    lens = lens_of(optics, field, width_px)
    every = [lens.samples(field, k).views for k in range(lens.pass_count(field))]
    return {field.grid.offset(int(row), int(column)) for views in every for row, column in views}


@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: shape.kind)
@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    t=st.one_of(st.integers(-2, 2), st.floats(-3, 3)),
    s=st.one_of(st.integers(-3, 3), st.floats(-4, 4)),
    diameter=st.one_of(st.just(0.0), st.floats(0.01, 9)),
    with_disparity=st.booleans(),
)
@example(t=1.0, s=0.0, diameter=5.0, with_disparity=False)  # a mask's corners reach beyond the disc
def test_no_pass_asks_for_a_view_that_is_not_among_them(
    renderer: Renderer, shape: ApertureShape, t: float, s: float, diameter: float, with_disparity: bool
) -> None:
    grid = GridShape(5, 7)
    if renderer.field is None or renderer.field.has_disparity.any() != with_disparity:
        SCENE.fill(renderer, grid, with_disparity)
    optics = Optics(ViewOffset(t, s), focus_disparity=2.0, aperture_diameter=diameter, aperture_shape=shape)
    seen = views_seen(optics, grid)
    assert seen is not None
    assert asked_for(renderer, optics) <= seen


@pytest.mark.parametrize(("eye", "diameter"), [(ViewOffset(0.4, -0.3), 0.0), (ViewOffset(1.0, 3.2), 2.5)])
def test_they_are_the_corners_of_all_cells_that_the_disc_lies_in(eye: ViewOffset, diameter: float) -> None:
    grid, along = GridShape(9, 9), diameter * ((np.arange(50) + 0.5) / 50 - 0.5)
    corners = {
        grid.offset(row, column)
        for t in along
        for s in along
        if np.hypot(t, s) <= diameter / 2
        for row, column, _ in pinhole_sources(ViewOffset(eye.t + t, eye.s + s), grid, np.ones(grid, bool))
    }
    seen = views_seen(Optics(eye, aperture_diameter=diameter), grid)
    assert seen is not None
    assert corners <= seen
    assert len(seen - corners) <= 2


def test_with_dolly_all_are_seen() -> None:
    assert views_seen(Optics(aperture_diameter=3.0, dolly=0.1), GridShape(5, 5)) is None
