"""The ablations' switches on a small field, what is said of their figures, and what the drawn scenes are."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.speed.variants import BenchScene, evaluated_views
from benchmarks.tables.ablations import (
    DEFAULT,
    SWITCHES,
    Figures,
    Switch,
    measure,
    table_rows,
    time_ratios,
    unimportant_sentence,
)
from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.evaluation.reference_warp import reference_warp
from iibr_core.generation import view_maker
from iibr_core.training.degradation import blur
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import GridShape, ImageSize, ViewOffset

SIZE, GRID = ImageSize(72, 96), GridShape(5, 5)
JUDGED = (ViewOffset(-2.0, 2.0), ViewOffset(1.0, -1.0))
UNCHANGED = (
    "6 candidates a ray (5)",
    "occluded: less than 0.01 covered (0.2)",
    "occluded: less than 0.5 covered (0.2)",
)
"""Few pixels have so many surfaces; rays covered in part are laid over what is behind, occluded or not."""


@pytest.fixture(scope="module")
def judged() -> tuple[BenchScene, BenchScene]:
    scene = random_scene(np.random.default_rng(3), SIZE, 4.0)
    photo, disparity = render(scene, SIZE, ViewOffset(0.0, 0.0))
    field = tuple(GRID.offset(*at) for at in np.ndindex(*GRID))
    exact = BenchScene("small", photo, disparity, {at: render(scene, SIZE, at)[0] for at in JUDGED}, field)
    return replace(exact, disparity=blur(disparity, 1.0)), exact


def views(switch: Switch, scene: BenchScene) -> np.ndarray:
    with switch.applied():
        return np.array(list(evaluated_views(switch.variant, scene).values()))


@pytest.mark.parametrize("switch", [one for one in SWITCHES[1:] if one.name not in UNCHANGED], ids=lambda one: one.name)
def test_every_switch_changes_views_and_is_undone(switch: Switch, judged: tuple[BenchScene, BenchScene]) -> None:
    scene, _ = judged
    before, changed, after = views(DEFAULT, scene), views(switch, scene), views(DEFAULT, scene)
    assert not np.array_equal(changed, before)
    np.testing.assert_array_equal(after, before)


def test_a_name_that_the_core_lacks_is_an_error() -> None:
    with pytest.raises(AttributeError), Switch("", swaps={"generation.view_maker.nothing": 0}).applied():
        pass
    assert not hasattr(view_maker, "nothing")


def test_figures_are_means_over_views(judged: tuple[BenchScene, BenchScene]) -> None:
    scene, exact = judged
    full, hole = [], []
    for at, image in zip(JUDGED, views(DEFAULT, scene)):
        unseen = reference_warp(exact.photo, exact.disparity, at).hole
        full.append(bounded_psnr(image, exact.truth[at]))
        hole.append(bounded_psnr(image[unseen], exact.truth[at][unseen]))
    found = measure(DEFAULT, scene, exact)
    assert (found.full_db, found.hole_db) == pytest.approx((np.mean(full), np.mean(hole)))


def test_times_are_against_the_default(judged: tuple[BenchScene, BenchScene]) -> None:
    ratios = time_ratios(judged[0], SWITCHES[:2])
    assert list(ratios) == [switch.name for switch in SWITCHES[:2]]
    assert ratios["default"] == 1
    assert min(ratios.values()) > 0


def test_what_does_not_matter_is_said_from_the_figures() -> None:
    found = {
        "default": {"a": Figures(30.0, 20.0), "b": Figures(40.0, math.nan)},
        "idle": {"a": Figures(30.04, 19.96), "b": Figures(39.96, math.nan)},
        "in holes": {"a": Figures(30.0, 19.0), "b": Figures(40.0, math.nan)},
        "on one set": {"a": Figures(30.0, 20.0), "b": Figures(40.06, math.nan)},
    }
    assert unimportant_sentence(found).endswith(": idle.")
    assert unimportant_sentence({name: of for name, of in found.items() if name != "idle"}).startswith("No row")
    assert list(table_rows(found, {"idle": 1.0, "in holes": 0.5, "on one set": 4.0})) == [
        ("default", "30.00 / 20.00", "40.00 / –", "1.00"),
        ("idle", "+0.04 / -0.04", "-0.04 / –", "1.00"),
        ("in holes", "+0.00 / -1.00", "+0.00 / –", "0.50"),
        ("on one set", "+0.00 / +0.00", "+0.06 / –", "4.00"),
    ]
