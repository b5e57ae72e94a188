"""Networks of depth models with random weights, as the library that publishes them builds them, and as ONNX files."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import torch
import transformers


def depth_anything_network(backbone: dict[str, Any], **config: Any) -> torch.nn.Module:
    """Depth Anything V2. backbone, config: settings that differ from the library's."""
    backbone = {"model_type": "dinov2", "reshape_hidden_states": False, **backbone}
    network = transformers.DepthAnythingForDepthEstimation(
        transformers.DepthAnythingConfig(backbone_config=backbone, **config)
    )
    with torch.no_grad():  # random weights rarely reach beyond the last rectifier
        network.head.conv3.bias += 1
    return network


def with_random_weights(network: Any) -> Any:
    """Large enough that something of the photo reaches the output: they are meant to be trained."""
    with torch.no_grad():
        for weights in network.parameters():
            if weights.ndim > 1:
                weights.normal_(0, weights[0].numel() ** -0.5)
    return network.eval()


def export_depth_anything(network: torch.nn.Module, file: Path) -> None:
    """As an ONNX file that takes inputs of any size."""
    torch.onnx.export(
        WithSymbolicSize(network).eval(),
        (torch.zeros(1, 3, 56, 84),),
        file,
        dynamo=False,
        input_names=["pixel_values"],
        output_names=["predicted_depth"],
        dynamic_axes={"pixel_values": {2: "rows", 3: "columns"}},
    )


class WithSymbolicSize(torch.nn.Module):
    """The network, its head's last steps repeated without `int()`, which would fix the exported size."""

    def __init__(self, network: torch.nn.Module) -> None:
        super().__init__()
        self.network = network

    def forward(self, pixel_values: torch.Tensor) -> torch.Tensor:
        network, (rows, columns) = self.network, (side // 14 for side in pixel_values.shape[2:])
        features = network.backbone.forward_with_filtered_kwargs(pixel_values).feature_maps
        head, hidden = network.head, network.neck(features, rows, columns)[network.head.head_in_index]
        hidden = torch.nn.functional.interpolate(
            head.conv1(hidden), (rows * 14, columns * 14), mode="bilinear", align_corners=True
        )
        return head.activation2(head.conv3(head.activation1(head.conv2(hidden)))).squeeze(1) * head.max_depth
