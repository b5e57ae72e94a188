"""Python and the command line give the same numbers of the same photo."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import uniform_filter

import iibr_core as iibr
from tests.iibr_core.depth.onnx_graphs import of_channels
from tests.viewer.cli.test_cli import run
from tests.viewer.conftest import FAR, NEAR

Monkey = pytest.MonkeyPatch
SQUARE, WALL, FLOOR = np.s_[20:44, 36:60], np.s_[2:10, 2:90], np.s_[56:, :]
"""Of `write_scene`: the near square, the wall above it, and what is put below it here, between both."""


@pytest.fixture
def photo(photo_path: Path, monkeypatch: Monkey) -> Path:
    monkeypatch.chdir(photo_path.parent)
    return photo_path


def keep_map(photo: Path, kind: str) -> None:
    """Put a map of this kind beside the photo; a depth in metres is 1 / (a + b * disparity)."""
    given = photo.with_name("scene_disparity.npy")
    disparity = uniform_filter(np.load(given), 5)  # so that its edges are refined
    disparity[FLOOR] = (NEAR + FAR) / 2
    np.save(given, disparity)
    if kind != "disparity":
        given.unlink()
    if kind == "depth":
        np.save(photo.with_name("scene_depth.npy"), (1.0 / (0.1 + 0.3 * (disparity - FAR))).astype(np.float32))
    elif kind == "depth picture":  # white is near
        near = (255 * (disparity - FAR) / (NEAR - FAR)).astype(np.uint8)
        Image.fromarray(near).save(photo.with_name("scene_depth.png"))


@pytest.mark.parametrize("kind", ["disparity", "depth", "depth picture"])
def test_a_light_field_is_the_one_that_generate_writes(monkeypatch: Monkey, photo: Path, kind: str) -> None:
    keep_map(photo, kind)
    field = iibr.open(photo).light_field(3)
    assert run(monkeypatch, "generate", photo, "--grid", 3, "--out", "field", "--with-disparity") == 0
    written = iibr.open("field").light_field()
    np.testing.assert_array_equal(written.views, field.views)
    assert written.disparity is not None
    assert field.disparity is not None
    np.testing.assert_array_equal(written.disparity, field.disparity)
    near, far = (np.median(field.disparity[1, 1][part]) for part in (SQUARE, WALL))
    assert near > far + 0.5, "what is near moves most"


@pytest.mark.parametrize("kind", ["disparity", "depth", "depth picture"])
def test_disparity_is_the_one_that_depth_writes(monkeypatch: Monkey, photo: Path, kind: str) -> None:
    keep_map(photo, kind)
    found = iibr.open(photo, refine=False).disparity
    assert run(monkeypatch, "depth", photo, "--refine", "off", "-o", "map.npy") == 0
    np.testing.assert_allclose(np.load("map.npy"), found, rtol=1e-5)
    near, far, between = (np.median(found[part]) for part in (SQUARE, WALL, FLOOR))
    assert near > far
    assert (between - far) / (near - far) == pytest.approx(0.5, abs=0.03)


@pytest.mark.parametrize("is_metric", [False, True])
def test_a_models_depth_is_the_one_that_depth_writes(monkeypatch: Monkey, photo: Path, is_metric: bool) -> None:
    """The model says how red a pixel is: nearness, or a distance."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(photo.parent / "cache"))
    red = np.full((64, 96, 3), 60, np.uint8)
    red[SQUARE] = (220, 60, 60)
    Image.fromarray(red).save(photo)
    model = of_channels(photo.with_name("red.onnx"), as_bytes=True)
    if is_metric:
        photo.with_name("config.json").write_text('{"depth_estimation_type": "metric"}')
    inverse = iibr.estimate_depth(photo, model)
    words = ("--depth-model", model, "--refine", "off", "-o", "map.npy")
    assert run(monkeypatch, "depth", photo, *words) == 0
    written = np.load("map.npy")
    assert np.corrcoef(inverse.ravel(), written.ravel())[0, 1] > 0.999
    square, wall = (np.median(inverse[part]) for part in (SQUARE, WALL))
    assert (square > wall) != is_metric
    expected = 60 / 220 if is_metric else 220 / 60
    assert square / wall == pytest.approx(expected, rel=0.05)
