from pathlib import Path

import numpy as np
import pytest

from benchmarks.compare import changes_table, compare, judge_view, main, mean_table, scene_table
from benchmarks.disparity import judge
from benchmarks.guess import known_maps, ordered_share, table
from benchmarks.lens import FOCI, MARGIN, Judge, drawn
from benchmarks.scenes import MAPS, data_scenes, drawn_scene
from benchmarks.ways import chosen_ways
from iibr_core.types import ImageSize, InputError
from tests.golden_text import assert_same_text

THIN_LENS = Path(__file__).parents[1] / "data" / "thin_lens"


def test_figures_notice_an_error_only_in_its_part() -> None:
    truth = np.full((60, 80, 3), 0.5, np.float32)
    hole = np.zeros((60, 80), np.bool_)
    hole[20:40, 30:40] = True
    view = truth.copy()
    view[hole] = 0.6
    whole, visible, edges, holes, flying = judge_view(view, truth, hole)
    assert visible == edges == 100
    assert holes == pytest.approx(20, abs=0.01)
    assert holes < whole < edges
    assert flying == 0
    view[25, 45] = 1.0
    assert judge_view(view, truth, hole)[4] > 0
    assert np.isnan(judge_view(view, truth, np.zeros_like(hole))[3])


def test_every_table_is_made_of_a_small_scene() -> None:
    scene = drawn_scene(1, ImageSize(48, 64), 1.0, [(1, 1), (0, -1)])
    results = list(compare([scene], chosen_ways("iibr,plain,unchanged"), ["exact", "soft"]))
    assert [(result.kind, result.way) for result in results] == [
        ("exact", "iibr"), ("exact", "plain warp"), ("exact", "unchanged photo"),
        ("soft", "iibr"), ("soft", "plain warp"),
    ]  # fmt: skip
    assert results[0].figures.whole > results[2].figures.whole
    assert all(result.figures.seconds > 0 for result in results)
    assert mean_table(results).count("\n") == 6
    assert "| drawn 1 | " in scene_table(results)
    assert changes_table(results, "iibr").splitlines()[2].startswith("| plain warp | ")
    with pytest.raises(InputError):
        changes_table(results, "splatting")


def test_scenes_of_a_folder_are_judged_at_corners_and_sides() -> None:
    assert [scene.name for scene in data_scenes(THIN_LENS, max_pixels=3000)] == ["fence", "shelf"]
    (scene,) = data_scenes(THIN_LENS / "shelf", max_pixels=3000)
    assert len(scene.truth) == 8
    assert len(scene.field) == 25
    assert all(view.shape == scene.photo.shape for view in scene.truth.values())
    with pytest.raises(InputError, match="no scene"):
        main(["--data", str(THIN_LENS), "--only", "nothing"])


def test_the_programs_print_what_they_printed(capsys, regenerate_golden) -> None:
    """All but times."""
    shelf = ["--data", str(THIN_LENS), "--only", "shelf", "--max-pixels", "3000"]
    main([*shelf, "--ways", "iibr,plain,unchanged", "--maps", ",".join(MAPS), "--by", "scene"])
    lines = capsys.readouterr().out.splitlines()
    results = list(compare(data_scenes(THIN_LENS / "shelf", max_pixels=3000), chosen_ways("iibr,plain"), ["exact"]))
    lines += [line.rpartition(" | ")[0] for line in mean_table(results).splitlines()]
    lines += [line.rpartition("; x")[0] for line in changes_table(results, "plain warp").splitlines()]
    lines += [" | ".join(judge(THIN_LENS / "shelf")[:-1])]
    lines += table(known_maps(THIN_LENS, 3000)).splitlines()
    layers = drawn(1)
    shown = np.where(layers.opacity[2] > 0.5, 2, np.where(layers.opacity[1] > 0.5, 1, 0))[
        MARGIN:-MARGIN, MARGIN:-MARGIN
    ]
    for focus in FOCI:
        found = Judge(shown, layers.seen(12, focus), 12, focus)(layers.seen(8, 0))
        lines.append(f"lens focused at {focus}: {found[0]:.2f}, {found[1]:.2f}")
    assert_same_text(lines, "benchmarks", "programs", regenerate_golden)


def test_a_guess_is_judged_by_the_order_of_its_points() -> None:
    known = np.linspace(0, 4, 40, dtype=np.float32)[:, None] * np.ones((1, 50), np.float32)
    assert ordered_share(known, known) == 1
    assert ordered_share(-known, known) == 0
    assert ordered_share(np.zeros_like(known), known) == 0.5
    photo = np.random.default_rng(0).random((40, 50, 3)).astype(np.float32)
    assert table(iter([("slope", photo, known)])).endswith(" | 1.000 |")
