import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image
from plyfile import PlyData

from iibr_core.beyond.optics import Optics
from iibr_core.color import stored_from_encoded
from iibr_core.exports.cameras import cameras_of, colors_of
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.formats.maps.writer import KEY, text_from
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError, ViewOffset, ViewUpdate
from tests.iibr_core.exports.conftest import exported


def colmap_places(folder: Path) -> dict[str, np.ndarray]:
    """Places of cameras by picture."""
    model, places = folder / "sparse" / "0", {}
    for line in (model / "cameras.txt").read_text().splitlines():
        assert line.split()[1:4] == ["PINHOLE", "96", "64"]
    for line in (model / "images.txt").read_text().splitlines()[::2]:
        _, w, x, y, z, *moved, _, name = line.split()
        assert (float(w), float(x), float(y), float(z)) == (1, 0, 0, 0)
        places[name] = -np.array(moved, float)
    return places


def test_the_three_layouts_say_the_same(source, tmp_path) -> None:
    folders = {kind: exported(source, kind, tmp_path / kind) for kind in ("llff", "nerfstudio", "colmap")}
    colmap = colmap_places(folders["colmap"])
    whole = json.loads((folders["nerfstudio"] / "transforms.json").read_text())
    assert (whole["w"], whole["h"], len(whole["frames"])) == (96, 64, 9)
    for frame in whole["frames"]:
        assert Image.open(folders["nerfstudio"] / frame["file_path"]).size == (96, 64)
        matrix = np.array(frame["transform_matrix"])
        place = colmap[Path(frame["file_path"]).name] * [1, -1, -1]
        np.testing.assert_allclose(matrix[:, 3], [*place, 1], atol=1e-12)
        assert not matrix[3, :3].any()
        assert (frame["cx"], frame["cy"]) == (48, 32)
    poses = np.load(folders["llff"] / "poses_bounds.npy")
    assert poses.shape == (9, 17)
    for name, pose in zip(sorted(colmap), poses):
        matrix = pose[:15].reshape(3, 5)
        np.testing.assert_allclose(matrix[:, 3], colmap[name] * [1, -1, -1], atol=1e-12)
        np.testing.assert_allclose(matrix[:, 4], [64, 96, whole["fl_x"]])
        np.testing.assert_array_equal(matrix[:, 0], [0, -1, 0], "down, where y is up")


def test_splats_are_the_photo_with_something_behind_it(source, tmp_path) -> None:
    vertex = PlyData.read(str(exported(source, "splats", tmp_path / "a.ply")))["vertex"]
    count = 96 * 64
    assert len(vertex) > count, "behind the square"
    colors = np.column_stack([vertex[f"f_dc_{i}"] for i in range(3)]) * 0.28209479177387814 + 0.5
    shown = source.draw(RenderSettings(Optics(), ScreenSize(96, 64))).reshape(-1, 3) / 255
    assert np.abs(colors[:count] - shown).max() < 1.6 / 255
    opacity = 1 / (1 + np.exp(-np.asarray(vertex["opacity"])))
    assert 0.9 < opacity.min() <= opacity.max() < 1
    quaternion = np.column_stack([vertex[f"rot_{i}"] for i in range(4)])
    assert np.array_equal(quaternion, np.tile([1, 0, 0, 0], (len(vertex), 1)))
    cameras = cameras_of(source)
    depth = np.asarray(vertex["z"])
    assert np.exp(np.asarray(vertex["scale_0"])) == pytest.approx(0.6 * depth / cameras.focal_px, rel=1e-4)
    assert depth.min() == pytest.approx(1, rel=1e-4)
    square = (colors[:, 0] - colors[:, 2]) > 0.3
    assert np.median(depth[count:]) > 1.1 * np.median(depth[:count][square[:count]]), "behind the square"
    cloud = PlyData.read(str(exported(source, "point-cloud", tmp_path / "b.ply")))["vertex"]
    assert [p.name for p in cloud.properties] == ["x", "y", "z", "red", "green", "blue"]
    for axis, sign in (("x", 1), ("y", -1), ("z", -1)):
        np.testing.assert_allclose(cloud[axis], sign * np.asarray(vertex[axis]))
    cloud_colors = np.column_stack([cloud[name] for name in ("red", "green", "blue")])[:count] / 255
    assert np.abs(cloud_colors - shown).max() < 1.6 / 255


