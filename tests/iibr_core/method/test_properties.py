"""Properties that hold for every photo and disparity: symmetries, limits, sums, and float32 against float64 twins."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as stn

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.method.ambiguous_rays import find_ambiguous_rays
from iibr_core.method.candidates import find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.look_up import KEYS_A, look_up
from iibr_core.method.mixed_pixels import move_with_foreground, split_mixed_pixels
from iibr_core.method.occlusion import entropy
from iibr_core.method.ray_transformer import shipped_transformer
from iibr_core.method.rays import LEAST_STEP_PX, rays_of_photo
from iibr_core.method.view import Renderer
from iibr_core.surfaces import EDGE_PX
from iibr_core.types import ViewOffset
from tests.iibr_core.method.filled_rays import filled_rays
from tests.iibr_core.scenes import smooth_texture

HEIGHT, WIDTH = 18, 22
few = settings(max_examples=20)
seeds = st.integers(0, 10_000)
steps = st.integers(-8, 8).map(lambda quarter: quarter / 4)
offsets = st.builds(ViewOffset, steps, steps)


def scene(seed, height=HEIGHT, width=WIDTH):
    """A photo (H, W, 3) of waves and noise; its disparity (H, W), blocks of whole quarters, kept exact by scaling."""
    random = np.random.default_rng(seed)
    pixels = (0.6 * smooth_texture(height, width, seed) + random.uniform(0, 0.3, (height, width, 3))).astype(np.float32)
    blocks = np.kron(random.integers(-4, 5, (5, 5)) / 4, np.ones((-(-height // 5), -(-width // 5))))
    return pixels, np.ascontiguousarray(blocks[:height, :width], np.float32)


def rendered(pixels, disparity, offset, farthest=2.0, transformer=None):
    with Renderer(transformer=transformer, every=transformer is not None) as synthesis:
        return synthesis.render(rays_of_photo(np.ascontiguousarray(pixels), disparity, farthest, 0), offset)


TURNS = {
    "left and right": (lambda image: np.flip(image, 1), lambda t, s: ViewOffset(t, -s)),
    "up and down": (lambda image: np.flip(image, 0), lambda t, s: ViewOffset(-t, s)),
    "rows and columns": (lambda image: image.swapaxes(0, 1), lambda t, s: ViewOffset(s, t)),
}


@few
@given(seeds, offsets, st.sampled_from(sorted(TURNS)), st.booleans())
def test_flipping_the_photo_flips_the_views(seed, offset, turn, has_mixed_pixels):
    """Where the photo is seen, but for ties: of what lies equally near the first counts, so few rays may differ.

    A mixed pixel at a corner takes the colour of its foreground from one of two neighbours, so there it is some more.
    """
    pixels, disparity = scene(seed)
    pixels = pixels if has_mixed_pixels else 0.5 + 0.04 * (pixels - 0.5)
    disparity = np.round(2 * disparity) + np.float32(0.3)
    offset = ViewOffset(offset.t + 0.137, offset.s - 0.361)
    turned, turned_offset = TURNS[turn]
    one = rendered(pixels, disparity, offset)
    other = rendered(turned(pixels), np.ascontiguousarray(turned(disparity)), turned_offset(*offset))
    assert (turned(other.occluded) != one.occluded).mean() <= 0.02
    differs = (np.abs(turned(other.colors) - one.colors) > 1e-5).any(axis=2) & (filled_rays(one)[2] == 0)
    assert differs.mean() <= (0.1 if has_mixed_pixels else 0.03)


@few
@given(seeds)
def test_a_view_offset_of_zero_gives_the_photo_back(seed):
    """Exactly, but where a pixel was split in two, of which one would be darker than black. (A field has the photo
    itself there.)
    """
    pixels, disparity = scene(seed)
    view = rendered(pixels, disparity, ViewOffset(0.0, 0.0))
    is_split = split_mixed_pixels(pixels, disparity, EDGE_PX / 2.0)[3] > 0
    assert (view.colors == pixels)[~is_split].all()
    error = np.abs(view.colors - pixels).max(axis=2)
    assert (error > 1e-3).mean() <= 0.01
    assert error.max() <= 0.1
    moved = move_with_foreground(disparity, (LEAST_STEP_PX / 2.0, EDGE_PX / 2.0))
    assert (view.disparity == moved).mean() > 0.95, "all but split pixels, whose foreground may weigh more"
    assert not view.inpainted.any()


@few
@given(seeds)
def test_at_a_view_offset_of_zero_the_transformer_errs_at_split_pixels_only(seed):
    """No field is made of such a view, for the photo itself stands there; half a share of a pixel is what it costs."""
    pixels, disparity = scene(seed)
    view = rendered(pixels, disparity, ViewOffset(0.0, 0.0), transformer=shipped_transformer("balanced"))
    coverage = split_mixed_pixels(pixels, disparity, EDGE_PX / 2.0)[3]
    error = np.abs(view.colors - pixels).max(axis=2)
    assert error[coverage == 0].max() <= 1e-4
    assert error.max() <= 0.4


@few
@given(seeds, offsets)
def test_an_offset_towards_zero_comes_to_the_photo(seed, offset):
    """Its error against the photo vanishes with it, but for pixels that were split in two, see above."""
    pixels, disparity = scene(seed)
    errors = [
        float(np.abs(rendered(pixels, disparity, ViewOffset(offset.t * f, offset.s * f)).colors - pixels).mean())
        for f in (1e-2, 1e-4, 1e-8)
    ]
    assert errors[1] <= errors[0] / 10 + 1e-4
    assert errors[2] <= 1e-4


@few
@given(seeds, offsets, st.sampled_from([0.25, 0.5, 2.0, 8.0, -1.0, -2.0]))
def test_disparity_times_a_and_offset_over_a_is_the_same_view(seed, offset, a):
    """Exactly, for powers of two; a sign turns the grid round."""
    pixels, disparity = scene(seed)
    one = rendered(pixels, disparity, offset)
    scaled = ViewOffset(offset.t / a, offset.s / a)
    if a < 0:  # near and far change places, so only surfaces that hide nothing look the same
        disparity = np.full_like(disparity, disparity[0, 0])
        one = rendered(pixels, disparity, offset)
    other = rendered(pixels, disparity * np.float32(a), scaled, farthest=2.0 / abs(a))
    assert (other.occluded == one.occluded).all()
    assert np.abs(other.colors - one.colors).max() <= 1e-5
    assert np.abs(other.disparity - one.disparity * a).max() <= 1e-5


@few
@given(seeds, offsets)
def test_weights_sum_to_one(seed, offset):
    """The transformer's exactly so; the closed form's to the share of the pixel that is covered."""
    pixels, disparity = scene(seed)
    rays = rays_of_photo(pixels, disparity, 2.0, 0)
    found = find_candidates(rays, offset, (0, HEIGHT))
    weights = closed_form(found)
    used = np.arange(5)[:, None, None] < found.number
    covered = np.minimum(np.where(used, found.coverage, 0).sum(axis=0, dtype=np.float64), 1)
    assert np.abs(weights.sum(axis=0) - covered).max() <= 1e-5
    assert weights.min() >= 0
    shown = look_up(rays, found, weights)
    ambiguous = find_ambiguous_rays(rays, found, weights, shown, (0, HEIGHT), every=True)
    decided = shipped_transformer("balanced")(ambiguous)
    assert np.abs(decided.sum(axis=1) - 1).max(initial=0) <= 1e-5
    assert decided.min(initial=0) >= 0


any_weights = stn.arrays(
    np.float32, st.tuples(st.integers(1, 9), st.just(2), st.just(3)), elements=st.floats(0, 1, width=32)
)


@given(any_weights)
def test_entropy_is_from_0_to_1(weights):
    """Whatever sums to one or less: also denormal weights, and sums that rounding carries beyond one."""
    weights = weights / np.maximum(weights.sum(axis=0, dtype=np.float64), 1).astype(np.float32)
    for factor in (1.0, 1 + 1e-6, 1e-42):
        values = entropy(np.ascontiguousarray(weights * np.float32(factor)))
        assert (values >= 0).all()
        assert (values <= 1).all()


def entropy_in_doubles(weights):
    weights = weights.astype(np.float64)
    slots, covered = len(weights), np.minimum(weights.sum(axis=0), 1)
    if slots == 1:
        return 1 - covered
    shares = weights + (1 - covered) / slots
    return -np.where(shares > 0, shares * np.log(np.maximum(shares, 1e-300)), 0).sum(axis=0) / np.log(slots)


@given(any_weights)
def test_entropy_against_its_twin_in_doubles(weights):
    weights = weights / np.maximum(weights.sum(axis=0, dtype=np.float64), 1).astype(np.float32)
    assert np.abs(entropy(weights) - entropy_in_doubles(weights)).max() <= 1e-6


@given(stn.arrays(np.float64, 64, elements=st.floats(0, 1e4)))
def test_colour_curves_against_their_twins_in_doubles(values):
    """Within 3 parts in a million, also far beyond white, and back again."""
    linear = np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)
    encoded = np.where(values <= 0.0031308, values * 12.92, 1.055 * values ** (1 / 2.4) - 0.055)
    assert linear_from_srgb(values) == pytest.approx(linear, rel=3e-6, abs=1e-12)
    assert srgb_from_linear(values) == pytest.approx(encoded, rel=3e-6, abs=1e-9)
    assert srgb_from_linear(linear_from_srgb(values)) == pytest.approx(values, rel=3e-6, abs=1e-8)


def keys_in_doubles(f):
    at = np.abs(np.array([f + 1, f, 1 - f, 2 - f]))
    near = (KEYS_A + 2) * at**3 - (KEYS_A + 3) * at**2 + 1
    return np.where(at <= 1, near, KEYS_A * (at**3 - 5 * at**2 + 8 * at - 4))


@few
@given(seeds, st.floats(-1.9, 1.9), st.floats(-1.9, 1.9))
def test_a_moved_photo_against_its_twin_in_doubles(seed, down, right):
    """Keys' cubic convolution of the whole photo, moved by parts of a pixel; within 4 parts in a million of white."""
    pixels, _ = scene(seed)
    view = rendered(pixels, np.ones((HEIGHT, WIDTH), np.float32), ViewOffset(down, right))
    exact = pixels.astype(np.float64)
    for axis, by in ((0, down), (1, right)):
        whole = int(np.floor(by))
        weights = keys_in_doubles(by - whole)
        exact = sum(w * np.roll(exact, 1 - k - whole, axis) for k, w in enumerate(weights))
    inner = np.s_[4:-4, 4:-4]
    assert np.abs(view.colors - np.maximum(exact, 0))[inner].max() <= 4e-6


