"""Depth by trained models, on tiny checkpoints with random weights that the library itself saves."""

from __future__ import annotations

import dataclasses
import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import transformers

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.estimates import DisparityMap, Estimate, MetricDepth, RelativeInverseDepth
from iibr_core.depth.estimators import estimate_cache
from iibr_core.depth.estimators.catalog import known_model, model_here, model_to_use
from iibr_core.depth.estimators.depth_estimator import LocalModel
from iibr_core.depth.estimators.download import VERIFIED
from iibr_core.depth.estimators.estimate_depth import estimate_with
from iibr_core.depth.estimators.known_models import FAMILIES
from iibr_core.depth.estimators.preparation import Preparation, input_size
from iibr_core.depth.estimators.transformers_models import FAMILY
from iibr_core.depth.search import estimator_of, open_with_depth
from iibr_core.formats.images.write import write_image
from iibr_core.runtime.work import Cancelled, stoppable, watched
from iibr_core.types import ImageSize, InputError, Photo
from tests.iibr_core.depth.random_networks import depth_anything_network, with_random_weights

RNG = np.random.default_rng(3)
PHOTO = Photo(RNG.random((40, 60, 3)).astype(np.float32), 50.0, "photo")
BACKBONE = {
    "hidden_size": 32,
    "num_hidden_layers": 4,
    "num_attention_heads": 2,
    "image_size": 56,
    "patch_size": 14,
    "intermediate_size": 32,
}
FEATURES = {"out_indices": [1, 2, 3, 4], "reshape_hidden_states": False, "model_type": "dinov2"}


