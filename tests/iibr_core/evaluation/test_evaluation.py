"""Whole evaluations of small scenes: what is judged, what is always there, reports that are complete."""

from __future__ import annotations

import base64
import io
import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.color import quantise_as_stored
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation import evaluation_report
from iibr_core.evaluation.datasets import read_scene
from iibr_core.evaluation.evaluate_scene import Options, evaluate
from iibr_core.evaluation.metrics import flip, psnr, ssim
from iibr_core.evaluation.reference_warp import reference_warp
from iibr_core.evaluation.report_folder import FILES, require_report_folder
from iibr_core.evaluation.results import EvaluationResult
from iibr_core.evaluation.tables import ABOUT_CONSISTENCY
from iibr_core.evaluation.trials import CENTRE_TRIAL, CORNER_TRIAL, trial_input, trials_of
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.method.light_field import generate
from iibr_core.method.photo_views import PhotoViews
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.types import (
    GridShape,
    InputError,
    ViewOffset,
)
from tests.iibr_core.known_scenes import HEIGHT, WIDTH, disparity_of_square, view_of_square, write_grid, write_numbered
from tests.iibr_core.scenes import by_index, disparity_of, literal_plan, photo_of

ALWAYS = ["identity", "reference warp", "iibr"]
UNREFINED = DepthChoice(refine=False)


def scene_of(folder: Path) -> MultiView:
    scene = read_scene(folder)
    assert scene is not None
    return scene


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_grid(tmp_path_factory.mktemp("scenes") / "square")


@pytest.fixture(scope="module")
def results(folder: Path) -> list[EvaluationResult]:
    return evaluate(scene_of(folder), Options(choice=UNREFINED))


def test_views_are_those_that_generate_makes() -> None:
    photo, disparity = photo_of(view_of_square(ViewOffset(0.0, 0.0))), disparity_of(disparity_of_square())
    grid = GridShape(5, 5)
    made = by_index(list(generate(photo, disparity, literal_plan(photo, disparity, 5))))
    offsets = {(v, u): grid.offset(v, u) for v, u in made if (v, u) != grid.centre}
    views = PhotoViews(photo.pixels, disparity.values, offsets.values())
    for index, offset in offsets.items():
        shown = np.rint(255 * quantise_as_stored(views.view(offset).colors)).astype(np.uint8)
        np.testing.assert_array_equal(shown, made[index].colors, err_msg=str(index))


def test_both_trials_show_every_row(results: list[EvaluationResult]) -> None:
    assert [j.trial for j in results] == [CENTRE_TRIAL, CORNER_TRIAL]
    centre, corner = results
    for result in results:
        assert [row.method for row in result.rows] == ALWAYS
        assert result.size == (HEIGHT, WIDTH)
    assert centre.given == "v01 u01"
    assert set(centre.rows[0].of_views) == {f"v{v:02d} u{u:02d}" for v in range(3) for u in range(3)} - {"v01 u01"}
    assert corner.given == "v02 u00"
    assert list(corner.rows[0].of_views) == ["v00 u00"]
    assert any("carried over" in note for note in corner.notes)


def test_figures_are_of_the_right_pictures(folder: Path, results: list[EvaluationResult]) -> None:
    """Identity and reference warp, worked out again from the files."""
    photo = read_photo(folder / "views/v01_u01.png").pixels
    truth = read_photo(folder / "views/v00_u02.png").pixels
    offset = ViewOffset(-1.0, 1.0)
    warped = reference_warp(photo, disparity_of_square(), offset)
    rows = {row.method: row.of_views["v00 u02"] for row in results[0].rows}
    for name, image in (("identity", photo), ("reference warp", quantise_as_stored(warped.colors))):
        figures = rows[name]
        assert figures.full_db == pytest.approx(psnr(image, truth))
        assert figures.visible_db == pytest.approx(psnr(image, truth, warped.visible))
        assert figures.hole_db == pytest.approx(psnr(image, truth, warped.hole))
        assert figures.ssim == pytest.approx(ssim(image, truth))
        assert figures.flip == pytest.approx(flip(image, truth))
        assert math.isnan(figures.lpips)


def test_means_and_the_worst_view(results: list[EvaluationResult]) -> None:
    for row in results[0].rows:
        full = {name: figures.full_db for name, figures in row.of_views.items()}
        assert row.mean.full_db == pytest.approx(np.mean(list(full.values())))
        assert (row.worst_view, row.worst_db) == min(full.items(), key=lambda item: item[1])
        holes = [figures.hole_db for figures in row.of_views.values() if math.isfinite(figures.hole_db)]
        assert row.mean.hole_db == pytest.approx(np.mean(holes))


