from dataclasses import fields, replace
from functools import cache

import cv2
import numpy as np
import pytest

from iibr_core.depth.edges.refine import refine
from iibr_core.method.light_field import ViewMaker
from iibr_core.method.ray_transformer import shipped_transformer
from iibr_core.method.view import Renderer, finish
from iibr_core.stages import ALL_STAGES, STAGE_NAMES, Stages, stages_without
from iibr_core.training.degradation import blur
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import render
from iibr_core.types import FloatImage, ImageSize, InputError, ViewOffset

SIZE = ImageSize(96, 128)
CASES = {
    "sharpen_soft_edges": "soft",
    "fit_to_blur": "enlarged",
    "refill_between_surfaces": "resampled",
    "label_edge_bands": "dilated",
    "connect_slopes": "steep",
}
"""Of those that an exact map of a drawn scene does not need."""


@cache
def scene(case: str) -> tuple[FloatImage, FloatImage]:
    photo, exact = render(random_scene(np.random.default_rng(3), SIZE, 4.0), SIZE, ViewOffset(0, 0))
    if case in ("soft", "enlarged"):
        return photo, blur(exact, 2.0)
    if case == "resampled":
        return photo, resampled(exact)
    if case == "steep":
        return photo, np.tile(np.linspace(-15, 15, SIZE.width, dtype=np.float32), (SIZE.height, 1))
    if case == "dilated":
        return photo, np.asarray(cv2.dilate(exact, np.ones((3, 3))), np.float32)
    return photo, exact


def resampled(exact: FloatImage) -> FloatImage:
    small = cv2.resize(exact, (SIZE.width // 2, SIZE.height // 2), interpolation=cv2.INTER_AREA)
    return np.asarray(cv2.resize(small, (SIZE.width, SIZE.height), interpolation=cv2.INTER_LINEAR), np.float32)


@cache
def views(case: str, stages: Stages) -> FloatImage:
    photo, values = scene(case)
    judged = [ViewOffset(2, 2), ViewOffset(-2, 1), ViewOffset(1, -1)]
    field = [ViewOffset(t, s) for t in (-2, 2) for s in (-2, 2)]
    disparity = refine(photo, values, stages=stages, is_enlarged=case == "enlarged")
    made = ViewMaker(photo, disparity, field, stages=stages)
    return np.stack([made.view(at).colors for at in judged])


@pytest.mark.parametrize("stage", [stage.name for stage in fields(Stages)])
def test_a_stage_that_is_left_out_changes_views(stage) -> None:
    case = CASES.get(stage, "exact")
    assert (views(case, replace(ALL_STAGES, **{stage: False})) != views(case, ALL_STAGES)).any()


def test_views_are_those_that_the_transformer_decides_without_flying_pixels() -> None:
    photo, values = scene("exact")
    maker, at = ViewMaker(photo, values, [ViewOffset(-2, -2), ViewOffset(2, 2)]), ViewOffset(1.5, -1)
    decided, closed_form = (Renderer(each).render(maker.rays, at) for each in (shipped_transformer(), None))
    assert (decided.colors != closed_form.colors).any()
    assert (decided.inpainted & (decided.disparity != closed_form.disparity)).any()
    expected = finish(maker.rays, at, decided).colors
    assert (expected != decided.colors).any()
    np.testing.assert_array_equal(maker.view(at).colors, expected)


def test_stages_are_left_out_by_name() -> None:
    without = Stages(share_inpainted=False, label_edge_bands=False)
    assert stages_without(["share-inpainted", "label-edge-bands"]) == without
    assert all(stages_without([name]) != ALL_STAGES for name in STAGE_NAMES)
    with pytest.raises(InputError, match=r"'share' is no stage; give one of .*share-inpainted.*"):
        stages_without(["share"])
