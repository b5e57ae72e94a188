"""The bench's arithmetic, its variants on a small field, its scenes, tables and plots."""

from __future__ import annotations

import io
import math
from pathlib import Path

import numpy as np
import pytest
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
from benchmarks.harness.plots import Panel, on_the_front, plot_panels
from benchmarks.harness.reports import holds, markdown
from benchmarks.harness.timing import Cost, in_turns, make_field, median_cost, median_ratio
from benchmarks.speed.__main__ import measure_scene
from benchmarks.speed.speed_report import Bench, Figures, SpeedTarget, markdown_of, means, write_bench
from benchmarks.speed.variants import VARIANTS
from iibr_core.evaluation.metrics import psnr
from iibr_core.evaluation.scenes import read_scene
from iibr_core.runtime.work import watched
from iibr_core.types import GridShape, ImageSize, ViewOffset, image_size
from tests.iibr_core.known_scenes import HEIGHT, WIDTH, view_of_square, write_grid


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> list[BenchScene]:
    known = read_scene(write_grid(tmp_path_factory.mktemp("bench") / "square", 5))
    assert known is not None
    return bench_scenes(known, 10**6)


@pytest.fixture(scope="module")
def figures(scenes: list[BenchScene]) -> tuple[Figures, ...]:
    return tuple(measure_scene(scene, VARIANTS, 2) for scene in scenes)


def test_ratios_are_taken_within_a_round() -> None:
    reference = [Cost(1, 1.0), Cost(1, 10.0), Cost(1, 2.0)]
    assert median_ratio([Cost(1, 3.0), Cost(1, 30.0), Cost(1, 8.0)], reference) == 3.0
    assert math.isnan(median_ratio([Cost(1, 1)], [Cost(1, 0)]))
    assert median_cost([Cost(1, 5), Cost(3, 4), Cost(2, 6)]) == Cost(2, 5)
    assert Cost(1, 2) + Cost(3, 4).times(2) == Cost(7, 10)


def test_rounds_go_through_all_ways_in_turn() -> None:
    order: list[str] = []
    reported: list[float] = []

    def way(name: str) -> Cost:
        order.append(name)
        return Cost(len(order), 0)

    with watched(lambda done, total, doing: reported.append(done / total)):
        found = in_turns({name: lambda name=name: way(name) for name in "ab"}, 3)  # type: ignore[misc]
    assert "".join(order) == "ababab"
    assert [cost.wall_s for cost in found["b"]] == [2, 4, 6]
    assert reported == [k / 6 for k in range(6)]


def test_the_front_is_what_nothing_beats() -> None:
    rng = np.random.default_rng(0)
    points = {str(k): (float(c), float(g)) for k, (c, g) in enumerate(rng.integers(0, 6, (30, 2)))}
    front = on_the_front(points)
    for name, (cost, gain) in points.items():
        beaten = any((c < cost and g >= gain) or (c <= cost and g > gain) for c, g in points.values())
        assert (name in front) != beaten
    assert on_the_front({"a": (math.nan, 1.0), "b": (1.0, 1.0)}) == {"b"}


def test_a_scene_comes_with_its_own_map_and_a_soft_one(scenes: list[BenchScene]) -> None:
    exact, soft = scenes
    assert (exact.is_soft, soft.is_soft) == (False, True)
    assert exact.reach == 2
    assert len(exact.field) == len(make_field(exact)) == 25
    assert len(np.unique(soft.disparity)) > len(np.unique(exact.disparity)) == 2
    for at, truth in exact.truth.items():
        assert psnr(truth, view_of_square(at)) > 45
    assert {ViewOffset(t, s) for t in (-2.0, 2.0) for s in (-2.0, 2.0)} <= exact.truth.keys()
    assert any(at.t % 2 for at in exact.truth)


def test_what_is_left_out_shows(figures: tuple[Figures, ...]) -> None:
    found = {m.name: m for m in figures[0].measured}
    assert found.keys() == {variant.name for variant in VARIANTS}
    assert found["iibr"].ratio == 1
    assert found["half width"].psnr_db < found["iibr"].psnr_db
    assert min(m.cost.wall_s for m in found.values()) > 0
    assert figures[0].front <= found.keys()
    assert figures[0].about == f"25 views of {WIDTH}x{HEIGHT}, {12} judged."