@pytest.fixture(autouse=True)
def own_cache(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """No test reads or fills the user's cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(estimate_cache, "cache_folder", lambda: tmp_path / "cache" / "depth")
    return tmp_path / "cache" / "depth"


def saved(network: Any, folder: Path, **preparation: object) -> LocalModel:
    """With random weights, and how photos are prepared for it."""
    with_random_weights(network).save_pretrained(folder)
    (folder / "preprocessor_config.json").write_text(json.dumps(preparation))
    return in_folder(folder)


def in_folder(folder: Path) -> LocalModel:
    return LocalModel("Tiny", folder, FAMILY, FAMILY.weights_in(folder))


def opened(folder: Path) -> LocalModel:
    """As users name it."""
    model = model_to_use(DepthChoice(model=str(folder)))
    assert model is not None
    return model


def depth_anything(folder: Path, kind: str = "relative", seed: int = 0) -> LocalModel:
    torch.manual_seed(seed)
    network = depth_anything_network(
        {**BACKBONE, **FEATURES},
        reassemble_hidden_size=32,
        neck_hidden_sizes=[8, 8, 8, 8],
        fusion_hidden_size=8,
        head_hidden_size=8,
        depth_estimation_type=kind,
        max_depth=20,
    )
    return saved(network, folder, size={"height": 56, "width": 56}, keep_aspect_ratio=True, ensure_multiple_of=14)


def dpt(folder: Path) -> LocalModel:
    torch.manual_seed(0)
    config = transformers.DPTConfig(
        hidden_size=32,
        num_hidden_layers=4,
        num_attention_heads=2,
        intermediate_size=32,
        image_size=64,
        patch_size=16,
        backbone_out_indices=[0, 1, 2, 3],
        neck_hidden_sizes=[8, 8, 8, 8],
        fusion_hidden_size=8,
        is_hybrid=False,
    )
    network = transformers.DPTForDepthEstimation(config)
    with torch.no_grad():
        network.head.head[4].bias += 1
    return saved(network, folder, size={"height": 64, "width": 64}, image_mean=[0.5] * 3, image_std=[0.5] * 3)


def zoedepth(folder: Path) -> LocalModel:
    torch.manual_seed(0)
    config = transformers.ZoeDepthConfig(
        backbone_config={
            "model_type": "beit",
            "hidden_size": 32,
            "num_hidden_layers": 4,
            "num_attention_heads": 2,
            "intermediate_size": 32,
            "image_size": 64,
            "patch_size": 16,
            "reshape_hidden_states": False,
            "out_features": ["stage1", "stage2", "stage3", "stage4"],
            "use_relative_position_bias": True,
        },
        neck_hidden_sizes=[8, 8, 8, 8],
        fusion_hidden_size=8,
        bottleneck_features=8,
        num_relative_features=8,
        bin_embedding_dim=8,
        num_attractors=[4, 2, 2, 1],
    )
    network = transformers.ZoeDepthForDepthEstimation(config)
    return saved(network, folder, size={"height": 64, "width": 64}, keep_aspect_ratio=True, ensure_multiple_of=32)


def depth_pro(folder: Path, with_field_of_view: bool = True) -> LocalModel:
    torch.manual_seed(0)
    part = {**BACKBONE, "image_size": 32, "patch_size": 8, "model_type": "dinov2"}
    config = transformers.DepthProConfig(
        patch_size=32,
        fusion_hidden_size=8,
        intermediate_hook_ids=[2, 0],
        intermediate_feature_dims=[8, 8],
        scaled_images_feature_dims=[8, 8, 8],
        image_model_config=part,
        patch_model_config=part,
        fov_model_config=part,
        use_fov_model=with_field_of_view,
    )
    network = transformers.DepthProForDepthEstimation(config)
    if with_field_of_view:
        with torch.no_grad():
            list(network.fov_model.parameters())[-1].fill_(60.0)
    return saved(network, folder, size={"height": 128, "width": 128})


def values_of(estimate: Estimate) -> np.ndarray:
    match estimate:
        case RelativeInverseDepth(values) | MetricDepth(values) | DisparityMap(values):
            return values


@pytest.mark.parametrize(
    ("make", "kind"),
    [
        (depth_anything, RelativeInverseDepth),
        (lambda folder: depth_anything(folder, "metric"), MetricDepth),
        (dpt, RelativeInverseDepth),
        (zoedepth, MetricDepth),
        (depth_pro, MetricDepth),
        (lambda folder: depth_pro(folder, with_field_of_view=False), RelativeInverseDepth),
    ],
)
def test_each_kind_of_network_says_what_it_knows(
    make: Callable[[Path], LocalModel], kind: type, tmp_path: Path
) -> None:
    found = estimate_with(make(tmp_path / "model"), PHOTO)
    assert type(found) is kind
    values = values_of(found)
    assert values.dtype == np.float32
    assert np.isfinite(values).all()
    assert np.ptp(values) > 0
    if isinstance(found, MetricDepth):
        assert (values > 0).all()


def test_as_the_library_prepares_and_reads_it(tmp_path: Path) -> None:
    """The library's own image processor, its network, its output: the same but for rounding to bytes."""
    model = depth_anything(tmp_path / "model")
    config = json.loads((model.folder / "preprocessor_config.json").read_text())
    processor = transformers.DPTImageProcessorPil(
        **config, image_mean=[0.5] * 3, image_std=[0.5] * 3, do_resize=True, resample=3
    )
    network = transformers.DepthAnythingForDepthEstimation.from_pretrained(model.folder).eval()
    smooth = np.dstack([np.add.outer(np.arange(40), np.arange(60)) / 99] * 3).astype(np.float32)
    pixels = processor((smooth * 255).round().astype(np.uint8), return_tensors="pt")["pixel_values"]
    with torch.inference_mode():
        expected = network(pixel_values=pixels).predicted_depth[0].numpy()
    found = values_of(estimate_with(model, dataclasses.replace(PHOTO, pixels=smooth)))
    assert found.shape == expected.shape
    np.testing.assert_allclose(found, expected, atol=0.02 * np.ptp(expected))


def test_what_was_painted_is_seen_by_the_network_that_saw_the_photo(tmp_path: Path) -> None:
    choice = DepthChoice(model=str(depth_anything(tmp_path / "model").folder), start="model", refine=False)
    write_image(tmp_path / "photo.png", (PHOTO.pixels * 255).round().astype(np.uint8))
    found = open_with_depth(tmp_path / "photo.png", choice)
    estimate = estimator_of(found, choice)
    assert estimate is not None
    np.testing.assert_array_equal(estimate(found.photo.pixels), found.disparity.values)
    assert (estimate(1 - found.photo.pixels) != found.disparity.values).any()
    rough = DepthChoice(start="rough")
    assert estimator_of(open_with_depth(tmp_path / "photo.png", rough), rough) is None


def test_zoedepth_loses_its_borders_again(tmp_path: Path) -> None:
    assert values_of(estimate_with(zoedepth(tmp_path / "model"), PHOTO)).shape == PHOTO.size


def test_the_field_of_view_gives_metres_and_the_focal_length(tmp_path: Path) -> None:
    """As Depth Pro's authors have it: inverse distance = output * width / focal length, here from the library's run."""
    model = depth_pro(tmp_path / "model")
    photo = dataclasses.replace(PHOTO, pixels=RNG.random((128, 128, 3)).astype(np.float32))
    found = estimate_with(model, photo)
    assert isinstance(found, MetricDepth)
    network = transformers.DepthProForDepthEstimation.from_pretrained(model.folder).eval()
    with torch.inference_mode():
        output = network(torch.from_numpy((photo.pixels - 0.5) / 0.5).permute(2, 0, 1)[None])
    width = found.metres.shape[1]
    focal_px = 0.5 * width / np.tan(np.radians(float(output.field_of_view[0])) / 2)
    inverse = np.clip(output.predicted_depth[0].numpy() * width / focal_px, 1e-4, 1e4)
    np.testing.assert_allclose(found.metres, 1 / inverse, rtol=1e-2)


@pytest.mark.parametrize("size", [(1, 1), (3, 400)])
@pytest.mark.parametrize("make", [depth_anything, dpt, zoedepth])
def test_photos_of_any_shape(make: Callable[[Path], LocalModel], size: tuple[int, int], tmp_path: Path) -> None:
    photo = Photo(RNG.random((*size, 3)).astype(np.float32) * 3, 50.0, "odd")
    try:
        found = estimate_with(make(tmp_path / "model"), photo)
    except InputError as error:
        assert "everywhere" in str(error)  # noqa: PT017 - of one pixel there is nothing to tell
        assert max(size) == 1
        return
    assert np.isfinite(values_of(found)).all()


# ---- sizes


PREPARATION = Preparation((518, 518), True, 14, False, (0.5,) * 3, (0.5,) * 3)


@pytest.mark.parametrize(
    ("size", "expected"),
    [((1000, 1000), (518, 518)), ((600, 800), (518, 686)), ((800, 600), (686, 518)), ((1080, 1920), (518, 924))],
)
def test_the_input_is_as_large_as_the_library_makes_it(size: tuple[int, int], expected: tuple[int, int]) -> None:
    assert input_size(PREPARATION, ImageSize(*size), 1e9) == expected


@pytest.mark.parametrize("size", [(1, 1), (10, 10_000), (10_000, 10), (1, 100_000), (3000, 4000)])
@pytest.mark.parametrize("max_pixels", [28 * 28, 10_000, 1e9])
def test_the_input_never_exceeds_what_is_allowed(size: tuple[int, int], max_pixels: float) -> None:
    height, width = input_size(PREPARATION, ImageSize(*size), max_pixels)
    assert height % 14 == width % 14 == 0
    assert min(height, width) >= 28
    assert height * width <= min(max_pixels, 2.5 * 518 * 518)


def test_less_memory_gives_a_smaller_input_and_none_gives_an_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    model, shapes = depth_anything(tmp_path / "model"), []
    for free in (2**31, 6 * 2**20):
        monkeypatch.setattr("iibr_core.depth.estimators.estimate_depth.free_memory_bytes", lambda: free)  # noqa: B023
        shapes.append(values_of(estimate_with(model, PHOTO)).shape)
    assert shapes[1] < shapes[0]
    monkeypatch.setattr("iibr_core.depth.estimators.estimate_depth.free_memory_bytes", lambda: 2000)
    with pytest.raises(InputError, match="choose a smaller model"):
        estimate_with(model, PHOTO)


# ---- what is wrong with folders


def test_pickled_weights_are_refused(tmp_path: Path) -> None:
    model = depth_anything(tmp_path / "model")
    (model.folder / "model.safetensors").unlink()
    (model.folder / "pytorch_model.bin").write_bytes(b"pickle")
    with pytest.raises(InputError, match="pickled"):
        opened(model.folder)


def cut(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-100])


