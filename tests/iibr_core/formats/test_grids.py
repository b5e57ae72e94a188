from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.light_field_formats import find_light_field, open_light_field
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.light_fields.order import Arrangement, grid_of
from iibr_core.formats.light_fields.views import read_views, view_offsets
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.scenes.light_fields import find_disparity
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset
from tests.iibr_core.evaluation.test_scenes import offset_by_file, scene_of, write_picture
from tests.iibr_core.known_scenes import (
    HEIGHT,
    WIDTH,
    disparity_of_square,
    offsets_of,
    write_grid,
    write_hci,
    write_numbered,
)


def write_flat(folder: Path, names: list[str]) -> Path:
    folder.mkdir(exist_ok=True)
    for k, name in enumerate(names):
        write_image(folder / name, np.full((2, 3, 3), k, np.uint8))
    return folder


@pytest.mark.parametrize(
    "name",
    [
        "v{v:02d}_u{u:02d}.png", "scene7_{v1}_{u1}.png", "{k:03d}.png", "img-{k1}.png", "lf_{v}_{u}.jpg",
        "image_{v5:+d}_{u5:+d}.png",
    ],
)  # fmt: skip
def test_grids_under_any_numbering(tmp_path, name) -> None:
    """By row and column or row by row, counted from 0, 1 or the middle; the map without a number is the centre view's.

    A preview and hidden files among the views do not count.
    """
    names = {
        name.format(v=v, u=u, v1=v + 1, u1=u + 1, k=v * 11 + u, k1=v * 11 + u + 1, v5=v - 5, u5=u - 5): at
        for (v, u), at in offsets_of(11, 11).items()
    }
    for file in names:
        Image.new("RGB", (4, 4)).save(tmp_path / file)
        (tmp_path / f"._{file}").write_bytes(b"\0\5\x16\7")
    Image.new("RGB", (8, 4)).save(tmp_path / "preview.png")
    write_pfm(tmp_path / "disparity.pfm", np.ones((4, 4), np.float32))
    scene = open_light_field(tmp_path)
    assert (scene.layout, scene.grid) == ("grid folder, 11x11", (11, 11))
    assert offset_by_file(scene) == {Path(file).stem: at for file, at in names.items()}
    assert list(scene.disparity) == [scene.centre]


@pytest.mark.parametrize("count", [4, 9, 16, 25])
def test_a_few_numbered_photos_are_no_light_field(tmp_path, count) -> None:
    write_flat(tmp_path, [f"beach {n + 1}.png" for n in range(count)])
    assert find_light_field(tmp_path) is None
    with pytest.raises(InputError, match=f"holds no light field; its {count} numbered pictures"):
        find_disparity(Source(str(tmp_path)))
    (tmp_path / "parameters.cfg").write_text(f"[extrinsics]\nnum_cams_x = {count}\nnum_cams_y = 1\n")
    assert open_light_field(tmp_path).grid == (1, count)
    by_date = [f"IMG_202307{day}_1{day}{k}.png" for day in (11, 14) for k in range(3)]
    stacks = [f"IMG_{n}-stk_{k:02d}.png" for n, length in enumerate((12, 4, 8)) for k in range(length)]
    for names in (by_date, stacks):
        assert find_light_field(write_flat(tmp_path / names[0], names)) is None


@pytest.mark.parametrize(
    ("names", "grid"),
    [
        ([f"input_Cam{3 * k:03d}.png" for k in range(9)], (3, 3)),
        ([f"input_Cam{9 * v + u:03d}.png" for v in range(0, 9, 2) for u in range(0, 9, 4)], (5, 3)),
        ([f"v{v:02d}_u{u:02d}.png" for v in range(1, 9, 3) for u in range(0, 9, 2)], (3, 5)),
        ([f"shot {2 * k + 1}.png" for k in range(25)], (5, 5)),
    ],
)
def test_views_at_regular_gaps_are_a_smaller_grid(tmp_path, names, grid) -> None:
    assert open_light_field(write_flat(tmp_path, names)).grid == grid


def test_a_given_grid_opens_pictures_under_any_names(tmp_path) -> None:
    write_flat(tmp_path, [f"shot {n} of {n % 5}{n}.png" for n in (1, 2, 5, 9, 10, 17)])
    with pytest.raises(InputError, match="holds no light field"):
        open_light_field(tmp_path)
    scene = open_light_field(tmp_path, Arrangement(grid=GridShape(2, 3)))
    assert [view.path.stem.split()[1] for view in scene.views] == ["1", "2", "5", "9", "10", "17"]
    assert scene.views[3].place == (1, 0)


