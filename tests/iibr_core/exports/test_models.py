"""Splats as SPZ, read by the format's description, and textured meshes, read by trimesh."""

import json
import math
import struct
from pathlib import Path

import cv2
import numpy as np
import pytest
import trimesh
from PIL import Image
from plyfile import PlyData

from iibr_core.exports.cameras import cameras_of, nearest_metres
from iibr_core.exports.kinds import EXPORTS, ExportOptions
from iibr_core.exports.source import ExportSource, open_for_export, write_export
from iibr_core.exports.triangles import MAX_ERROR_PX, Triangles, triangulate
from iibr_core.formats.images.color_profile import icc_profile
from iibr_core.formats.images.photo import read_photo
from iibr_core.runtime.resources import resource_folder
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.scene import Source
from iibr_core.types import DISPLAY_P3, GridShape
from tests.iibr_core.exports.conftest import exported, with_metres
from tests.iibr_core.exports.readers import SH_BASIS_0, read_spz
from tests.viewer.conftest import write_scene


@pytest.mark.parametrize(("nearest", "farthest", "factor"), [(0.5, 400.0, 1), (0.001, 0.004, 10)])
def test_splats_as_spz_are_those_of_the_ply_file(source, tmp_path, nearest, farthest, factor) -> None:
    known = with_metres(source, nearest, farthest)
    ply = PlyData.read(str(exported(known, "splats", tmp_path / "a.ply")))["vertex"]
    assert (ply["z"].min(), ply["z"].max()) == pytest.approx((nearest, farthest), rel=1e-3), "metres"
    assert np.exp(ply["scale_0"]) == pytest.approx(0.6 * ply["z"] / cameras_of(known).focal_px, rel=1e-3)
    message = write_export(EXPORTS["splats"], tmp_path / "a.spz", known, ExportOptions())
    assert (message is None) if factor == 1 else (f"{factor} times" in message)
    spz = read_spz(tmp_path / "a.spz")
    radii = factor * np.exp(ply["scale_0"])
    places = factor * np.column_stack([ply["x"], -ply["y"], -ply["z"]])
    assert (np.abs(spz["places"] - places) < 0.1 * radii[:, None]).all()
    np.testing.assert_allclose(spz["radii"], np.repeat(radii[:, None], 3, axis=1), rtol=0.033)
    colors = np.column_stack([ply[f"f_dc_{i}"] for i in range(3)]) * SH_BASIS_0 + 0.5
    assert np.abs(spz["colors"] - colors).max() < 1 / 255
    assert spz["opacities"] == pytest.approx(1 / (1 + np.exp(-ply["opacity"])), abs=1 / 255)
    assert np.abs(spz["rotations"]).max() < 0.005
    assert (tmp_path / "a.spz").stat().st_size < (tmp_path / "a.ply").stat().st_size / 5


def joins_of(nearness: np.ndarray, cut: float) -> tuple[np.ndarray, np.ndarray]:
    return np.abs(np.diff(nearness, axis=1)) <= cut, np.abs(np.diff(nearness, axis=0)) <= cut


