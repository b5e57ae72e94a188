"""Batches of ambiguous rays from random scenes: true colours, and disparity as real maps have it.

Step n of a seed always gives the same batch. Ambiguous rays of a few views come after one EPI, which has every ray.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from iibr_core.color import linear_from_srgb
from iibr_core.depth.edges.refine import refine
from iibr_core.method.ambiguous_rays import (
    HYPOTHESES,
    SEARCH_PX,
    SHARE,
    AmbiguousRays,
    find_ambiguous_rays,
    hypothesis_colors,
)
from iibr_core.method.candidates import find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.look_up import heaviest_candidates
from iibr_core.method.rays import RaySet, rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer
from iibr_core.training.degradation import degrade
from iibr_core.training.losses import EpiShape, color_loss, to_perceptual
from iibr_core.training.scenes.random_scene import RaycastScene, cast, random_scene, render
from iibr_core.training.trainer import Batch
from iibr_core.types import FloatImage, ImageSize, ViewOffset

SIZE = ImageSize(112, 128)
VIEWS = 3
RAYS_A_VIEW = 1500
EPI_VIEWS, EPI_WIDTH = 9, 64
LIGHT_FIELD, STEREO = 4, 1
"""Radii of the grids trained for, view steps: many views a little apart, or two far apart."""
PARALLAX_PX = 4.0, 45.0
"""Between the outermost view and the photo, at the largest disparity."""
TYPICAL_ERROR, LEAST_ERROR = 0.004, 0.0005
"""Of colours, squared: which scenes count once, and below which a scene's error is no matter."""
REFINED = 0.75
"""Share of the maps that are refined, as the program does unless it is told not to."""


class LabelledRays(NamedTuple):
    """N ambiguous rays: their hypotheses, what those would show (N, K, 3) and the truth (N, 3), both sRGB-encoded."""

    ambiguous: AmbiguousRays
    votes: FloatImage
    truth: FloatImage


def _identity(rays: RaySet, ambiguous: AmbiguousRays) -> AmbiguousRays:
    return ambiguous


@dataclass(frozen=True)
class RayChoice:
    """What rays are given to T; other than the default for ablations only.

    hypotheses: K. inpainted: whether the ray set has what corner views inpaint. describe: (rays, ambiguous) ->
    ambiguous, with the features T shall see.
    """

    hypotheses: int = HYPOTHESES
    inpainted: bool = True
    describe: Callable[[RaySet, AmbiguousRays], AmbiguousRays] = _identity


AS_RENDERED = RayChoice()


def training_batch(step: int, seed: int, choice: RayChoice = AS_RENDERED) -> Batch:
    """The batch of a step: one EPI, then ambiguous rays of VIEWS views, of one random scene that has any."""
    rng = np.random.default_rng((seed, step))
    while True:
        batch = _scene_batch(rng, choice)
        if batch is not None:
            return batch


def _scene_batch(rng: np.random.Generator, choice: RayChoice) -> Batch | None:
    """None of a scene that leaves nothing to be decided."""
    radius = int(rng.choice([LIGHT_FIELD, STEREO], p=[0.75, 0.25]))
    largest = float(np.exp(rng.uniform(*np.log(PARALLAX_PX)))) / radius
    scene = random_scene(rng, SIZE, largest)
    colors, disparity = render(scene, SIZE, ViewOffset(0.0, 0.0))
    disparity = degrade(disparity, rng, radius)
    if rng.random() < REFINED:
        disparity = refine(colors, disparity)
    rays = _ray_set(colors, disparity, radius, choice.inpainted)
    epi = _epi(scene, rays, radius, rng, choice)
    parts = list(epi or [])
    parts += [_sample_ambiguous(scene, rays, _random_offset(radius, rng), rng, choice) for _ in range(VIEWS)]
    if not any(len(part.truth) for part in parts):
        return None
    return _batch(parts, (1, EPI_VIEWS, EPI_WIDTH) if epi else None)


def _ray_set(colors: FloatImage, disparity: FloatImage, radius: int, inpainted: bool) -> RaySet:
    """The photo's rays and, if inpainted, those that the corner views add, as `generate` makes them."""
    corners = [ViewOffset(float(t), float(s)) for t, s in ((-radius, -radius), (radius, radius))]
    rays = rays_of_photo(colors, disparity, radius, len(corners))
    if inpainted:
        for _ in update(rays, corners, Renderer()):
            pass
    return rays


