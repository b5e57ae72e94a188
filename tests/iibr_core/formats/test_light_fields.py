"""One way in and one way out for every layout: what one part of the program opens, all open."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.evaluation.datasets import read_known_disparity, read_scene
from iibr_core.formats.images.photo import write_image
from iibr_core.formats.light_fields.hci import HciWriter
from iibr_core.formats.light_fields.light_field_formats import (
    READERS,
    WRITERS,
    WriterFactory,
    find_light_field,
    open_light_field,
    writer_for,
)
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.light_fields.views import disparity_range, grid_of, read_stored_view, read_views, step_length
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset, ViewUpdate
from tests.iibr_core.known_scenes import (
    HEIGHT,
    WIDTH,
    disparity_of_square,
    offsets_of,
    view_of_wall,
    write_grid,
    write_hci,
    write_llff_row,
    write_numbered,
    write_stanford,
    write_stereo_pair,
)

Write = Callable[[Path], Path]

LAYOUTS: dict[str, tuple[Write, str, GridShape | None]] = {
    "hci": (lambda to: write_hci(to, 3, 5), "HCI 4D light field, 5x3", GridShape(3, 5)),
    "views": (write_grid, "grid folder, 3x3", GridShape(3, 3)),
    "heber": (
        lambda to: write_numbered(to, {f"lf_{v}_{u}.png": at for (v, u), at in offsets_of(11, 11).items()}),
        "Pov-ray (Heber), 11x11",
        GridShape(11, 11),
    ),
    "stanford": (lambda to: write_stanford(to, 2, 3), "Stanford archive, 3x2", GridShape(2, 3)),
    "middlebury": (write_stereo_pair, "Middlebury pair", GridShape(1, 2)),
    "llff": (write_llff_row, "LLFF, 3 photos", None),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_every_layout_opens_through_one_function_for_viewer_and_evaluation(tmp_path: Path, name: str) -> None:
    write, layout, grid = LAYOUTS[name]
    folder = write(tmp_path / "scene")
    scene, judged = open_light_field(folder), read_scene(folder)
    assert judged is not None
    assert (scene.name, scene.layout, scene.grid) == ("scene", layout, grid)
    assert [view.path for view in scene.views] == [view.path for view in judged.views]
    if grid is not None:
        size, views = read_views(scene)
        found = {(view.row, view.column): view for view in views}
        assert sorted(found) == list(np.ndindex(*grid))
        for (row, column), view in found.items():
            assert view.colors.shape == (*size, 3)
            np.testing.assert_array_equal(view.colors, read_stored_view(scene, row, column))
        assert sum(view.disparity is not None for view in found.values()) == len(scene.disparity)


@pytest.mark.parametrize("entry", [*READERS, *WRITERS.values()])
def test_entries_name_files_of_the_folder(entry: str) -> None:
    from iibr_core.formats.light_fields import light_field_formats

    assert callable(light_field_formats._resolve(entry))


def test_views_of_no_grid_are_refused_by_saying_what_reads_them(tmp_path: Path) -> None:
    scene = open_light_field(write_llff_row(tmp_path / "fern"))
    for refused in (grid_of, read_views, disparity_range, lambda scene: read_stored_view(scene, 0, 0)):
        with pytest.raises(InputError, match=r"fern.*no regular grid.*`iibr evaluate` reads them") as caught:
            refused(scene)
        assert "\n" not in str(caught.value)


def test_llff_counts_in_steps_between_neighbours_across_the_viewing_direction(tmp_path: Path) -> None:
    """Half a unit apart and some of them nearer; bounds are depths, so disparity is focal length x step / depth."""
    folder = tmp_path / "fern"
    write_numbered(folder / "images", {f"IMG_{n}.png": ViewOffset(0, n) for n in range(3)}, (HEIGHT, WIDTH))
    down, right, back = np.eye(3)[[1, 0, 2]] * [[1], [1], [-1]]
    places = [(-0.5, 0.0, 0.3), (0.0, 0.0, 0.0), (0.0, 0.5, 0.1)]
    poses = [np.column_stack([down, right, back, place, [HEIGHT, WIDTH, 50]]).ravel() for place in places]
    np.save(folder / "poses_bounds.npy", np.array([[*pose, 5.0, 40.0] for pose in poses]))
    scene = open_light_field(folder)
    found = [(view.offset.t, view.offset.s) for view in scene.views]
    np.testing.assert_allclose(found, [(0, -1), (0, 0), (1, 0)], atol=1e-12)
    assert scene.range_px == pytest.approx((50 * 0.5 / 40, 50 * 0.5 / 5))
    assert scene.focal_px == 50
    assert any("up to 0.6 view steps before or behind" in note for note in scene.notes)


def test_where_stanford_s_positions_tell_nothing_rows_go_upwards(tmp_path: Path) -> None:
    names = {f"out_{row:02d}_{column:02d}_0_0.png": ViewOffset(-row, column) for row, column in np.ndindex(2, 3)}
    scene = open_light_field(write_numbered(tmp_path / "lego", names))
    assert {view.path.stem[:9]: view.place for view in scene.views}["out_01_02"] == (0, 2)
    steps = {view.path.stem[:9]: view.offset for view in scene.views}
    first, last = steps["out_00_00"], steps["out_01_02"]
    assert (last.t - first.t, last.s - first.s) == (-1, 2)
    assert any("positions are not told" in note for note in scene.notes)


def test_a_folder_that_no_reader_knows(tmp_path: Path) -> None:
    assert find_light_field(tmp_path) is None
    with pytest.raises(InputError, match="no photos in it"):
        open_light_field(tmp_path)
    (tmp_path / "photo.png").touch()
    with pytest.raises(InputError, match=r"holds no light field; laid out as HCI, Stanford"):
        open_light_field(tmp_path)
    with pytest.raises(InputError, match="is empty"):
        open_light_field(tmp_path / "photo.png")


def test_rows_of_stanford_count_upwards_on_disk_and_downwards_here(tmp_path: Path) -> None:
    scene = open_light_field(write_stanford(tmp_path / "lego", 3, 4))
    places = {view.path.stem[:9]: view.place for view in scene.views}
    assert places["out_02_00"] == (0, 0)
    assert places["out_00_03"] == (2, 3)
    assert step_length(scene) == pytest.approx(1)
    assert "Viewpoints from the names." in scene.notes, "no stray of 0.00"
    dark = {view.path.stem[:9]: read_stored_view(scene, *view.place).mean() for view in scene.views if view.place}
    assert dark["out_00_00"] < dark["out_00_01"] < dark["out_02_00"]


@pytest.mark.parametrize(
    ("kept", "grid"),
    [
        ([(0, 0), (0, 2), (2, 0), (2, 2)], GridShape(2, 2)),  # every second view
        ([(3, 7), (3, 8)], GridShape(1, 2)),
        ([(0, 0), (0, 1), (1, 0)], None),  # a gap
        ([(0, 0), (0, 1), (0, 5)], None),  # uneven
    ],
)
def test_stanford_names_that_fill_a_grid_and_that_do_not(
    tmp_path: Path, kept: list[tuple[int, int]], grid: GridShape | None
) -> None:
    folder = write_numbered(tmp_path, {f"out_{v:02d}_{u:02d}_{v}.0_{u}.0.png": ViewOffset(v, u) for v, u in kept})
    scene = read_scene(folder)
    assert scene is not None
    assert scene.grid == grid
    assert (scene.views[0].place is None) == (grid is None)


def test_the_steps_of_the_grid_count_where_views_were_left_out(tmp_path: Path) -> None:
    """Two views of seven: their maps hold px from one to the next, as many as four times a step of the data set."""
    for n in (1, 5):
        write_image(tmp_path / f"view{n}.png", np.full((4, 463, 3), n / 9, np.float32))
        write_image(tmp_path / f"disp{n}.png", np.full((4, 463), 120, np.uint8))
    scene = open_light_field(tmp_path)
    assert (scene.grid, step_length(scene)) == ((1, 2), 4)
    assert read_known_disparity(scene.disparity[0], ImageSize(4, 463)).values.max() == pytest.approx(10)
    _, views = read_views(scene)
    for view in views:
        assert view.disparity is not None
        np.testing.assert_allclose(view.disparity, 40, rtol=1e-5)
    assert disparity_range(scene) == pytest.approx((40, 40))


def test_the_range_is_stated_or_that_of_the_map_nearest_to_the_centre(tmp_path: Path) -> None:
    folder = write_grid(tmp_path / "scene", 5)
    truth = folder / "gt_disp_u02_v02.npy"
    assert disparity_range(open_light_field(folder)) == (0.5, 2.0)
    truth.unlink()
    assert disparity_range(open_light_field(folder)) is None
    np.save(folder / "gt_disp_u00_v00.npy", 2 * disparity_of_square())
    np.save(folder / "gt_disp_u03_v02.npy", 3 * disparity_of_square())
    assert disparity_range(open_light_field(folder)) == (1.5, 6.0)
    (folder / "parameters.cfg").write_text("[meta]\ndisp_min = -1\ndisp_max = 7\n")
    assert disparity_range(open_light_field(folder)) == (-1, 7)


def test_of_a_view_in_two_kinds_one_is_taken(tmp_path: Path) -> None:
    folder = write_hci(tmp_path / "field")
    write_image(folder / "input_Cam003.exr", np.ones((5, 5, 3), np.float32))
    scene = open_light_field(folder)
    assert len(scene.views) == 9
    assert not scene.is_hdr
    write_image(folder / "input_Cam03.png", np.ones((5, 5, 3), np.float32))
    with pytest.raises(InputError, match=r"shows the same view as input_Cam0"):
        open_light_field(folder)


@pytest.mark.parametrize("first", [0, 1])
def test_hci_names_may_count_from_one_and_lie_in_a_subfolder(tmp_path: Path, first: int) -> None:
    names = {f"input_Cam{k + first:03d}.png": at for k, at in enumerate(offsets_of(2, 2).values())}
    write_numbered(tmp_path / "views", names)
    scene = open_light_field(tmp_path)
    assert (scene.grid, [view.path.name for view in scene.views]) == ((2, 2), list(names))


def test_truth_goes_before_an_estimate(tmp_path: Path) -> None:
    folder = write_hci(tmp_path / "field")
    write_pfm(folder / "disp_Cam002.pfm", disparity_of_square())
    assert [known.is_truth for _, known in sorted(open_light_field(folder).disparity.items())] == [False, True]
    write_pfm(folder / "gt_disp_lowres_Cam002.pfm", disparity_of_square())
    assert open_light_field(folder).disparity[2].is_truth


def written(scene: MultiView) -> list[ViewUpdate]:
    return sorted(read_views(scene)[1], key=lambda view: (view.row, view.column))


@pytest.mark.parametrize("layout", ["hci", "numbered-grid"])
def test_what_says_all_of_a_field_is_read_again(tmp_path: Path, layout: str) -> None:
    """Any order in, the same views out; whole or not at all."""
    original = open_light_field(write_grid(tmp_path / "original"))
    with writer_for(layout)(tmp_path / "copy", GridShape(3, 3), 60.0, "copy", True) as writer:
        for view in read_views(original)[1]:
            writer.add(view)
    copy = open_light_field(tmp_path / "copy")
    assert copy.focal_px == pytest.approx(60)
    for ours, theirs in zip(written(copy), written(original)):
        np.testing.assert_array_equal(ours.colors, theirs.colors)
    assert disparity_range(copy) == disparity_range(original)
    with pytest.raises(KeyboardInterrupt), writer_for(layout)(tmp_path / "half", GridShape(3, 3), 60.0, "", True):
        raise KeyboardInterrupt
    assert sorted(path.name for path in tmp_path.iterdir()) == ["copy", "original"]


def test_a_layout_that_none_writes_is_refused_by_those_there_are() -> None:
    with pytest.raises(InputError, match=r"'mp4' is not a layout that can be written: give hci"):
        writer_for("mp4")
    expected: WriterFactory = HciWriter
    assert writer_for("hci") is expected


def test_columns_of_stanford_go_where_the_camera_went(tmp_path: Path) -> None:
    """In some scenes leftwards: positions say so, as they say how far off the grid a camera stands."""
    names = {
        f"out_{row:02d}_{column:02d}_{-400 - 30.0 * row + 3 * column}_{1100 - 30.0 * column}_.png": ViewOffset(
            -float(row), -float(column)
        )
        for row, column in np.ndindex(3, 3)
    }
    scene = open_light_field(write_numbered(tmp_path / "knights", names))
    places = {view.path.stem[:9]: (view.place, view.offset) for view in scene.views}
    assert places["out_00_00"][0] == (2, 2)
    assert places["out_02_02"][0] == (0, 0)
    first, last = (places[f"out_{k:02d}_{k:02d}"][1] for k in (0, 2))
    assert (last.s - first.s, last.t - first.t) == pytest.approx((-2, -1.8))
    assert any("stand up to 0.10 view steps off" in note for note in scene.notes)


@pytest.mark.parametrize(("rows", "columns", "step"), [(3, 3, 20.0), (3, 1, 45.0), (1, 3, 20.0)])
def test_a_step_of_stanford_is_from_column_to_column_of_one_column_from_row_to_row(
    tmp_path: Path, rows: int, columns: int, step: float
) -> None:
    """Rows may stand farther apart; that is no stray."""
    places = {at: (300 + 45.0 * at[0], -700 + 20.0 * at[1]) for at in np.ndindex(rows, columns)}
    names = {
        f"out_{row:02d}_{column:02d}_{y}_{x}.png": ViewOffset(y / step, x / step)
        for (row, column), (y, x) in places.items()
    }
    scene = read_scene(write_numbered(tmp_path / "wide", names))
    assert scene is not None
    assert scene.grid == GridShape(rows, columns)
    found = {view.path.stem[:9]: view.offset for view in scene.views}
    for (row, column), (y, x) in places.items():
        offset, first = found[f"out_{row:02d}_{column:02d}"], found["out_00_00"]
        assert (offset.t - first.t, offset.s - first.s) == pytest.approx(((y - 300) / step, (x + 700) / step))
    assert "Viewpoints from the names." in scene.notes


def write_rendered(folder: Path, config: str = "", focal_mm: float = 50.0) -> Path:
    """As light-field-renderer's exporter for Blender has it: rows upwards, columns to the left, v written as -v."""
    step = 20.0
    names = {
        f"Camera_{j:02d}_{i:02d}_{-(j - 1) * step:f}_{(1 - i) * step:f}_{focal_mm:g}_36.png": ViewOffset(
            -float(j - 1), float(1 - i)
        )
        for j, i in np.ndindex(3, 3)
    }
    write_numbered(folder, names, (HEIGHT, WIDTH))
    if config:
        (folder / "config.cfg").write_text(config, "utf-8")
    return folder