def of_another_kind(path: Path) -> None:
    path.write_text(json.dumps(json.loads(path.read_text()) | {"model_type": "llama"}))


@pytest.mark.parametrize(
    ("name", "damage", "named"),
    [
        ("config.json", cut, "config.json"),
        ("config.json", of_another_kind, "llama"),
        ("preprocessor_config.json", Path.unlink, "preprocessor_config.json"),
        ("preprocessor_config.json", lambda path: path.write_text('{"size": "big"}'), "preprocessor_config.json"),
        ("preprocessor_config.json", lambda path: path.write_text('{"image_std": [0, 1, 1]}'), "no sense"),
        ("model.safetensors", Path.unlink, "holds no .safetensors"),
        ("model.safetensors", cut, "cannot be loaded"),
    ],
)
def test_damaged_folders_are_one_line(name: str, damage: Callable[[Path], object], named: str, tmp_path: Path) -> None:
    model = depth_anything(tmp_path / "model")
    damage(model.folder / name)
    with pytest.raises(InputError, match=named) as caught:
        estimate_with(opened(model.folder), PHOTO)
    assert "\n" not in str(caught.value)


def test_weights_of_another_network_are_told(tmp_path: Path) -> None:
    model, other = depth_anything(tmp_path / "model"), dpt(tmp_path / "other")
    (model.folder / "model.safetensors").write_bytes((other.folder / "model.safetensors").read_bytes())
    with pytest.raises(InputError, match="lack"):
        estimate_with(model, PHOTO)


