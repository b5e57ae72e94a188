from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.training.scenes.primitives import BALL, BOX, PLANE, PRIMITIVE, WIRE
from iibr_core.training.scenes.random_scene import (
    RaycastScene,
    cast,
    disparity_at,
    is_visible_from,
    random_scene,
    render,
    sample_places,
)
from iibr_core.types import ImageSize, ViewOffset

CENTRE = ViewOffset(0.0, 0.0)
SIZE = ImageSize(48, 64)
FOCAL, INFINITY = 70.0, 1.5
GREATEST_Z = FOCAL / 0.5  # disparity -1
ENDLESS = 1e9


def primitive(shape, centre, half, axes=None, color=(0.5, 0.5, 0.5)):
    p = np.zeros((), PRIMITIVE)
    p["shape"], p["centre"], p["half"] = shape, centre, np.maximum(half, 1e-9)
    p["axes"] = np.eye(3) if axes is None else axes
    p["nearest_z"] = 0.0
    p["period"] = p["wavelength"] = 20.0
    p["palette"] = color
    return p


def scene_of(*primitives, background=(0.1, 0.1, 0.1)):
    last = primitive(PLANE, (0, 0, GREATEST_Z), (ENDLESS, ENDLESS, 0), color=background)
    return RaycastScene(
        primitives=np.array([*primitives, last], PRIMITIVE),
        centre_px=(31.5, 23.5),
        focal_px=FOCAL,
        infinity_px=INFINITY,
        depths=(5.0, GREATEST_Z),
        light=(0.0, 0.0, -1.0),
        ambient=1.0,
    )


def wavy(seed=3, largest=2.0):
    return random_scene(np.random.default_rng(seed), SIZE, largest)


def depth_at(disparity):
    return FOCAL / (disparity + INFINITY)


def world(x, y, d):
    """The point that the centre view sees at (x, y)."""
    z = depth_at(d)
    return np.stack([(x - 31.5) * z / FOCAL, (y - 23.5) * z / FOCAL, z + 0 * x], axis=-1)


@pytest.mark.parametrize("offset", [CENTRE, ViewOffset(-3.0, 4.0), ViewOffset(0.37, -11.2)])
def test_a_slanted_plane_has_the_disparity_of_its_equation(offset):
    """d = a + b x + c y in the centre view is a plane; in another view x + d s stands for x, and d solves that."""
    a, b, c = 0.4, 0.006, -0.011
    corners = [world(np.float64(x), np.float64(y), a + b * x + c * y) for x, y in [(10, 10), (50, 12), (20, 40)]]
    first = corners[1] - corners[0]
    third = np.cross(first, corners[2] - corners[0])
    axes = [v / np.linalg.norm(v) for v in (first, np.cross(third, first), third)]
    scene = scene_of(primitive(PLANE, corners[0], (ENDLESS, ENDLESS, 0), axes))
    y, x = np.indices(SIZE)
    expected = (a + b * x + c * y) / (1 - b * offset.s - c * offset.t)
    assert render(scene, SIZE, offset, samples=1)[1] == pytest.approx(np.maximum(expected, -1), abs=1e-5)


@pytest.mark.parametrize("offset", [CENTRE, ViewOffset(2.0, -1.5)])
def test_a_ball_has_the_disparity_of_its_sphere(offset):
    centre, radius = world(np.float64(30), np.float64(20), 0.6), 4.0
    disparity = render(scene_of(primitive(BALL, centre, [radius] * 3)), SIZE, offset, samples=1)[1]
    y, x = np.indices(SIZE)
    points = world(x + disparity * offset.s, y + disparity * offset.t, disparity.astype(np.float64))
    distance = np.linalg.norm(points - centre, axis=-1)
    on_ball = disparity > -0.999
    assert on_ball.sum() > 150
    assert distance[on_ball] == pytest.approx(radius, abs=1e-4)
    camera = np.array([offset.s, offset.t, 0.0])
    assert (((points - centre) * (points - camera)).sum(-1)[on_ball] < 1e-3).all(), "the side that faces the camera"
    assert distance[~on_ball].min() > radius


