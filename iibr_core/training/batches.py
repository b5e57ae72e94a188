"""Batches of ambiguous rays from random scenes: features made with degraded disparity, and true colours.

The same step of the same seed always gives the same batch. It begins with one EPI, which has every ray.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from iibr_core.color import linear_from_srgb
from iibr_core.depth.edges.refine import refine
from iibr_core.method.ambiguous_rays import SEARCH_PX, SHARE, AmbiguousRays, blend, find_ambiguous_rays
from iibr_core.method.candidates import find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.look_up import look_up
from iibr_core.method.rays import RaySet, rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer
from iibr_core.training.degradation import degrade
from iibr_core.training.distributions import log_uniform
from iibr_core.training.losses import color_loss, to_perceptual
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import RaycastScene, cast, render
from iibr_core.training.trainer import Batch
from iibr_core.types import CENTRE, FloatImage, ImageSize, ViewOffset

SIZE = ImageSize(112, 128)
VIEWS = 3
RAYS_PER_VIEW = 1500
EPI_VIEWS, EPI_WIDTH = 9, 64
GRID_RADII = (4, 4, 4, 1)
"""Radii of the grids of views, in view steps: many views a little apart; in one of four scenes, few far apart."""
PARALLAX_PX = 4.0, 45.0
"""Range of the parallax between the photo and the outermost view, at the largest disparity."""
REFINED_SHARE = 0.75
"""Share of the maps that are refined, as the program does by default."""
TYPICAL_ERROR, MIN_ERROR = 0.004, 0.0005
"""Squared errors of colours: of a scene with gain 1, and one below which scenes do not gain more."""


class LabelledRays(NamedTuple):
    """Features (N, K, F), mask (N, K), colours of the hypotheses (N, K, 3) and true colours (N, 3) in linear light."""

    features: FloatImage
    mask: NDArray[np.bool_]
    colors: FloatImage
    truth: FloatImage


def training_batch(step: int, seed: int) -> Batch:
    """Return the batch of a step: one EPI, then ambiguous rays of VIEWS views, all of one random scene."""
    rng = np.random.default_rng((seed, step))
    radius = int(rng.choice(GRID_RADII))
    scene = random_scene(rng, SIZE, log_uniform(rng, *PARALLAX_PX) / radius)
    rays = _ray_set(scene, radius, rng)
    epi = _epi_rays(scene, rays, radius, rng)
    views = [_view_rays(scene, rays, _random_offset(radius, rng), rng) for _ in range(VIEWS)]
    parts = zip(*epi, *views)
    features, mask, colors, truth = (torch.from_numpy(np.concatenate(arrays)) for arrays in parts)
    epi_shape = (1, EPI_VIEWS, EPI_WIDTH) if epi else None
    return Batch(features, mask, colors, truth, epi_shape, _color_gain(features, mask, colors, truth))


def _ray_set(scene: RaycastScene, radius: int, rng: np.random.Generator) -> RaySet:
    """Return the rays of the photo with a degraded map, and those that two corner views add."""
    colors, disparity = render(scene, SIZE, CENTRE)
    disparity = degrade(disparity, rng, radius)
    if rng.random() < REFINED_SHARE:
        disparity = refine(colors, disparity)
    corners = [ViewOffset(float(r), float(r)) for r in (-radius, radius)]
    rays = rays_of_photo(colors, disparity, radius, len(corners))
    for _ in update(rays, corners, Renderer()):
        pass
    return rays


def _random_offset(radius: int, rng: np.random.Generator) -> ViewOffset:
    """Return the offset of any view of the grid except the photo."""
    steps = range(-radius, radius + 1)
    offsets = [ViewOffset(float(t), float(s)) for t in steps for s in steps if t or s]
    return offsets[rng.integers(len(offsets))]


def _view_rays(scene: RaycastScene, rays: RaySet, offset: ViewOffset, rng: np.random.Generator) -> LabelledRays:
    """Return a random choice of the ambiguous rays of a view."""
    ambiguous = _ambiguous_rays(rays, offset, (0, SIZE.height), False)
    return _label(scene, rays, ambiguous, rng.permutation(len(ambiguous.pixel))[:RAYS_PER_VIEW])


def _epi_rays(scene: RaycastScene, rays: RaySet, radius: int, rng: np.random.Generator) -> list[LabelledRays]:
    """Return every ray of a piece of one row, view by view from left to right; nothing if one has no hypothesis."""
    row = int(rng.integers(SEARCH_PX, SIZE.height - SEARCH_PX))
    first = int(rng.integers(0, SIZE.width - EPI_WIDTH + 1))
    views = []
    for s in np.linspace(-radius, radius, EPI_VIEWS):
        ambiguous = _ambiguous_rays(rays, ViewOffset(0.0, float(s)), (row, row + 1), True)
        column = ambiguous.pixel[:, 1]
        chosen = np.flatnonzero((first <= column) & (column < first + EPI_WIDTH))
        views.append(_label(scene, rays, ambiguous, chosen))
    return views if all(len(view.truth) == EPI_WIDTH for view in views) else []


def _ambiguous_rays(rays: RaySet, offset: ViewOffset, rows: tuple[int, int], every: bool) -> AmbiguousRays:
    """Return the ambiguous rays, or every ray, in rows [first, last) of the view at an offset."""
    above = min(rows[0], SEARCH_PX)
    candidates = find_candidates(rays, offset, (rows[0] - above, min(rows[1] + SEARCH_PX, rays.size.height)))
    weights, share = closed_form(candidates)
    asked = np.zeros(share.shape, np.bool_)
    asked[above : above + rows[1] - rows[0]] = True
    return find_ambiguous_rays(rays, candidates, weights, look_up(rays, candidates, weights), asked, every)


def _label(scene: RaycastScene, rays: RaySet, ambiguous: AmbiguousRays, chosen: NDArray[np.intp]) -> LabelledRays:
    """Return the chosen rays with the colours of their hypotheses and their true colours."""
    ambiguous = ambiguous.chosen(chosen)
    y, x = ambiguous.pixel.T
    truth, _ = cast(scene, x, y, ambiguous.offset)
    colors = _hypothesis_colors(rays, ambiguous)
    return LabelledRays(ambiguous.features, ambiguous.mask, linear_from_srgb(colors), linear_from_srgb(truth))


def _hypothesis_colors(rays: RaySet, ambiguous: AmbiguousRays) -> FloatImage:
    """Return the colour (N, K, 3) that each hypothesis would show, sRGB-encoded; black in unused slots."""
    mask, slots = ambiguous.mask, np.eye(ambiguous.disparity.shape[1], dtype=np.float32)
    return np.stack([blend(rays, ambiguous, slot * mask)[0] for slot in slots], axis=1)


def _color_gain(features: Tensor, mask: Tensor, colors: Tensor, truth: Tensor) -> float:
    """Return the factor that makes scenes count alike, as in decibels: one over the error of the closed form.

    Without it, scenes with degraded maps, whose errors are a hundred times larger, would dominate the training.
    """
    share = (features[..., SHARE] + 1e-6) * mask
    closed_form = (share / share.sum(dim=1, keepdim=True))[..., None] * colors
    error = color_loss(to_perceptual(closed_form.sum(dim=1)), to_perceptual(truth))
    return TYPICAL_ERROR / (error.item() + MIN_ERROR)
