"""Folders: which are of photos, and which photos lie in them."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.exports.photo_folder import first_photo, list_photos
from iibr_core.formats.images.write import write_image

GREY = np.full((4, 6, 3), 100, np.uint8)


def test_maps_hidden_files_and_others_are_no_photos(tmp_path: Path) -> None:
    for name in ("b.JPG", "a.png", "a_disparity.png", "a_depth.exr", "b_depth.jpg", ".c.png", "d.txt", "low_depth.jpg"):
        (tmp_path / name).write_bytes(b"-")
    (tmp_path / "folder.jpg").mkdir()
    assert {photo.name for photo in list_photos(str(tmp_path))} == {"b.JPG", "a.png", "low_depth.jpg"}
    assert list_photos(str(tmp_path / "gone")) == ()


def test_what_was_saved_or_exported_of_a_photo_is_none_of_its_folder(tmp_path: Path) -> None:
    made = ("a-iibr.png", "a-quilt_qs8x6a1.482.png", "a-sbs_2x1.png", "a-rgbd.jpg", "a-b-anaglyph.jpg")
    kept = ("a.jpg", "a-b.png", "gone-iibr.png", "a-iibre.png", "a-quilted.png", "iibr-quilt.png", "-iibr.png")
    for name in (*made, *kept):
        (tmp_path / name).write_bytes(b"-")
    assert {photo.name for photo in list_photos(str(tmp_path))} == set(kept)


@pytest.mark.parametrize("inside", ["", "views"])
def test_a_light_field_is_no_folder_of_photos_also_in_views(tmp_path: Path, inside: str) -> None:
    assert first_photo(tmp_path) is None
    (tmp_path / inside).mkdir(exist_ok=True)
    for v, u in np.ndindex(2, 2):
        write_image(tmp_path / inside / f"v{v:02d}_u{u:02d}.png", GREY)
    assert first_photo(tmp_path) is None


@pytest.mark.parametrize("names", [[f"DSC_{i:04d}.jpg" for i in range(4)], ["beach.png", "sea.png", "view.png"]])
def test_pictures_of_a_camera_and_others_that_are_no_grid_are_photos(tmp_path: Path, names: list[str]) -> None:
    for name in names:
        Image.fromarray(GREY).save(tmp_path / name)
    assert first_photo(tmp_path) == tmp_path / names[0]