def test_light_field_renderers_names_and_config(tmp_path: Path) -> None:
    config = "\ufefffocus-distance 2 1.0 8.0\nfocal-length 50 10 100\n"
    scene = open_light_field(write_rendered(tmp_path / "shop", config))
    assert (scene.layout, scene.grid) == ("light-field-renderer, 3x3", GridShape(3, 3))
    focal_px = 50 / 36 * WIDTH
    assert scene.focal_px == pytest.approx(focal_px)
    assert scene.range_px == pytest.approx((focal_px * 0.02 / 8, focal_px * 0.02))
    for view in written(scene):
        t, s = GridShape(3, 3).offset(view.row, view.column)
        expected = np.rint(view_of_wall(ViewOffset(t, s)) * 255)
        np.testing.assert_array_equal(view.colors, expected)


@pytest.mark.parametrize("line", ["focus-distance", "focus-distance 1 5 2", "focus-distance a b c"])
def test_a_config_that_makes_no_sense(tmp_path: Path, line: str) -> None:
    with pytest.raises(InputError, match=r"config\.cfg: focus-distance.*least and a greatest"):
        open_light_field(write_rendered(tmp_path, f"{line}\n"))


def test_names_with_no_focal_length(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="focal length of 0 mm; correct the names"):
        open_light_field(write_rendered(tmp_path, focal_mm=0.0))