def test_box_and_wire_against_small_steps_along_the_ray():
    rng = np.random.default_rng(5)
    axes, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    centre, half = world(np.float64(33), np.float64(22), 0.3), np.array([3.0, 7.0, 4.0])
    round_half = np.array([3.0, 3.0, 9.0])
    y, x = (a.ravel() for a in np.indices(SIZE))
    depths = np.linspace(5, GREATEST_Z, 4000)
    for shape, extent in ((BOX, half), (WIRE, round_half)):
        seen = depth_at(disparity_at(scene_of(primitive(shape, centre, extent, axes)), x, y, CENTRE))
        assert 100 < (seen < GREATEST_Z - 1).sum() < len(x) / 2
        for n in range(0, len(x), 37):
            local = (world(x[n], y[n], FOCAL / depths - INFINITY) - centre) @ axes.T
            within = np.abs(local) <= extent
            inside = within.all(-1) if shape == BOX else (np.hypot(*local.T[:2]) <= extent[0]) & within[:, 2]
            first = depths[inside][0] if inside.any() else GREATEST_Z
            open_end = shape == WIRE and inside.any() and abs(abs(local[inside][0, 2]) - extent[2]) < 0.1
            grazing = inside.sum() < 12
            if not open_end and not grazing:
                assert seen[n] == pytest.approx(first, abs=0.05)


@pytest.mark.parametrize("largest", [0.25, 3.75, 60.0])
def test_epi_lines_are_straight(largest):
    """A surface point of the centre view is seen in every view where x - d s says, to 1e-4 px, or is hidden there."""
    tracked = 0
    for seed in range(4):
        scene = random_scene(np.random.default_rng(seed), SIZE, largest)
        y, x = (a.ravel() for a in np.indices(SIZE))
        color, d = (a.astype(np.float64) for a in cast(scene, x, y, CENTRE, samples=1))
        for offset in (ViewOffset(0.0, -1.0), ViewOffset(1.0, 1.0), ViewOffset(-0.5, 0.25)):
            there = cast(scene, x - d * offset.s, y - d * offset.t, offset, samples=1)
            nearer = there[1] > d + 1e-3
            shown = np.abs(there[1] - d) < 1e-4
            edge = ~shown & ~nearer
            assert edge.mean() < 0.003, "neither the same point nor something before it: rounding at an edge"
            assert np.median(np.abs(there[1] - d)[shown]) < 1e-5
            assert np.quantile(np.abs(there[0] - color)[shown].max(-1), 0.99) < 2e-3, "matt: of one colour everywhere"
            tracked += shown.sum()
    assert tracked > 4 * 3 * 48 * 64 * 0.3


def test_seen_from_agrees_with_what_stands_before():
    scene = wavy(1, largest=4.0)
    y, x = (a.ravel() for a in np.indices(SIZE))
    offset = ViewOffset(2.0, -3.0)
    d = disparity_at(scene, x, y, offset).astype(np.float64)
    centre = disparity_at(scene, x + d * offset.s, y + d * offset.t, CENTRE)
    seen = is_visible_from(scene, x, y, d, offset)
    assert (centre[~seen] > d[~seen]).mean() > 0.99, "hidden by something nearer"
    assert 0.3 < seen.mean() < 1
    assert is_visible_from(scene, x, y, d, offset, offset).all()


def test_rays_of_chosen_pixels_are_those_of_the_picture():
    scene, offset = wavy(), ViewOffset(1.0, 2.5)
    colors, disparity = render(scene, SIZE, offset)
    y, x = np.array([0, 47, 13, 20]), np.array([0, 63, 40, 7])
    some, some_disparity = cast(scene, x, y, offset)
    assert (some == colors[y, x]).all()
    assert (some_disparity == disparity[y, x]).all()


