"""Which views of a grid pictures are made of, found before any is made."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from iibr_core.generation import WantedViews
from iibr_core.rendering import Optics
from iibr_core.types import GridShape, ViewOffset
from viewer.gpu.refocus.accumulation import MAX_PASSES, r2_sequence
from viewer.gpu.refocus.picture_lens import aperture_share_of
from viewer.gpu.refocus.view_sampling import aperture_samples, pinhole_sources

MOST_OPEN = 32
"""Of so many different open apertures the views are found in 0.3 s; more show nearly all."""


def wanted_for(optics: Optics, grid: GridShape) -> WantedViews:
    """What a picture through these optics is made of, once it has converged, and how that is seen in it."""
    is_sum = aperture_share_of(optics.aperture_diameter) == 1 and optics.dolly == 0
    return WantedViews(views_seen(optics, grid), "sum" if is_sum else "one")


def views_seen(optics: Optics, grid: GridShape) -> set[ViewOffset] | None:
    """The views of a grid that a picture through these optics is made of, once it has converged; None: all."""
    if optics.dolly != 0:
        return None
    everywhere = np.ones(grid, np.bool_)
    seen = {(row, column) for row, column, _ in pinhole_sources(optics.eye, grid, everywhere)}
    if optics.aperture_diameter > 1:
        for moved, leaves_room in itertools.product(r2_sequence(MAX_PASSES), (False, True)):
            shape, diameter = optics.aperture_shape, optics.aperture_diameter
            samples = aperture_samples(optics.eye, diameter, grid, everywhere, shape, 1, moved, leaves_room)
            seen |= {(row, column) for _, row, column, _ in samples}
    return {grid.offset(row, column) for row, column in seen}


def views_seen_by(pictures: Iterable[Optics], grid: GridShape) -> set[ViewOffset] | None:
    """The views that any of these pictures is made of; None: all."""
    different = {replace(optics, focus_disparity=0.0, gloss=None) for optics in pictures}  # neither matters
    if sum(optics.aperture_diameter > 1 for optics in different) > MOST_OPEN:
        return None
    seen = set[ViewOffset]()
    for optics in different:
        found = views_seen(optics, grid)
        if found is None:
            return None
        seen |= found
    return seen
