"""Light-field folders: written whole or not at all, read in order, refused by the name of what is wrong."""

import configparser
import threading
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import OpenImageIO as oiio
import pytest

from iibr_core.color import linear_from_srgb
from iibr_core.formats.images.photo import write_image
from iibr_core.formats.light_fields import folder_writer
from iibr_core.formats.light_fields.hci import HciWriter
from iibr_core.formats.light_fields.light_field_formats import find_light_field, open_light_field
from iibr_core.formats.light_fields.views import read_views
from iibr_core.formats.maps.pfm import read_pfm, write_pfm
from iibr_core.types import GridShape, InputError, ViewUpdate

RNG = np.random.default_rng(5)
GRID = GridShape(3, 5)


def updates(grid=GRID, size=(6, 9), dtype=np.uint8, with_disparity=True):
    for row in range(grid.rows):
        for column in range(grid.columns):
            colors = RNG.integers(0, 256, (*size, 3), dtype=np.uint8)
            if dtype == np.float16:
                colors = (colors / 64).astype(np.float16)
            disparity = RNG.uniform(-2, 3, size).astype(np.float32) if with_disparity else None
            yield ViewUpdate(row, column, colors, disparity)


def write(folder, views, grid=GRID, with_disparity=True):
    with HciWriter(folder, grid, 12.5, "a scene", with_disparity) as writer:
        for view in views:
            writer.add(view)


def read_light_field(folder):
    """The scene of a folder, and its views."""
    scene = open_light_field(folder)
    return scene, read_views(scene)[1]


def edit_parameters(folder, section, **values):
    parser = configparser.ConfigParser()
    parser.read(folder / "parameters.cfg")
    for name, value in values.items():
        parser[section][name] = value
    with (folder / "parameters.cfg").open("w") as file:
        parser.write(file)


@pytest.mark.parametrize("grid", [GRID, GridShape(1, 1), GridShape(2, 2), GridShape(1, 7)])
@pytest.mark.parametrize("dtype", [np.uint8, np.float16])
def test_round_trip(tmp_path, grid, dtype):
    views = list(updates(grid, dtype=dtype))
    write(tmp_path / "lf", reversed(views), grid)
    scene, found = read_light_field(tmp_path / "lf")
    assert (scene.grid, read_views(scene)[0], scene.name) == (grid, (6, 9), "lf")
    assert scene.focal_px == pytest.approx(12.5)
    assert scene.is_hdr == (dtype == np.float16)
    low, high = scene.range_px
    assert low == min(view.disparity.min() for view in views)
    assert high == max(view.disparity.max() for view in views)
    by_index = {(view.row, view.column): view for view in found}
    assert len(by_index) == len(views)
    for view in views:
        read = by_index[view.row, view.column]
        assert read.colors.dtype == dtype
        assert np.allclose(read.colors.astype(float), view.colors.astype(float), rtol=4e-3, atol=1e-3)
        assert np.array_equal(read.disparity, view.disparity)
    if dtype == np.uint8:
        assert all(np.array_equal(by_index[v.row, v.column].colors, v.colors) for v in views)


def test_files_and_parameters_are_those_of_the_benchmark(tmp_path):
    views = list(updates())
    write(tmp_path / "lf", views)
    names = {path.name for path in (tmp_path / "lf").iterdir()}
    assert names == {
        *(f"input_Cam{i:03d}.png" for i in range(15)),
        *(f"disp_Cam{i:03d}.pfm" for i in range(15)),
        "gt_disp_lowres.pfm",
        "parameters.cfg",
    }
    centre = next(view for view in views if (view.row, view.column) == (1, 2))
    assert np.array_equal(read_pfm(tmp_path / "lf" / "gt_disp_lowres.pfm"), centre.disparity)
    parser = configparser.ConfigParser()
    parser.read(tmp_path / "lf" / "parameters.cfg")
    assert (parser["extrinsics"]["num_cams_x"], parser["extrinsics"]["num_cams_y"]) == ("5", "3")
    assert parser["intrinsics"]["image_resolution_x_px"] == "9"
    sensor, focal = (float(parser["intrinsics"][key]) for key in ("sensor_size_mm", "focal_length_mm"))
    assert focal / sensor * 9 == pytest.approx(12.5)
    # Disparity 0 lies at the focus distance, the least disparity at infinity: d = f * b * (1 / z - 1 / focus).
    focus_mm = 1000 * float(parser["extrinsics"]["focus_distance_m"])
    assert 12.5 * 1.0 * -1 / focus_mm == pytest.approx(float(parser["meta"]["disp_min"]))


def test_without_disparity_only_the_centre_has_one(tmp_path):
    write(tmp_path / "lf", updates(), with_disparity=False)
    _, found = read_light_field(tmp_path / "lf")
    assert [(v.row, v.column) for v in found if v.disparity is not None] == [(1, 2)]


