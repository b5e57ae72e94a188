"""Folders of pictures with cameras, opened as light fields."""

import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.cameras import FieldCameras, write_llff, write_nerfstudio
from iibr_core.formats.colmap import write_colmap
from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset

SIZE = ImageSize(12, 16)
GRID = GridShape(2, 3)
OFFSETS = {f"v{v:02d}_u{u:02d}.png": GRID.offset(v, u) for v, u in np.ndindex(*GRID)}


def write_scene(
    folder: Path, kind: str, offsets: dict[str, ViewOffset], at_infinity: float = 0.0, orientation: int = 1
) -> Path:
    """Write pictures and their cameras."""
    (folder / "images").mkdir(parents=True)
    exif = Image.Exif()
    exif[0x0112] = orientation
    for name in offsets:
        Image.new("RGB", SIZE[::-1]).save(folder / "images" / name, exif=exif)
    cameras = FieldCameras(GRID, SIZE, 20.0, (1.0, 4.0), at_infinity)
    if kind == "COLMAP":
        write_colmap(folder, cameras, offsets, np.zeros((0, 3), np.float32), np.zeros((0, 3), np.uint8))
    else:
        (write_llff if kind == "LLFF" else write_nerfstudio)(folder, cameras, offsets)
    return folder


def turn_world(folder: Path) -> None:
    """Give transforms.json another world: turned, moved and larger."""
    half = np.sqrt(0.5)
    turn = np.array([[half, 0, half], [0.5, half, -0.5], [-0.5, half, 0.5]])
    content = json.loads((folder / "transforms.json").read_text())
    for frame in content["frames"]:
        matrix = np.array(frame["transform_matrix"])
        matrix[:3] = turn @ matrix[:3]
        matrix[:3, 3] = 3 * matrix[:3, 3] + (5, -2, 1)
        frame["transform_matrix"] = matrix.tolist()
    (folder / "transforms.json").write_text(json.dumps(content))


@pytest.mark.parametrize("kind", ["LLFF", "nerfstudio", "COLMAP"])
@pytest.mark.parametrize("row_step", [1.0, 0.4, 2.5])
def test_cameras_on_a_grid_are_a_light_field(tmp_path, kind, row_step) -> None:
    """Whatever the order of names; rows may lie closer than columns or farther apart."""
    offsets = {f"{9 - k}.png": ViewOffset(row_step * t, s) for k, (t, s) in enumerate(OFFSETS.values())}
    scene = open_light_field(write_scene(tmp_path / "scene", kind, offsets))
    assert (scene.name, scene.layout, scene.grid, scene.focal_px) == ("scene", f"{kind}, 3x2", (2, 3), 20.0)
    assert scene.infinity_px == 0
    assert scene.range_px == (pytest.approx((1, 4)) if kind == "LLFF" else None)
    assert {view.path.name: view.offset.s - scene.views[0].offset.s for view in scene.views} == pytest.approx(
        {name: offset.s - offsets[scene.views[0].path.name].s for name, offset in offsets.items()}
    )
    assert {view.path.name: view.offset.t - scene.views[0].offset.t for view in scene.views} == pytest.approx(
        {name: offset.t - offsets[scene.views[0].path.name].t for name, offset in offsets.items()}
    )
    places = {view.path.name: view.place for view in scene.views}
    assert [places[f"{9 - k}.png"] for k in range(6)] == list(np.ndindex(*GRID))
    if kind != "LLFF":
        other = write_scene(tmp_path / "other", kind, OFFSETS, -1.5)
        assert open_light_field(other).infinity_px == -1.5, "principal points that move give it"
        (other / "images" / "v01_u02.png").unlink()
        with pytest.raises(InputError, match=r"the picture \S*v01_u02.png of a camera is missing"):
            open_light_field(other)


def test_worlds_may_be_turned_and_cameras_stand_a_little_off(tmp_path) -> None:
    jittered = {name: ViewOffset(t, s + 0.02 * (-1) ** k) for k, (name, (t, s)) in enumerate(OFFSETS.items())}
    folder = write_scene(tmp_path / "scene", "nerfstudio", jittered)
    turn_world(folder)
    scene = open_light_field(folder)
    assert scene.grid == GRID
    assert [view.place for view in scene.views] == list(np.ndindex(*GRID))
    assert scene.views[1].offset.s - scene.views[0].offset.s == pytest.approx(0.96, abs=0.02), "as they stand"


def test_turned_pictures_have_turned_viewpoints(tmp_path) -> None:
    """What such a picture stores to the right is shown below."""
    offsets = {name.replace("png", "jpg"): at for name, at in OFFSETS.items()}
    scene = open_light_field(write_scene(tmp_path / "scene", "nerfstudio", offsets, orientation=6))
    assert (scene.grid, scene.layout) == ((3, 2), "nerfstudio, 2x3")
    for view, (v, u) in zip(scene.views, np.ndindex(*GRID)):
        assert view.place == (u, 1 - v)
        assert np.subtract(view.offset, scene.views[0].offset) == pytest.approx((u, -v))


TURNED = [[0.995, 0, 0.0998, 0], [0, 1, 0, 0], [-0.0998, 0, 0.995, 0], [0, 0, 0, 1]]
OFF_COLUMN, NEARER = np.eye(4), np.eye(4)
OFF_COLUMN[0, 3] = NEARER[2, 3] = 0.05


@pytest.mark.parametrize("change", [TURNED, OFF_COLUMN, NEARER], ids=["turned", "off its column", "nearer"])
def test_other_cameras_make_no_light_field(tmp_path, change) -> None:
    folder = write_scene(tmp_path / "scene", "nerfstudio", OFFSETS)
    content = json.loads((folder / "transforms.json").read_text())
    content["frames"][1]["transform_matrix"] = (np.array(content["frames"][1]["transform_matrix"]) @ change).tolist()
    (folder / "transforms.json").write_text(json.dumps(content))
    with pytest.raises(
        InputError, match=r"its 6 cameras do not look the same way from a regular grid.*give them as poses"
    ):
        open_light_field(folder)


def test_the_folder_with_a_picture_for_each_pose_counts(tmp_path) -> None:
    folder = write_scene(tmp_path / "scene", "LLFF", OFFSETS)
    (folder / "images_8").mkdir()
    for name in sorted(OFFSETS)[:2]:
        write_image(folder / "images_8" / name, np.zeros((6, 8, 3), np.float32))
    assert open_light_field(folder).notes == ("Pictures from images.",)
    (folder / "images" / "v00_u00.png").unlink()
    with pytest.raises(InputError, match="6 poses for 2 pictures in images_8 and 5 pictures in images"):
        open_light_field(folder)


@pytest.mark.parametrize("name", ["../other.png", "/etc/passwd", "C:\\a.png", "", "a" * 300, "a\0.png"])
def test_a_picture_elsewhere_is_never_opened(tmp_path, name) -> None:
    folder = write_scene(tmp_path / "scene", "nerfstudio", OFFSETS)
    write_image(tmp_path / "other.png", np.zeros((*SIZE, 3), np.float32))
    content = json.loads((folder / "transforms.json").read_text())
    content["frames"][1]["file_path"] = name
    (folder / "transforms.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match=r"of a camera (does not lie in this folder|is missing)"):
        open_light_field(folder)