def with_metres(source: ExportSource, nearest: float, farthest: float) -> ExportSource:
    """The source where these distances in metres are known of its nearest and farthest disparity."""
    plan = source.plan()
    low, high = (value / plan.disparity_scale + plan.disparity_zero for value in plan.disparity_range_px)
    slope = (1 / nearest - 1 / farthest) / (high - low)
    return replace(source, scene=replace(source.scene, inverse_metres=(slope, 1 / nearest - slope * high)))


@pytest.mark.parametrize("farthest", [1e9, math.inf, -50.0])
def test_a_sky_at_infinity_is_far_but_not_infinitely(source, farthest) -> None:
    assert cameras_of(with_metres(source, 2.0, farthest)).depth_range == pytest.approx((1, 1000), rel=1e-3)


def test_a_plan_with_another_disparity_that_stays_states_its_range(source) -> None:
    plan = source.plan(0.75)
    field = plan.field_disparity(source.loaded.disparity).values
    assert (field.min(), field.max()) == pytest.approx(plan.disparity_range_px)
    assert field[32, 48] == pytest.approx((source.loaded.disparity.values[32, 48] - 0.75) * plan.disparity_scale)


def test_maps(source, tmp_path) -> None:
    disparity = read_pfm(exported(source, "disparity", tmp_path / "a.pfm"))
    out = exported(source, "depth", tmp_path / "a.exr")
    assert out.name == "a_depth.exr"
    file = oiio.ImageBuf(str(out))
    depth, text = np.asarray(file.get_pixels(oiio.FLOAT))[..., 0], text_from(file.spec()[KEY])
    assert text.inverse[0] / depth + text.inverse[1] == pytest.approx(disparity, abs=1e-4), "as the file is read again"
    cameras = cameras_of(source)
    expected = (cameras.range_px[1] - cameras.at_infinity) / (disparity - cameras.at_infinity)
    np.testing.assert_allclose(depth, expected, rtol=1e-5)
    assert (disparity.min(), disparity.max()) == pytest.approx(source.scene.disparity_range_px)
    stored = np.asarray(Image.open(exported(source, "depth", tmp_path / "b.png"))).astype(float)
    assert np.corrcoef(stored.ravel(), depth.ravel())[0, 1] > 0.9999


@pytest.mark.parametrize(
    ("layout", "picture", "depth"),
    [("right", np.s_[:, :96], np.s_[:, 96:]), ("left", np.s_[:, 96:], np.s_[:, :96]),
     ("below", np.s_[:64], np.s_[64:])],
)  # fmt: skip
def test_a_picture_with_its_depth_beside_it(source, tmp_path, layout, picture, depth) -> None:
    pixels = np.asarray(Image.open(exported(source, "rgbd", tmp_path / "a.png", layout=layout)))
    assert np.abs(pixels[picture].astype(int) - source.draw(RenderSettings(Optics(), ScreenSize(96, 64)))).max() <= 1
    assert (pixels[depth].min(), pixels[depth].max()) == (0, 255)
    assert pixels[depth][32, 48, 0] == 255, "the square in the middle is near"
    low, high = source.scene.disparity_range_px
    expected = 255 * (source.centre_view().disparity - low) / (high - low)
    assert np.abs(pixels[depth] - expected[..., None]).max() <= 0.51


def test_bright_views_are_written_as_bytes() -> None:
    encoded = np.random.default_rng(0).random((4, 5, 3), np.float32)
    assert np.abs(colors_of(ViewUpdate(0, 0, stored_from_encoded(encoded, True), None)) - 255 * encoded).max() <= 1


def test_epi_has_a_line_a_view(source, tmp_path) -> None:
    epi = np.asarray(Image.open(exported(source, "epi", tmp_path / "a.png", row=32))).astype(int)
    assert epi.shape == (3, 96, 3)
    for line, s in zip(epi, (-1.0, 0.0, 1.0)):
        shown = source.draw(RenderSettings(Optics(eye=ViewOffset(0.0, s)), ScreenSize(96, 64)))[32].astype(int)
        assert np.abs(line - shown).max() <= 1
    for row in (0, 63):
        assert exported(source, "epi", tmp_path / "b.png", row=row).is_file()
    with pytest.raises(InputError, match="rows 0 to 63"):
        exported(source, "epi", tmp_path / "c.png", row=64)


def test_depth_beside_a_picture_of_one_plane_is_black(source, tmp_path) -> None:
    centre = ViewUpdate(1, 1, np.zeros((64, 96, 3), np.uint8), np.full((64, 96), -1, np.float32))
    out = exported(replace(source, loaded=None, centre=centre), "rgbd", tmp_path / "a.png")
    assert not np.asarray(Image.open(out))[:, 96:].any()
