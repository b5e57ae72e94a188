"""The scenes that the bench measures: those of a folder, or a made-up one whose every view is known; the demo photo."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.speed.prediction import BenchInput
from benchmarks.speed.variants import BenchScene, bench_scenes, soften
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation.datasets import find_scenes
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.generation.plan import plan_for_viewing
from iibr_core.runtime.resources import resource_folder
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset

MADE_UP_SIZE = ImageSize(256, 256)
MADE_UP_DISPARITY = 2.0
"""The largest, px per view step."""
MADE_UP_REACH = 4
JUDGED_SHARES = ((1.0, 1.0), (0.75, 0.25), (0.25, 0.75))
"""Of the way to the outermost row and column: the views judged, each in all four quarters of the field."""
DEMO_GRID = GridShape(9, 9)


def scenes_of_folder(folder: Path, max_pixels: int | None, with_soft: bool) -> list[BenchScene]:
    """The scenes of a folder that have disparity, each also with a soft map. Raises InputError where there is none."""
    known = [scene for scene in find_scenes(folder) if scene.disparity]
    if not known:
        raise InputError(
            f"{folder}: holds no scene with disparity; give one, such as views/v00_u00.png and gt_disp_*.npy"
        )
    limit = max_pixels or DEFAULT_MAX_PIXELS
    return [made for scene in known for made in bench_scenes(scene, limit, with_soft)]


def made_up_scenes(with_soft: bool) -> list[BenchScene]:
    """A ray-cast scene: true disparity, true views, a field of 9x9 views; also with a soft map."""
    scene = random_scene(np.random.default_rng(0), MADE_UP_SIZE, MADE_UP_DISPARITY)
    photo, disparity = render(scene, MADE_UP_SIZE, ViewOffset(0.0, 0.0))
    signs = [(t, s) for t in (-MADE_UP_REACH, MADE_UP_REACH) for s in (-MADE_UP_REACH, MADE_UP_REACH)]
    judged = [ViewOffset(t * down, s * across) for down, across in JUDGED_SHARES for t, s in signs]
    truth = {at: render(scene, MADE_UP_SIZE, at)[0] for at in judged}
    steps = range(-MADE_UP_REACH, MADE_UP_REACH + 1)
    field = tuple(ViewOffset(float(t), float(s)) for t in steps for s in steps)
    own = BenchScene("made-up scene", photo, disparity, truth, field)
    return [own, soften(own)] if with_soft else [own]


def demo_input() -> BenchInput:
    """The bundled photo with the disparity that its viewing plan gives."""
    found = open_with_depth(resource_folder("assets") / "motorcycle" / "motorcycle.png")
    disparity = plan_for_viewing(found.photo, found.disparity).field_disparity(found.disparity)
    return BenchInput("demo photo", found.photo, disparity, DEMO_GRID)
