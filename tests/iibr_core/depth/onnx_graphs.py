"""ONNX models whose output is a known function of their input."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from iibr_core.types import ImageSize


def weighing(file: Path, weights: tuple[float, float, float], fixed: ImageSize | None = None) -> Path:
    """A graph whose output is the weighted sum of the input's channels, (N, H, W)."""
    sides: list[int | str] = ["height", "width"] if fixed is None else [*fixed]
    nodes = [
        helper.make_node("Conv", ["pixel_values", "weights"], ["sum"]),
        helper.make_node("Squeeze", ["sum", "axis"], ["predicted_depth"]),
    ]
    constants = [
        numpy_helper.from_array(np.array(weights, np.float32).reshape(1, 3, 1, 1), "weights"),
        numpy_helper.from_array(np.array([1]), "axis"),
    ]
    graph = helper.make_graph(
        nodes,
        "weighing",
        [helper.make_tensor_value_info("pixel_values", TensorProto.FLOAT, ["batch", 3, *sides])],
        [helper.make_tensor_value_info("predicted_depth", TensorProto.FLOAT, ["batch", *sides])],
        constants,
    )
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=10), file)
    return file


def published(folder: Path) -> dict[str, bytes]:
    """The files of a small model by their names, as the hub's repositories of ONNX models have them."""
    (folder / "onnx").mkdir(parents=True)
    model = weighing(folder / "onnx" / "model.onnx", (1, 1, 1))
    preparation = {"size": {"height": 56, "width": 56}, "keep_aspect_ratio": True, "ensure_multiple_of": 14}
    return {
        "config.json": json.dumps({"model_type": "depth_anything"}).encode(),
        "preprocessor_config.json": json.dumps(preparation).encode(),
        "onnx/model.onnx": model.read_bytes(),
    }


def of_channels(
    file: Path,
    last: bool = False,
    as_bytes: bool = False,
    extra_first: bool = False,
    rank: int = 3,
    farness: bool = False,
    size: int = 112,
) -> Path:
    """A network of one channel, red: its depth, or, with `farness`, 300 less it. last: channels; as_bytes: uint8 input;
    extra_first: gives its input before the depth; rank: of the depth.
    """
    axis = 3 if last else 1
    kind = TensorProto.UINT8 if as_bytes else TensorProto.FLOAT
    shape = [1, size, size, 3] if last else [1, 3, "h", "w"]
    nodes = [
        helper.make_node("Cast", ["x"], ["floats"], to=TensorProto.FLOAT),
        helper.make_node("Gather", ["floats", "red"], ["picked"], axis=axis),
        helper.make_node("Sub", ["most", "picked"], ["far"]),
        helper.make_node("Identity", ["far" if farness else "picked"], ["whole"]),
        helper.make_node("Squeeze", ["whole", "axis"], ["depth"])
        if rank == 3
        else helper.make_node("Identity", ["whole"], ["depth"]),
    ]
    constants = [
        helper.make_tensor("red", TensorProto.INT64, [1], [0]),
        helper.make_tensor("axis", TensorProto.INT64, [1], [axis]),
        helper.make_tensor("most", TensorProto.FLOAT, [], [300.0]),
    ]
    outputs = [helper.make_tensor_value_info("depth", TensorProto.FLOAT, None)]
    if extra_first:
        nodes.append(helper.make_node("Identity", ["floats"], ["features"]))
        outputs.insert(0, helper.make_tensor_value_info("features", TensorProto.FLOAT, None))
    graph = helper.make_graph(nodes, "g", [helper.make_tensor_value_info("x", kind, shape)], outputs, constants)
    onnx.save(helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=9), file)
    return file
