from pathlib import Path

import numpy as np
import pytest

from benchmarks.compare import changes_table, compare, judge_view, main, mean_table, plot, scene_table
from benchmarks.guess import ordered_share, table
from benchmarks.scenes import Scene, data_scenes, drawn_scene, offsets_of
from benchmarks.ways import WAYS, chosen_ways
from iibr_core.training.degradation import blur
from iibr_core.types import FloatImage, GridShape, ImageSize, InputError, ViewOffset

OTHERS = pytest.mark.parametrize("name", [name for name in WAYS if not name.startswith(("iibr", "unchanged"))])


def scene_of(photo: FloatImage, disparity: FloatImage) -> Scene:
    return Scene("scene", photo, disparity, {}, offsets_of(GridShape(5, 5)))


@OTHERS
def test_a_plane_moves_by_its_disparity(name) -> None:
    noise = np.random.default_rng(3).random((3, 40, 56)).astype(np.float32)
    photo = np.clip(0.5 + 2 * (np.stack([blur(channel, 1.5) for channel in noise], axis=-1) - 0.5), 0, 1)
    view = WAYS[name](scene_of(photo, np.full(photo.shape[:2], 2.0, np.float32)))(ViewOffset(-1.0, 1.5))
    np.testing.assert_allclose(view[3:-1, 1:-5], photo[1:-3, 4:-2], atol=0.02)


@OTHERS
def test_the_foreground_hides_the_background(name) -> None:
    photo, disparity = np.zeros((40, 56, 3), np.float32), np.zeros((40, 56), np.float32)
    photo[10:30, 20:30], disparity[10:30, 20:30] = 1.0, 4.0
    view = WAYS[name](scene_of(photo, disparity))(ViewOffset(0.0, 2.0))
    assert view[13:27, 15:19].min() > 0.95, "the square, moved to the left by 8 px"
    assert view[13:27, :9].max() < 0.05
    assert view[:6].max() < 0.05


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
    assert len(plot(results).axes[0].texts) == 2


def test_scenes_of_a_folder_are_judged_at_corners_and_sides(capsys) -> None:
    names = [scene.name for scene in data_scenes(THIN_LENS, max_pixels=3000)]
    assert names == ["fence", "shelf"]
    (scene,) = data_scenes(THIN_LENS / "shelf", max_pixels=3000)
    assert len(scene.truth) == 8
    assert len(scene.field) == 25
    assert all(view.shape == scene.photo.shape for view in scene.truth.values())
    main(["--data", str(THIN_LENS), "--only", "shelf", "--max-pixels", "3000", "--ways", "plain"])
    assert "1 scenes: shelf.\n" in capsys.readouterr().out
    with pytest.raises(InputError, match="no scene"):
        main(["--data", str(THIN_LENS), "--only", "nothing"])


def test_a_guess_is_judged_by_the_order_of_its_points() -> None:
    known = np.linspace(0, 4, 40, dtype=np.float32)[:, None] * np.ones((1, 50), np.float32)
    assert ordered_share(known, known) == 1
    assert ordered_share(-known, known) == 0
    assert ordered_share(np.zeros_like(known), known) == 0.5
    photo = np.random.default_rng(0).random((40, 50, 3)).astype(np.float32)
    assert table(iter([("slope", photo, known)])).endswith(" | 1.000 |")