def test_jpeg_pleno_counts_columns_first(tmp_path: Path) -> None:
    for row, column in np.ndindex(3, 4):
        pixels = np.rint(view_of_wall(ViewOffset(row, column), size=(8, 8)) * 255).astype(np.uint8)
        Image.fromarray(pixels).save(tmp_path / f"{column + 1:03d}_{row + 1:03d}.ppm")
    scene = open_light_field(tmp_path)
    assert scene.grid == GridShape(3, 4)
    assert {view.path.stem for view in scene.views if view.place == (2, 0)} == {"001_003"}
    (tmp_path / "002_001.ppm").unlink()
    with pytest.raises(InputError, match="row 0, column 1 is missing"):
        open_light_field(tmp_path)


def test_stanford_of_1996(tmp_path: Path) -> None:
    for u, v in np.ndindex(3, 2):
        pixels = np.full((4, 5, 3), 10 * u + 100 * v, np.uint8)
        Image.fromarray(pixels).save(tmp_path / f"dragon.{u}.{v}.rgb", "SGI")
    (tmp_path / "dragon.lid").write_text("# LIF1.0\n")
    found = {(view.row, view.column): int(view.colors.mean()) for view in written(open_light_field(tmp_path))}
    assert found == {(0, 0): 100, (0, 1): 110, (0, 2): 120, (1, 0): 0, (1, 1): 10, (1, 2): 20}
    Image.fromarray(pixels).save(tmp_path / "buddha.0.0.rgb", "SGI")
    with pytest.raises(InputError, match=r"2 slabs \(buddha, dragon\)"):
        open_light_field(tmp_path)