def covered_twice(triangles: Triangles) -> np.ndarray:
    """The sides of triangles that only one triangle has, as rows (x0, y0, x1, y1)."""
    sides = np.sort(triangles.indices[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    lone, counts = np.unique(sides, axis=0, return_counts=True)
    assert counts.max() <= 2
    return triangles.corners[lone[counts == 1]].reshape(-1, 4)


@pytest.mark.parametrize("size", [(64, 128), (50, 70), (1, 1), (130, 3)])
def test_triangles_of_a_slanted_plane_fit_it_without_gaps(size) -> None:
    height, width = size
    rows, columns = np.indices(size, np.float32) + 0.5
    nearness = (5 + 0.01 * columns + 0.004 * rows).astype(np.float32)
    triangles = triangulate(nearness, np.ones(size, bool), joins_of(nearness, 1.0), 4)
    x, y = triangles.corners.T
    inside = (x > 0) & (x < width) & (y > 0) & (y < height)
    np.testing.assert_allclose(triangles.nearness[inside], (5 + 0.01 * x + 0.004 * y)[inside], rtol=1e-5)
    assert len(triangles.indices) <= max(0.4 * height * width, 8 * (height + width))
    a, b, c = triangles.corners[triangles.indices].transpose(1, 0, 2)
    areas = ((b - a)[:, 1] * (c - a)[:, 0] - (b - a)[:, 0] * (c - a)[:, 1]) / 2
    assert areas.min() > 0, "counter-clockwise"
    assert areas.sum() == height * width
    x0, y0, x1, y1 = covered_twice(triangles).T
    assert (((x0 == x1) & np.isin(x0, [0, width])) | ((y0 == y1) & np.isin(y0, [0, height]))).all()


def test_triangles_follow_a_depth_edge_and_curved_surfaces() -> None:
    rows, columns = np.indices((96, 96), np.float32) + 0.5
    disc = np.hypot(rows - 40, columns - 50) < 25
    nearness = np.where(disc, 9, 5 + np.sin(columns / 15)).astype(np.float32)
    triangles = triangulate(nearness, np.ones_like(disc), joins_of(nearness, 1.0), 4)
    corners = triangles.nearness[triangles.indices]
    assert np.ptp(corners, axis=1).max() < 1, "no triangle joins the disc with what is behind it"
    middles = triangles.corners[triangles.indices].mean(axis=1)
    x, y = middles.astype(int).T
    np.testing.assert_array_equal(corners.mean(axis=1) > 7, disc[y, x])
    behind = ~disc[y, x]
    errors = corners.mean(axis=1) - (5 + np.sin(middles[:, 0] / 15))
    assert np.abs(errors[behind]).max() * 4 < 2.5 * MAX_ERROR_PX
    assert len(triangles.indices) < 0.7 * disc.size


def meshes_of(path: Path) -> list[trimesh.Trimesh]:
    return trimesh.load_scene(path, process=False).dump()


def opened(photo: Path | str, max_pixels: int) -> ExportSource:
    source = Source(str(photo), grid=GridShape(3, 3), max_pixels=max_pixels)
    return open_for_export(EXPORTS["mesh"], ExportOptions(), source, 1.0, LensChoice(), lambda scene: None, None)


def test_a_mesh_of_a_photo_has_no_holes_from_the_corner_views(tmp_path) -> None:
    source = opened(resource_folder("assets") / "motorcycle" / "motorcycle.png", 20_000)
    meshes, cameras = meshes_of(exported(source, "mesh", tmp_path / "a.glb")), cameras_of(source)
    finer, (width, height) = 4, source.scene.size
    assert len(meshes[0].faces) < width * height, "few triangles where surfaces are smooth"
    for row, column in ((0, 0), (0, 2), (2, 0), (2, 2)):
        offset = cameras.grid.offset(row, column)
        (left, top, _), centre = cameras.place(offset), cameras.principal_point(offset)
        covered = np.zeros((height * finer, width * finer), np.uint8)
        for mesh in meshes:
            x, y, z = mesh.vertices.T
            pixels = np.column_stack([(x - left) / -z, (-y - top) / -z]) * cameras.focal_px + centre
            for triangle in np.rint(pixels * finer).astype(np.int32)[mesh.faces]:
                cv2.fillConvexPoly(covered, triangle, 1)
        assert (covered == 0).sum() < 10


def test_a_mesh_has_the_photos_camera_and_its_picture_at_its_own_size(tmp_path) -> None:
    photo = write_scene(tmp_path)
    Image.open(photo).save(photo, icc_profile=icc_profile(DISPLAY_P3))
    source = opened(photo, 48 * 32)
    assert source.scene.size == (48, 32)
    exported(source, "mesh", tmp_path / "a.glb")
    scene = trimesh.load_scene(tmp_path / "a.glb", process=False)
    vertical = math.radians(scene.camera.fov[1])
    assert math.tan(vertical / 2) == pytest.approx(16 / cameras_of(source).focal_px)
    photo_mesh, content = meshes_of(tmp_path / "a.glb")[0], (tmp_path / "a.glb").read_bytes()
    corners = json.loads(content[20 : 20 + struct.unpack_from("<I", content, 12)[0]])["accessors"][0]
    unmoved = photo_mesh.vertices / (nearest_metres(source) or 1.0)
    np.testing.assert_allclose([corners["min"], corners["max"]], [unmoved.min(0), unmoved.max(0)], rtol=1e-5)
    texture = photo_mesh.visual.material.baseColorTexture.convert("RGB")
    assert texture.size == (96, 64)
    assert np.abs(np.asarray(texture) - 255 * read_photo(photo).pixels).mean() < 2, (
        "viewers of models take textures for sRGB"
    )
