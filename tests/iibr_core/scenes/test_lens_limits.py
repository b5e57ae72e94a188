from dataclasses import replace

import pytest

from iibr_core.beyond.optics import ApertureShape, Optics
from iibr_core.depth.choice import DepthChoice
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.lens_limits import (
    WIDEST_DISC,
    aperture_limit,
    clamp_optics,
    clamp_to_grid,
    eye_limits,
    focus_limits,
    is_finite,
)
from iibr_core.scenes.scene import (
    Scene,
    Source,
    source_beside,
    source_with_depth,
    source_with_map,
)
from iibr_core.types import GridShape, ViewOffset

RANGES = [(-1.0, 2.0), (1.0, 4.0), (-3.0, -1.0), (2.0, -1.0), (-1.0, -3.0), (0.0, 2.0), (-2.0, 0.0), (0.0, 0.0)]
SCENE = Scene(Source("a.png"), "a", 96, 64, GridShape(5, 9), (-1.0, 2.0), "file")


@pytest.mark.parametrize("range_px", RANGES)
def test_the_focus_goes_from_beyond_one_end_over_the_static_plane_to_the_other(range_px) -> None:
    """Also where all lies before the plane that does not move, all behind it, or near and far are exchanged."""
    scene = replace(SCENE, disparity_range_px=range_px)
    low, high = min(*range_px, 0.0), max(*range_px, 0.0)
    margin = 0.1 * (high - low) or 0.1
    assert focus_limits(scene) == pytest.approx((low - margin, high + margin))
    for focus in (*range_px, 0.0):
        assert clamp_optics(Optics(focus_disparity=focus), scene).focus_disparity == focus
        assert LensChoice(focus=focus).optics_on(scene).focus_disparity == focus


@pytest.mark.parametrize("sign", [1, -1])
def test_every_number_of_the_lens_stays_within_its_limits(sign) -> None:
    shape = ApertureShape("mask", 7 + sign * 9, 360.0 + sign * 30, 0.5 + sign * 9, 0.5 + sign * 9)
    nine = sign * 9
    wild = Optics(ViewOffset(nine, -nine), nine, nine, nine, (11 * nine, -11 * nine), 11 * nine, shape, nine)
    clamped, is_low = clamp_optics(wild, SCENE), sign < 0
    assert clamped.eye == (sign * 2, -sign * 4)
    assert clamped.dolly == sign * 4
    assert clamped.focus_disparity == pytest.approx(-1.3 if is_low else 2.3)
    assert clamped.focus_range == pytest.approx(0 if is_low else 3.6)
    assert clamped.focus_tilt == pytest.approx((sign * 14.4, -sign * 14.4))
    assert (clamped.aperture_diameter, clamped.highlight_recovery) == ((0, 0) if is_low else (aperture_limit(SCENE), 1))
    shape = clamped.aperture_shape
    assert (shape.kind, shape.blades, shape.rotation_deg) == ("disc", 3 if is_low else 11, 330 if is_low else 30)
    assert (shape.ring_inner > 0.5, shape.cat_eye) == (not is_low, 0 if is_low else 1)
    assert clamp_optics(clamped, SCENE) == clamped


def test_the_viewpoint_leaves_a_single_view_only() -> None:
    shallow, deep = (replace(SCENE, disparity_range_px=(-1.0, far)) for far in (-0.8, 1e3))
    assert aperture_limit(shallow) * 0.1 == pytest.approx(WIDEST_DISC * SCENE.width), "half of the range of disparity"
    assert aperture_limit(deep) == 9, "as wide as the grid"
    assert [eye_limits(views) for views in (1, 2, 3, 4)] == [(-0.5, 0.5), (-1, 0), (-1, 1), (-2, 1)]
    single = replace(SCENE, grid=GridShape(1, 1))
    assert clamp_optics(Optics(ViewOffset(1.0, -1.0), aperture_diameter=3.0), single).eye == (0.5, -0.5)
    assert clamp_optics(Optics(aperture_diameter=3.0), single).aperture_diameter == 0
    assert clamp_to_grid(ViewOffset(0.4, -0.4), GridShape(1, 4)) == (0, -0.4)
    assert clamp_to_grid(ViewOffset(9, 9), GridShape(3, 4)) == (1, 1)


@pytest.mark.parametrize(
    "changes",
    [{"dolly": float("nan")}, {"focus_tilt": (0.0, float("inf"))}, {"eye": ViewOffset(0.0, float("nan"))},
     {"aperture_shape": ApertureShape(rotation_deg=float("inf"))}],
)  # fmt: skip
def test_numbers_that_are_not_finite_are_known(changes) -> None:
    assert is_finite(Optics())
    assert not is_finite(replace(Optics(), **changes))


def test_another_file_or_map_keeps_only_decisions_that_still_make_sense() -> None:
    depth = DepthChoice("rough", file="m.png", file_scale=2.0, inverts=True, is_metric=True, model="m")
    source = Source("a.png", depth, GridShape(3, 3), 0.5, 100, "i", True)
    beside = source_beside(source, "b.png")
    assert beside == replace(source, path="b.png", focus_disparity=None, depth=beside.depth)
    assert beside.depth == DepthChoice("rough", model="m")
    assert source_with_map(source, "n.png").depth == DepthChoice("auto", file="n.png", stretches=True, model="m")
    assert source_with_depth(source, "model").depth == DepthChoice("model", model="m")
    assert source_with_depth(source, "model", "n").depth == DepthChoice("model", model="n")
    assert source_beside(None, "b.png") == Source("b.png")
