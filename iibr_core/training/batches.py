"""Batches of contested rays from random scenes: true colours, and disparity as real maps have it.

Step n of a seed always gives the same batch. Contested rays of a few views come after one EPI, which has every ray.
"""

from __future__ import annotations

import numpy as np
import torch
from numpy.typing import NDArray

from iibr_core.candidates import find_candidates
from iibr_core.color import linear_from_srgb
from iibr_core.contested import REACH_PX, Contested, find_contested
from iibr_core.occlusion import occlusion_mask
from iibr_core.rays import RaySet
from iibr_core.synthesis import ViewSynthesis, rays_of_photo
from iibr_core.training.degrade import degrade
from iibr_core.training.loop import Batch
from iibr_core.training.losses import EpiShape
from iibr_core.training.scenes import Scene, cast, random_scene, render
from iibr_core.types import FloatImage, ViewOffset
from iibr_core.weights import closed_form_weights

SIZE = 112, 128
VIEWS = 3
RAYS_A_VIEW = 1500
EPI_VIEWS, EPI_WIDTH = 9, 64
LIGHT_FIELD, STEREO = 4, 1
"""Radii of the grids trained for, view steps: many views a little apart, or two far apart."""
PARALLAX_PX = 4.0, 45.0
"""Between the outermost view and the photo, at the largest disparity."""

Rays = tuple[Contested, FloatImage]
"""Contested rays and their true colours (N, 3), sRGB-encoded."""


def training_batch(step: int, seed: int) -> Batch:
    """The batch of a step: one EPI, then contested rays of VIEWS views, of one random scene."""
    rng = np.random.default_rng((seed, step))
    radius = int(rng.choice([LIGHT_FIELD, STEREO], p=[0.75, 0.25]))
    largest = float(np.exp(rng.uniform(*np.log(PARALLAX_PX)))) / radius
    scene = random_scene(rng, SIZE, largest)
    colors, disparity = render(scene, SIZE, ViewOffset(0.0, 0.0))
    rays = _ray_set(colors, degrade(disparity, rng, radius), radius)
    epi = _epi(scene, rays, radius, rng)
    parts = [epi] if epi else []
    parts += [_contested(scene, rays, _random_offset(radius, rng), rng) for _ in range(VIEWS)]
    return _batch(parts, (1, EPI_VIEWS, EPI_WIDTH) if epi else None)


def _ray_set(colors: FloatImage, disparity: FloatImage, radius: int) -> RaySet:
    """The photo's rays and those inpainted in the corner views, as `generate` makes them."""
    corners = [ViewOffset(float(t), float(s)) for t, s in ((-radius, -radius), (radius, radius))]
    rays = rays_of_photo(colors, disparity, radius, len(corners))
    with ViewSynthesis() as synthesis:
        for offset in corners:
            view = synthesis.render(rays, offset)
            if view.occluded.any():
                rays.add(offset, view.colors, view.disparity, view.occluded.astype(np.float32))
    return rays


def _random_offset(radius: int, rng: np.random.Generator) -> ViewOffset:
    """Any view of the grid but the photo's own."""
    while True:
        t, s = rng.integers(-radius, radius + 1, 2)
        if t or s:
            return ViewOffset(float(t), float(s))


def _contested(scene: Scene, rays: RaySet, offset: ViewOffset, rng: np.random.Generator) -> Rays:
    """Contested rays of a view, also those whose true surface the photo does not show: background is right there."""
    candidates = find_candidates(rays, offset, (0, SIZE[0]))
    weights = closed_form_weights(candidates)
    contested = find_contested(rays, candidates, weights, (0, SIZE[0]), occlusion_mask(weights))
    chosen = rng.permutation(len(contested.pixel))[:RAYS_A_VIEW]
    y, x = contested.pixel[chosen].T
    return _subset(contested, chosen), cast(scene, x, y, offset)[0]


def _epi(scene: Scene, rays: RaySet, radius: int, rng: np.random.Generator) -> Rays | None:
    """Every ray of a piece of one row in EPI_VIEWS views from left to right; None where one has no hypothesis."""
    row = int(rng.integers(REACH_PX, SIZE[0] - REACH_PX))
    first = int(rng.integers(0, SIZE[1] - EPI_WIDTH + 1))
    columns = np.arange(first, first + EPI_WIDTH)
    parts, truths = [], []
    for s in np.linspace(-radius, radius, EPI_VIEWS):
        offset = ViewOffset(0.0, float(s))
        candidates = find_candidates(rays, offset, (row - REACH_PX, row + REACH_PX + 1))
        weights = closed_form_weights(candidates)
        nothing = np.zeros(candidates.count.shape, np.bool_)
        contested = find_contested(rays, candidates, weights, (REACH_PX, REACH_PX + 1), nothing, every=True)
        chosen = np.flatnonzero(np.isin(contested.pixel[:, 1], columns))
        if len(chosen) < EPI_WIDTH:
            return None
        parts.append(_subset(contested, chosen))
        truths.append(cast(scene, columns, np.full(EPI_WIDTH, row), offset)[0])
    return _joined(parts), np.concatenate(truths)


def _subset(contested: Contested, chosen: NDArray[np.intp]) -> Contested:
    return Contested(
        contested.pixel[chosen],
        contested.mask[chosen],
        contested.disparity[chosen],
        contested.source[chosen],
        contested.features[chosen],
        contested.colors[chosen],
    )


def _joined(parts: list[Contested]) -> Contested:
    names = ("pixel", "mask", "disparity", "source", "features", "colors")
    return Contested(*(np.concatenate([getattr(part, name) for part in parts]) for name in names))


def _batch(parts: list[Rays], epi_shape: EpiShape | None) -> Batch:
    everything = _joined([contested for contested, _ in parts])
    truth = np.concatenate([truth for _, truth in parts])
    return Batch(
        features=torch.from_numpy(everything.features),
        mask=torch.from_numpy(everything.mask),
        colors=torch.from_numpy(linear_from_srgb(everything.colors)),
        truth=torch.from_numpy(linear_from_srgb(truth)),
        epi_shape=epi_shape,
    )
