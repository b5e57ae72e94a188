"""Light fields exported with their cameras, and opened again."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.poses import read_poses
from tests.iibr_core.known_scenes import HEIGHT, WIDTH, offsets_of, view_of_wall
from tests.viewer.cli.conftest import output_of, refusal_of


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """The working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def write_wall(folder, disparity):
    """Write 3x3 views of a wall with this disparity as an HCI folder with a map."""
    for k, offset in enumerate(offsets_of(3, 3).values()):
        write_image(folder / f"input_Cam{k:03d}.png", view_of_wall(offset, disparity))
    np.save(folder / "gt_disp_u01_v01.npy", np.full((HEIGHT, WIDTH), disparity, np.float32))
    return folder


@pytest.mark.parametrize("kind", ["llff", "nerfstudio", "colmap"])
def test_views_that_converge_are_cropped_around_their_principal_points(iibr, folder, kind):
    """A wall at -1.4, infinity at -3: its views as seen by cameras that look straight ahead."""
    (folder / "wall").mkdir()
    done = iibr("export", write_wall(folder / "wall", -1.4), "--to", kind, "-o", "out")
    output_of(done)
    assert "cropped from 48x40 to 42x34" in done.stderr
    cameras = read_poses(Path("out"))
    for camera, (_, offset), path in zip(
        cameras, sorted(offsets_of(3, 3).items()), sorted(Path("out/images").iterdir()), strict=True
    ):
        assert camera.size == (HEIGHT - 6, WIDTH - 6)
        assert np.add(camera.centre_px, 0.5).tolist() == [WIDTH / 2 - 3, HEIGHT / 2 - 3]
        across = cameras[4].world_from_camera.T @ (camera.position - cameras[4].position)
        np.testing.assert_allclose(across * camera.focal_px[0], [1.6 * offset.s, 1.6 * offset.t, 0], atol=1e-6)
        expected = view_of_wall(offset, 1.6)[3:-3, 3:-3]
        assert np.abs(np.asarray(Image.open(path)) / 255 - expected).max() < 0.01
    if kind == "colmap":
        points = np.loadtxt("out/sparse/0/points3D.txt", usecols=range(1, 7))
        middle = cameras[4]
        x, y, z = middle.world_from_camera.T @ (points[:, :3] - middle.position).T
        seen = np.asarray(Image.open("out/images/v01_u01.png")).astype(int)
        column, row = (
            np.rint(place / z * middle.focal_px[0] + at).astype(int) for place, at in zip((x, y), middle.centre_px)
        )
        np.testing.assert_array_equal(seen[row, column], points[:, 3:])
    output_of(iibr("depth", "out", "-o", "found.npy"))
    assert np.median(np.load("found.npy")) == pytest.approx(1.6, abs=0.08), "it opens again as a light field"


def test_principal_points_that_move_far_are_stated_or_refused(iibr, folder):
    (folder / "wall").mkdir()
    write_wall(folder / "wall", -8.4)
    assert "export cameras for nerfstudio or COLMAP" in refusal_of(iibr("export", "wall", "--to", "llff", "-o", "out"))
    done = iibr("export", "wall", "--to", "colmap", "-o", "out")
    output_of(done)
    assert "up to 10 px off the middle" in done.stderr
    assert {camera.centre_px for camera in read_poses(Path("out"))} == {
        (23.5 + 10 * s, 19.5 + 10 * t) for t in (-1, 0, 1) for s in (-1, 0, 1)
    }


def test_a_densified_field_states_the_same_distances(iibr, folder):
    """Twice as many steps, each half as long: a point at infinity moves half as far in each."""
    (folder / "wall").mkdir()
    output_of(iibr("export", write_wall(folder / "wall", -1.4), "--to", "hci", "-o", "given"))
    output_of(iibr("generate", "given", "--grid", 5, "-o", "dense"))
    given, dense = (open_light_field(Path(name)) for name in ("given", "dense"))
    assert given.infinity_px < -1
    assert dense.infinity_px == pytest.approx(given.infinity_px / 2, abs=0.01)