def test_squares_are_as_near_and_as_many_as_asked_for() -> None:
    scene = squares_scene(64, 4.0, 5, GridShape(3, 3))
    assert image_size(scene.photo) == (64, 64)
    assert scene.grid == (3, 3)
    assert 0 <= scene.photo.min() < scene.photo.max() <= 1
    assert scene.disparity.min() == 0
    assert 2 <= scene.disparity.max() <= 4
    assert not squares_scene(64, 4.0, 0).disparity.any()


def test_a_drawn_scene_has_true_views_of_every_quarter() -> None:
    drawn = drawn_scene(0, ImageSize(64, 64), 2.0, FIELD, judged_of(FIELD))
    assert (drawn.is_soft, soften(drawn).is_soft) == (False, True)
    assert (drawn.reach, drawn.grid, len(drawn.truth)) == (4, FIELD, 12)
    assert {(t, s) for t in (-4.0, 4.0) for s in (-4.0, 4.0)} <= drawn.truth.keys() <= set(drawn.field)
    assert {(np.sign(at.t), np.sign(at.s)) for at in drawn.truth} == {(-1, -1), (-1, 1), (1, -1), (1, 1)}
    assert np.abs(drawn.disparity).max() <= 2.0
    assert not any(psnr(view, drawn.photo) > 60 for view in drawn.truth.values())


@pytest.mark.parametrize("extension", [".png", ".exr"])
def test_a_written_photo_is_read_with_its_map(tmp_path: Path, extension: str) -> None:
    scene = photo_scene(write_photo(tmp_path / f"a{extension}", (300, 400)))
    assert scene is not None
    assert image_size(scene.photo) == (300, 400)
    assert np.ptp(scene.disparity) > 0
    assert photo_scene(write_photo(tmp_path / f"b{extension}", (60, 80), with_map=False)) is None


def test_tables_name_every_variant_and_mark_the_front(figures: tuple[Figures, ...]) -> None:
    text = markdown_of(Bench(figures, (SpeedTarget("a", "<= 1", "2", False), SpeedTarget("b", ">= 1", "2", True))))
    for title in ("## Mean over scenes, maps as they are", "## Mean over scenes, soft maps", "## Targets"):
        assert title in text
    exact, soft = figures
    assert f"## {soft.scene}\n" not in text, "only its means"
    part = text.split(f"## {exact.scene}\n")[1].split("##")[0]
    for measured in exact.measured:
        (line,) = [row for row in part.splitlines() if row.startswith(f"| {measured.name} |")]
        assert ("●" in line) == (measured.name in exact.front)
    assert text.index("## Mean") < text.index(f"## {exact.scene}")  # the first table is the one to show
    assert "nan" not in text
    assert "| a | <= 1 | 2 | **no** |" in text
    assert markdown(("a", "b"), [(1, "c")]) == "| a | b |\n| --- | --- |\n| 1 | c |"
    assert [holds(is_met) for is_met in (True, False, None)] == ["yes", "**no**", "not known here"]


def test_means_are_geometric_for_time(figures: tuple[Figures, ...]) -> None:
    ratios = [m.ratio for scene in figures for m in scene.measured if m.name == "half width"]
    assert len(ratios) == 2
    assert means(figures)["half width"][0] == pytest.approx(math.sqrt(math.prod(ratios)))


def test_plots_are_pictures(figures: tuple[Figures, ...], tmp_path: Path) -> None:
    panel = Panel("all", {name: (ratio, gain) for name, (ratio, gain, _) in means(figures).items()})
    picture = Image.open(io.BytesIO(plot_panels([panel], "png")))
    assert picture.size[0] > 500
    assert len(np.unique(np.asarray(picture.convert("L")))) > 20
    paths = write_bench(tmp_path, Bench(figures, ()))
    assert [path.name for path in paths] == ["speed.md", "speed.svg"]
    assert b"<svg" in paths[1].read_bytes()
