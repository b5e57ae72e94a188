"""Spatial photos, read by pillow-heif: two pictures, a pair, each with its camera."""

from pathlib import Path

import numpy as np
import pillow_heif
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.spatial_photo import write_spatial_photo
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from tests.iibr_core.exports.conftest import exported


def test_both_pictures_are_what_the_renderer_shows(source: ExportSource, tmp_path: Path) -> None:
    path = exported(source, "spatial-photo", tmp_path / "a.heic")
    file = pillow_heif.open_heif(path)
    assert (len(file), file.primary_index) == (2, 0)
    for picture, s in zip(file, (-1.0, 1.0)):
        expected = source.draw(RenderSettings(Optics(eye=ViewOffset(0.0, s)), ScreenSize(96, 64))).astype(int)
        assert np.abs(np.asarray(picture).astype(int) - expected).mean() < 3
    assert read_photo(path).size == (64, 96), "as an ordinary photo it is the left picture"


def test_libheif_knows_the_pair_and_its_cameras(tmp_path: Path) -> None:
    pytest.importorskip("pillow_heif", minversion="1.8")
    eye = np.zeros((64, 96, 3), np.uint8)
    write_spatial_photo(tmp_path / "a.heic", eye, eye, focal_px=90.0)
    file = pillow_heif.open_heif(tmp_path / "a.heic")
    (pair,) = file.info["entity_groups"]
    assert (pair["type"], pair["images"]) == ("ster", [0, 1])
    for picture in file:
        camera = picture.info["heif"]["camera_intrinsic_matrix"]
        assert camera["focal_length_x"] == pytest.approx(90)
        assert (camera["principal_point_x"], camera["principal_point_y"]) == (48, 32)
