import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper
from onnx.external_data_helper import set_external_data

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.models import cache
from iibr_core.depth.models.catalog import LocalModel, known_model, model_here, model_to_use
from iibr_core.depth.models.download import local_folder
from iibr_core.depth.models.onnx import depth_output
from iibr_core.depth.models.points import depth_of_points
from iibr_core.depth.models.preparation import USUAL_PREPARATION, read_preparation
from iibr_core.depth.search import estimator_of, find_depth, open_with_depth
from iibr_core.formats.images.photo import focal_px_from_fov
from iibr_core.formats.images.write import write_image
from iibr_core.interface.public_scene import estimate_depth
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.types import FloatImage, ImageSize, InputError, Photo
from tests.iibr_core.depth.drawn_photo import usual_disparity
from tests.iibr_core.depth.onnx_graphs import of_channels, of_points, save_graph, weighing

MEAN, DEVIATION = (np.array(values, np.float32) for values in (USUAL_PREPARATION.mean, USUAL_PREPARATION.std))
MAP = np.arange(56 * 84, dtype=np.float32)


def photo_of(height: int, width: int) -> Photo:
    """Channels that tell top from bottom, left from right, and each other."""
    y, x = np.indices((height, width), np.float32) / np.array((height, width), np.float32)[:, None, None]
    pixels = np.stack([0.2 + 0.5 * x, 0.1 + 0.6 * y, 0.3 + 0.2 * x * y], axis=2).astype(np.float32)
    return Photo(pixels, 50.0, "photo")


def model_of(file: Path) -> LocalModel:
    model = model_to_use(DepthChoice(model=str(file)))
    assert model is not None
    return model


def values_of(file: Path, photo: Photo) -> FloatImage:
    return model_of(file).estimate(photo).values


@pytest.mark.parametrize("channel", [0, 2])
def test_orientation_order_of_colours_and_normalisation(tmp_path, channel) -> None:
    weights = tuple(float(c == channel) for c in range(3))
    photo = photo_of(518, 518)  # the size of the input: nothing is resized
    found = model_of(weighing(tmp_path / "model.onnx", weights)).estimate(photo)
    assert found.meaning == "inverse depth"
    expected = (photo.pixels[..., channel] - MEAN[channel]) / DEVIATION[channel]
    np.testing.assert_allclose(found.values, expected, atol=1e-4)


@pytest.mark.parametrize(("height", "width"), [(700, 900), (900, 700), (90, 200), (1, 1), (518, 5000), (5000, 518)])
def test_the_input_has_the_photos_aspect_in_multiples_of_14(height, width) -> None:
    size = USUAL_PREPARATION.size_for(ImageSize(height, width))
    assert all(side % 14 == 0 and side >= 28 for side in size)
    fixed = replace(USUAL_PREPARATION, size=ImageSize(280, 560), keeps_aspect=False)
    assert fixed.size_for(ImageSize(height, width)) == (280, 560)
    assert size.height * size.width <= 2.5 * 518 * 518
    if max(height, width) < 2.5 * min(height, width):
        assert abs(size.width / size.height / (width / height) - 1) < 0.06


@pytest.mark.parametrize(
    "layout",
    [
        {"last": True},
        {"as_bytes": True},
        {"last": True, "as_bytes": True},
        {"extra": "feature"},
        {"rank": 4},
        {"channels": "c"},
    ],
)
def test_other_layouts_are_read_alike(tmp_path, layout) -> None:
    photo = photo_of(112, 112)
    found = values_of(of_channels(tmp_path / "model.onnx", **layout), photo)
    columns = np.interp(np.linspace(0, 111, found.shape[1]), np.arange(112), photo.pixels[0, :, 0])
    assert np.corrcoef(found.ravel(), np.tile(columns, found.shape[0]))[0, 1] > 0.999


@pytest.mark.parametrize(
    ("settings", "black", "white"),
    [
        ({}, -0.485 / 0.229, (1 - 0.485) / 0.229),
        ({"do_normalize": False}, 0.0, 1.0),
        ({"do_normalize": False, "do_rescale": False}, 0.0, 255.0),
        ({"image_mean": 127.5, "image_std": 127.5, "do_rescale": False}, -1.0, 1.0),
        ({"image_mean": 0, "image_std": [1, 1, 1], "rescale_factor": 2 / 255}, 0.0, 2.0),
    ],
)
def test_settings_beside_a_file_state_the_colours(tmp_path, settings, black, white) -> None:
    (tmp_path / "preprocessor_config.json").write_text(json.dumps(settings))
    prepared = read_preparation(tmp_path)
    for value, expected in ((0.0, black), (1.0, white)):
        assert (value - prepared.mean[0]) / prepared.std[0] == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("extra", ["", "focallength_px", "predicted_normal"])
