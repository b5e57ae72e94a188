"""The bench's arithmetic against slow twins, its variants on a small field, its tables and plots."""

from __future__ import annotations

import io
import math
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from iibr_core.generation.cost_model import CORES, NANOSECONDS, Workload
from PIL import Image

from benchmarks.harness.bench_scenes import (
    FIELD,
    BenchScene,
    bench_scenes,
    drawn_scene,
    judged_of,
    photo_scene,
    soften,
    squares_scene,
    write_photo,
)
from benchmarks.harness.plots import on_the_front, plot_panels
from benchmarks.harness.reports import holds, markdown
from benchmarks.harness.timing import (
    COMMAND_LINE,
    Cost,
    in_turns,
    make_field,
    median_cost,
    median_ratio,
    peak_bytes,
    run,
)
from benchmarks.prediction import Prediction, fit_nanoseconds, fitted_scenes, is_near, judged_scenes, predict, sum_up
from benchmarks.speed.__main__ import front_targets, measure_scene
from benchmarks.speed.speed_report import Bench, Figures, Measured, SpeedTarget, markdown_of, means, panels, write_bench
from benchmarks.speed.speed_report import table as report_table
from benchmarks.speed.variants import REFERENCE, VARIANTS, Variant, evaluated_views, field_cost
from iibr_core.evaluation.datasets import read_scene
from iibr_core.evaluation.metrics import psnr
from iibr_core.method.plan import ScenePlan, plan_literal
from iibr_core.types import (
    GridShape,
    ImageSize,
    Quality,
    ViewOffset,
    image_size,
)
from tests.iibr_core.known_scenes import HEIGHT, WIDTH, view_of_square, write_grid

SMALL = (
    REFERENCE,
    Variant("balanced", "balanced"),
    Variant("K = 1 candidates", slots=1),
    Variant("half width", shrink=2),
)


def quiet(done: float, total: float, doing: str) -> None:
    assert 0 <= done <= total
    assert doing


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> list[BenchScene]:
    known = read_scene(write_grid(tmp_path_factory.mktemp("bench") / "square", 5))
    assert known is not None
    return bench_scenes(known, 10**6)


@pytest.fixture(scope="module")
def figures(scenes: list[BenchScene]) -> tuple[Figures, ...]:
    return tuple(measure_scene(scene, SMALL, 2, quiet) for scene in scenes)


def test_ratios_are_taken_within_a_round() -> None:
    reference = [Cost(1, 1.0), Cost(1, 10.0), Cost(1, 2.0)]
    assert median_ratio([Cost(1, 3.0), Cost(1, 30.0), Cost(1, 8.0)], reference) == 3.0
    assert math.isnan(median_ratio([Cost(1, 1)], [Cost(1, 0)]))
    assert median_cost([Cost(1, 5), Cost(3, 4), Cost(2, 6)]) == Cost(2, 5)
    assert Cost(1, 2) + Cost(3, 4).times(2) == Cost(7, 10)


def test_rounds_go_through_all_ways_in_turn() -> None:
    order: list[str] = []

    def way(name: str) -> Cost:
        order.append(name)
        return Cost(len(order), 0)

    found = in_turns({name: lambda name=name: way(name) for name in "ab"}, 3, quiet)  # type: ignore[misc]
    assert "".join(order) == "ababab"
    assert [cost.wall_s for cost in found["b"]] == [2, 4, 6]


def test_the_front_is_what_nothing_beats() -> None:
    rng = np.random.default_rng(0)
    points = {str(k): (float(c), float(g)) for k, (c, g) in enumerate(rng.integers(0, 6, (30, 2)))}
    front = on_the_front(points)
    for name, (cost, gain) in points.items():
        beaten = any((c < cost and g >= gain) or (c <= cost and g > gain) for c, g in points.values())
        assert (name in front) != beaten
    assert on_the_front({"a": (math.nan, 1.0), "b": (1.0, 1.0)}) == {"b"}


def take_memory(lasting_mib: int, passing_mib: int) -> object:
    passing = np.ones(passing_mib << 20, np.uint8)
    return np.ones(lasting_mib << 20, np.uint8) + passing[0]


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux tells")
def test_peak_memory_sees_what_was_freed_again() -> None:
    for _ in range(2):  # what the first kept back must not help the second
        assert peak_bytes(take_memory, 8, 64) == pytest.approx(80 << 20, rel=0.2)


def test_a_scene_comes_with_its_own_map_and_a_soft_one(scenes: list[BenchScene]) -> None:
    own, soft = scenes
    assert (own.is_soft, soft.is_soft) == (False, True)
    assert own.reach == 2
    assert len(own.field) == 25
    assert len(np.unique(soft.disparity)) > len(np.unique(own.disparity)) == 2
    for at, truth in own.truth.items():
        assert psnr(truth, view_of_square(at)) > 45
    assert {ViewOffset(t, s) for t in (-2.0, 2.0) for s in (-2.0, 2.0)} <= own.truth.keys()
    assert any(at.t % 2 for at in own.truth)


