"""Exports that are refused or stopped: each leaves nothing; and depths at the edge of what can be written."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from iibr_core.exports.cameras import cameras_of
from iibr_core.exports.kinds import EXPORTS, require_export_place
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError, ViewUpdate
from tests.iibr_core.exports.conftest import exported, with_metres

ODD = ScreenSize(97, 65)
REFUSED: dict[str, tuple[str, str, dict[str, Any], dict[str, Any]]] = {
    "too much for a common frame": ("sbs", "a.png", {"focus_disparity": 30.0}, {}),
    "a closed lens blurs nothing": ("blur", "a.exr", {}, {}),
    "rows 0 to 63": ("epi", "a.png", {}, {"row": 64}),
    "8 or 16": ("focal-stack", "a", {}, {"frames": 2, "bits": 12}),
    "width and height must be even, not 97x65; give 96x64": ("webm", "a.webm", {}, {"size": ODD}),
    "give 96x64": ("spatial-photo", "a.heic", {}, {"size": ODD}),
    "96,0: lies outside the picture": ("matte", "a.png", {}, {"at": (96.0, 0.0)}),
    "which surface": ("matte", "a.tif", {}, {}),
    "'tv' is not a known display: give go, portrait": ("quilt", "a.png", {}, {"device": "tv"}),
    "can be written as .png, .jpg": ("rgbd", "a.gif", {}, {}),
    "a name with _depth means depth": ("disparity", "a_depth.pfm", {}, {}),
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_cannot_be_written_is_refused_in_one_line(source, tmp_path, message) -> None:
    kind, name, optics, options = REFUSED[message]
    with pytest.raises(InputError, match=message) as error:
        exported(source, kind, tmp_path / name, optics, **options)
    assert "\n" not in str(error.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", [name for name, kind in EXPORTS.items() if kind.endings])
def test_a_file_of_another_ending_is_refused(tmp_path, name) -> None:
    kind = EXPORTS[name]
    for ending in kind.endings:
        require_export_place(kind, tmp_path / f"a{ending.upper() if len(ending) < 6 else ending}", (), False)
    with pytest.raises(InputError, match="must end in"):
        require_export_place(kind, tmp_path / "a.xyz", (), True)


@pytest.mark.parametrize("kind", ["focal-stack", "gif", "mp4", "quilt", "hci", "eslf", "npz", "colmap", "web", "mesh"])
def test_what_is_stopped_leaves_the_older_output_and_nothing_beside_it(hard, tmp_path, kind) -> None:
    path = tmp_path / f"a{(*EXPORTS[kind].endings, '')[0]}"
    for is_first in (True, False):
        before, steps = contents(tmp_path), iter(range(1000))
        with pytest.raises(Cancelled), stoppable(lambda steps=steps: next(steps) > 2):
            exported(hard["photo"], kind, path)
        assert contents(tmp_path) == before
        if is_first:
            exported(hard["photo"], kind, path, **({"frames": 2} if kind in ("focal-stack", "gif", "mp4") else {}))


def contents(folder: Path) -> dict[str, bytes]:
    return {str(path.relative_to(folder)): path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize("kind", ["depth", "point-cloud", "nerfstudio", "rgbd"])
def test_a_field_without_depth_is_refused_where_depth_is_written(hard, tmp_path, kind) -> None:
    field = hard["field"]
    centre = replace(field.centre, disparity=None)
    flat = replace(field, scene=replace(field.scene, depth_source="none"), centre=centre)
    with pytest.raises(InputError, match="field: "):
        exported(flat, kind, tmp_path / f"a{(*EXPORTS[kind].endings, '')[0]}")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("farthest", [1e9, math.inf, -50.0])
def test_a_sky_at_infinity_is_far_but_not_infinitely(source, farthest) -> None:
    assert cameras_of(with_metres(source, 2.0, farthest)).depth_range == pytest.approx((1, 1000), rel=1e-3)


def test_depth_beside_a_picture_of_one_plane_is_black(source, tmp_path: Path) -> None:
    centre = ViewUpdate(1, 1, np.zeros((64, 96, 3), np.uint8), np.full((64, 96), -1, np.float32))
    out = exported(replace(source, loaded=None, centre=centre), "rgbd", tmp_path / "a.png")
    assert not np.asarray(Image.open(out))[:, 96:].any()
