import dataclasses
import json
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
import transformers

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.models.catalog import model_to_use
from iibr_core.depth.models.preparation import network_input, read_preparation
from iibr_core.depth.models.torch_models import PREPARATIONS
from iibr_core.types import InputError, Photo
from tests.iibr_core.depth.random_networks import depth_anything, depth_pro, zoedepth

RNG = np.random.default_rng(3)
PHOTO = Photo(RNG.random((40, 60, 3)).astype(np.float32), 50.0, "photo")


@pytest.mark.parametrize(
    ("make", "meaning"),
    [(depth_anything, "inverse depth"), (lambda folder: depth_anything(folder, "metric"), "metres"),
     (zoedepth, "metres")],
)  # fmt: skip
def test_each_kind_of_network_gives_depth_of_its_meaning(make, meaning, tmp_path) -> None:
    found = make(tmp_path / "model").estimate(PHOTO)
    assert found.meaning == meaning
    assert found.values.dtype == np.float32
    assert np.ptp(found.values) > 0
    if make is zoedepth:
        assert found.values.shape == PHOTO.size, "its borders are gone"


def test_the_input_is_as_transformers_prepares_it(tmp_path) -> None:
    """The same as its image processor's but for rounding to bytes, and its network gives the same of it."""
    model = depth_anything(tmp_path / "model")
    config = json.loads((model.folder / "preprocessor_config.json").read_text())
    half = {"image_mean": [0.5] * 3, "image_std": [0.5] * 3}
    processor = transformers.DPTImageProcessorPil(**config, **half, do_resize=True, resample=3)
    smooth = np.dstack([np.add.outer(np.arange(40), np.arange(60)) / 99] * 3).astype(np.float32)
    expected = processor((smooth * 255).round().astype(np.uint8), return_tensors="np")["pixel_values"]
    preparation = read_preparation(model.folder, PREPARATIONS["depth_anything"])
    values = network_input(smooth, preparation, preparation.size_for(PHOTO.size))
    np.testing.assert_allclose(values, expected, atol=2 / 255 / 0.5)
    network = transformers.DepthAnythingForDepthEstimation.from_pretrained(model.folder).eval()
    with torch.inference_mode():
        depth = network(pixel_values=torch.from_numpy(values)).predicted_depth[0].numpy()
    found = model.estimate(dataclasses.replace(PHOTO, pixels=smooth)).values
    np.testing.assert_allclose(found, depth, rtol=1e-3)


def test_the_field_of_view_gives_depth_pros_metres(tmp_path) -> None:
    """As its authors have it: inverse distance = output * width / focal length."""
    model = depth_pro(tmp_path / "model")
    photo = dataclasses.replace(PHOTO, pixels=RNG.random((128, 128, 3)).astype(np.float32))
    network = transformers.DepthProForDepthEstimation.from_pretrained(model.folder).eval()
    with torch.inference_mode():
        output = network(torch.from_numpy((photo.pixels - 0.5) / 0.5).permute(2, 0, 1)[None])
    focal_widths = 0.5 / np.tan(np.radians(float(output.field_of_view[0])) / 2)
    inverse = np.clip(output.predicted_depth[0].numpy() / focal_widths, 1e-4, 1e4)
    found = model.estimate(photo)
    assert found.meaning == "metres"
    np.testing.assert_allclose(found.values, 1 / inverse, rtol=1e-2)


def with_settings(**settings: object) -> Callable[[Path], object]:
    return lambda path: path.write_text(json.dumps(json.loads(path.read_text()) | settings))


@pytest.mark.parametrize(
    ("name", "damage", "message"),
    [
        ("config.json", lambda path: path.write_text("{"), "config.json"),
        ("config.json", Path.unlink, "holds no config.json"),
        ("config.json", with_settings(model_type="llama"), "llama"),
        ("config.json", with_settings(backbone="somebody/model"), "needs another model, somebody/model"),
        ("preprocessor_config.json", with_settings(size="big"), "preprocessor_config.json"),
        ("model.safetensors", lambda path: path.rename(path.with_name("pytorch_model.bin")), "holds no .safetensors"),
        ("model.safetensors", lambda path: path.write_bytes(path.read_bytes()[:-100]), "cannot be used"),
    ],
)
def test_damaged_folders_are_one_line(name, damage, message, tmp_path) -> None:
    folder = depth_anything(tmp_path / "model").folder
    damage(folder / name)
    with pytest.raises(InputError, match=rf"^[^\n]*{message}[^\n]*$"):
        model_to_use(DepthChoice(model=str(folder))).estimate(PHOTO)
    assert not list((tmp_path / "cache").rglob("*.npz")), "nothing of that is kept"


UNIDEPTH = """
import torch
class UniDepthV2:
    @classmethod
    def from_pretrained(cls, folder): return cls()
    def eval(self): return self
    def infer(self, rgb):
        assert rgb.dtype == torch.uint8 and rgb.shape[0] == 3
        depth = rgb[:1].float()[None] / 10 + 1
        depth[0, 0, 0, 0] = float("inf")
        return {"depth": depth}
"""


def test_unidepth_is_called_as_its_package_documents(monkeypatch, tmp_path) -> None:
    """A stand-in: the package is not in any registry. What it gives passes through with its unknowns."""
    folder = tmp_path / "weights"
    for made in (tmp_path / "unidepth", folder):
        made.mkdir()
    (folder / "config.json").write_text('{"model": {"name": "UniDepthV2"}}')
    (folder / "model.safetensors").touch()
    with pytest.raises(InputError, match="needs the package unidepth first: follow github"):
        model_to_use(DepthChoice(model=str(folder)))
    (tmp_path / "unidepth" / "__init__.py").touch()
    (tmp_path / "unidepth" / "models.py").write_text(UNIDEPTH)
    monkeypatch.syspath_prepend(str(tmp_path))
    found = model_to_use(DepthChoice(model=str(folder))).estimate(PHOTO)
    assert found.meaning == "metres"
    assert np.argwhere(np.isnan(found.values)).tolist() == [[0, 0]]
    for name in [name for name in sys.modules if name.startswith("unidepth")]:
        del sys.modules[name]