def test_nan_in_the_weights_is_told_and_not_kept(tmp_path: Path, own_cache: Path) -> None:
    from safetensors.torch import load_file, save_file

    model = depth_anything(tmp_path / "model")
    path = model.folder / "model.safetensors"
    weights = load_file(path)
    weights["head.conv3.bias"][:] = float("nan")
    save_file(weights, path, {"format": "pt"})
    with pytest.raises(InputError, match="NaN"):
        estimate_with(model, PHOTO)
    assert not list(own_cache.glob("*.npz"))


# ---- stopping, telling, keeping


def test_it_stops_between_layers_and_tells_how_far_it_is(tmp_path: Path, own_cache: Path) -> None:
    model = depth_anything(tmp_path / "model")
    shares: list[float] = []
    with watched(lambda done, total, _: shares.append(done / total if total else 0.0)):
        estimate_with(model, PHOTO)
    assert shares == sorted(shares)
    assert len(shares) > 50
    for path in own_cache.glob("*"):
        path.unlink()
    told: list[float] = []
    with pytest.raises(Cancelled), stoppable(lambda: len(told) >= 20), watched(lambda done, *_: told.append(done)):
        estimate_with(model, PHOTO)
    assert len(told) == 20
    assert not list(own_cache.glob("*"))


def test_a_kept_estimate_needs_no_network(tmp_path: Path, own_cache: Path) -> None:
    model = depth_anything(tmp_path / "model")
    first = estimate_with(model, PHOTO)
    doings: set[str] = set()
    with watched(lambda done, total, doing: doings.add(doing)):
        again = estimate_with(model, PHOTO)
    np.testing.assert_array_equal(values_of(first), values_of(again))
    assert not any("loading" in doing for doing in doings)
    assert len(list(own_cache.glob("*.npz"))) == 1
    # Another photo, and other weights, are something else.
    other = dataclasses.replace(PHOTO, pixels=PHOTO.pixels[::-1])
    assert not np.array_equal(values_of(estimate_with(model, other)), values_of(first))
    assert not np.array_equal(values_of(estimate_with(depth_anything(tmp_path / "b", seed=1), PHOTO)), values_of(first))
    # The same contents elsewhere are the same.
    model.folder.rename(tmp_path / "moved")
    np.testing.assert_array_equal(values_of(estimate_with(in_folder(tmp_path / "moved"), PHOTO)), values_of(first))
    assert len(list(own_cache.glob("*.npz"))) == 3


@pytest.mark.parametrize(
    "estimate",
    [
        RelativeInverseDepth(np.array([[1, np.nan]], np.float32)),
        MetricDepth(np.array([[1, 2]], np.float32)),
        DisparityMap(np.array([[1, -2]], np.float32)),
    ],
)
def test_every_estimate_comes_back_as_it_was(estimate: Estimate) -> None:
    estimate_cache.store("key", estimate)
    found = estimate_cache.load("key")
    assert found is not None
    assert type(found) is type(estimate)
    np.testing.assert_array_equal(values_of(found), values_of(estimate))


