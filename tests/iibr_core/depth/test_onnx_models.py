"""Depth by ONNX Runtime: graphs whose output is a known function of the input, and the real architecture."""

from __future__ import annotations

import dataclasses
import json
import os
import subprocess
import sys
import threading
from pathlib import Path

import cv2
import numpy as np
import onnx
import pytest
import torch
import transformers
from onnx import TensorProto, helper, numpy_helper

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimates import MetricDepth, RelativeInverseDepth, values_of
from iibr_core.depth.estimators import estimate_cache, onnx_models
from iibr_core.depth.estimators.catalog import model_to_use
from iibr_core.depth.estimators.depth_estimator import LocalModel
from iibr_core.depth.estimators.estimate_depth import estimate_with
from iibr_core.depth.estimators.onnx_models import USUAL_PREPARATION, OnnxInput, run_onnx
from iibr_core.depth.estimators.preparation import network_input
from iibr_core.depth.search import open_with_depth
from iibr_core.formats.images.write import write_image
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.types import (
    FloatImage,
    ImageSize,
    InputError,
    Photo,
)
from tests.iibr_core.depth.onnx_graphs import of_channels, weighing
from tests.iibr_core.depth.random_networks import export_depth_anything
from tests.iibr_core.depth.test_transformers_models import depth_anything as depth_anything_folder

BUDGET = 2**30
MEAN, DEVIATION = (np.array(v, np.float32) for v in (USUAL_PREPARATION.mean, USUAL_PREPARATION.std))


def smooth_photo(size: ImageSize) -> FloatImage:
    """Channels that tell top from bottom, left from right, and each other."""
    y, x = np.indices(size, np.float32) / np.array(size, np.float32)[:, None, None]
    return np.stack([0.2 + 0.5 * x, 0.1 + 0.6 * y, 0.3 + 0.2 * x * y], axis=2).astype(np.float32)


def model_of(file: Path) -> LocalModel:
    model = model_to_use(DepthChoice(model=str(file)))
    assert model is not None
    return model


def input_for(file: Path, size: ImageSize, memory_bytes: int) -> OnnxInput:
    return onnx_models.input_for(model_of(file), size, memory_bytes)


def photo_of(pixels: FloatImage) -> Photo:
    return Photo(pixels, 50.0, "photo")


def estimate(file: Path, pixels: FloatImage) -> RelativeInverseDepth | MetricDepth:
    wanted = input_for(file, ImageSize(*pixels.shape[:2]), BUDGET)
    found = run_onnx(model_of(file), wanted, photo_of(pixels))
    assert isinstance(found, RelativeInverseDepth | MetricDepth)
    return found


@pytest.mark.parametrize("channel", [0, 2])
def test_orientation_colour_order_and_normalisation(tmp_path: Path, channel: int) -> None:
    weights = tuple(float(c == channel) for c in range(3))
    pixels = smooth_photo(ImageSize(518, 518))  # the size of the input: nothing is resized
    found = estimate(weighing(tmp_path / "model.onnx", weights), pixels)
    assert isinstance(found, RelativeInverseDepth)
    expected = (pixels[..., channel] - MEAN[channel]) / DEVIATION[channel]
    np.testing.assert_allclose(found.values, expected, atol=1e-4)


@pytest.mark.parametrize(("height", "width"), [(900, 1500), (1, 1), (518, 5000)])
def test_sides_are_multiples_of_14_near_the_photos_aspect(tmp_path: Path, height: int, width: int) -> None:
    wanted = input_for(weighing(tmp_path / "model.onnx", (1, 0, 0)), ImageSize(height, width), BUDGET).size
    assert all(side % 14 == 0 and side >= 28 for side in wanted)
    if max(height, width) < 2.5 * min(height, width):
        assert abs(wanted.width / wanted.height / (width / height) - 1) < 0.05
        assert abs(min(wanted) - 518) <= 14


def test_a_resized_photo_keeps_its_places(tmp_path: Path) -> None:
    """Linear in x and y, cubic resizing gives the value at each new pixel's centre, but for the frame."""
    size, pixels = ImageSize(700, 900), smooth_photo(ImageSize(700, 900))
    file = weighing(tmp_path / "model.onnx", (0, 1, 0))
    wanted = input_for(file, size, BUDGET).size
    found = estimate(file, pixels)
    assert isinstance(found, RelativeInverseDepth)
    assert found.values.shape == wanted
    rows = ((np.arange(wanted.height) + 0.5) * size.height / wanted.height - 0.5) / size.height
    expected = (0.1 + 0.6 * rows - MEAN[1]) / DEVIATION[1]
    inside = slice(4, -4)
    np.testing.assert_allclose(found.values[inside, 100], expected[inside], atol=1e-4)


