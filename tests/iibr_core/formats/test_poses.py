"""Cameras from files: what the program writes comes background, other programs' conventions, and what are no poses."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.cameras import FieldCameras, write_colmap, write_llff, write_nerfstudio
from iibr_core.formats.poses import central_camera, read_poses
from iibr_core.types import GridShape, ImageSize, InputError

GRID, SIZE = GridShape(2, 3), ImageSize(40, 48)


def field(at_infinity=0.0):
    return FieldCameras(GRID, SIZE, 50.0, (1.0, 4.0), at_infinity)


def views():
    return {f"v{v:02d}_u{u:02d}.png": GRID.offset(v, u) for v in range(2) for u in range(3)}


def write_field(folder: Path, kind: str, at_infinity=0.0):
    cameras = field(at_infinity)
    if kind == "colmap":
        write_colmap(folder, cameras, views(), np.zeros((1, 3), np.float32), np.zeros((1, 3), np.uint8))
    else:
        {"llff": write_llff, "nerfstudio": write_nerfstudio}[kind](folder, cameras, views())
    return cameras


@pytest.mark.parametrize(
    ("kind", "at_infinity"),
    [("llff", 0.0), ("nerfstudio", 0.0), ("nerfstudio", 0.5), ("colmap", 0.0), ("colmap", -0.5)],
)
def test_what_is_written_comes_back(tmp_path, kind, at_infinity):
    written, read = write_field(tmp_path, kind, at_infinity), read_poses(tmp_path)
    first = read[0].world_from_camera
    assert len(read) == 6
    for camera, (_, offset) in zip(read, sorted(views().items())):
        np.testing.assert_allclose(first.T @ camera.world_from_camera, np.eye(3), atol=1e-12)
        place = first.T @ (camera.position - read[0].position)
        expected = np.subtract(written.place(offset), written.place(GRID.offset(0, 0)))
        np.testing.assert_allclose(place, expected, atol=1e-12)
        np.testing.assert_allclose(np.add(camera.centre_px, 0.5), written.principal_point(offset))
        assert (camera.size, camera.focal_px) == (SIZE, (50.0, 50.0))
        assert camera.depth_range == (pytest.approx(written.depth_range) if kind == "llff" else None)


def test_the_middle_one_is_nearest_to_all():
    cameras = read_llff(np.diag([1.0, 1.0, 1.0]), [(x, 0, 0) for x in (0, 1, 2, 6)])
    assert central_camera(cameras) == 2


def read_llff(rotation, places, folder=None, hwf=(40, 48, 50.0), bounds=(1.0, 5.0)):
    """poses_bounds.npy whose cameras look along rotation (columns down, right, backwards)."""
    import tempfile

    folder = folder or Path(tempfile.mkdtemp())
    rows = [[*np.column_stack([rotation, place, hwf]).ravel(), *bounds] for place in places]
    np.save(folder / "poses_bounds.npy", np.array(rows, float))
    return read_poses(folder / "poses_bounds.npy")


def write_transforms(path: Path, **changes):
    frame = {"file_path": "a.png", "transform_matrix": np.eye(4).tolist()}
    whole = {"w": 48, "h": 40, "fl_x": 50.0, "frames": [frame], **changes}
    path.write_text(json.dumps({name: value for name, value in whole.items() if value is not None}))
    return path


@pytest.mark.parametrize(
    "name", ["/etc/passwd", "../a.png", "a/../../a.png", "//host/share/a.png", "..\\a.png", "C:a.png"]
)
def test_a_picture_elsewhere_is_never_opened(tmp_path, name):
    path = write_transforms(
        tmp_path / "transforms.json", w=None, frames=[{"file_path": name, "transform_matrix": np.eye(4).tolist()}]
    )
    with pytest.raises(InputError, match=r"pose 1: its picture .* does not lie beside the file"):
        read_poses(path)


def test_a_byte_order_mark_is_no_part_of_the_poses(tmp_path):
    path = write_transforms(tmp_path / "transforms.json")
    path.write_text("\ufeff" + path.read_text("utf-8"), "utf-8")
    assert len(read_poses(path)) == 1


@pytest.mark.parametrize("name", ["cameras.txt", "images.txt"])
def test_a_byte_order_mark_is_no_part_of_colmaps_text(tmp_path, name):
    write_field(tmp_path, "colmap")
    (path,) = tmp_path.rglob(name)
    path.write_text("\ufeff" + path.read_text("utf-8"), "utf-8")
    assert len(read_poses(tmp_path)) == 6


def test_opengls_axes_are_turned(tmp_path):
    (camera,) = read_poses(write_transforms(tmp_path / "transforms.json"))
    np.testing.assert_array_equal(camera.world_from_camera @ (0.0, 1.0, 1.0), (0.0, -1.0, -1.0))
    assert camera.focal_px == (50.0, 50.0)
    assert camera.centre_px == (23.5, 19.5)


@pytest.mark.parametrize(("angle", "focal_px"), [(np.pi / 2, 24.0), (np.pi / 3, 24.0 * np.sqrt(3))])
def test_an_angle_tells_the_focal_length(tmp_path, angle, focal_px):
    (camera,) = read_poses(write_transforms(tmp_path / "poses.json", fl_x=None, camera_angle_x=angle))
    assert camera.focal_px[0] == pytest.approx(focal_px)


def test_colmaps_quaternion_is_from_the_world(tmp_path):
    write_field(tmp_path, "colmap")
    half = np.sqrt(0.5)
    line = f"1 {half} 0 0 {half} 1 2 3 1 a b.png\n\n"  # a quarter turn about z
    (tmp_path / "sparse/0/images.txt").write_text(line)
    (camera,) = read_poses(tmp_path)
    np.testing.assert_allclose(camera.world_from_camera.T @ (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), atol=1e-12)
    np.testing.assert_allclose(camera.world_from_camera.T @ -camera.position, (1.0, 2.0, 3.0), atol=1e-12)
    assert camera.source.endswith("a b.png")


def test_smaller_pictures_keep_their_corners():
    (camera,) = read_llff(np.eye(3)[:, [1, 0, 2]] * [1, 1, -1], [(0, 0, 0)])
    smaller = camera.resized(ImageSize(10, 24))
    assert smaller.focal_px == (25.0, 12.5)
    assert smaller.centre_px == (11.5, 4.5)


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"fl_x": 0.0}, "focal"),
        ({"fl_x": 1e9}, "focal"),
        ({"fl_x": float("nan")}, "NaN"),
        ({"fl_x": None}, "transforms.json"),
        ({"fl_x": None, "camera_angle_x": 0.0}, "transforms.json"),
        ({"fl_x": "wide"}, "transforms.json"),
        ({"w": 0}, "pixels"),
        ({"w": float("nan")}, "pixels"),
        ({"h": 10**30}, "pixels"),
        ({"cx": float("inf")}, "NaN"),
        ({"frames": []}, "0 poses"),
        ({"frames": [1]}, "transforms.json"),
        ({"frames": [{"transform_matrix": np.zeros((4, 4)).tolist()}]}, "rotation"),
        ({"frames": [{"transform_matrix": np.diag([1.0, 1.0, -1.0, 1.0]).tolist()}]}, "rotation"),
        ({"frames": [{"transform_matrix": np.full((4, 4), np.nan).tolist()}]}, "NaN"),
        ({"frames": [{"transform_matrix": [1, 2]}]}, "4x4"),
        ({"frames": [{"transform_matrix": [[1], [1, 2]]}]}, "transforms.json"),
        ({"w": None}, "a.png"),
    ],
)
def test_what_is_no_camera_is_said_in_a_line(tmp_path, changes, said):
    with pytest.raises(InputError, match=said) as raised:
        read_poses(write_transforms(tmp_path / "transforms.json", **changes))
    assert "\n" not in str(raised.value)


@pytest.mark.parametrize("text", ["", "{", "[]", "null", "1", "[" * 100_000, '{"frames": 3}', "\xff"])
def test_text_that_is_no_list_of_poses(tmp_path, text):
    (tmp_path / "transforms.json").write_text(text, "latin-1")
    with pytest.raises(InputError, match=r"transforms\.json"):
        read_poses(tmp_path)


@pytest.mark.parametrize(
    "changes", [{"hwf": (40, 48, 0.0)}, {"hwf": (40, 48, np.nan)}, {"hwf": (0, 48, 50)}, {"bounds": (5.0, 1.0)},
                {"bounds": (0.0, 1.0)}, {"places": [(np.inf, 0, 0)]}, {"places": []}, {"rotation": np.zeros((3, 3))}],
)  # fmt: skip
def test_llff_poses_that_are_none(tmp_path, changes):
    words = {"rotation": np.eye(3)[:, [1, 0, 2]] * [1, 1, -1], "places": [(0, 0, 0)], **changes}
    with pytest.raises(InputError, match=r"poses_bounds\.npy"):
        read_llff(words.pop("rotation"), words.pop("places"), tmp_path, **words)


def test_a_file_of_another_kind(tmp_path):
    (tmp_path / "poses.txt").write_text("1 2 3")
    with pytest.raises(InputError, match="no known poses"):
        read_poses(tmp_path / "poses.txt")
    with pytest.raises(InputError, match="holds neither"):
        read_poses(tmp_path)


@pytest.mark.parametrize(
    ("name", "old", "new", "said"),
    [
        ("cameras.txt", "PINHOLE", "OPENCV", "undistort"),
        ("cameras.txt", "PINHOLE 48", "PINHOLE x", "COLMAP"),
        ("images.txt", "1 0 0 0", "0 0 0 0", "NaN"),
        ("images.txt", " 0 0 0 ", " ", "COLMAP"),
        ("images.txt", "", None, "empty"),
    ],
)
def test_damaged_colmap_text(tmp_path, name, old, new, said):
    write_field(tmp_path, "colmap")
    path = tmp_path / "sparse/0" / name
    path.write_text("" if new is None else path.read_text().replace(old, new))
    with pytest.raises(InputError, match=said):
        read_poses(tmp_path)


def test_names_that_mean_nothing_here_cost_nothing(tmp_path):
    """400,000 of them beside 10,000 frames: copied for each frame they would take hours."""
    frame = {"transform_matrix": np.eye(4).tolist()}
    others = {f"name {number}": number for number in range(400_000)}
    whole = others | {"w": 48, "h": 40, "fl_x": 50.0, "frames": [frame] * 10_000}
    (tmp_path / "transforms.json").write_text(json.dumps(whole))
    assert len(read_poses(tmp_path)) == 10_000


@pytest.mark.parametrize("name", ["gone.png", "/dev/zero", ".", "../gone.png"])
def test_a_frames_picture_is_named_with_the_file_that_names_it(tmp_path, name):
    frame = {"transform_matrix": np.eye(4).tolist(), "fl_x": 50.0, "file_path": name}
    (tmp_path / "transforms.json").write_text(json.dumps({"frames": [frame]}))
    with pytest.raises(InputError, match=r"transforms\.json, pose 1.*(states no size|does not lie beside)") as refused:
        read_poses(tmp_path)
    assert "\n" not in str(refused.value)