def _random_offset(radius: int, rng: np.random.Generator) -> ViewOffset:
    """Any view of the grid but the photo's own."""
    while True:
        t, s = rng.integers(-radius, radius + 1, 2)
        if t or s:
            return ViewOffset(float(t), float(s))


def _sample_ambiguous(
    scene: RaycastScene, rays: RaySet, offset: ViewOffset, rng: np.random.Generator, choice: RayChoice
) -> LabelledRays:
    """Ambiguous rays of a view, also those whose true surface the photo does not show: background is right there."""
    ambiguous = ambiguous_rays_of_view(rays, offset, (0, SIZE[0]), False)
    ambiguous = _subset(ambiguous, rng.permutation(len(ambiguous.pixel))[:RAYS_A_VIEW])
    return _label(scene, rays, ambiguous, choice)


def ambiguous_rays_of_view(rays: RaySet, offset: ViewOffset, rows: tuple[int, int], every: bool) -> AmbiguousRays:
    """Return the ambiguous rays of rows [first, last) of the view at an offset. every: see `find_ambiguous_rays`."""
    above = min(rows[0], SEARCH_PX)
    candidates = find_candidates(rays, offset, (rows[0] - above, min(rows[1] + SEARCH_PX, rays.size.height)))
    weights, _ = closed_form(candidates)
    inner = above, above + rows[1] - rows[0]
    shown = heaviest_candidates(rays, candidates, weights)
    return find_ambiguous_rays(rays, candidates, weights, shown, inner, every=every)


def _label(scene: RaycastScene, rays: RaySet, ambiguous: AmbiguousRays, choice: RayChoice) -> LabelledRays:
    y, x = ambiguous.pixel.T
    return LabelledRays(
        choice.describe(rays, ambiguous), hypothesis_colors(rays, ambiguous), cast(scene, x, y, ambiguous.offset)[0]
    )


def _epi(
    scene: RaycastScene, rays: RaySet, radius: int, rng: np.random.Generator, choice: RayChoice
) -> list[LabelledRays] | None:
    """Every ray of a piece of one row in EPI_VIEWS views from left to right; None where one has no hypothesis."""
    row = int(rng.integers(SEARCH_PX, SIZE[0] - SEARCH_PX))
    first = int(rng.integers(0, SIZE[1] - EPI_WIDTH + 1))
    columns = np.arange(first, first + EPI_WIDTH)
    parts = []
    for s in np.linspace(-radius, radius, EPI_VIEWS):
        ambiguous = ambiguous_rays_of_view(rays, ViewOffset(0.0, float(s)), (row, row + 1), True)
        chosen = np.flatnonzero(np.isin(ambiguous.pixel[:, 1], columns))
        if len(chosen) < EPI_WIDTH:
            return None
        parts.append(_label(scene, rays, _subset(ambiguous, chosen), choice))
    return parts


def _subset(ambiguous: AmbiguousRays, chosen: NDArray[np.intp]) -> AmbiguousRays:
    return ambiguous.chosen(chosen)


def _batch(parts: list[LabelledRays], epi_shape: EpiShape | None) -> Batch:
    features = torch.from_numpy(np.concatenate([part.ambiguous.features for part in parts]))
    mask = torch.from_numpy(np.concatenate([part.ambiguous.mask for part in parts]))
    colors = torch.from_numpy(linear_from_srgb(np.concatenate([part.votes for part in parts])))
    truth = torch.from_numpy(linear_from_srgb(np.concatenate([part.truth for part in parts])))
    return Batch(features, mask, colors, truth, epi_shape, _color_gain(features, mask, colors, truth))


def _color_gain(features: Tensor, mask: Tensor, colors: Tensor, truth: Tensor) -> float:
    """Makes scenes count alike, as they do in decibels: the closed form's error is what there is to gain.

    Else the scenes with spoilt disparity, whose errors are a hundred times larger, would decide what T learns.
    """
    share = (features[..., SHARE] + 1e-6) * mask
    closed_form = (share / share.sum(dim=1, keepdim=True))[..., None] * colors
    return TYPICAL_ERROR / (
        float(color_loss(to_perceptual(closed_form.sum(dim=1)), to_perceptual(truth))) + LEAST_ERROR
    )