def test_metric_files_are_known_by_their_settings_or_outputs(tmp_path, extra) -> None:
    """Taken for inverse depth, near and far would be swapped. What is 0 or less is unknown then."""
    if not extra:
        (tmp_path / "config.json").write_text('{"depth_estimation_type": "metric"}')
    file = of_channels(tmp_path / "model.onnx", extra=extra)
    assert model_of(file).estimate(photo_of(60, 90)).meaning == "metres"
    write_image(tmp_path / "photo.png", photo_of(60, 90).pixels)
    found = open_with_depth(tmp_path / "photo.png", DepthChoice(model=str(file), is_metric=True)).disparity
    assert found.unknown[:, :20].all()
    assert not found.unknown[:, -20:].any()
    np.testing.assert_array_equal(np.isnan(estimate_depth(tmp_path / "photo.png", file)), found.unknown)
    with pytest.raises(InputError, match="gave no distance above 0"):
        values_of(file, Photo(photo_of(60, 90).pixels / 4, 50.0, "dark"))


@pytest.mark.parametrize(("farness", "config"), [(False, ""), (True, ""), (False, "metric"), (True, "metric")])
def test_the_photo_shows_which_end_of_a_file_is_near(tmp_path, farness, config) -> None:
    """Red grows downwards in this photo, where things are nearer; with or without a config, true or not."""
    file = of_channels(tmp_path / "model.onnx", farness=farness)
    if config:
        (tmp_path / "config.json").write_text(f'{{"depth_estimation_type": "{config}"}}')
    pixels = np.zeros((60, 80, 3), np.float32)
    pixels[..., 0] = np.linspace(0.5, 0.9, 60)[:, None]
    pixels[20:30, 30:50, 1] = 0.5
    write_image(tmp_path / "photo.png", pixels)
    expected = usual_disparity(np.asarray(pixels[..., 0]))
    for inverts, sign in ((False, 1), (True, -1)):
        choice = DepthChoice(model=str(file), inverts=inverts, refine=False)
        found = open_with_depth(tmp_path / "photo.png", choice)
        np.testing.assert_allclose(found.disparity.values, sign * expected, atol=0.02)
        end = "low" if farness != inverts else "high"
        assert found.origin.near == f"the {end} end"
        assert any(f"the {end} end counts as near" in note for note in found.disparity.notes)
        estimate = estimator_of(found, choice)
        np.testing.assert_allclose(estimate(pixels), sign * expected, atol=0.02)
        np.testing.assert_allclose(estimate(pixels[::-1]), sign * expected[::-1], atol=0.02)
    assert estimator_of(open_with_depth(tmp_path / "photo.png", DepthChoice("rough")), choice) is None


@pytest.mark.parametrize(
    ("others", "name"),
    [
        ({"sky_mask": MAP.reshape(56, 84), "normals": np.zeros((1, 3, 56, 84), np.float32)}, "output_0"),
        ({"last_hidden_state": np.zeros((1, 1370, 384), np.float32)}, "predicted_depth"),
        ({"disp_3": MAP.reshape(112, 42)[:7, :10]}, "disp_0"),
        ({"other": MAP.reshape(1, 56, 84)}, "metric_depth"),
    ],
)
def test_of_several_outputs_the_map_of_depth_is_chosen(others, name) -> None:
    depth = (MAP + 7).reshape(1, 56, 84)
    found = depth_output(Path("model.onnx"), {**others, name: depth}, ImageSize(56, 84))
    np.testing.assert_array_equal(found, depth[0])
    for shape in ((1, 384, 4, 6), (1, 1370, 384), (1, 3, 56, 84), (0, 56, 84)):
        with pytest.raises(InputError, match=r"model\.onnx: gives out .*choose a depth model"):
            depth_output(Path("model.onnx"), {"out": np.zeros(shape, np.float32)}, ImageSize(56, 84))


@pytest.mark.parametrize(("weights", "message"), [(np.nan, "gave NaN"), (0.0, "gave the same depth everywhere")])
def test_results_that_say_nothing_are_refused_and_not_kept(tmp_path, weights, message) -> None:
    with pytest.raises(InputError, match=f"the model model.onnx {message}"):
        values_of(weighing(tmp_path / "model.onnx", (weights, 0, 0)), photo_of(60, 90))
    assert not (tmp_path / "cache").exists()