def test_views_without_any_disparity(tmp_path):
    write(tmp_path / "lf", updates(with_disparity=False))
    scene, found = read_light_field(tmp_path / "lf")
    assert scene.range_px == (0, 0)
    assert all(view.disparity is None for view in found)


def test_an_interruption_while_a_thread_starts_leaves_nothing(tmp_path, monkeypatch):
    """The pool does not wait for such a thread, and what it writes must not come after all was removed."""
    has_begun, pool_is_down = threading.Event(), threading.Event()
    start, shutdown, write_map = threading.Thread.start, ThreadPoolExecutor.shutdown, folder_writer.write_pfm
    files = []

    def interrupted_start(thread):
        start(thread)
        if thread.name == "view-writer_0":
            assert has_begun.wait(60)
            raise KeyboardInterrupt

    def told_shutdown(*args, **kwargs):
        shutdown(*args, **kwargs)
        pool_is_down.set()

    def late_map(path, *args):
        has_begun.set()
        assert pool_is_down.wait(60)
        write_map(path, *args)
        files.append(path.exists())

    monkeypatch.setattr(threading.Thread, "start", interrupted_start)
    monkeypatch.setattr(ThreadPoolExecutor, "shutdown", told_shutdown)
    monkeypatch.setattr(folder_writer, "write_pfm", late_map)
    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "field", updates())
    assert files == [True]
    assert list(tmp_path.iterdir()) == []


def test_the_centre_comes_first_then_the_nearest(tmp_path):
    write(tmp_path / "lf", updates())
    _, found = read_light_field(tmp_path / "lf")
    distances = [np.hypot(view.row - 1, view.column - 2) for view in found]
    assert distances[0] == 0
    assert distances == sorted(distances)


def test_hdr_views_are_stored_as_linear_light(tmp_path):
    view = next(updates(GridShape(1, 1), dtype=np.float16))
    write(tmp_path / "lf", [view], GridShape(1, 1))
    stored = oiio.ImageInput.open(str(tmp_path / "lf" / "input_Cam000.exr")).read_image()
    assert np.allclose(stored, linear_from_srgb(view.colors), rtol=1e-3, atol=1e-5)


def test_nothing_is_left_of_an_interrupted_writing(tmp_path):
    def interrupted():
        yield from list(updates())[:7]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write(tmp_path / "out" / "lf", interrupted())
    assert list(tmp_path.iterdir()) == []


def test_missing_views_are_not_written(tmp_path):
    with pytest.raises(InputError, match="only 2 of 15 views"):
        write(tmp_path / "lf", list(updates())[:2])
    assert list(tmp_path.iterdir()) == []


def test_same_view_twice_or_of_another_size_is_a_mistake(tmp_path):
    view = next(updates())
    with pytest.raises(ValueError, match="added before"):
        write(tmp_path / "lf", [view, view])
    with pytest.raises(ValueError, match="others are"):
        write(tmp_path / "lf", [view, ViewUpdate(0, 1, view.colors[1:], None)])
    assert list(tmp_path.iterdir()) == []


def test_an_older_light_field_is_replaced_whole(tmp_path):
    write(tmp_path / "lf", updates())
    write(tmp_path / "lf", updates(GridShape(1, 1)), GridShape(1, 1))
    assert len(list((tmp_path / "lf").glob("input_Cam*"))) == 1
    assert [path.name for path in tmp_path.iterdir()] == ["lf"]


def test_an_older_light_field_survives_an_interruption(tmp_path):
    write(tmp_path / "lf", updates())
    with pytest.raises(InputError, match="only 1 of 15"):
        write(tmp_path / "lf", list(updates())[:1])
    assert read_light_field(tmp_path / "lf")[0].grid == GRID


def test_foreign_folders_and_files_are_left_alone(tmp_path):
    folder = tmp_path / "holiday"
    folder.mkdir()
    (folder / "beach.jpg").touch()
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"holiday: holds other files \(beach.jpg\)"):
        write(folder, updates())
    with pytest.raises(InputError, match="is a file"):
        write(tmp_path / "file", updates())
    with pytest.raises(InputError, match="is a file"):
        write(tmp_path / "file" / "lf", updates())
    assert sorted(path.name for path in tmp_path.rglob("*")) == ["beach.jpg", "file", "holiday"]


def test_an_empty_folder_is_taken(tmp_path):
    (tmp_path / "lf").mkdir()
    write(tmp_path / "lf", updates())
    assert find_light_field(tmp_path / "lf") is not None


def test_a_photo_makes_no_light_field_but_a_single_view_does(tmp_path):
    assert find_light_field(tmp_path) is None
    write_image(tmp_path / "photo.png", np.zeros((2, 2, 3), np.uint8))
    assert find_light_field(tmp_path) is None
    write_image(tmp_path / "v00_u00.png", np.zeros((2, 2, 3), np.uint8))
    assert find_light_field(tmp_path).grid == (1, 1)