def test_a_grid_of_15x15_numbered_from_one(tmp_path: Path) -> None:
    names = {f"{k + 1:03d}.png": at for k, at in enumerate(offsets_of(15, 15).values())}
    scene = open_light_field(write_numbered(tmp_path, names, (4, 4)))
    assert (scene.grid, scene.views[16].place) == (GridShape(15, 15), (1, 1))


def test_views_of_two_depths_of_colour_and_two_grids_in_a_folder(tmp_path: Path) -> None:
    folder = write_grid(tmp_path / "depths")
    deep = np.full((HEIGHT, WIDTH, 3), 40_000, np.uint16)
    import cv2

    cv2.imwrite(str(folder / "views" / "v00_u00.png"), deep)
    assert {view.colors.dtype for view in written(open_light_field(folder))} == {np.dtype(np.uint8)}
    two = write_hci(tmp_path / "two")
    write_numbered(two, {f"v{v:02d}_u{u:02d}.png": at for (v, u), at in offsets_of(2, 2).items()})
    assert open_light_field(two).grid == GridShape(3, 3)
    mixed = write_numbered(tmp_path / "mixed", {f"a_{k}.png": ViewOffset(0.0, 0.0) for k in range(4)})
    write_numbered(mixed, {f"b_{k}_{k}.png": ViewOffset(0.0, 0.0) for k in range(3)})
    with pytest.raises(InputError, match="holds no light field"):
        open_light_field(mixed)


@pytest.mark.parametrize("count", [4, 9, 16, 25])
def test_a_few_numbered_photos_are_no_light_field(tmp_path: Path, count: int) -> None:
    write_numbered(tmp_path, {f"beach {n + 1}.png": ViewOffset(0, n) for n in range(count)}, (4, 4))
    with pytest.raises(InputError, match="holds no light field"):
        open_light_field(tmp_path)
