"""Networks of depth models with random weights, as transformers builds and saves them."""

import json
from pathlib import Path
from typing import Any

import torch
import transformers

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.models.catalog import LocalModel, model_to_use

LAYERS = {"hidden_size": 32, "num_hidden_layers": 4, "num_attention_heads": 2, "intermediate_size": 32}
HEAD = {"neck_hidden_sizes": [8, 8, 8, 8], "fusion_hidden_size": 8}


def saved(network: Any, folder: Path, **preparation: object) -> LocalModel:
    """Save a network with weights that let something of the photo reach the output; return it as users name it."""
    torch.manual_seed(0)
    with torch.no_grad():
        for weights in network.parameters():
            if weights.ndim > 1:
                weights.normal_(0, weights[0].numel() ** -0.5)
    network.eval().save_pretrained(folder)
    (folder / "preprocessor_config.json").write_text(json.dumps(preparation))
    model = model_to_use(DepthChoice(model=str(folder)))
    assert model is not None
    return model


def depth_anything(folder: Path, kind: str = "relative") -> LocalModel:
    backbone = {**LAYERS, "model_type": "dinov2", "image_size": 56, "patch_size": 14, "reshape_hidden_states": False}
    config = transformers.DepthAnythingConfig(
        backbone_config={**backbone, "out_indices": [1, 2, 3, 4]}, reassemble_hidden_size=32, head_hidden_size=8,
        depth_estimation_type=kind, max_depth=20, **HEAD,
    )  # fmt: skip
    network = transformers.DepthAnythingForDepthEstimation(config)
    with torch.no_grad():  # random weights rarely reach beyond the last rectifier
        network.head.conv3.bias += 1
    return saved(network, folder, size={"height": 56, "width": 56}, keep_aspect_ratio=True, ensure_multiple_of=14)


def zoedepth(folder: Path) -> LocalModel:
    backbone = {**LAYERS, "model_type": "beit", "image_size": 64, "patch_size": 16, "reshape_hidden_states": False}
    stages = [f"stage{n}" for n in range(1, 5)]
    config = transformers.ZoeDepthConfig(
        backbone_config={**backbone, "out_features": stages, "use_relative_position_bias": True},
        bottleneck_features=8, num_relative_features=8, bin_embedding_dim=8, num_attractors=[4, 2, 2, 1], **HEAD,
    )  # fmt: skip
    network = transformers.ZoeDepthForDepthEstimation(config)
    return saved(network, folder, size={"height": 64, "width": 64}, keep_aspect_ratio=True, ensure_multiple_of=32)


def depth_pro(folder: Path) -> LocalModel:
    part = {**LAYERS, "image_size": 32, "patch_size": 8, "model_type": "dinov2"}
    config = transformers.DepthProConfig(
        patch_size=32, fusion_hidden_size=8, intermediate_hook_ids=[2, 0], intermediate_feature_dims=[8, 8],
        scaled_images_feature_dims=[8, 8, 8], image_model_config=part, patch_model_config=part, fov_model_config=part,
        use_fov_model=True,
    )  # fmt: skip
    network = transformers.DepthProForDepthEstimation(config)
    with torch.no_grad():
        list(network.fov_model.parameters())[-1].fill_(60.0)
    return saved(network, folder, size={"height": 128, "width": 128})