def test_the_disparity_does_not_depend_on_samples_or_blur():
    scene, offset = wavy(), ViewOffset(-2.0, 1.0)
    exact = render(scene, SIZE, offset, samples=1)[1]
    for samples, blur_px in ((2, 0.0), (3, 0.5), (4, 0.0)):
        assert (render(scene, SIZE, offset, samples, blur_px)[1] == exact).all()


def test_more_samples_converge():
    scene = wavy(7)
    finest = render(scene, SIZE, CENTRE, samples=16)[0]
    errors = [np.sqrt(np.mean((render(scene, SIZE, CENTRE, n)[0] - finest) ** 2)) for n in (1, 2, 4, 8)]
    assert errors[0] > 0.01
    assert all(finer < 0.6 * coarser for coarser, finer in pairwise(errors))


def test_an_edge_mixes_in_linear_light_by_its_coverage():
    foreground, background = np.float32([0.8, 0.5, 0.1]), np.float32([0.05, 0.1, 0.4])
    z = depth_at(1.0)
    width = ENDLESS
    for share in (0.2, 0.5, 0.9):
        edge = (20.5 - share - 31.5) * z / FOCAL  # covers this share of column 20, and all to its right
        plane = primitive(PLANE, (edge + width, 0, z), (width, ENDLESS, 0), color=foreground)
        colors, _ = render(scene_of(plane, background=background), SIZE, CENTRE, samples=8)
        mixed = linear_from_srgb(colors[10, 20])
        assert mixed == pytest.approx(share * foreground + (1 - share) * background, abs=0.02)
        assert linear_from_srgb(colors[10, 21]) == pytest.approx(foreground, abs=1e-5)
        assert linear_from_srgb(colors[10, 19]) == pytest.approx(background, abs=1e-5)


@pytest.mark.parametrize("samples", [1, 2, 3, 4])
def test_samples_differ_in_rows_and_columns_and_are_centred(samples):
    places, weights = sample_places(samples)
    used = places[weights > 0]
    assert weights.sum() == pytest.approx(1)
    assert (places[0] == 0).all()
    assert len(used) == samples**2
    for axis in (0, 1):
        assert len(np.unique(used[:, axis].round(9))) == samples**2
        assert weights @ places[:, axis] == pytest.approx(0, abs=1e-12)
    assert np.abs(used).max() < 0.5
    wide, weights = sample_places(samples, blur_px=0.5)
    assert samples == 1 or (weights @ wide**2 > 2 * (weights @ places**2)).all()


@pytest.mark.parametrize("shape", [WIRE, PLANE])
@pytest.mark.parametrize("offset", [CENTRE, ViewOffset(4.0, -4.0), ViewOffset(-1.3, 2.7)])
def test_a_wire_one_pixel_wide_is_whole_in_every_view(shape, offset):
    z = depth_at(0.8)
    pixel = z / FOCAL
    axes = np.array([[0.0, 0, 1], [1, 0, 0], [0, 1, 0]]) if shape == WIRE else np.eye(3)
    half = (pixel / 2, pixel / 2, ENDLESS) if shape == WIRE else (pixel / 2, ENDLESS, 0)
    wire = primitive(shape, (1.0, 0, z), half, axes, color=(1, 1, 1))
    colors, _ = render(scene_of(wire, background=(0, 0, 0)), SIZE, offset, samples=3)
    light_in_rows = linear_from_srgb(colors[..., 0]).sum(1)
    assert light_in_rows == pytest.approx(1.0, abs=0.12), "one pixel's worth of light in each row"
    places = (linear_from_srgb(colors[..., 0]) * np.arange(SIZE[1])).sum(1) / light_in_rows
    assert places == pytest.approx(31.5 + 1 / pixel - 0.8 * offset.s, abs=0.12)


