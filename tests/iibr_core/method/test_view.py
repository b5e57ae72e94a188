import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.method.look_up import KEYS_A
from iibr_core.method.mixed_pixels import move_with_foreground, split_mixed_pixels
from iibr_core.method.rays import MIN_STEP_PX, rays_of_photo
from iibr_core.method.view import Renderer
from iibr_core.surfaces import EDGE_PX
from iibr_core.types import ImageSize, Margins, ViewOffset
from tests.iibr_core.method.ray_sets import filled_rays
from tests.iibr_core.scenes import smooth_texture

FOREGROUND, WALL = np.float32([0.9, 0.6, 0.3]), np.float32([0.1, 0.2, 0.5])
HEIGHT, WIDTH, FIRST, LAST = 40, 48, 16, 30
"""A foreground in columns [FIRST, LAST), at disparity 6 before 0."""
LEFT, RIGHT = ViewOffset(0.0, -1.0), ViewOffset(0.0, 1.0)


def mixed(share):
    return srgb_from_linear(share * linear_from_srgb(FOREGROUND) + (1 - share) * linear_from_srgb(WALL))


def bar_photo(share):
    """Return colours and disparity of a plain bar before a plain wall.

    It covers `share` of the column beside it on either side.
    """
    colors = np.tile(WALL, (HEIGHT, WIDTH, 1))
    colors[:, FIRST:LAST] = FOREGROUND
    colors[:, [FIRST - 1, LAST]] = mixed(share)
    disparity = np.zeros((HEIGHT, WIDTH), np.float32)
    disparity[:, FIRST:LAST] = 6.0
    return colors, disparity


def bar(share):
    return rays_of_photo(*bar_photo(share), 1.0, 2)


@pytest.mark.parametrize("share", [0.15, 0.3, 0.45, 0.55])
@pytest.mark.parametrize("offset", [LEFT, RIGHT], ids=["left", "right"])
def test_an_edge_beside_a_gap_is_the_front_over_what_was_inpainted(share, offset):
    view = Renderer().render(bar(share), offset)
    moved = round(-6 * offset.s)
    row = view.colors[HEIGHT // 2]
    assert row[FIRST + moved : LAST + moved] == pytest.approx(np.tile(FOREGROUND, (LAST - FIRST, 1)), abs=2e-3)
    for edge in (FIRST - 1 + moved, LAST + moved):
        assert row[edge] == pytest.approx(mixed(share), abs=5e-3)
    beside_gap = HEIGHT // 2, LAST + moved if offset == RIGHT else FIRST - 1 + moved
    assert view.disparity[beside_gap] == pytest.approx(6 if share > 0.5 else 0), "the heavier part's"
    assert view.inpainted[beside_gap] == (share < 0.5)
    rest = np.r_[8 : FIRST - 1 + moved, LAST + 1 + moved : WIDTH - 8]
    assert row[rest] == pytest.approx(np.tile(WALL, (len(rest), 1)), abs=5e-3), "nothing of the foreground stays behind"


@pytest.mark.parametrize("is_upright", [True, False])
def test_both_margins_alike_continue_edges_beyond_the_frame(is_upright):
    turned = [part if is_upright else np.ascontiguousarray(part.swapaxes(0, 1)) for part in bar_photo(0.3)]
    rays = rays_of_photo(*turned, 1.0, 2, margins=Margins(8, 8, 0, 0) if is_upright else Margins(0, 0, 8, 8))
    offsets = [ViewOffset(along, 1.0) if is_upright else ViewOffset(1.0, along) for along in (-1.0, 1.0)]
    one, other = (Renderer().render(rays, offset).colors for offset in offsets)
    assert np.flip(other, 0 if is_upright else 1) == pytest.approx(one, abs=0.2), "but for what is inpainted"


SMALL = ImageSize(18, 22)
few = settings(max_examples=8)
seeds = st.integers(0, 10_000)
steps = st.integers(-8, 8).map(lambda quarter: quarter / 4)
offsets = st.builds(ViewOffset, steps, steps)


def scene(seed, height=SMALL.height, width=SMALL.width):
    """Return a photo of waves and noise and its disparity, blocks of whole quarters, which scaling keeps exact."""
    random = np.random.default_rng(seed)
    pixels = (0.6 * smooth_texture(height, width, seed) + random.uniform(0, 0.3, (height, width, 3))).astype(np.float32)
    blocks = np.kron(random.integers(-4, 5, (5, 5)) / 4, np.ones((-(-height // 5), -(-width // 5))))
    return pixels, np.ascontiguousarray(blocks[:height, :width], np.float32)


def rendered(pixels, disparity, offset, farthest=2.0, transformer=None):
    return Renderer(transformer).render(rays_of_photo(np.ascontiguousarray(pixels), disparity, farthest, 0), offset)


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
    moved = move_with_foreground(disparity, (MIN_STEP_PX / 2.0, EDGE_PX / 2.0))
    assert (view.disparity == moved).mean() > 0.95, "all but split pixels, whose foreground may weigh more"
    assert not view.inpainted.any()


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


def keys_in_doubles(f):
    at = np.abs(np.array([f + 1, f, 1 - f, 2 - f]))
    near = (KEYS_A + 2) * at**3 - (KEYS_A + 3) * at**2 + 1
    return np.where(at <= 1, near, KEYS_A * (at**3 - 5 * at**2 + 8 * at - 4))


@few
@given(seeds, st.floats(-1.9, 1.9), st.floats(-1.9, 1.9))
def test_a_moved_photo_against_its_twin_in_doubles(seed, down, right):
    """Keys' cubic convolution of the whole photo, moved by parts of a pixel; within 4 parts in a million of white."""
    pixels, _ = scene(seed)
    view = rendered(pixels, np.ones(SMALL, np.float32), ViewOffset(down, right))
    exact = pixels.astype(np.float64)
    for axis, by in ((0, down), (1, right)):
        whole = int(np.floor(by))
        weights = keys_in_doubles(by - whole)
        exact = sum(w * np.roll(exact, 1 - k - whole, axis) for k, w in enumerate(weights))
    inner = np.s_[4:-4, 4:-4]
    assert np.abs(view.colors - np.maximum(exact, 0))[inner].max() <= 4e-6