def test_the_cache_is_bounded_and_the_oldest_go(monkeypatch: pytest.MonkeyPatch, own_cache: Path) -> None:
    monkeypatch.setattr(estimate_cache, "MAX_BYTES", 10_000)
    estimate = RelativeInverseDepth(np.zeros((20, 40), np.float32))  # 3,200 bytes, and some for the names
    for n, key in enumerate("abcd"):
        estimate_cache.store(key, estimate)
        os.utime(own_cache / f"{key}.npz", (n, n))
        if key == "b":
            os.utime(own_cache / "a.npz", (99, 99))  # used again
    estimate_cache.store("e", estimate)
    assert {path.stem for path in own_cache.glob("*.npz")} == {"a", "e"}


# ---- which model


def test_models_are_found_by_folder_and_by_name(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("huggingface_hub.constants.HF_HUB_CACHE", str(tmp_path / "hub"))
    folder = depth_anything(tmp_path / "model").folder
    found = LocalModel("the model in model", folder, FAMILY, (folder / "model.safetensors",))
    assert model_to_use(DepthChoice(model=str(folder))) == found
    assert model_to_use(DepthChoice(model=None)) is None
    with pytest.raises(InputError, match="iibr models get depth-pro"):
        model_to_use(DepthChoice(model="depth-pro"))
    published = known_model("depth-anything-v2-metric-indoor")
    snapshot = tmp_path / "hub" / f"models--{published.repository.replace('/', '--')}" / "snapshots" / published.commit
    snapshot.parent.mkdir(parents=True)
    folder.rename(snapshot)
    assert model_here(published) is None  # nobody verified it
    (snapshot / VERIFIED).write_text("{}")
    named = model_to_use(DepthChoice(model=published.name))
    assert named is not None
    assert (named.title, named.folder) == (published.title, snapshot)
    (snapshot / "model.safetensors").unlink()
    assert model_here(published) is None


@pytest.mark.parametrize(
    "changes",
    [
        {"backbone": "somebody/model", "backbone_config": None, "use_pretrained_backbone": True},
        {"backbone_config": {"model_type": "timm_backbone", "backbone": "somebody/model"}},
    ],
)
def test_a_config_cannot_have_another_model_fetched(tmp_path: Path, changes: dict[str, object]) -> None:
    model = depth_anything(tmp_path / "model")
    path = model.folder / "config.json"
    path.write_text(json.dumps({**json.loads(path.read_text()), **changes}))
    with pytest.raises(InputError, match="needs another model, somebody/model, which is not downloaded"):
        estimate_with(model, PHOTO)


@pytest.mark.parametrize("package", ["depth_anything_3"])
def test_models_of_packages_that_are_not_installed(package: str) -> None:
    model = next(family for family in FAMILIES if family.packages[0] == package).models[0]
    with pytest.raises(InputError, match=f"package {package}.*not installed"):
        model_to_use(DepthChoice(model=model.name))


UNIDEPTH = """
import numpy as np, torch
class UniDepthV2:
    @classmethod
    def from_pretrained(cls, folder): return cls()
    def eval(self): return self
    def infer(self, rgb):
        assert rgb.dtype == torch.uint8 and rgb.shape[0] == 3
        depth = rgb[:1].float()[None] / 10 + 1
        depth[0, 0, 0, 0] = float("inf")
        return {"depth": depth, "intrinsics": torch.tensor([[[70.0, 0, 0], [0, 70.0, 0], [0, 0, 1]]])}
"""


def test_a_package_is_called_as_it_documents(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """A stand-in for UniDepth: the real one is not to be had here. What it gives passes through with its unknowns."""
    (tmp_path / "unidepth").mkdir()
    (tmp_path / "unidepth" / "__init__.py").touch()
    (tmp_path / "unidepth" / "models.py").write_text(UNIDEPTH)
    monkeypatch.syspath_prepend(str(tmp_path))
    folder = tmp_path / "weights"
    folder.mkdir()
    (folder / "config.json").write_text('{"model": {"name": "UniDepthV2"}}')
    (folder / "model.safetensors").touch()
    model = model_to_use(DepthChoice(model=str(folder)))
    assert model is not None
    found = estimate_with(model, PHOTO)
    assert isinstance(found, MetricDepth)
    assert np.isnan(found.metres[0, 0])
    assert np.isnan(found.metres).sum() == 1
    for name in [name for name in sys.modules if name.startswith("unidepth")]:
        del sys.modules[name]