@pytest.mark.parametrize("variant", VARIANTS, ids=lambda variant: variant.name)
def test_every_variant_makes_views_of_the_scenes_size(scenes: list[BenchScene], variant: Variant) -> None:
    made = evaluated_views(variant, scenes[0])
    assert made.keys() == scenes[0].truth.keys()
    for image in made.values():
        assert image.shape == (HEIGHT, WIDTH, 3)
        assert np.isfinite(image).all()
    cost = field_cost(variant, scenes[0])
    assert cost.wall_s > 0


def test_what_is_left_out_shows(figures: tuple[Figures, ...]) -> None:
    own = {m.name: m for m in figures[0].measured}
    assert own["fast"].ratio == 1
    assert own["half width"].psnr_db < own["fast"].psnr_db
    assert figures[0].planned in own
    assert figures[0].behind_front_db >= 0
    assert figures[0].front <= own.keys()


def test_the_plan_beside_what_was_measured(scenes: list[BenchScene]) -> None:
    fast, balanced = predict(scenes[0], ("fast", "balanced"), 1)
    assert 0 < fast.predicted_s < balanced.predicted_s
    assert min(fast.measured_s, balanced.measured_s) > 0
    assert balanced.predicted_bytes >= fast.predicted_bytes > 25 * HEIGHT * WIDTH * 7
    assert fast.time_ratio == fast.predicted_s / fast.measured_s
    assert len(make_field(scenes[0], "fast")) == 25


def test_constants_are_recovered_from_what_they_predicted() -> None:
    true = Workload(80.0, 300.0, NANOSECONDS.rays)
    rng = np.random.default_rng(0)
    found = []
    for _ in range(12):
        work = Workload(*(float(amount) for amount in rng.uniform(1e7, 1e8, 2)), 0.0)
        seconds = sum(amount * each for amount, each in zip(work, true)) * 1e-9 / CORES
        found.append(Prediction("", "fast", 1.0, seconds, 1.0, 1.0, work))
    assert fit_nanoseconds(found) == pytest.approx(true, rel=1e-6)


def test_near_is_within_a_quarter() -> None:
    assert [is_near(ratio) for ratio in (0.7, 0.8, 1.2, 1.3, math.nan)] == [False, True, True, False, None]
    assert sum_up("a", [0.9, 2.0, math.nan]) == "- a: 1 of 2 within 25%, from 0.90 to 2.00"
    assert sum_up("a", []) == "- a: 0 of 0 within 25%"
    assert [holds(is_so) for is_so in (True, False, None)] == ["yes", "**no**", "not known here"]


def test_the_plans_choice_is_judged_on_every_scene(figures: tuple[Figures, ...]) -> None:
    found = list(front_targets(figures))
    for scene, behind, slower in zip(figures, found[::2], found[1::2], strict=True):
        assert scene.what in behind.what
        assert scene.what in slower.what
        assert behind.is_met == (scene.behind_front_db <= 0.1)


@pytest.mark.parametrize(
    ("time", "psnr_db", "is_good_enough", "is_fast_enough"),
    [(2.0, 30.0, True, False), (2.0, 30.2, True, True), (1.2, 30.0, True, True), (2.0, 29.8, False, False)],
)
def test_a_choice_fails_that_is_slower_than_one_as_good(time, psnr_db, is_good_enough, is_fast_enough) -> None:
    fast = Measured("fast", Cost(1.0, 1.0), 1.0, 30.0, 0.1)
    choice = Measured("balanced", Cost(time, time), time, psnr_db, 0.1)
    scene = Figures("scene", "", (fast, choice), "balanced")
    behind, slower = front_targets([scene])
    assert (behind.is_met, slower.is_met) == (is_good_enough, is_fast_enough)
    assert scene.fastest_as_good(0.05).name == ("balanced" if psnr_db > 30.05 else "fast")


