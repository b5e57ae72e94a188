import numpy as np
import pytest

from iibr_core.training.degradation import degrade
from iibr_core.training.scenes.primitives import PLANE, PRIMITIVE
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import RaycastScene, cast, render
from iibr_core.types import CENTRE, ImageSize, ViewOffset

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
    camera, light = ((31.5, 23.5), FOCAL, INFINITY, (5.0, GREATEST_Z)), (0.0, 0.0, -1.0)
    return RaycastScene(np.array([*primitives, last], PRIMITIVE), *camera, light, ambient=1.0)


def depth_at(disparity):
    return FOCAL / (disparity + INFINITY)


def world(x, y, d):
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


@pytest.mark.parametrize("largest", [0.25, 60.0])
def test_epi_lines_are_straight(largest):
    """A surface point of the centre view is seen in every view where x - d s says, to 1e-4 px, or is hidden there."""
    tracked = 0
    for seed in range(2):
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
    assert tracked > 2 * 3 * 48 * 64 * 0.3


def rough(shape=(31, 37), seed=0):
    return np.random.default_rng(seed).normal(0, 2, shape).astype(np.float32)


def test_degrade_repeats_by_seed_and_leaves_its_input_alone():
    d = rough()
    before = d.copy()
    for seed in range(30):
        out, again = (degrade(d, np.random.default_rng(seed), 4.0) for _ in range(2))
        assert out.shape == d.shape
        assert out.dtype == np.float32
        assert np.isfinite(out).all()
        assert (out == again).all()
    assert (d == before).all()