def test_settings_beside_the_file_count(tmp_path: Path) -> None:
    (tmp_path / "onnx").mkdir()
    file = weighing(tmp_path / "onnx" / "model.onnx", (1, 0, 0))
    preparation = {"size": 28, "image_mean": [0, 0, 0], "image_std": [0.5, 1, 1], "ensure_multiple_of": 14}
    (tmp_path / "preprocessor_config.json").write_text(json.dumps(preparation))
    (tmp_path / "config.json").write_text(json.dumps({"depth_estimation_type": "metric"}))
    pixels = smooth_photo(ImageSize(28, 28))
    found = estimate(file, pixels)
    assert isinstance(found, MetricDepth)
    np.testing.assert_allclose(found.metres, pixels[..., 0] / 0.5, atol=1e-4)


def test_the_input_fits_the_memory(tmp_path: Path) -> None:
    file = weighing(tmp_path / "model.onnx", (1, 0, 0))
    size = ImageSize(1000, 1000)
    small = input_for(file, size, 100 * 2**20).size
    assert small.height * small.width * 1000 < 100 * 2**20
    with pytest.raises(InputError, match="choose a smaller model"):
        input_for(file, size, 2**20)


@pytest.mark.parametrize("damage", ["text", "cut", "empty", "three inputs", "vector"])
def test_what_is_no_depth_model_is_refused_in_one_line(tmp_path: Path, damage: str) -> None:
    file = weighing(tmp_path / "model.onnx", (1, 0, 0))
    if damage == "text":
        file.write_text("no model")
    elif damage == "cut":
        file.write_bytes(file.read_bytes()[:90])
    elif damage == "empty":
        file.write_bytes(b"")
    else:
        vector = helper.make_tensor_value_info("v", TensorProto.FLOAT, [3])
        out = helper.make_tensor_value_info("o", TensorProto.FLOAT, [3])
        graph = helper.make_graph([helper.make_node("Identity", ["v"], ["o"])], "g", [vector], [out])
        onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=10), file)
    with pytest.raises(InputError, match=r"model\.onnx") as caught:
        estimate(file, smooth_photo(ImageSize(40, 50)))
    assert "\n" not in str(caught.value)


def test_a_running_estimate_can_be_stopped(tmp_path: Path) -> None:
    """The graph loops practically for ever: only stopping ends it."""
    file = tmp_path / "model.onnx"
    body = helper.make_graph(
        [helper.make_node("Identity", ["go_in"], ["go_out"]), helper.make_node("Relu", ["x_in"], ["x_out"])],
        "body",
        [
            helper.make_tensor_value_info("i", TensorProto.INT64, []),
            helper.make_tensor_value_info("go_in", TensorProto.BOOL, []),
            helper.make_tensor_value_info("x_in", TensorProto.FLOAT, None),
        ],
        [
            helper.make_tensor_value_info("go_out", TensorProto.BOOL, []),
            helper.make_tensor_value_info("x_out", TensorProto.FLOAT, None),
        ],
    )
    sides = ["batch", 3, "height", "width"]
    graph = helper.make_graph(
        [helper.make_node("Loop", ["count", "go", "pixel_values"], ["predicted_depth"], body=body)],
        "endless",
        [helper.make_tensor_value_info("pixel_values", TensorProto.FLOAT, sides)],
        [helper.make_tensor_value_info("predicted_depth", TensorProto.FLOAT, sides)],
        [numpy_helper.from_array(np.array(2**62), "count"), numpy_helper.from_array(np.array(True), "go")],
    )
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=10), file)
    pixels, asked = smooth_photo(ImageSize(30, 30)), threading.Event()

    def should_stop() -> bool:
        """The second time it is asked, the graph runs."""
        was_asked = asked.is_set()
        asked.set()
        return was_asked

    with pytest.raises(Cancelled), stoppable(should_stop):
        run_onnx(model_of(file), input_for(file, ImageSize(30, 30), BUDGET), photo_of(pixels))


@pytest.fixture(scope="module")
def depth_anything(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, torch.nn.Module]:
    """Depth Anything V2's architecture, small, with random weights, as its library builds and torch exports it."""
    folder = tmp_path_factory.mktemp("model")
    saved = depth_anything_folder(folder / "saved").folder
    network, file = transformers.DepthAnythingForDepthEstimation.from_pretrained(saved).eval(), folder / "model.onnx"
    export_depth_anything(network, file)
    return file, network


@pytest.mark.parametrize(("height", "width"), [(56, 84), (84, 56), (140, 98)])
def test_the_architecture_gives_what_its_library_gives(
    depth_anything: tuple[Path, torch.nn.Module], height: int, width: int
) -> None:
    file, network = depth_anything
    pixels = smooth_photo(ImageSize(height, width))
    wanted = dataclasses.replace(input_for(file, ImageSize(height, width), BUDGET), size=ImageSize(height, width))
    with torch.inference_mode():
        values = torch.from_numpy(network_input(pixels, USUAL_PREPARATION, wanted.size))
        expected = network(pixel_values=values).predicted_depth[0].numpy()
    found = run_onnx(model_of(file), wanted, photo_of(pixels))
    assert isinstance(found, RelativeInverseDepth)
    np.testing.assert_allclose(found.values, expected, atol=1e-4 * np.ptp(expected))


