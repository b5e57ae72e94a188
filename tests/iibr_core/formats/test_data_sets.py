"""Layouts of data sets on small folders: which views stand where, which maps are theirs, and in what units."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iibr_core.evaluation.datasets import read_known_disparity
from iibr_core.formats.light_fields.stanford import StanfordWriter
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.types import GridShape, ImageSize, ViewOffset
from tests.iibr_core.evaluation.test_datasets import offset_by_file, scene_of, write_picture
from tests.iibr_core.known_scenes import (
    HEIGHT,
    WIDTH,
    disparity_of_square,
    offsets_of,
    write_grid,
    write_hci,
    write_numbered,
)


@pytest.mark.parametrize(("rows", "columns"), [(3, 3), (1, 3), (3, 5)])
def test_hci_names_count_row_by_row(tmp_path: Path, rows: int, columns: int) -> None:
    folder = write_hci(tmp_path / "dino", rows, columns)
    write_picture(folder / "objectids_highres.png", np.zeros((9, 9, 3), np.uint8))  # comes with the data set
    scene = scene_of(folder)
    assert scene.name == "dino"
    assert scene.layout == f"HCI 4D light field, {columns}x{rows}"
    wanted = {f"input_Cam{v * columns + u:03d}": at for (v, u), at in offsets_of(rows, columns).items()}
    assert offset_by_file(scene) == wanted
    assert list(scene.disparity) == [scene.centre]
    known = scene.disparity[scene.centre]
    assert known.is_truth
    np.testing.assert_array_equal(read_known_disparity(known, ImageSize(HEIGHT, WIDTH)).values, disparity_of_square())


def test_views_in_a_subfolder_with_truth_and_estimates(tmp_path: Path) -> None:
    folder = write_grid(tmp_path / "scene")
    np.save(folder / "disp_est_u02_v00.npy", disparity_of_square())
    scene = scene_of(folder)
    assert scene.layout == "grid folder, 3x3"
    assert offset_by_file(scene) == {f"v{v:02d}_u{u:02d}": at for (v, u), at in offsets_of(3, 3).items()}
    names = {scene.views[index].name: known.is_truth for index, known in scene.disparity.items()}
    assert names == {"v01 u01": True, "v00 u02": False}


@pytest.mark.parametrize("name", ["lf_{v:02d}_{u:02d}.png", "scene7_{v1}_{u1}.png", "{k:03d}.png", "img-{k1}.png"])
def test_hebers_grid_under_any_numbering(tmp_path: Path, name: str) -> None:
    """By row and column or row by row, counted from 0 or from 1; the map without a number is the centre view's."""
    offsets = offsets_of(11, 11)
    names = {
        name.format(v=v, u=u, v1=v + 1, u1=u + 1, k=v * 11 + u, k1=v * 11 + u + 1): at for (v, u), at in offsets.items()
    }
    folder = write_numbered(tmp_path / "pov", names)
    write_pfm(folder / "disparity.pfm", np.ones((8, 8), np.float32))
    scene = scene_of(folder)
    assert scene.layout == "Pov-ray (Heber), 11x11"
    assert offset_by_file(scene) == {Path(name).stem: at for name, at in names.items()}
    assert list(scene.disparity) == [scene.centre]


def stanford_names(jitter: float = 0.0) -> dict[str, ViewOffset]:
    """5 rows counted upwards, 4 columns to the left; positions in millimetres, up to `jitter` steps off."""
    rng, found = np.random.default_rng(3), {}
    for row in range(5):
        for column in range(4):
            t, s = -row + rng.uniform(-jitter, jitter), -column + rng.uniform(-jitter, jitter)
            found[f"out_{row:02d}_{column:02d}_{100 + 30 * t:.6f}_{30 * s:.6f}_.png"] = ViewOffset(t, s)
    return found


@pytest.mark.parametrize("inside", ["", "rectified"])
@pytest.mark.parametrize("jitter", [0.0, 0.1])
def test_stanford_viewpoints_are_the_cameras_positions(tmp_path: Path, inside: str, jitter: float) -> None:
    names = stanford_names(jitter)
    write_numbered(tmp_path / "lego" / inside, names)
    scene = scene_of(tmp_path / "lego")
    assert scene.layout == "Stanford archive, 4x5"
    found = np.array([view.offset for view in scene.views])
    wanted = np.array([names[view.path.name] for view in scene.views])
    np.testing.assert_allclose(found - found[0], wanted - wanted[0], atol=0.1 * jitter * 20 + 1e-6)
    by_index = {view.name: view.offset for view in scene.views}
    assert by_index["row 4 column 0"].t < by_index["row 0 column 0"].t  # rows are counted upwards
    assert by_index["row 0 column 3"].s < by_index["row 0 column 0"].s


def test_stanford_positions_that_make_no_grid_are_told(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    names = {
        f"out_{v:02d}_{u:02d}_{rng.uniform():.5f}_{rng.uniform():.5f}.png": ViewOffset(0.0, 0.0)
        for v in range(3)
        for u in range(3)
    }
    scene = scene_of(write_numbered(tmp_path / "odd", names))
    assert "regular" in scene.notes[0]
    assert {tuple(view.offset) for view in scene.views} == {(-float(v), float(u)) for v in range(3) for u in range(3)}


def test_middlebury_pair_from_the_left(tmp_path: Path) -> None:
    folder = write_numbered(tmp_path / "pair", {f"im{n}.png": ViewOffset(0, n) for n in (0, 1)}, (HEIGHT, WIDTH))
    disparity = np.full((HEIGHT, WIDTH), 7.5, np.float32)
    disparity[0, 0] = np.inf
    write_pfm(folder / "disp0.pfm", disparity)
    scene = scene_of(folder)
    assert scene.layout == "Middlebury pair"
    assert scene.centre == 0
    assert offset_by_file(scene) == {"im0": (0, 0), "im1": (0, 1)}
    known = read_known_disparity(scene.disparity[0], ImageSize(HEIGHT, WIDTH))
    assert known.values[1, 1] == 7.5
    assert np.isfinite(known.values).all()


@pytest.mark.parametrize(
    ("kind", "count", "truths", "extension", "width", "factor"),
    [
        ("im", 9, (2, 6), ".png", 450, 4.0),  # 2003, quarter size
        ("im", 9, (2, 6), ".ppm", 434, 8.0),  # 2001
        ("view", 7, (1, 5), ".png", 463, 3.0),  # 2005, third size
    ],
)
def test_middlebury_rows_store_four_steps_times_a_factor(
    tmp_path: Path, kind: str, count: int, truths: tuple[int, int], extension: str, width: int, factor: float
) -> None:
    pixels = np.zeros((4, width, 3), np.uint8)
    for n in range(count):
        write_picture(tmp_path / f"{kind}{n}{extension}", pixels)
    for n in truths:
        stored = np.full((4, width), 120, np.uint8)
        stored[0, 0] = 0  # unknown
        write_picture(tmp_path / f"disp{n}.png", stored)
    scene = scene_of(tmp_path)
    assert [view.offset.s for view in scene.views] == list(range(count))
    assert list(scene.disparity) == list(truths)
    for known in scene.disparity.values():
        values = read_known_disparity(known, ImageSize(4, width)).values
        np.testing.assert_allclose(values, 120 / factor / 4, rtol=1e-5)


def test_stanford_rows_are_named_upwards(tmp_path: Path) -> None:
    names = [
        StanfordWriter(tmp_path, GridShape(3, 1), 50.0, "scene", False).view_name(row, 0, "png") for row in range(3)
    ]
    assert [name.split("_")[1] for name in names] == ["02", "01", "00"]