def test_maps_of_places_and_truth_before_estimates(tmp_path) -> None:
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


def test_missing_odd_and_damaged_views_are_named(tmp_path) -> None:
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


def write_archive(folder: Path, positions: dict[tuple[int, int], tuple[float, float]]) -> MultiView:
    """Write and read a Stanford folder. positions: (y, x) by (row, column)."""
    names = {
        f"out_{row:02d}_{column:02d}_{y:.6f}_{x:.6f}_.png": ViewOffset(0, 0)
        for (row, column), (y, x) in positions.items()
    }
    write_numbered(folder, names)
    return scene_of(folder)


def offsets_by_index(scene: MultiView) -> dict[tuple[int, int], np.ndarray]:
    """Viewpoints (t, s) from that of row 0 and column 0, by row and column in the names."""
    by_index = {tuple(map(int, view.path.stem.split("_")[1:3])): np.array(view.offset) for view in scene.views}
    return {index: offset - by_index[0, 0] for index, offset in by_index.items()}


@pytest.mark.parametrize(("rows", "columns", "step"), [(3, 3, 20.0), (3, 1, 45.0), (1, 3, 20.0)])
def test_a_step_of_stanford_is_the_spacing_of_columns_else_of_rows(tmp_path, rows, columns, step) -> None:
    positions = {at: (300 + 45.0 * at[0], -700 + 20.0 * at[1]) for at in np.ndindex(rows, columns)}
    scene = write_archive(tmp_path, positions)
    assert scene.grid == GridShape(rows, columns)
    for at, offset in offsets_by_index(scene).items():
        np.testing.assert_allclose(offset, np.subtract(positions[at], positions[0, 0]) / step)
    assert scene.notes == ("Viewpoints from the names.",)
    every_second = write_archive(tmp_path / "thin", {at: positions[at] for at in positions if not any(np.mod(at, 2))})
    places = np.array(view_offsets(every_second))
    assert np.ptp(places, axis=0)[1 if columns > 1 else 0] == pytest.approx(1), "in steps of the views that are there"


@pytest.mark.parametrize(
    ("kind", "count", "truths", "extension", "width", "factor"),
    [
        ("im", 9, (2, 6), ".png", 450, 4.0),  # 2003, quarter size
        ("im", 9, (2, 6), ".ppm", 434, 8.0),  # 2001
        ("view", 7, (1, 5), ".png", 463, 3.0),  # 2005, third size
    ],
)
def test_middlebury_rows_store_four_steps_times_a_factor(
    tmp_path, kind, count, truths, extension, width, factor
) -> None:
    for n in range(count):
        write_picture(tmp_path / f"{kind}{n}{extension}", np.zeros((4, width, 3), np.uint8))
    for n in truths:
        stored = np.full((4, width), 120, np.uint8)
        stored[0, 0] = 0  # unknown
        write_picture(tmp_path / f"disp{n}.png", stored)
    scene = scene_of(tmp_path)
    assert [view.offset.s for view in scene.views] == list(range(count))
    assert list(scene.disparity) == list(truths)
    for known in scene.disparity.values():
        values = read_disparity(known.path, ImageSize(4, width), known.scale).values
        np.testing.assert_allclose(values, 120 / factor / 4, rtol=1e-5)


def test_llff_counts_in_steps_between_neighbours_across_the_viewing_direction(tmp_path) -> None:
    """Cameras are half a unit apart and some nearer; bounds are depths, so disparity is focal length x step / depth."""
    write_numbered(tmp_path / "images", {f"IMG_{n}.png": ViewOffset(0, n) for n in range(3)}, (HEIGHT, WIDTH))
    down, right, back = np.eye(3)[[1, 0, 2]] * [[1], [1], [-1]]
    places = [(-0.5, 0.0, 0.3), (0.0, 0.0, 0.0), (0.0, 0.5, 0.1)]
    poses = [np.column_stack([down, right, back, place, [HEIGHT, WIDTH, 50]]).ravel() for place in places]
    np.save(tmp_path / "poses_bounds.npy", np.array([[*pose, 5.0, 40.0] for pose in poses]))
    scene = open_light_field(tmp_path)
    np.testing.assert_allclose([view.offset for view in scene.views], [(0, -1), (0, 0), (1, 0)], atol=1e-12)
    assert scene.range_px == pytest.approx((50 * 0.5 / 40, 50 * 0.5 / 5))
    assert scene.focal_px == 50
    assert "up to 0.6 view steps before or behind" in scene.notes[0]
    with pytest.raises(InputError, match="only an evaluation reads them"):
        grid_of(scene)
