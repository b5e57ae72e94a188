"""`iibr generate --poses`: pictures of any cameras, beside the light field whose cameras they are."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.images.photo import read_photo
from tests.viewer.cli.test_cli import run
from tests.viewer.conftest import HEIGHT, WIDTH, write_scene


def pixels_of(path: Path) -> np.ndarray:
    return read_photo(path, 10**9).pixels


def write_poses(path: Path, places: list[tuple[float, float, float]], size: tuple[int, int] = (WIDTH, HEIGHT)) -> Path:
    """transforms.json with cameras that look ahead: y up, z backwards."""
    matrices = [np.block([[np.eye(3), np.array(place)[:, None]], [0, 0, 0, 1]]) for place in places]
    frames = [{"transform_matrix": matrix.tolist()} for matrix in matrices]
    path.write_text(json.dumps({"w": size[0], "h": size[1], "fl_x": 1.2 * size[0], "frames": frames}))
    return path


@pytest.mark.parametrize("kind", ["nerfstudio", "llff", "colmap"])
def test_the_cameras_of_a_light_field_see_its_views(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, kind: str) -> None:
    scene = write_scene(tmp_path)
    assert run(monkeypatch, "export", scene, "--to", kind, "--grid", "3", "-o", tmp_path / "field") == 0
    assert run(monkeypatch, "generate", scene, "--poses", tmp_path / "field", "-o", tmp_path / "new") == 0
    made, known = sorted((tmp_path / "new").iterdir()), sorted((tmp_path / "field/images").iterdir())
    assert [path.name for path in made] == [f"view_{number:04d}.png" for number in range(1, 10)]
    for one, other in zip(made, known):
        assert np.sqrt(np.mean((pixels_of(one) - pixels_of(other)) ** 2)) < 0.02


def test_a_step_forward_makes_the_photo_larger(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    scene = write_scene(tmp_path)
    poses = write_poses(tmp_path / "poses.json", [(0, 0, 0), (0, 0, -0.25)])
    assert run(monkeypatch, "generate", scene, "--poses", poses, "--photo-pose", "1", "-o", tmp_path / "new") == 0
    still, forward = (pixels_of(path) for path in sorted((tmp_path / "new").iterdir()))
    np.testing.assert_array_equal(still, pixels_of(scene))
    red = [(image[..., 0] > image[..., 1] + 0.2).sum() for image in (still, forward)]
    assert red[1] / red[0] == pytest.approx(1 / 0.75**2, rel=0.1)


def test_what_is_mostly_made_up_is_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    poses = write_poses(tmp_path / "poses.json", [(0, 0, 0), (0, 0, 20)])
    words = ("generate", write_scene(tmp_path), "--poses", poses, "--photo-pose", "1", "-o", tmp_path / "new")
    assert run(monkeypatch, *words) == 0
    assert "inpainted, as the photo does not show it: 2 (" in capsys.readouterr().err
    capsys.readouterr()
    assert run(monkeypatch, *words) == 2  # it already exists
    assert run(monkeypatch, *words, "--force") == 0
