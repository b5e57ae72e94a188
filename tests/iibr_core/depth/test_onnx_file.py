"""ONNX files as people have them: which output is the map, where weights are, which sizes are taken."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper, numpy_helper
from onnx.external_data_helper import set_external_data

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimates import values_of
from iibr_core.depth.estimators.catalog import model_to_use
from iibr_core.depth.estimators.config import read_preparation
from iibr_core.depth.estimators.estimate_depth import estimate_with
from iibr_core.depth.estimators.onnx_file import depth_output
from iibr_core.depth.estimators.onnx_models import USUAL_PREPARATION
from iibr_core.depth.search import open_with_depth
from iibr_core.formats.images.write import write_image
from iibr_core.types import (
    FloatImage,
    ImageSize,
    InputError,
    Photo,
)
from tests.iibr_core.depth.onnx_graphs import of_channels, weighing

SIZE = ImageSize(56, 84)
FILE = Path("model.onnx")
MAP = np.arange(56 * 84, dtype=np.float32)


def photo_of(height: int, width: int) -> Photo:
    red = np.tile(np.linspace(0.2, 0.8, width, dtype=np.float32), (height, 1))
    return Photo(np.stack([red, red / 2, 1 - red], axis=2), 50.0, "photo")


def estimate(file: Path, photo: Photo) -> FloatImage:
    model = model_to_use(DepthChoice(model=str(file)))
    assert model is not None
    return values_of(estimate_with(model, photo))


@pytest.fixture(autouse=True)
def caches_here(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("iibr_core.depth.estimators.estimate_cache.cache_folder", lambda: tmp_path / "cache")


@pytest.mark.parametrize(
    ("others_before", "name"),
    [
        ({"features": MAP.reshape(1, 1, 56, 84)}, "output_0"),
        ({"confidence": MAP.reshape(1, 56, 84)}, "output_0"),
        ({"sky_mask": MAP.reshape(56, 84), "normals": np.zeros((1, 3, 56, 84), np.float32)}, "output_0"),
        ({"last_hidden_state": np.zeros((1, 1370, 384), np.float32)}, "predicted_depth"),
        ({"intrinsics": np.eye(3, dtype=np.float32)[None]}, "output_0"),
        ({"disp_3": MAP.reshape(112, 42)[:7, :10]}, "disp_0"),
        ({"labels": np.array(["a", "b"])}, "output_0"),
        ({"other": MAP.reshape(1, 56, 84)}, "metric_depth"),
    ],
)
def test_of_several_outputs_the_map_of_depth_is_chosen(others_before: dict[str, np.ndarray], name: str) -> None:
    depth = (MAP + 7).reshape(1, 56, 84)
    found = depth_output(FILE, {**others_before, name: depth}, SIZE)
    np.testing.assert_array_equal(found, depth[0])


@pytest.mark.parametrize(
    "outputs",
    [
        {"features": np.zeros((1, 384, 4, 6), np.float32)},
        {"last_hidden_state": np.zeros((1, 1370, 384), np.float32)},
        {"mask": MAP.reshape(1, 56, 84)},
        {"out": np.zeros((1, 3, 56, 84), np.float32)},
        {"out": np.zeros((0, 56, 84), np.float32)},
        {"out": [1, 2]},
    ],
)
def test_outputs_without_a_map_are_listed(outputs: dict[str, np.ndarray]) -> None:
    with pytest.raises(InputError, match=rf"model\.onnx: gives {next(iter(outputs))} .*choose a depth model"):
        depth_output(FILE, outputs, SIZE)


def with_external_weights(file: Path) -> Path:
    """The same model, its numbers in FILE.data beside it."""
    weighing(file, (1.0, 0.0, 0.0))
    model = onnx.load(str(file))
    (weights,) = (tensor for tensor in model.graph.initializer if tensor.name == "weights")
    set_external_data(weights, f"{file.name}.data")
    onnx.save(model, str(file))
    return file


def test_missing_files_of_weights_are_named(tmp_path: Path) -> None:
    file = with_external_weights(tmp_path / "large.onnx")
    assert estimate(file, photo_of(60, 90)).std() > 0
    (tmp_path / "large.onnx.data").unlink()
    with pytest.raises(InputError, match=r"large\.onnx: its weights are in large\.onnx\.data, which does not lie besi"):
        estimate(file, photo_of(60, 90))


def halving(file: Path, stride: int) -> Path:
    """A network whose output is the red channel plus its mean over blocks, as a U-Net's: sides are multiples of one."""
    scales = np.array([1, 1, stride, stride], np.float32)
    nodes = [
        helper.make_node("Gather", ["x", "red"], ["picked"], axis=1),
        helper.make_node("AveragePool", ["picked"], ["small"], kernel_shape=[stride] * 2, strides=[stride] * 2),
        helper.make_node("Resize", ["small", "", "scales"], ["large"], mode="nearest"),
        helper.make_node("Add", ["picked", "large"], ["depth"]),
    ]
    constants = [numpy_helper.from_array(np.array([0]), "red"), numpy_helper.from_array(scales, "scales")]
    takes = helper.make_tensor_value_info("x", TensorProto.FLOAT, [1, 3, "h", "w"])
    gives = helper.make_tensor_value_info("depth", TensorProto.FLOAT, None)
    graph = helper.make_graph(nodes, "g", [takes], [gives], constants)
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9), str(file))
    return file