def test_every_way_beats_doing_nothing(results: list[EvaluationResult]) -> None:
    for result in results:
        full = {row.method: row.mean.full_db for row in result.rows}
        assert full["identity"] + 10 < min(full["reference warp"], full["iibr"])
        assert "iibr" in result.consistency
    assert results[0].consistency["truth"].line_off_px < 0.1


def test_a_pair_is_judged_from_the_left_without_a_corner_trial(tmp_path: Path) -> None:
    names = {f"views/v00_u{s:02d}.png": ViewOffset(0.0, float(s)) for s in (0, 1)}
    (tmp_path / "views").mkdir()
    scene = scene_of(write_numbered(tmp_path, names, (9, 9)))
    (trial,) = trials_of(scene, "auto")
    assert (scene.views[trial.given].name, trial.offset(trial.judged[0])) == ("v00 u00", (0, 1))


def test_only_so_many_views_the_farthest_among_them(folder: Path) -> None:
    centre, _ = trials_of(scene_of(folder), "auto", 3)
    assert len(centre.judged) == 3
    assert (-1.0, -1.0) in [centre.offset(index) for index in centre.judged]
    with pytest.raises(InputError, match="--views 0"):
        trials_of(scene_of(folder), "auto", 0)


def test_an_estimate_is_judged_as_it_is_and_aligned(folder: Path) -> None:
    choice = DepthChoice(start="rough", refine=False)
    options = Options("estimate", choice, most_views=2, with_consistency=False)
    plain, aligned = evaluate(scene_of(folder), options)[:2]
    assert "estimate" in plain.disparity
    assert aligned.disparity.endswith("scale and shift fitted to true views")
    assert aligned.consistency == {}
    # holes are told by the true disparity, whatever is judged
    assert plain.hole_share == aligned.hole_share


def test_an_estimate_does_not_know_the_range_of_a_grids_truth(tmp_path: Path) -> None:
    """HCI's parameters.cfg states it; photos on no grid (LLFF) state what their cameras' poses tell."""
    folder = write_grid(tmp_path / "square")
    told = {}
    for text in ("", "[meta]\ndisp_min = 0.5\ndisp_max = 2.0\n"):
        (folder / "parameters.cfg").write_text(text)
        scene = scene_of(folder)
        trial = trials_of(scene, "estimate")[0]
        told[scene.range_px] = trial_input(trial, "estimate", replace(UNREFINED, start="rough"), 10**6).maps[0].values
    assert list(told) == [None, (0.5, 2.0)]
    np.testing.assert_array_equal(*told.values())


def test_without_true_disparity_an_estimate_is_aligned_to_views(tmp_path: Path) -> None:
    folder = write_grid(tmp_path / "scene")
    (folder / "gt_disp_u01_v01.npy").unlink()
    scene = scene_of(folder)
    trial = trials_of(scene, "auto")[0]
    given = trial_input(trial, "auto", DepthChoice(start="rough"), 10**6)
    assert [disparity.source.split(",")[-1] for disparity in given.maps][1].endswith("fitted to true views")
    with pytest.raises(InputError, match="no true disparity"):
        trial_input(trial, "gt", UNREFINED, 10**6)


def test_a_file_is_the_centre_views_and_carried_to_the_corner(folder: Path, tmp_path: Path) -> None:
    path = tmp_path / "mine.npy"
    np.save(path, disparity_of_square() + 1)
    scene = scene_of(folder)
    centre, corner = trials_of(scene, "auto")
    (own,) = trial_input(centre, path, UNREFINED, 10**6).maps
    np.testing.assert_array_equal(own.values, disparity_of_square() + 1)
    (moved,) = trial_input(corner, path, UNREFINED, 10**6).maps
    assert moved.source == "mine.npy, carried over"
    assert trial_input(centre, path, UNREFINED, 10**6).judge.source == "gt_disp_u01_v01.npy"


def test_an_estimate_in_the_folder_is_used_where_there_is_no_truth(tmp_path: Path) -> None:
    folder = write_grid(tmp_path / "scene")
    (folder / "gt_disp_u01_v01.npy").rename(folder / "disp_est_u01_v01.npy")
    (given,) = trial_input(trials_of(scene_of(folder), "auto")[0], "auto", UNREFINED, 10**6).maps
    assert given.source == "disp_est_u01_v01.npy"


