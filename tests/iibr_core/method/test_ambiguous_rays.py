import numpy as np
import pytest

from iibr_core.method.ambiguous_rays import (
    MIN_COLOR_CHANGE,
    SHARE,
    find_ambiguous_rays,
)
from iibr_core.method.candidates import find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.look_up import look_up
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.view import Renderer
from iibr_core.types import ViewOffset
from tests.iibr_core.method.ray_sets import ray_set
from tests.iibr_core.scenes import photo_of, square_before_wall

OFFSET = ViewOffset(0.0, 2.0)
CONTRAST = 0.18


def ambiguous_of(photo, disparity, every=False, offset=OFFSET, fringe=True):
    """Return ambiguous rays, the weights of the closed form and the ray set."""
    rays = rays_of_photo(photo.pixels, disparity, 2.0, 0)
    if not fringe:  # which pixels are mixed is a matter of colour
        rays = ray_set(disparity, colors=photo.pixels, farthest=2.0)
    height, width = photo.size
    candidates = find_candidates(rays, offset, (0, height))
    weights, _ = closed_form(candidates)
    shown = look_up(rays, candidates, weights)
    asked = np.ones((height, width), np.bool_)
    return find_ambiguous_rays(rays, candidates, weights, shown, asked, every), weights, rays


def motley(size, seed=0):
    """A photo of which no two pixels look alike: all that could be decided is seen."""
    return photo_of(np.random.default_rng(seed).random((*size, 3)).astype(np.float32))


def test_where_hypotheses_look_alike_nothing_is_ambiguous():
    photo, disparity = square_before_wall()
    pixels, is_lower = np.full_like(photo.pixels, 0.5), np.arange(photo.size.height) > 30
    pixels[(disparity.values > 0) & is_lower[:, None]] = 0.5 + CONTRAST
    ambiguous, weights, _ = ambiguous_of(photo_of(pixels), disparity.values)
    assert len(ambiguous.pixel) > 20
    assert ambiguous.pixel[:, 0].min() > 25
    left = 1 - weights.max(axis=0)[tuple(ambiguous.pixel.T)]
    assert (left * CONTRAST > MIN_COLOR_CHANGE).all(), "whatever is decided, the colour hardly changes"
    everything, _, _ = ambiguous_of(photo_of(pixels), disparity.values, every=True)
    assert len(everything.pixel) == disparity.values.size


def test_features_know_no_colour_and_no_place():
    _, disparity = square_before_wall()
    photo, other = motley(disparity.values.shape), motley(disparity.values.shape, seed=9)
    here, _, _ = ambiguous_of(photo, disparity.values, fringe=False)
    recoloured, _, _ = ambiguous_of(other, disparity.values, fringe=False)
    assert (here.features == recoloured.features).all()
    assert (here.pixel == recoloured.pixel).all()
    down, right = 4, -5
    moved, _, _ = ambiguous_of(photo, np.roll(disparity.values, (down, right), axis=(0, 1)), fringe=False)
    assert (moved.pixel == here.pixel + np.array([down, right])).all()
    assert moved.features == pytest.approx(here.features, abs=1e-5)


def test_a_transformer_that_repeats_the_closed_form_changes_nothing():
    photo, disparity = square_before_wall()
    rays = rays_of_photo(photo.pixels, disparity.values, 2.0, 0)

    def repeat(ambiguous):
        share = ambiguous.features[..., SHARE] + 1e-9 * ambiguous.mask
        return (share / share.sum(axis=1, keepdims=True)).astype(np.float32)

    one, two = Renderer().render(rays, OFFSET), Renderer(repeat).render(rays, OFFSET)
    assert two.colors == pytest.approx(one.colors, abs=0.02)
    assert np.mean(np.abs(two.colors - one.colors) > 1e-3) < 0.01
    assert (two.occluded == one.occluded).all()
