import base64
import io
import json
import math
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.color import quantise_as_stored
from iibr_core.depth.choice import DepthChoice
from iibr_core.evaluation.evaluate import Options, Result, evaluate
from iibr_core.evaluation.metrics import flip, psnr, ssim
from iibr_core.evaluation.report import write_report
from iibr_core.evaluation.warp import reference_warp
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.write import write_image
from iibr_core.types import ViewOffset
from tests.golden_text import assert_same_text
from tests.iibr_core.evaluation.test_metrics import networks  # noqa: F401
from tests.iibr_core.evaluation.test_scenes import UNREFINED, scene_of, turned_cameras
from tests.iibr_core.known_scenes import HEIGHT, WIDTH, disparity_of_square, view_of_square, write_grid
from tests.iibr_core.lens_scenes import FOLDER
from tests.image_compare import DECISIONS, assert_golden

WAYS = ["unchanged photo", "one plane", "plain warp, true map", "iibr, true map"]
REPORT = ["index.html", "report.json", "report.md"]


def full_db(result: Result) -> dict[str, float]:
    return {row.name: row.mean.full_db for row in result.rows}


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    return write_grid(tmp_path_factory.mktemp("scenes") / "square")


@pytest.fixture(scope="module")
def results(folder) -> list[Result]:
    return evaluate(scene_of(folder), Options(choice=UNREFINED))


def test_figures_are_those_of_the_files(folder, results) -> None:
    photo = read_photo(folder / "views/v01_u01.png").pixels
    truth = read_photo(folder / "views/v00_u02.png").pixels
    warped = reference_warp(photo, disparity_of_square(), ViewOffset(-1.0, 1.0))
    rows = {row.name: row.views["v00 u02"] for row in results[0].rows}
    for name, image in ((WAYS[0], photo), (WAYS[2], quantise_as_stored(warped.colors))):
        figures = rows[name]
        assert figures.full_db == pytest.approx(psnr(image, truth))
        assert figures.visible_db == pytest.approx(psnr(image, truth, warped.visible))
        assert figures.hole_db == pytest.approx(psnr(image, truth, warped.hole))
        assert figures.ssim == pytest.approx(ssim(image, truth))
        assert figures.flip == pytest.approx(flip(image, truth))
        assert math.isnan(figures.lpips)


def test_nan_in_a_true_view_and_in_the_map_give_finite_figures(tmp_path) -> None:
    folder = write_grid(tmp_path / "scene")
    holed = view_of_square(ViewOffset(-1.0, -1.0)).copy()
    holed[3:5, 7] = np.nan
    (folder / "views/v00_u00.png").unlink()
    write_image(folder / "views/v00_u00.exr", holed)
    disparity = disparity_of_square()
    disparity[::7] = np.nan
    disparity[0, 0] = np.inf
    np.save(folder / "gt_disp_u01_v01.npy", disparity)
    result = evaluate(scene_of(folder), Options(choice=UNREFINED))[0]
    for row in result.rows:
        assert all(np.isfinite([of.full_db, of.ssim, of.flip]).all() for of in row.views.values())


@pytest.fixture(scope="module")
def all_results(folder, results, networks, tmp_path_factory) -> list[Result]:  # noqa: F811
    """Both trials of the square; an estimate for it in smaller pictures; a rendered scene, refined; turned cameras."""
    rough, small = DepthChoice(start="rough", refine=False), HEIGHT * WIDTH // 4
    fence = Options(lpips=networks, views=10, max_pixels=10_000)
    return [
        *results,
        *evaluate(scene_of(folder), Options("estimate", rough, views=2, max_pixels=small)),
        *evaluate(scene_of(FOLDER / "fence"), fence),
        *evaluate(*turned_cameras(tmp_path_factory.mktemp("turned"))),
    ]


def test_the_report_is_what_it_was_and_its_order_is_plausible(all_results, regenerate_golden, tmp_path) -> None:
    write_report(tmp_path, all_results, "iibr <evaluate>")
    lines = (tmp_path / "report.md").read_text().splitlines()
    assert_same_text(lines, "evaluation/report", "all trials", regenerate_golden, rtol=0.02)
    pictures = [picture for shown in all_results[0].pictures.values() for picture in shown.values()]
    sizes = [max(picture.shape[axis] for picture in pictures) for axis in (0, 1)]
    padded = [np.pad(p, ((0, sizes[0] - p.shape[0]), (0, sizes[1] - p.shape[1]), (0, 0))) for p in pictures]
    count = len(WAYS) + 1
    sheet = np.vstack([np.hstack(padded[k : k + count]) for k in range(0, len(padded), count)])
    assert_golden(sheet, "evaluation/pictures", DECISIONS, tmp_path, regenerate_golden)
    photo, *_, ours = all_results[4].rows
    assert list(ours.refocus_db) == ["near", "middle", "far"]
    assert all(ours.refocus_db[name] > photo.refocus_db[name] + 3 for name in ours.refocus_db)
    assert 0 < ours.mean.lpips < photo.mean.lpips
    found = full_db(all_results[2])
    assert found["iibr, true map"] > found["unchanged photo"] + 5
    assert found["plain warp, guess"] <= found["plain warp, guess, fitted"] < found["plain warp, true map"]
    turned = {row.name: row.mean for row in all_results[-1].rows}
    assert turned["unchanged photo"].full_db < 25 < 35 < turned["iibr, given map"].visible_db
    assert turned["plain warp, given map"].visible_db > 35
    assert turned["one plane"].full_db > 30


def test_a_report_holds_every_figure_and_needs_no_other_file(results, tmp_path) -> None:
    write_report(tmp_path / "new" / "report", results, "iibr <evaluate>")
    assert sorted(path.name for path in (tmp_path / "new" / "report").iterdir()) == REPORT
    page, stored, text = ((tmp_path / "new" / "report" / name).read_text() for name in REPORT)
    for result, stored_result in zip(results, json.loads(stored)["results"], strict=True):
        for row, stored_row in zip(result.rows, stored_result["rows"], strict=True):
            assert row.views[row.worst_view].full_db == min(view.full_db for view in row.views.values())
            assert stored_row["mean"]["full_db"] == row.mean.full_db
            assert stored_row["mean"]["lpips"] is None
            assert stored_row["views"].keys() == row.views.keys()
    assert "nan" not in text
    assert "NaN" not in stored
    for block in re.findall(r"(?m)(?:^\|.*\n)+", text):
        assert len({line.count("|") for line in block.strip().splitlines()}) == 1
    assert all(len(re.findall(rf"(?m)^\| {way} \|", text)) == len(results) for way in WAYS)
    assert "iibr &lt;evaluate&gt;" in page
    assert not re.findall(r'(?:src|href)="(?!data:)|url\(|@import|<script|<link', page)
    titles = sum(len(result.pictures) for result in results)
    assert titles == 5 + 1  # the farthest view of both trials; the EPI and three foci of the centre
    pictures = re.findall(r'alt="[^"]+" src="data:image/\w+;base64,([^"]+)"', page)
    assert len(pictures) == titles * (1 + 2 * len(WAYS))
    for data in pictures:
        Image.open(io.BytesIO(base64.b64decode(data))).load()