def test_smaller_pictures_with_disparity_to_match(folder: Path) -> None:
    (result, *_) = evaluate(scene_of(folder), Options(choice=UNREFINED, max_pixels=HEIGHT * WIDTH // 4))
    assert result.size == (HEIGHT // 2, WIDTH // 2)
    full = {row.method: row.mean.full_db for row in result.rows}
    assert full["iibr"] > full["identity"] + 5


def test_stopping_ends_it(folder: Path) -> None:
    with pytest.raises(Cancelled), stoppable(lambda: True):
        evaluate(scene_of(folder), Options(choice=UNREFINED))


def test_the_json_holds_every_figure(results: list[EvaluationResult]) -> None:
    read = json.loads(
        evaluation_report.json_of(results, "iibr evaluate x"), parse_constant=lambda name: pytest.fail(name)
    )
    assert read["command"] == "iibr evaluate x"
    for result, stored in zip(results, read["judgements"]):
        assert stored["trial"] == result.trial
        for row, stored_row in zip(result.rows, stored["rows"]):
            assert stored_row["mean"]["full_db"] == row.mean.full_db
            assert stored_row["mean"]["lpips"] is None
            assert stored_row["of_views"].keys() == row.of_views.keys()
        assert stored["consistency"].keys() == result.consistency.keys()


def test_the_markdown_has_a_table_for_each_result(results: list[EvaluationResult]) -> None:
    text = evaluation_report.markdown_of(results, "iibr evaluate x")
    for method in ALWAYS:
        assert len(re.findall(rf"(?m)^\| {method} \|", text)) >= len(results)
    for line in text.splitlines():
        assert "nan" not in line
    assert text.count(ABOUT_CONSISTENCY) == 1
    assert ABOUT_CONSISTENCY not in evaluation_report.markdown_of([replace(results[0], consistency={})], "x")
    assert f"| iibr | – | {results[0].consistency['iibr'].hole_pixels} |" in text
    blocks = re.findall(r"(?m)(?:^\|.*\n?)+", text)
    assert len(blocks) == 1 + sum(2 + bool(result.refocus) for result in results)
    for block in blocks:
        assert len({line.count("|") for line in block.strip().splitlines()}) == 1


def test_the_page_needs_nothing_else(results: list[EvaluationResult]) -> None:
    text = evaluation_report.page_of(results, "iibr <evaluate>")
    assert "iibr &lt;evaluate&gt;" in text
    assert not re.findall(r'(?:src|href)="(?!data:)|url\(|@import|<script|<link', text)
    images = re.findall(r'alt="([^"]+)" src="data:image/\w+;base64,([^"]+)"', text)
    per_result = 1 + 2 * len(ALWAYS)
    epis = len(results[0].pictures.epis)
    assert epis == len(ALWAYS)  # the truth and all but identity
    refocused = ("near", "middle", "far")
    assert len(images) == per_result * len(results) + epis + 3 * len(refocused)
    for name, data in images:
        picture = Image.open(io.BytesIO(base64.b64decode(data)))
        picture.load()
        if name.startswith(refocused):
            assert picture.width < WIDTH
            continue
        assert picture.size == ((WIDTH, 3) if name.startswith("EPI") else (WIDTH, HEIGHT))


def test_epis_of_the_truth_hold_the_views_own_rows(folder: Path, results: list[EvaluationResult]) -> None:
    pictures = results[0].pictures
    rows = [read_photo(folder / f"views/v01_u{u:02d}.png").pixels[pictures.epi_row] for u in range(3)]
    np.testing.assert_array_equal(pictures.epis["truth"], np.rint(255 * np.stack(rows)))


def test_reports_replace_older_ones_whole(results: list[EvaluationResult], tmp_path: Path) -> None:
    out = tmp_path / "made" / "report"
    evaluation_report.write_report(out, results, "first")
    evaluation_report.write_report(out, results[:1], "second")
    assert sorted(path.name for path in out.iterdir()) == sorted(FILES)
    assert "`second`" in (out / "report.md").read_text()


def test_places_where_no_report_can_be_are_told_before_any_work(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    require_report_folder(tmp_path / "new" / "deep")
    for folder in (tmp_path / "file", tmp_path / "file" / "below"):
        with pytest.raises(InputError, match="file"):
            require_report_folder(folder)


def test_unknown_disparity_is_filled_by_the_photo_as_the_program_does_it(tmp_path: Path) -> None:
    folder = write_grid(tmp_path / "scene")
    path = tmp_path / "map.npy"
    unknown = disparity_of_square().copy()
    edge = int(np.flatnonzero(np.diff(unknown[HEIGHT // 2]))[0])
    unknown[:, edge - 2 : edge + 2] = np.nan
    np.save(path, unknown)
    centre = trials_of(scene_of(folder), path)[0]
    given = trial_input(centre, path, UNREFINED, 10**6)
    expected = open_with_depth(centre.scene.views[centre.given].path, replace(UNREFINED, file=str(path)))
    np.testing.assert_array_equal(given.maps[0].values, expected.disparity.values)


def test_the_summary_takes_means_over_scenes(results: list[EvaluationResult]) -> None:
    other = replace(results[0], scene="other")
    text = evaluation_report.markdown_of([*results, other], "x")
    assert re.search(r"(?m)^\| mean of 2 scenes \|", text)
    assert "mean of" not in evaluation_report.markdown_of(results, "x")
