"""What the shipped weights are worth on scenes that training never drew, for each kind of edge that T decides on."""

from collections import defaultdict
from dataclasses import replace

import numpy as np
import pytest

from iibr_core.depth.edges.refine import refine
from iibr_core.method.ambiguous_rays import FAINT_WEIGHT, blend, find_ambiguous_rays
from iibr_core.method.candidates import find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.farthest_views import outer_views
from iibr_core.method.look_up import look_up
from iibr_core.method.occlusion import FULLY_COVERED
from iibr_core.method.ray_transformer import shipped_transformer
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.update_loop import complete_ray_set
from iibr_core.training.degradation import blur, degrade
from iibr_core.training.scenes.random_scene import cast, random_scene, render
from iibr_core.types import ImageSize, ViewOffset

SIZE, RADIUS = ImageSize(96, 128), 4
SEEDS = range(1_000_003, 1_000_011)
"""Training counts its steps from 0."""
OFFSETS = [ViewOffset(0.0, 4.0), ViewOffset(-3.0, -2.0)]
CORNERS = [ViewOffset(-4.0, -4.0), ViewOffset(4.0, 4.0)]
ARRAYS = ("pixel", "mask", "disparity", "source", "features")
MAPS = {
    "exact": lambda photo, d, rng: d,
    "blurred": lambda photo, d, rng: refine(photo, blur(d, 2.0)),
    "blurred, not refined": lambda photo, d, rng: blur(d, 2.0),
    "degraded": lambda photo, d, rng: refine(photo, degrade(d, rng, RADIUS)),
}
LEAST_GAIN = {
    ("exact", "all"): 0.3,
    ("exact", "covered in part"): 0.1,
    ("exact", "beside what is inpainted"): 0.25,
    ("exact", "between surfaces"): 0.5,
    ("blurred", "all"): 0.2,
    ("blurred", "covered in part"): 0.2,
    ("blurred", "beside what is inpainted"): 0.15,
    ("blurred", "between surfaces"): 0.2,
    ("blurred, not refined", "all"): 0.4,
    ("degraded", "all"): 0.6,
    ("degraded", "covered in part"): 0.15,
    ("degraded", "beside what is inpainted"): 0.6,
    ("degraded", "between surfaces"): 0.7,
}
"""dB over the closed form. T lost 0.2 to 0.9 dB of what it gains when its features of front and back were swapped."""


def squared_errors(seed, spoil):
    """Of each kind of ambiguous ray: the closed form's errors, and T's."""
    rng = np.random.default_rng(seed)
    scene = random_scene(rng, SIZE, float(rng.uniform(6, 30)) / RADIUS)
    colors, disparity = render(scene, SIZE, ViewOffset(0.0, 0.0))
    rays = rays_of_photo(colors, spoil(colors, disparity, rng), RADIUS, 8)
    complete_ray_set(rays, outer_views(CORNERS))
    transformer, found = shipped_transformer("balanced"), []
    for offset in OFFSETS:
        candidates = find_candidates(rays, offset, (0, SIZE.height))
        weights, share = closed_form(candidates)
        shown = look_up(rays, candidates, weights)
        ambiguous = find_ambiguous_rays(rays, candidates, weights, shown, (0, SIZE.height))
        # Where less is covered, T is not asked: what was filled behind shows there, too.
        asked = share[tuple(ambiguous.pixel.T)] >= FULLY_COVERED
        ambiguous = replace(ambiguous, **{name: getattr(ambiguous, name)[asked] for name in ARRAYS})
        y, x = ambiguous.pixel.T
        truth = cast(scene, x, y, offset)[0]
        chosen = blend(rays, ambiguous, transformer(ambiguous))[0]
        heavy = weights > FAINT_WEIGHT
        inpainted = (heavy & (candidates.source >= rays.photo_images)).any(axis=0)[y, x]
        covered = weights.sum(axis=0)[y, x] >= 1 - FAINT_WEIGHT
        kinds = ["covered in part", "beside what is inpainted"]
        kind = np.select([~covered, inpainted], kinds, "between surfaces")
        found.append((kind, np.square(shown.colors[y, x] - truth).sum(axis=1), np.square(chosen - truth).sum(axis=1)))
    return [np.concatenate(part) for part in zip(*found)]


@pytest.fixture(scope="module")
def gains():
    """dB that T gains over the closed form, by map and kind of ray."""
    gains = {}
    for name, spoil in MAPS.items():
        sums = defaultdict(lambda: np.zeros(2))
        for seed in SEEDS:
            kinds, closed, chosen = squared_errors(seed, spoil)
            for kind in (*np.unique(kinds), "all"):
                of_kind = (kinds == kind) | (kind == "all")
                sums[kind] += closed[of_kind].sum(), chosen[of_kind].sum()
        for kind, (before, after) in sums.items():
            gains[name, str(kind)] = 10 * np.log10(before / after)
    return gains


@pytest.mark.parametrize("case", LEAST_GAIN, ids=", ".join)
def test_the_transformer_gains_on_held_out_scenes(gains, case):
    assert gains[case] > LEAST_GAIN[case]