@pytest.mark.parametrize(("quality", "is_met"), [("fast", True), ("balanced", False)])
def test_a_plan_that_chose_balanced_here_would_be_found_out(
    quality: Quality, is_met: bool, scenes: list[BenchScene], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Errors as they are; times as if the transformer took half as long again."""

    def planned(*given: Any) -> ScenePlan:
        return replace(plan_literal(*given), quality=quality)

    monkeypatch.setattr("benchmarks.speed.__main__.plan_literal", planned)
    variants = [REFERENCE, Variant("balanced", "balanced")]
    found = measure_scene(scenes[0], variants, 1, quiet)
    timed = tuple(replace(m, ratio=1.5 if m.name == "balanced" else 1.0) for m in found.measured)
    _, slower = front_targets([replace(found, measured=timed)])
    assert found.planned == quality
    assert slower.is_met == is_met


def test_nothing_is_judged_that_constants_are_fitted_to(tmp_path: Path) -> None:
    data = write_grid(tmp_path / "square", 5).parent
    fitted, judged = list(fitted_scenes(data)), list(judged_scenes(data))
    assert any(given.name.startswith("square") for given in fitted)
    assert judged
    pictures = {given.photo.tobytes() for given in fitted}
    assert not any(given.photo.tobytes() in pictures for given in judged)


def test_squares_are_as_near_and_as_many_as_asked_for() -> None:
    scene = squares_scene(64, 4.0, 5, GridShape(3, 3))
    assert image_size(scene.photo) == (64, 64)
    assert scene.grid == (3, 3)
    assert 0 <= scene.photo.min() < scene.photo.max() <= 1
    assert scene.disparity.min() == 0
    assert 2 <= scene.disparity.max() <= 4
    assert not squares_scene(64, 4.0, 0).disparity.any()
    np.testing.assert_array_equal(squares_scene(64, 4.0, 5).photo, scene.photo)


def test_a_drawn_scene_has_true_views_of_every_quarter() -> None:
    own = drawn_scene(0, ImageSize(64, 64), 2.0, FIELD, judged_of(FIELD))
    assert (own.is_soft, soften(own).is_soft) == (False, True)
    assert own.reach == 4
    assert own.grid == FIELD
    assert len(own.truth) == 12
    assert {(t, s) for t in (-4.0, 4.0) for s in (-4.0, 4.0)} <= own.truth.keys() <= set(own.field)
    assert {(np.sign(at.t), np.sign(at.s)) for at in own.truth} == {(-1, -1), (-1, 1), (1, -1), (1, 1)}
    assert np.abs(own.disparity).max() <= 2.0
    assert not any(psnr(view, own.photo) > 60 for view in own.truth.values())


@pytest.mark.parametrize("extension", [".png", ".jpg", ".exr"])
def test_a_written_photo_is_read_with_its_map(tmp_path: Path, extension: str) -> None:
    path = write_photo(tmp_path / f"a{extension}", (300, 400))
    scene = photo_scene(path)
    assert scene is not None
    assert image_size(scene.photo) == (300, 400)
    assert np.ptp(scene.disparity) > 0
    assert photo_scene(write_photo(tmp_path / f"b{extension}", (60, 80), with_map=False)) is None


def test_a_process_is_measured_and_its_code_told() -> None:
    ended = run((*COMMAND_LINE, "--help"))
    assert ended.code == 0
    assert ended.cost.wall_s > 0
    assert ended.peak_mib > 10
    assert run((*COMMAND_LINE, "no-command")).code == 2


def bench_of(figures: tuple[Figures, ...]) -> Bench:
    targets = (
        SpeedTarget("a", "<= 1", "2", False),
        SpeedTarget("b", ">= 1", "2", True),
        SpeedTarget("c", "d", "–", None),
    )
    return Bench(figures, targets)


def test_tables_name_every_variant_and_mark_the_front(figures: tuple[Figures, ...]) -> None:
    text = markdown_of(bench_of(figures))
    for title in ("## Mean over scenes, maps as they are", "## Mean over scenes, soft maps", "## Targets"):
        assert title in text
    assert not any(f"## {scene.what}\n" in text for scene in figures if scene.is_soft), "only their means"
    for scene in (scene for scene in figures if not scene.is_soft):
        part = text.split(f"## {scene.what}\n")[1].split("##")[0]
        for measured in scene.measured:
            (line,) = [row for row in part.splitlines() if row.startswith(f"| {measured.name} |")]
            assert ("●" in line) == (measured.name in scene.front)
    assert text.index("## Mean") < text.index(f"## {figures[0].what}")  # the first table is the one to show
    drawn = tuple(
        Measured(name, Cost(1, ratio), ratio, 40 + ratio, 0.01, 9) for name, ratio in (("once", 1), ("all", 5))
    )
    assert "| all | ● | 5.00 | 5000 | 45.00 | 0.0100 | 9 |" in report_table(Figures("a picture", "", drawn))
    assert "nan" not in text
    assert "| a | <= 1 | 2 | **no** |" in text
    assert markdown(("a", "b"), [(1, "c")]) == "| a | b |\n| --- | --- |\n| 1 | c |"


def test_means_are_geometric_for_time(figures: tuple[Figures, ...]) -> None:
    ratios = [m.ratio for scene in figures for m in scene.measured if m.name == "half width"]
    assert len(ratios) == 2
    assert means(figures)["half width"][0] == pytest.approx(math.sqrt(math.prod(ratios)))


def test_plots_are_pictures(figures: tuple[Figures, ...], tmp_path: Path) -> None:
    svg, png = (plot_panels(panels(bench_of(figures)), kind) for kind in ("svg", "png"))
    assert svg.startswith(b"<?xml")
    assert b"<svg" in svg
    picture = Image.open(io.BytesIO(png))
    assert picture.size[0] > 500
    assert len(np.unique(np.asarray(picture.convert("L")))) > 20
    paths = write_bench(tmp_path, bench_of(figures))
    assert [path.name for path in paths] == ["speed.md", "speed.svg"]
    assert sorted(tmp_path.iterdir()) == sorted(paths)