def test_a_folder_with_several_files_asks_which(tmp_path: Path) -> None:
    for name in ("a.onnx", "b.onnx"):
        weighing(tmp_path / name, (1, 0, 0))
    with pytest.raises(InputError, match="which ONNX file is meant"):
        model_of(tmp_path)
    weighing(tmp_path / "model.onnx", (1, 0, 0))
    assert model_of(tmp_path).weights == (tmp_path / "model.onnx",)


@pytest.mark.parametrize(("kind", "package"), [("depth_anything", "onnxruntime"), ("zoedepth", "transformers")])
def test_a_folder_with_both_weights_runs_as_onnx_where_its_output_is_known(
    tmp_path: Path, kind: str, package: str
) -> None:
    """ZoeDepth gives metres, which its ONNX files do not say: taken for inverse depth, near would be far."""
    weighing(tmp_path / "model.onnx", (1, 0, 0))
    (tmp_path / "model.safetensors").touch()
    (tmp_path / "config.json").write_text(json.dumps({"model_type": kind}))
    assert model_of(tmp_path).family.packages[0] == package


def test_an_estimate_is_cached_by_the_file(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(estimate_cache, "cache_folder", lambda: tmp_path / "cache")
    file = weighing(tmp_path / "model.onnx", (1, 0, 0))
    photo = photo_of(smooth_photo(ImageSize(60, 60)))
    first = estimate_with(model_of(file), photo)
    assert len(list((tmp_path / "cache").glob("*.npz"))) == 1
    weighing(file, (0, 1, 0))
    second = estimate_with(model_of(file), photo)
    assert isinstance(first, RelativeInverseDepth)
    assert isinstance(second, RelativeInverseDepth)
    assert np.abs(first.values - second.values).max() > 0.1
    assert len(list((tmp_path / "cache").glob("*.npz"))) == 2


def test_neither_torch_nor_transformers_is_imported(tmp_path: Path) -> None:
    file = weighing(tmp_path / "model.onnx", (1, 1, 1))
    write_image(tmp_path / "photo.png", (smooth_photo(ImageSize(40, 50)) * 255).astype(np.uint8))
    code = (
        "import sys; from pathlib import Path; from iibr_core.depth.choice import DepthChoice; "
        "from iibr_core.depth.search import open_with_depth; "
        f"found = open_with_depth(Path({str(tmp_path / 'photo.png')!r}), DepthChoice(model={str(file)!r})); "
        "print(found.origin.kind, sorted({'torch', 'transformers'} & set(sys.modules)))"
    )
    environment = {**os.environ, "XDG_CACHE_HOME": str(tmp_path)}
    done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=False)
    assert (done.stdout.strip(), done.stderr) == ("model []", "")


@pytest.mark.parametrize(
    "told", [{"last": True}, {"as_bytes": True}, {"last": True, "as_bytes": True}, {"extra_first": True}, {"rank": 4}]
)
def test_networks_of_other_layouts_are_read_alike(tmp_path: Path, told: dict[str, object]) -> None:
    pixels = smooth_photo(ImageSize(112, 112))
    found = values_of(estimate(of_channels(tmp_path / "model.onnx", **told), pixels))  # type: ignore[arg-type]
    red = cv2.resize(pixels[..., 0], found.shape[::-1], interpolation=cv2.INTER_AREA)
    assert np.corrcoef(found.ravel(), red.ravel())[0, 1] > 0.999


@pytest.mark.parametrize(("farness", "config"), [(False, ""), (True, ""), (False, "metric"), (True, "metric")])
def test_the_photo_tells_which_way_round_a_file_of_ones_own_counts(tmp_path: Path, farness: bool, config: str) -> None:
    """Red grows downwards in this photo, where things are nearer; with or without a config, true or not."""
    file = of_channels(tmp_path / "model.onnx", farness=farness)
    if config:
        (tmp_path / "config.json").write_text(f'{{"depth_estimation_type": "{config}"}}')
    pixels = np.zeros((60, 80, 3), np.float32)
    pixels[..., 0] = np.linspace(0.5, 0.9, 60)[:, None]
    pixels[20:30, 30:50, 1] = 0.5
    write_image(tmp_path / "photo.png", pixels)
    found = open_with_depth(tmp_path / "photo.png", DepthChoice(model=str(file), refine=False))
    assert found.disparity.values[-5].mean() > found.disparity.values[5].mean()
    assert any(f"count as {'far' if farness else 'near'}, as" in note for note in found.disparity.notes)