def test_a_scene_of_one_colour_stays_of_one_colour():
    scene = wavy()
    gray = scene.primitives.copy()
    gray["palette"] = linear_from_srgb(np.float32(0.6))
    plain = replace(scene, primitives=gray, ambient=1.0)
    for offset in (CENTRE, ViewOffset(4.0, -4.0)):
        assert render(plain, SIZE, offset, blur_px=0.4)[0] == pytest.approx(0.6, abs=1e-5)


def test_light_from_one_side_shades():
    ball = primitive(BALL, world(np.float64(31.5), np.float64(23.5), 0.5), [6, 6, 6])
    scene = replace(scene_of(ball), light=(-1.0, 0.0, 0.0), ambient=0.2)
    colors, _ = render(scene, SIZE, CENTRE)
    assert colors[23, 24, 0] > colors[23, 39, 0] + 0.1
    assert colors[23, 39] == pytest.approx(srgb_from_linear(np.float32([0.1] * 3)), abs=1e-3), "0.2 of 0.5"


def test_a_seed_repeats_and_another_differs():
    first, again, other = (wavy(seed) for seed in (5, 5, 6))
    assert first.primitives.tobytes() == again.primitives.tobytes()
    colors = [render(scene, SIZE, ViewOffset(1.0, 1.0))[0] for scene in (first, again, other)]
    assert (colors[0] == colors[1]).all()
    assert np.abs(colors[0] - colors[2]).mean() > 0.02


@pytest.mark.parametrize("size", [(1, 1), (1, 17), (13, 1), (2, 3), (31, 37)])
@pytest.mark.parametrize("largest", [0.0, 1e-6, 1.0, 60.0, 1e4])
def test_every_size_and_range_is_finite_and_within_its_range(size, largest):
    for seed in range(3):
        scene = random_scene(np.random.default_rng(seed), ImageSize(*size), largest)
        for offset in (CENTRE, ViewOffset(4.0, -4.0)):
            colors, disparity = render(scene, ImageSize(*size), offset)
            assert colors.shape == (*size, 3)
            assert np.isfinite(colors).all()
            assert (colors >= 0).all()
            assert (colors <= 1 + 1e-6).all()
            assert (np.abs(disparity) <= largest * (1 + 1e-5) + 1e-9).all()


@pytest.mark.parametrize("wild", [np.nan, np.inf, -np.inf, 1e30, -1e300])
def test_wild_positions_and_views_stay_finite(wild):
    scene = wavy()
    for x, offset in ((wild, CENTRE), (3.0, ViewOffset(0.0, wild)), (3.0, ViewOffset(wild, wild))):
        colors, disparity = cast(scene, [x, 5.0], [2.0, wild], offset)
        assert np.isfinite(colors).all()
        assert np.isfinite(disparity).all()


def test_scenes_hold_depth_edges_and_all_kinds_of_shapes():
    rng = np.random.default_rng(0)
    scenes = [random_scene(rng, SIZE, 2.0) for _ in range(20)]
    kinds = np.concatenate([scene.primitives["shape"] for scene in scenes])
    cuts = np.concatenate([scene.primitives["cut"] for scene in scenes])
    assert set(kinds) == {PLANE, BOX, BALL, WIRE}
    assert set(cuts) == set(range(6))
    spreads = [np.ptp(render(scene, SIZE, CENTRE, samples=1)[1]) for scene in scenes]
    assert np.median(spreads) > 0.8


def test_bad_requests_are_refused():
    rng = np.random.default_rng(0)
    for size, largest in (((0, 5), 1.0), ((4, 4), -1.0), ((4, 4), np.nan), ((4, 4), np.inf)):
        with pytest.raises(ValueError, match="size"):
            random_scene(rng, ImageSize(*size), largest)
    with pytest.raises(ValueError, match="samples"):
        cast(wavy(), [1.0], [2.0], CENTRE, samples=0)
    with pytest.raises(ValueError, match="equal"):
        cast(wavy(), [1.0, 2.0], [2.0], CENTRE)
