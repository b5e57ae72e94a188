"""The views that are said to be seen are all that any pass of a picture asks for, and not many more."""

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.gpu.scenes import TwoPlanes
from viewer.gpu.refocus.picture_lens import lens_of
from viewer.gpu.refocus.view_sampling import views_seen

SCENE = TwoPlanes(width=8, height=6)


def asked_for(renderer, optics, width_px=400):
    """By the passes of the picture."""
    field = renderer.field
    lens = lens_of(optics, field, width_px).pinhole(ScreenSize(width_px, 300))
    return {field.grid.offset(int(row), int(column)) for row, column in lens.samples(field).views}


@settings(max_examples=12, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    t=st.one_of(st.integers(-2, 2), st.floats(-3, 3)),
    s=st.one_of(st.integers(-3, 3), st.floats(-4, 4)),
    diameter=st.one_of(st.just(0.0), st.floats(0.01, 9)),
)
def test_no_pass_asks_for_a_view_that_is_not_among_them(renderer, t, s, diameter):
    grid = GridShape(5, 7)
    if renderer.field is None:
        SCENE.fill(renderer, grid)
    optics = Optics(ViewOffset(t, s), focus_disparity=2.0, aperture_diameter=diameter)
    seen = views_seen(optics, grid)
    assert asked_for(renderer, optics) <= seen


def test_an_open_lens_sees_what_the_outer_views_show_behind_the_photo():
    grid, corners = GridShape(9, 9), {ViewOffset(t, s) for t in (-4.0, 4.0) for s in (-4.0, 4.0)}
    assert views_seen(Optics(), grid) == {ViewOffset(0.0, 0.0)}
    assert views_seen(Optics(aperture_diameter=2.5), grid) == {ViewOffset(0.0, 0.0), *corners}
    assert views_seen(Optics(ViewOffset(0.5, 1.0)), grid) == {ViewOffset(0.0, 1.0), ViewOffset(1.0, 1.0)}


def test_with_dolly_all_are_seen():
    assert views_seen(Optics(aperture_diameter=3.0, dolly=0.1), GridShape(5, 5)) is None
