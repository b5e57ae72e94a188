"""The depth of stereo photos, from their two views."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.depth.stereo_pair import estimate_from_pair
from iibr_core.types import InputError, ViewOffset
from tests.iibr_core.formats.test_view_files import leia_image
from tests.iibr_core.known_scenes import view_of_wall

DISPARITY = 2.0


def eye(s: float) -> np.ndarray:
    return np.rint(view_of_wall(ViewOffset(0, s), DISPARITY, (60, 80)) * 255).astype(np.uint8)


def test_a_pair_side_by_side_tells_the_disparity_from_eye_to_eye(tmp_path: Path) -> None:
    path = tmp_path / "wall_SBS.png"
    Image.fromarray(np.hstack([eye(0), eye(1)])).save(path)
    found = estimate_from_pair(path)
    assert found is not None
    assert found[1] == "side-by-side stereo"
    assert found[0].values.shape == (60, 80)
    assert np.median(np.abs(found[0].values - DISPARITY)) < 0.25  # a smooth wall, half a pixel a step


def test_files_without_a_pair_or_that_show_another_picture_tell_nothing(tmp_path: Path) -> None:
    Image.fromarray(eye(0)).save(tmp_path / "a.png")
    assert estimate_from_pair(tmp_path / "a.png") is None
    (tmp_path / "a.lif").write_bytes(leia_image(eye(0), eye(1)).replace(b'"blob_id": -1', b'"blob_id": 10'))
    assert estimate_from_pair(tmp_path / "a.lif") is None


def test_views_of_two_shapes_are_refused(tmp_path: Path) -> None:
    narrow = Image.fromarray(eye(1)[:, :50])
    Image.fromarray(eye(0)).save(tmp_path / "a.mpo", "MPO", save_all=True, append_images=[narrow])
    with pytest.raises(InputError, match=r"a\.mpo: .*80x60 and 50x60"):
        estimate_from_pair(tmp_path / "a.mpo")
