import math
from dataclasses import replace

import numpy as np
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.exports.kinds import EXPORTS, ExportOptions, require_export_place, with_defaults
from iibr_core.exports.source import open_for_export
from iibr_core.formats.outputs import AlreadyThereError
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import GridShape, InputError
from tests.iibr_core.exports.conftest import exported

FOLDERS = [name for name, kind in EXPORTS.items() if not kind.endings]
SCENE = Scene(Source("a.png"), "a", 741, 500, GridShape(5, 4), (-1.0, 2.0), "file")
SHARP_NEAR = Optics(focus_disparity=10.0)


@pytest.mark.parametrize(
    ("kind", "size", "frames", "rate"),
    [("mp4", (740, 500), 120, 30), ("gif", (480, 324), 60, 15), ("webp", (741, 500), 100, 25),
     ("focal-stack", (741, 500), 16, 0), ("spatial-photo", (700, 500), 2, 0)],
)  # fmt: skip
def test_defaults(kind, size, frames, rate) -> None:
    options = with_defaults(EXPORTS[kind], ExportOptions(), SCENE, SHARP_NEAR)
    assert (options.size, options.frames, options.rate, options.eyes, options.row) == (size, frames, rate, 3, 250)


@pytest.mark.parametrize(("height", "width"), [(3000, 4000), (4000, 3000), (9000, 1000), (1000, 9000), (2160, 3840)])
def test_a_large_video_is_one_that_phones_play(height, width) -> None:
    scene = replace(SCENE, width=width, height=height)
    size = with_defaults(EXPORTS["mp4"], ExportOptions(), scene, SHARP_NEAR).size
    assert max(size) <= 4096
    macroblocks = math.prod(-(-side // 16) for side in size)
    assert macroblocks <= 32_768, "30 frames a second of H.264, level 5.1"
    assert macroblocks > 32_000 or max(size) >= 4090, "no smaller than need be"
    assert size.width / size.height == pytest.approx(width / height, rel=2e-2)


@pytest.mark.parametrize("name", FOLDERS)
def test_a_folder_of_other_files_is_never_replaced(source, tmp_path, name) -> None:
    kind, folder = EXPORTS[name], tmp_path / "out"
    require_export_place(kind, folder, (), False)
    exported(source, name, folder, **({"frames": 1} if "frames" in kind.supports else {}))
    with pytest.raises(AlreadyThereError):
        require_export_place(kind, folder, (), False)
    require_export_place(kind, folder, (), True)
    mine = next(place for place in (folder / "images", folder) if place.is_dir()) / "mine.png"
    mine.touch()
    with pytest.raises(InputError, match=r"mine\.png"):
        require_export_place(kind, folder, (), True)


def test_a_photo_is_written_with_another_number_of_views(source, tmp_path) -> None:
    usual = exported(source, "npz", tmp_path / "usual.npz")
    finer = exported(source, "npz", tmp_path / "finer.npz", grid=GridShape(5, 5))
    with np.load(usual) as few, np.load(finer) as many:
        assert many["views"].shape == (5, 5, 64, 96, 3)
        difference = np.abs(many["views"][::4, ::4].astype(int) - few["views"][::2, ::2])
        assert difference.mean() < 0.5, "the outermost views stay where they are"
        np.testing.assert_allclose(2 * many["disparity"][2, 2], few["disparity"][1, 1], rtol=1e-5)
        assert many["offsets"][0, 4].tolist() == [-2.0, 2.0]
    low_high = source.with_grid(GridShape(5, 5)).scene.disparity_range_px
    assert np.multiply(2, low_high) == pytest.approx(source.scene.disparity_range_px)
    folder = exported(source, "hci", tmp_path / "hci", grid=GridShape(2, 2))
    assert len(list(folder.glob("input_Cam*.png"))) == 4
    for path in folder.glob("disp_Cam*"):
        path.unlink()
    kind, given = EXPORTS["npz"], Source(str(folder))
    opened = open_for_export(kind, ExportOptions(), given, 1.0, LensChoice(), lambda scene: None, None)
    with np.load(exported(opened, "npz", tmp_path / "copy.npz")) as copied:
        assert np.isfinite(copied["disparity"]).all(), "a light field from disk has the disparity of its views"