@pytest.mark.parametrize("quality", ["fast", "balanced"])
def test_error_falls_with_the_noise_of_the_disparity(quality):
    """Before a depth edge too, where the photo shows. What is inpainted is chosen among patches: it stays near, and
    without noise nothing differs.
    """
    transformer = shipped_transformer(quality)
    pixels, truth = smooth_texture(32, 40), np.where(np.arange(40) < 20, 2.0, 0.0) * np.ones((32, 1), np.float32)
    noise = np.random.default_rng(0).normal(0, 1, truth.shape)
    offset = ViewOffset(0.5, 1.0)
    exact = rendered(pixels, truth.astype(np.float32), offset, transformer=transformer)
    errors = []
    for s in (0.4, 0.2, 0.1, 0.05, 0.01, 0.0):
        view = rendered(pixels, (truth + s * noise).astype(np.float32), offset, 2.0, transformer)
        seen = ~(exact.inpainted | view.inpainted)
        errors.append(float(np.sum(((view.colors - exact.colors) ** 2)[seen])))
        assert seen.mean() > 0.9
        assert np.mean(((view.colors - exact.colors) ** 2)[~seen]) < 0.03**2
    assert errors == sorted(errors, reverse=True)
    np.testing.assert_array_equal(view.colors, exact.colors)