def test_a_folder_without_parameters_is_a_square(tmp_path):
    for index in range(9):
        write_image(tmp_path / f"input_Cam{index:03d}.png", np.full((2, 3, 3), index, np.uint8))
    write_pfm(tmp_path / "gt_disp_lowres_Cam002.pfm", np.ones((2, 3), np.float32))
    scene, found = read_light_field(tmp_path)
    assert (scene.grid, scene.range_px) == (GridShape(3, 3), None)
    assert scene.focal_px is None
    by_index = {(view.row, view.column): view for view in found}
    assert all((view.colors == 3 * row + column).all() for (row, column), view in by_index.items())
    assert (by_index[0, 2].disparity == 1).all()
    assert by_index[1, 1].disparity is None
    (tmp_path / "input_Cam008.png").unlink()
    with pytest.raises(InputError, match="8 views do not form a square"):
        read_light_field(tmp_path)


def test_grid_names(tmp_path):
    for row, column in np.ndindex(2, 3):
        write_image(tmp_path / f"v{row:02d}_u{column:02d}.png", np.full((2, 3, 3), 10 * row + column, np.uint8))
    scene, found = read_light_field(tmp_path)
    assert scene.grid == GridShape(2, 3)
    assert all((view.colors == 10 * view.row + view.column).all() for view in found)
    (tmp_path / "v01_u01.png").unlink()
    with pytest.raises(InputError, match=r"v01_u01.png: this view is missing \(1 of 2x3"):
        read_light_field(tmp_path)
    write_image(tmp_path / "v9999_u9999.png", np.zeros((2, 3, 3), np.uint8))
    with pytest.raises(InputError, match="10000x10000"):
        read_light_field(tmp_path)


def test_missing_odd_and_damaged_views_are_named(tmp_path):
    folder = tmp_path / "lf"
    write(folder, updates())
    whole = (folder / "input_Cam004.png").read_bytes()
    (folder / "input_Cam004.png").unlink()
    with pytest.raises(InputError, match=r"input_Cam004\.png: this view is missing"):
        read_light_field(folder)
    write_image(folder / "input_Cam004.png", np.zeros((6, 8, 3), np.uint8))
    with pytest.raises(InputError, match=r"input_Cam004.png: is 8x6.*9x6"):
        read_light_field(folder)
    (folder / "input_Cam004.png").write_bytes(whole[:-30])
    with pytest.raises(InputError, match=r"input_Cam004\.png: damaged"):
        read_light_field(folder)


def test_of_numbers_without_parameters_gaps_are_missing_views_unless_most_are_gaps(tmp_path):
    for name in ("few", "gap"):
        (tmp_path / name).mkdir()
    for number in (0, 2, 4, 6):
        write_image(tmp_path / "few" / f"input_Cam{10 * number:03d}.png", np.zeros((6, 9, 3), np.uint8))
    assert read_light_field(tmp_path / "few")[0].grid == GridShape(2, 2)
    for number in (0, 1, 3, 4):
        write_image(tmp_path / "gap" / f"input_Cam{number:03d}.png", np.zeros((6, 9, 3), np.uint8))
    with pytest.raises(InputError, match=r"input_Cam002\.png: this view is missing"):
        read_light_field(tmp_path / "gap")


@pytest.mark.parametrize("count", ["0", "-3", "1000000000", "4"])
def test_parameters_that_do_not_fit(tmp_path, count):
    write(tmp_path / "lf", updates())
    edit_parameters(tmp_path / "lf", "extrinsics", num_cams_x=count)
    with pytest.raises(InputError, match="15 views do not fit"):
        read_light_field(tmp_path / "lf")


@pytest.mark.parametrize("name", ["disp_min", "disp_max"])
def test_half_a_range_is_none(tmp_path, name):
    write(tmp_path / "lf", updates())
    parser = configparser.ConfigParser()
    parser.read(tmp_path / "lf" / "parameters.cfg")
    assert parser.remove_option("meta", name)
    with (tmp_path / "lf" / "parameters.cfg").open("w") as file:
        parser.write(file)
    assert read_light_field(tmp_path / "lf")[0].range_px is None


def test_parameters_that_are_none(tmp_path):
    write(tmp_path / "lf", updates())
    edit_parameters(tmp_path / "lf", "meta", disp_min="low", disp_max="nan", scene="100 % %(x)s".replace("%", "%%"))
    assert read_light_field(tmp_path / "lf")[0].range_px is None
    (tmp_path / "lf" / "parameters.cfg").write_bytes(b"\xff\xfe no sections")
    with pytest.raises(InputError, match=r"parameters\.cfg: is not a valid parameter file"):
        read_light_field(tmp_path / "lf")


def test_folder_without_light_field(tmp_path):
    with pytest.raises(InputError, match="no photos in it"):
        read_light_field(tmp_path)
    with pytest.raises(InputError, match="no such file"):
        read_light_field(tmp_path / "none")
