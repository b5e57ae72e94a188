"""Scenes that the ablations draw: like those that training learns from, by seeds of their own, with exact disparity."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from iibr_core.generation.view_maker import quantise_as_stored
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import FloatImage, GridShape, ImageSize, ViewOffset

SIZE, GRID = ImageSize(240, 320), GridShape(9, 9)
DISPARITIES_PX = (0.5, 2.0)


@dataclass(frozen=True, eq=False)
class Known:
    """A view with its exact disparity, and others to judge by."""

    name: str
    photo: FloatImage
    disparity: FloatImage
    truths: dict[ViewOffset, FloatImage]


def drawn(seed: int, judged: Iterable[ViewOffset]) -> Known:
    """The scene of a seed, with its views at the offsets to be judged."""
    rng = np.random.default_rng(seed)
    scene = random_scene(rng, SIZE, float(np.exp(rng.uniform(*np.log(DISPARITIES_PX)))))
    photo, disparity = render(scene, SIZE, ViewOffset(0, 0))
    truths = {offset: render(scene, SIZE, offset)[0] for offset in judged}
    return Known(f"scene {seed}", quantise_as_stored(photo), disparity, truths)