@pytest.mark.parametrize(
    ("name", "content"),
    [("model.onnx", ""), ("model.onnx", "no model"), ("preprocessor_config.json", "{"),
     ("preprocessor_config.json", '{"size": "big"}'), ("preprocessor_config.json", '{"image_std": [0, 1, 1]}'),
     ("preprocessor_config.json", '{"size": 1e9}')],
)  # fmt: skip
def test_damaged_files_are_one_line(tmp_path, name, content) -> None:
    weighing(tmp_path / "model.onnx", (1, 0, 0))
    (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=rf"^[^\n]*{name}[^\n]*$"):
        values_of(tmp_path / "model.onnx", photo_of(60, 90))


def with_external_weights(file: Path, weights: tuple[float, float, float] = (1.0, 0.0, 0.0)) -> Path:
    """A model whose numbers are in FILE_data beside it."""
    file.with_name(f"{file.name}_data").unlink(missing_ok=True)
    model = onnx.load(str(weighing(file, weights)))
    numbers = next(tensor for tensor in model.graph.initializer if tensor.name == "weights")
    set_external_data(numbers, f"{file.name}_data")
    onnx.save(model, str(file))
    return file


def test_an_estimate_is_kept_until_the_photo_or_a_file_of_the_model_changes(tmp_path) -> None:
    file, photo = with_external_weights(tmp_path / "model.onnx"), photo_of(60, 90)
    first = values_of(file, photo)
    assert values_of(file, photo).tolist() == first.tolist()
    assert len(list((tmp_path / "cache").rglob("*.npz"))) == 1
    before = file.read_bytes()
    with_external_weights(file, (0.0, 1.0, 0.0))
    assert file.read_bytes() == before, "only the file of numbers changed"
    assert np.abs(values_of(file, photo) - first).max() > 0.1
    values_of(file, photo_of(61, 90))
    (tmp_path / "preprocessor_config.json").write_text('{"size": 28}')
    assert values_of(file, photo).shape != first.shape
    assert len(list((tmp_path / "cache").rglob("*.npz"))) == 4
    (tmp_path / "model.onnx_data").unlink()
    with pytest.raises(InputError, match=r"its weights are in model\.onnx_data, which does not lie beside it"):
        values_of(file, photo)


def halving(file: Path, stride: int) -> Path:
    """A network whose output is red plus its mean over blocks, as a U-Net's: sides must be multiples of a stride."""
    nodes = [
        helper.make_node("Gather", ["x", "red"], ["picked"], axis=1),
        helper.make_node("AveragePool", ["picked"], ["small"], kernel_shape=[stride] * 2, strides=[stride] * 2),
        helper.make_node("Resize", ["small", "", "scales"], ["large"], mode="nearest"),
        helper.make_node("Add", ["picked", "large"], ["depth"]),
    ]
    takes = helper.make_tensor_value_info("x", TensorProto.FLOAT, [1, 3, "h", "w"])
    return save_graph(file, nodes, {"red": [0], "scales": np.float32([1, 1, stride, stride])}, takes, "depth")


def test_networks_of_other_strides_get_sides_that_suit_them(tmp_path) -> None:
    found = values_of(halving(tmp_path / "unet.onnx", 32), photo_of(480, 640))
    assert found.shape[0] % 32 == found.shape[1] % 32 == 0
    assert found[:, -1].mean() > found[:, 0].mean()
    file = halving(tmp_path / "odd.onnx", 45)
    with pytest.raises(InputError, match=r"failed on this photo .*ensure_multiple_of in a preprocessor_config\.json"):
        values_of(file, photo_of(480, 640))
    (tmp_path / "preprocessor_config.json").write_text(json.dumps({"ensure_multiple_of": 45}))
    assert values_of(file, photo_of(480, 640)).shape[0] % 45 == 0


def test_a_running_estimate_can_be_stopped(tmp_path) -> None:
    """The graph loops practically for ever: only stopping ends it."""

    def value(name: str, kind: int = TensorProto.FLOAT, shape: list[object] | None = None) -> Any:
        return helper.make_tensor_value_info(name, kind, shape)

    inner = [value("i", TensorProto.INT64, []), value("go_in", TensorProto.BOOL, []), value("x_in")]
    steps = [helper.make_node("Identity", ["go_in"], ["go_out"]), helper.make_node("Relu", ["x_in"], ["x_out"])]
    body = helper.make_graph(steps, "body", inner, [value("go_out", TensorProto.BOOL, []), value("x_out")])
    loop = helper.make_node("Loop", ["count", "go", "x"], ["depth"], body=body)
    takes = value("x", shape=["batch", 3, "height", "width"])
    file = save_graph(tmp_path / "model.onnx", [loop], {"count": np.array(2**62), "go": np.array(True)}, takes, "depth")
    answers = iter([False])  # at the second question, the graph runs
    with pytest.raises(Cancelled), stoppable(lambda: next(answers, True)):
        values_of(file, photo_of(60, 90))


