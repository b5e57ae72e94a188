"""ONNX models whose output is a known function of their input."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import onnx
from onnx import TensorProto, helper, numpy_helper

from iibr_core.types import ImageSize

IR_VERSION, OPSET = 10, 17


def save_graph(file: Path, nodes: list[Any], constants: dict[str, Any], takes: Any, *gives: str) -> Path:
    """Save a graph from nodes and arrays by name. takes: value info of its input, or several; gives: output names."""
    outputs = [helper.make_tensor_value_info(name, TensorProto.FLOAT, None) for name in gives]
    arrays = [numpy_helper.from_array(np.asarray(value), name) for name, value in constants.items()]
    graph = helper.make_graph(nodes, "graph", takes if isinstance(takes, list) else [takes], outputs, arrays)
    opset = helper.make_opsetid("", OPSET)
    onnx.save(helper.make_model(graph, opset_imports=[opset], ir_version=IR_VERSION), str(file))
    return file


def weighing(file: Path, weights: tuple[float, float, float], fixed: ImageSize | None = None) -> Path:
    """A graph whose output is the weighted sum of the input's channels, (N, H, W)."""
    sides: list[int | str] = ["height", "width"] if fixed is None else [*fixed]
    nodes = [
        helper.make_node("Conv", ["pixel_values", "weights"], ["sum"]),
        helper.make_node("Squeeze", ["sum", "axis"], ["predicted_depth"]),
    ]
    constants = {"weights": np.array(weights, np.float32).reshape(1, 3, 1, 1), "axis": [1]}
    takes = helper.make_tensor_value_info("pixel_values", TensorProto.FLOAT, ["batch", 3, *sides])
    return save_graph(file, nodes, constants, takes, "predicted_depth")


def of_points(file: Path, points: np.ndarray, mask: np.ndarray, tokens: int) -> Path:
    """A graph with MoGe's inputs and outputs: these points (H, W, 3) and this mask, whatever the picture is.

    The scale is the picture's largest number, times the number of tokens that it is given, over `tokens`.
    """
    nodes = [
        helper.make_node("ReduceMax", ["image"], ["brightest"], keepdims=0),
        helper.make_node("Cast", ["num_tokens"], ["count"], to=TensorProto.FLOAT),
        helper.make_node("Div", ["count", "right"], ["ratio"]),
        helper.make_node("Mul", ["brightest", "ratio"], ["factor"]),
        helper.make_node("Reshape", ["factor", "one"], ["scale"]),
        helper.make_node("Identity", ["all_points"], ["points"]),
        helper.make_node("Identity", ["all_points"], ["normal"]),
        helper.make_node("Identity", ["all_mask"], ["mask"]),
    ]
    constants = {
        "right": np.float32(tokens),
        "one": np.array([1], np.int64),
        "all_points": points[None].astype(np.float32),
        "all_mask": mask[None].astype(np.float32),
    }
    image = helper.make_tensor_value_info("image", TensorProto.FLOAT, ["batch", 3, *mask.shape])
    count = helper.make_tensor_value_info("num_tokens", TensorProto.INT64, [])
    return save_graph(file, nodes, constants, [image, count], "points", "normal", "mask", "scale")


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


def of_channels(file, last=False, as_bytes=False, extra="", rank=3, farness=False, size=112, channels=3):
    """A network that gives red, or, with `farness`, 300 less red. last: channels; as_bytes: uint8 input; rank: of the
    depth; extra: name of an output before it that holds the input; channels: their number, a name if the file has none.
    """
    axis = 3 if last else 1
    nodes = [
        helper.make_node("Cast", ["x"], ["floats"], to=TensorProto.FLOAT),
        helper.make_node("Gather", ["floats", "red"], ["picked"], axis=axis),
        helper.make_node("Sub", ["most", "picked"], ["far"]),
        helper.make_node("Identity", ["far" if farness else "picked"], ["whole" if rank == 3 else "depth"]),
    ]
    nodes += [helper.make_node("Squeeze", ["whole", "axis"], ["depth"])] if rank == 3 else []
    nodes += [helper.make_node("Identity", ["floats"], [extra])] if extra else []
    shape = [1, size, size, 3] if last else [1, channels, "h", "w"]
    constants = {"red": [0], "axis": [axis], "most": np.float32(300)}
    takes = helper.make_tensor_value_info("x", TensorProto.UINT8 if as_bytes else TensorProto.FLOAT, shape)
    return save_graph(file, nodes, constants, takes, *([extra] if extra else []), "depth")
