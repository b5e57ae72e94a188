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
