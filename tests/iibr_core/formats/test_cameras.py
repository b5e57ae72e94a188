import json
import struct
from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.cameras import (
    MAX_DEPTH_RATIO,
    FieldCameras,
    infinity_of,
    write_llff,
    write_nerfstudio,
)
from iibr_core.formats.colmap import write_colmap
from iibr_core.formats.poses import read_poses
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset

GRID, SIZE = GridShape(3, 3), ImageSize(64, 96)


def test_points_of_a_view_are_projected_to_where_other_views_see_them() -> None:
    """For a field whose still plane is at a finite distance, as most are."""
    cameras = FieldCameras(GRID, SIZE, 80.0, (-1.5, 2.5), -2.0)
    disparity = np.random.default_rng(0).uniform(-1.5, 2.5, SIZE).astype(np.float32)
    points = cameras.points(disparity, ViewOffset(0, 0)).astype(float)
    y, x = np.indices(SIZE)
    for offset in (ViewOffset(1, -2), ViewOffset(0.5, 3)):
        moved = points - cameras.place(offset)
        cx, cy = cameras.principal_point(offset)
        np.testing.assert_allclose(80 * moved[..., 0] / moved[..., 2] + cx - 0.5, x - disparity * offset.s, atol=1e-3)
        np.testing.assert_allclose(80 * moved[..., 1] / moved[..., 2] + cy - 0.5, y - disparity * offset.t, atol=1e-3)
    assert cameras.depth(disparity).min() >= 1
    assert cameras.depth_range == (1.0, pytest.approx(9.0))


def test_cropped_views_have_their_principal_points_in_the_middle_to_half_a_pixel() -> None:
    whole = FieldCameras(GRID, SIZE, 80.0, (-1.5, 2.5), -2.3)
    offsets = [GRID.offset(row, column) for row, column in np.ndindex(*GRID)]
    cameras = whole.centred(offsets)
    assert cameras.size == (60, 92)
    assert 0.29 < cameras.off_centre_px(offsets) < 0.31 < whole.off_centre_px(offsets)
    assert whole.off_centre_px([ViewOffset(0, 1)]) == pytest.approx(2.3)
    for offset in offsets:
        rows, columns = cameras.window(offset)
        assert 0 <= rows.start < rows.stop <= 64
        assert 0 <= columns.start < columns.stop <= 96
        x, y = cameras.principal_point(offset)
        assert (x + columns.start, y + rows.start) == pytest.approx(whole.principal_point(offset))
    assert FieldCameras(GRID, SIZE, 80.0, (1.0, 2.5), 0.0).centred(offsets).size == SIZE
    far = FieldCameras(GRID, SIZE, 80.0, (-8.0, 2.5), -9.0).centred(offsets)
    assert (far.margins, far.window(offsets[0])) == (None, (slice(0, 64), slice(0, 96)))


@pytest.mark.parametrize(
    ("low", "high"), [(1.0, 5.0), (1.0, 20.0), (-3.0, 3.0), (0.001, 9.0), (2.0, 2.0), (0.0, 0.0), (-2.0, -2.0)]
)
def test_infinity_lies_beyond_all_at_a_sensible_ratio_of_depths(low, high) -> None:
    infinity = infinity_of(low, high)
    assert infinity < low
    assert (high - infinity) / (low - infinity) <= 1.00005 * MAX_DEPTH_RATIO
    assert (infinity == 0) == (low in (1.0, 2.0))


@pytest.mark.parametrize(("inverse_metres", "infinity"), [((0.5, -1.0), 2.0), ((0.0, 1.0), 0.0), ((0.5, -5.0), 0.0)])
def test_infinity_is_known_with_metres_unless_everything_would_lie_beyond(inverse_metres, infinity) -> None:
    assert infinity_of(1.0, 9.0, inverse_metres) == infinity


FIELD, FIELD_SIZE = GridShape(2, 3), ImageSize(40, 48)
VIEWS = {f"v{v:02d}_u{u:02d}.png": FIELD.offset(v, u) for v, u in np.ndindex(*FIELD)}


def write_field(folder: Path, kind: str, at_infinity=0.0):
    cameras = FieldCameras(FIELD, FIELD_SIZE, 50.0, (1.0, 4.0), at_infinity)
    if kind == "colmap":
        write_colmap(folder, cameras, VIEWS, np.zeros((1, 3), np.float32), np.zeros((1, 3), np.uint8))
    else:
        {"llff": write_llff, "nerfstudio": write_nerfstudio}[kind](folder, cameras, VIEWS)
    return cameras


