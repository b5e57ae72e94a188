"""Folders of views on a grid: which view stands where, and which folders are refused or are none."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.light_field_formats import find_light_field, open_light_field
from iibr_core.formats.light_fields.views import read_views
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.types import GridShape, InputError
from tests.iibr_core.evaluation.test_scenes import offset_by_file
from tests.iibr_core.known_scenes import disparity_of_square, offsets_of, write_grid, write_hci


def write_flat(folder: Path, names: list[str]) -> Path:
    """Write small grey pictures of 0, 1, 2, ..."""
    folder.mkdir(exist_ok=True)
    for k, name in enumerate(names):
        write_image(folder / name, np.full((2, 3, 3), k, np.uint8))
    return folder


@pytest.mark.parametrize(("rows", "columns"), [(3, 3), (1, 3), (3, 5)])
def test_hci_names_count_row_by_row(tmp_path: Path, rows: int, columns: int) -> None:
    folder = write_hci(tmp_path / "dino", rows, columns)
    write_image(folder / "objectids_highres.png", np.zeros((9, 9, 3), np.uint8))  # comes with the data set
    scene = open_light_field(folder)
    assert (scene.name, scene.layout) == ("dino", f"HCI 4D light field, {columns}x{rows}")
    wanted = {f"input_Cam{v * columns + u:03d}": at for (v, u), at in offsets_of(rows, columns).items()}
    assert offset_by_file(scene) == wanted
    assert list(scene.disparity) == [scene.centre]
    assert scene.disparity[scene.centre].is_truth


@pytest.mark.parametrize(
    "name", ["v{v:02d}_u{u:02d}.png", "scene7_{v1}_{u1}.png", "{k:03d}.png", "img-{k1}.png", "lf_{v}_{u}.jpg"]
)
def test_grids_under_any_numbering(tmp_path: Path, name: str) -> None:
    """By row and column or row by row, counted from 0 or from 1; the map without a number is the centre view's."""
    names = {
        name.format(v=v, u=u, v1=v + 1, u1=u + 1, k=v * 11 + u, k1=v * 11 + u + 1): at
        for (v, u), at in offsets_of(11, 11).items()
    }
    for file in names:
        Image.new("RGB", (4, 4)).save(tmp_path / file)
    write_pfm(tmp_path / "disparity.pfm", np.ones((4, 4), np.float32))
    scene = open_light_field(tmp_path)
    assert (scene.layout, scene.grid) == ("grid folder, 11x11", (11, 11))
    assert offset_by_file(scene) == {Path(file).stem: at for file, at in names.items()}
    assert list(scene.disparity) == [scene.centre]


def test_a_light_field_has_the_name_of_its_folder_not_of_the_views_in_it(tmp_path: Path) -> None:
    (tmp_path / "boxes").mkdir()
    write_flat(tmp_path / "boxes" / "views", [f"v{v}_u{u}.png" for v, u in np.ndindex(2, 2)])
    for folder in (tmp_path / "boxes", tmp_path / "boxes" / "views"):
        assert open_light_field(folder).name == "boxes"


def test_jpeg_pleno_counts_columns_first(tmp_path: Path) -> None:
    for row, column in np.ndindex(3, 4):
        Image.new("RGB", (4, 4)).save(tmp_path / f"{column + 1:03d}_{row + 1:03d}.ppm")
    scene = open_light_field(tmp_path)
    assert scene.grid == GridShape(3, 4)
    assert {view.path.stem for view in scene.views if view.place == (2, 0)} == {"001_003"}
    (tmp_path / "002_001.ppm").unlink()
    with pytest.raises(InputError, match=r"row 0, column 1 is missing \(1 of 3x4"):
        open_light_field(tmp_path)


@pytest.mark.parametrize("count", [4, 9, 16, 25])
def test_a_few_numbered_photos_are_no_light_field(tmp_path: Path, count: int) -> None:
    write_flat(tmp_path, [f"beach {n + 1}.png" for n in range(count)])
    with pytest.raises(InputError, match="holds no light field"):
        open_light_field(tmp_path)
    (tmp_path / "parameters.cfg").write_text(f"[extrinsics]\nnum_cams_x = {count}\nnum_cams_y = 1\n")
    assert open_light_field(tmp_path).grid == (1, count)


def test_views_of_which_every_third_was_kept_stand_on_a_square(tmp_path: Path) -> None:
    write_flat(tmp_path, [f"input_Cam{3 * k:03d}.png" for k in range(9)])
    assert open_light_field(tmp_path).grid == (3, 3)


def test_photos_numbered_by_date_and_time_are_no_light_field(tmp_path: Path) -> None:
    write_flat(tmp_path, [f"IMG_202307{day}_1{day}{k}.png" for day in (11, 14) for k in range(3)])
    assert find_light_field(tmp_path) is None


def test_maps_of_places_and_truth_before_estimates(tmp_path: Path) -> None:
    grid = write_grid(tmp_path / "grid")
    np.save(grid / "disp_est_u02_v00.npy", disparity_of_square())
    scene = open_light_field(grid)
    names = {scene.views[index].name: known.is_truth for index, known in scene.disparity.items()}
    assert names == {"v01 u01": True, "v00 u02": False}
    hci = write_hci(tmp_path / "hci")
    write_pfm(hci / "disp_Cam002.pfm", disparity_of_square())
    assert [known.is_truth for _, known in sorted(open_light_field(hci).disparity.items())] == [False, True]
    write_pfm(hci / "gt_disp_lowres_Cam002.pfm", disparity_of_square())
    assert open_light_field(hci).disparity[2].is_truth


def test_missing_odd_and_damaged_views_are_named(tmp_path: Path) -> None:
    folder = write_hci(tmp_path / "lf")
    view = folder / "input_Cam004.png"
    whole = view.read_bytes()
    view.unlink()
    with pytest.raises(InputError, match=r"input_Cam004\.png: this view is missing \(1 of 3x3"):
        open_light_field(folder)
    write_image(view, np.zeros((6, 8, 3), np.uint8))
    with pytest.raises(InputError, match=r"input_Cam004.png: is 8x6.*48x40"):
        read_views(open_light_field(folder))
    view.write_bytes(whole[:-30])
    with pytest.raises(InputError, match=r"input_Cam004\.png: "):
        list(read_views(open_light_field(folder))[1])
    places = write_flat(tmp_path / "places", [f"v{v:02d}_u{u:02d}.png" for v in range(2) for u in range(3)])
    (places / "v01_u01.png").unlink()
    with pytest.raises(InputError, match=r"v01_u01.png: this view is missing \(1 of 2x3"):
        open_light_field(places)
    write_flat(places, ["v9999_u9999.png"])
    with pytest.raises(InputError, match="10000x10000"):
        open_light_field(places)