@pytest.mark.parametrize("stride", [16, 32])
def test_networks_of_other_strides_get_sides_that_suit_them(tmp_path: Path, stride: int) -> None:
    found = estimate(halving(tmp_path / "unet.onnx", stride), photo_of(480, 640))
    assert found.shape[0] % stride == found.shape[1] % stride == 0
    assert found[:, -1].mean() > found[:, 0].mean()


def test_a_stride_that_nobody_uses_is_told_with_the_way_out(tmp_path: Path) -> None:
    file = halving(tmp_path / "unet.onnx", 45)
    with pytest.raises(InputError, match=r"failed on this photo .*ensure_multiple_of in a preprocessor_config\.json"):
        estimate(file, photo_of(480, 640))
    (tmp_path / "preprocessor_config.json").write_text(json.dumps({"ensure_multiple_of": 45}))
    assert estimate(file, photo_of(480, 640)).shape[0] % 45 == 0


@pytest.mark.parametrize(
    ("settings", "black", "white"),
    [
        ({}, -0.485 / 0.229, (1 - 0.485) / 0.229),
        ({"do_normalize": False}, 0.0, 1.0),
        ({"do_normalize": False, "do_rescale": False}, 0.0, 255.0),
        ({"image_mean": 127.5, "image_std": 127.5, "do_rescale": False}, -1.0, 1.0),
        ({"image_mean": 0, "image_std": 1, "rescale_factor": 2 / 255}, 0.0, 2.0),
    ],
)
def test_settings_say_what_black_and_white_become(
    tmp_path: Path, settings: dict[str, object], black: float, white: float
) -> None:
    (tmp_path / "preprocessor_config.json").write_text(json.dumps(settings))
    prepared = read_preparation(tmp_path, USUAL_PREPARATION)
    for value, expected in ((0.0, black), (1.0, white)):
        assert (value - prepared.mean[0]) / prepared.std[0] == pytest.approx(expected, abs=1e-9)


def test_distances_of_0_are_unknown(tmp_path: Path) -> None:
    """Networks give them for the sky; the darkest red, normalised, lies below 0 here."""
    (tmp_path / "config.json").write_text('{"depth_estimation_type": "metric"}')
    file = of_channels(tmp_path / "metres.onnx")
    write_image(tmp_path / "photo.png", photo_of(60, 90).pixels)
    found = open_with_depth(tmp_path / "photo.png", DepthChoice(model=str(file), refine=False)).disparity
    assert found.unknown is not None
    assert found.unknown[:, :20].all()
    assert not found.unknown[:, -20:].any()
    with pytest.raises(InputError, match="gave no distance above 0"):
        estimate(file, Photo(photo_of(60, 90).pixels / 4, 50.0, "dark"))
