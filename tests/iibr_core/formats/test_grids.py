from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.light_field_formats import find_light_field, open_light_field
from iibr_core.formats.light_fields.order import Arrangement, grid_of
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.scenes.light_fields import find_disparity
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, InputError, ViewOffset
from tests.iibr_core.evaluation.test_scenes import offset_by_file
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