def read_transforms(folder, **changes):
    """Read a file of one frame. changes: values of the file; None removes one."""
    frame = {"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}
    content = {"w": 48, "h": 40, "fl_x": 50.0, "frames": [frame], **changes}
    text = json.dumps({name: value for name, value in content.items() if value is not None})
    (folder / "transforms.json").write_text(f"\ufeff{text}", "utf-8")
    return read_poses(folder)


def require_refusal(match, read, *args, **options):
    with pytest.raises(InputError, match=match) as caught:
        read(*args, **options)
    assert "\n" not in str(caught.value)


def test_colmaps_binary_model_holds_the_same_as_its_text(tmp_path):
    """Programs take only the one or the other, and some stop reading text at an empty line."""
    points, colors = np.float32([[0.5, -2, 4], [1, 2, 3]]), np.uint8([[1, 2, 3], [250, 251, 252]])
    write_colmap(tmp_path, FieldCameras(FIELD, FIELD_SIZE, 50.0, (1.0, 4.0), -0.5), VIEWS, points, colors)
    model, text_only = tmp_path / "sparse" / "0", tmp_path / "text"
    assert all(line for path in model.glob("*.txt") for line in path.read_text().splitlines())
    rows = [line.split() for line in (model / "points3D.txt").read_text().splitlines()]
    data = (model / "points3D.bin").read_bytes()
    binary = list(struct.iter_unpack("<Q3d3BdQ", data[8:]))
    assert struct.unpack("<Q", data[:8]) == (2,)
    assert rows == [[f"{value:g}" for value in row[:-1]] for row in binary]
    assert [row[-1] for row in binary] == [0, 0], "observed nowhere"
    text_only.mkdir()
    for name in ("cameras.txt", "images.txt"):
        (model / name).rename(text_only / name)
    for one, other in zip(read_poses(text_only), read_poses(tmp_path), strict=True):
        assert (one.size, one.focal_px, one.centre_px) == (other.size, other.focal_px, other.centre_px)
        np.testing.assert_array_equal(
            [*one.world_from_camera, one.position], [*other.world_from_camera, other.position]
        )


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("images", lambda data: data[:-120], "is not a model of COLMAP"),
        ("images", lambda data: struct.pack("<Q", 2**60) + data[8:], "poses"),
        ("images", lambda data: data.replace(b"\0v", b"xv").replace(b"png\0", b"png "), "is not a model of COLMAP"),
        ("images", lambda data: data[:12] + struct.pack("<4d", 0, 0, 0, 0) + data[44:], "a quaternion of length 0"),
        ("cameras", lambda data: data[:12] + struct.pack("<i", 4) + data[16:] + bytes(32), "is OPENCV; undistort"),
        ("cameras", lambda data: data[:12] + struct.pack("<i", 99) + data[16:], "unknown camera model 99"),
        ("cameras", lambda data: data[:16] + struct.pack("<Q", 2**62) + data[24:], "pixels"),
    ],
)
def test_damaged_and_distorted_binary_models_are_refused(tmp_path, name, change, message):
    write_field(tmp_path, "colmap")
    path = tmp_path / f"sparse/0/{name}.bin"
    path.write_bytes(change(path.read_bytes()))
    require_refusal(message, read_poses, tmp_path)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"camera_model": "OPENCV", "k1": -0.35, "k2": 0.12}, "k1 = -0.35, k2 = 0.12.*undistort the pictures"),
        ({"p2": 0.01}, "p2 = 0.01"),
        ({"camera_model": "OPENCV_FISHEYE"}, "model OPENCV_FISHEYE.*undistort"),
        ({"is_fisheye": True}, "is_fisheye = True"),
        ({"distortion_params": [0.1, 0]}, "distortion_params"),
    ],
)
def test_cameras_that_distort_are_refused_and_stated_distortions_of_zero_are_none(tmp_path, values, message):
    frame = {"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}
    for changes in (values, {"frames": [frame, {**frame, **values}]}):
        require_refusal(message, read_transforms, tmp_path, **changes)
    none = {"camera_model": "OPENCV", "k1": 0, "k2": 1e-5, "p1": None, "is_fisheye": False}
    assert read_transforms(tmp_path, **none)[0].focal_px == (50.0, 50.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"fl_x": float("nan")}, "transforms.json"),
        ({"fl_x": None}, "focal length"),
        ({"w": 0}, "pixels"),
        (
            {"w": None, "frames": [{"file_path": "a/../../a.png", "transform_matrix": np.eye(4).tolist()}]},
            "pose 1: its picture .* does not lie beside the file",
        ),
        ({"frames": []}, "0 poses"),
        ({"frames": [{"transform_matrix": np.zeros((4, 4)).tolist()}]}, "rotation"),
        ({"frames": [{"file_path": "a.png"}]}, "4x4"),
        ({"w": None}, "pose 1 states no size.*a.png"),
    ],
)
def test_invalid_cameras_are_refused(tmp_path, changes, message):
    require_refusal(message, read_transforms, tmp_path, **changes)