def test_a_map_of_points_gives_metres_the_sky_and_the_focal_length(tmp_path) -> None:
    """As of MoGe-2: points are known but for a shift along z; plain colours and a number of tokens go in."""
    height, width, focal_ratio, shift, brightest = 56, 84, 1.3, 0.7, 0.8
    rows, columns = np.indices((height, width), np.float32)
    metres = 2 + columns / width + 3 * (rows > 30)
    seen = np.stack([columns + 0.5 - width / 2, rows + 0.5 - height / 2], axis=2) / (focal_ratio * width)
    points = np.concatenate([seen * metres[..., None], metres[..., None] - shift], axis=2) / brightest
    points[..., 2] = metres / brightest - shift
    mask = np.where(rows < 10, 0.1, 0.9)
    points[rows < 10] = 9e5
    file = of_points(tmp_path / "moge.onnx", points, mask, tokens=(height // 14) * (width // 14))
    pixels = np.full((height, width, 3), 0.3, np.float32)
    pixels[20, 20] = brightest
    photo = Photo(pixels, focal_px_from_fov(width), "photo")
    found = model_of(file).estimate(photo)
    assert found.meaning == "metres"
    np.testing.assert_allclose(found.values[mask > 0.5], metres[mask > 0.5], rtol=1e-3)
    assert (found.values[mask < 0.5] > 1000).all(), "the sky is far"
    assert found.focal_ratio == pytest.approx(focal_ratio, rel=1e-3)
    relative = depth_of_points(points * brightest, mask < 0.5, None)
    assert relative.meaning == "inverse depth"
    np.testing.assert_allclose(relative.values, np.where(mask > 0.5, 1 / metres, 0), rtol=1e-3)
    assert relative.focal_ratio == pytest.approx(focal_ratio, rel=1e-3)
    assert model_of(file).estimate(photo).focal_ratio == found.focal_ratio, "from the cache, too"
    write_image(tmp_path / "photo.png", (pixels * 255).astype(np.uint8))
    with_depth = open_with_depth(tmp_path / "photo.png", DepthChoice("model", model=str(file)))
    assert with_depth.photo.focal_px == pytest.approx(focal_ratio * width, rel=1e-3)
    stated = find_depth(tmp_path / "photo.png", replace(photo, focal_px=77.0), DepthChoice("model", model=str(file)))
    assert stated.photo.focal_px == 77.0, "a file that states its focal length is believed"


@pytest.mark.parametrize(("name", "is_far"), [("sky", True), ("mask", False)])
def test_focal_length_and_sky_of_other_metric_models_are_used(tmp_path, name, is_far) -> None:
    """As of Depth Pro, in pixels of its input."""
    nodes = [
        helper.make_node("ReduceMean", ["x"], ["depth"], axes=[1], keepdims=0),
        helper.make_node("Identity", ["length"], ["focallength_px"]),
        helper.make_node("Identity", ["beyond"], [name]),
    ]
    beyond = np.full((1, 56, 56), 0.4, np.float32)
    beyond[:, :20] = 0.6
    constants = {"length": np.array([84.0], np.float32), "beyond": beyond}
    takes = helper.make_tensor_value_info("x", TensorProto.FLOAT, [1, 3, 56, 56])
    file = save_graph(tmp_path / "model.onnx", nodes, constants, takes, "depth", "focallength_px", name)
    found = model_of(file).estimate(photo_of(112, 112))
    assert found.focal_ratio == pytest.approx(1.5)
    assert ((found.values > 1000) == ((beyond[0] > 0.5) == is_far)).all()


@pytest.mark.parametrize("name", ["depth-anything-v2-small-int8", "moge-2-small", "midas-small"])
def test_published_models_without_settings_take_colours_as_they_were_trained(name) -> None:
    model = known_model(name)
    assert model.licence in ("MIT", "Apache-2.0")
    assert model.megabytes < 150
    folder = local_folder(model)
    for file in model.files[:-1]:
        (folder / file).parent.mkdir(parents=True, exist_ok=True)
        (folder / file).write_text("{}")
    (folder / model.files[-1]).parent.mkdir(parents=True, exist_ok=True)
    weighing(folder / model.files[-1], (1, 0, 0), ImageSize(256, 256))
    here = model_here(model)
    assert here is not None
    photo = photo_of(256, 256)
    usual = (photo.pixels[..., 0] - MEAN[0]) / DEVIATION[0]
    wanted = photo.pixels[..., 0] if name == "midas-small" else usual  # this file has not MoGe's inputs
    np.testing.assert_allclose(here.estimate(photo).values, wanted, atol=1e-4)
    assert cache.seconds_of(name) is not None
