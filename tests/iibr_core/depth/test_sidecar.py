"""Disparity from files: what is found, how it changes size, and what is refused."""

import numpy as np
import OpenImageIO as oiio
import pytest

from iibr_core.depth.sidecar import SIDECAR_EXTENSIONS, find_sidecar
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.maps.resample import SURFACE_SHARE, resample_surfaces
from iibr_core.types import ImageSize, InputError

RNG = np.random.default_rng(3)
NAN = np.float32(np.nan)


def save(path, pixels, channels=None):
    pixels = np.atleast_3d(pixels)
    kind = "float" if pixels.dtype == np.float32 else str(pixels.dtype)
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    if channels:
        spec.channelnames = channels
        spec.alpha_channel = channels.index("A")
        spec.attribute("oiio:UnassociatedAlpha", 1)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(np.ascontiguousarray(pixels))
    output.close()
    return path


def pfm(path, values):
    write_pfm(path, np.asarray(values, np.float32))
    return path


# ---- resampling


def resample_slowly(values, size):
    """Twin: tent weights over the whole map, then the vote between the two surfaces."""
    low, high = np.nanpercentile(values, [2, 98]) if np.isfinite(values).any() else (0, 0)
    weights = []
    for source, target in zip(values.shape, size):
        step = source / target
        centres = (np.arange(target) + 0.5) * step - 0.5
        weights.append(np.maximum(0, 1 - np.abs(np.arange(source) - centres[:, None]) / max(1, step)))
    result = np.full(size, np.nan)
    for y in range(size[0]):
        for x in range(size[1]):
            weight = np.outer(weights[0][y], weights[1][x])
            inside = values[weight > 0]
            weight = weight[weight > 0]
            known = ~np.isnan(inside)
            if not known.any() or weight[~known].sum() > weight[known].sum():
                continue
            inside, weight = inside[known], weight[known]
            chosen = np.ones(len(inside), bool)
            if np.ptp(inside) > SURFACE_SHARE * (high - low):
                near = inside > (inside.min() + inside.max()) / 2
                chosen = near if weight[near].sum() >= weight[~near].sum() else ~near
            result[y, x] = np.average(inside[chosen], weights=weight[chosen])
    return result


def test_resampling_agrees_with_its_slow_twin():
    # Values and sizes where no vote is a tie, which rounding would decide.
    values = RNG.uniform(0, 10, (13, 17)).astype(np.float32)
    values[RNG.random(values.shape) < 0.2] = NAN
    for size in [(29, 37), (7, 11), (13, 31), (40, 5), (1, 1), (1, 23)]:
        assert np.allclose(
            resample_surfaces(values, ImageSize(*size)), resample_slowly(values, size), 1e-5, equal_nan=True
        )


@pytest.mark.parametrize("size", [(200, 300), (37, 61), (20, 30), (99, 151)])
def test_no_pixel_flies_between_two_surfaces(size):
    scene = np.full((40, 60), 1.0, np.float32)
    scene[10:30, 17:41] = 5.0
    found = resample_surfaces(scene, ImageSize(*size))
    assert set(np.unique(found)) == {1.0, 5.0}
    area = (found == 5).mean()
    assert abs(area - (scene == 5).mean()) < 0.02


# ---- files


def test_sidecar_order(tmp_path):
    photo = tmp_path / "scene.jpg"
    assert find_sidecar(photo) is None
    names = [f"scene{kind}{extension}" for kind in ("_disparity", "_depth") for extension in SIDECAR_EXTENSIONS]
    for name in reversed(names):
        (tmp_path / name).touch()
        assert find_sidecar(photo) == tmp_path / name


@pytest.mark.parametrize("extension", [".pfm", ".npy", ".npz", ".exr", ".tif", ".png"])
def test_every_format_gives_the_same_values(tmp_path, extension):
    whole = RNG.integers(1, 20, (6, 8))
    path = tmp_path / f"a{extension}"
    if extension == ".pfm":
        pfm(path, whole)
    elif extension == ".npy":
        np.save(path, whole)
    elif extension == ".npz":
        np.savez_compressed(path, depth=whole, other=np.zeros(3))
    else:
        save(path, whole.astype(np.float32 if extension == ".exr" else np.uint16))
    found = read_disparity(path, ImageSize(6, 8))
    assert found.values.dtype == np.float32
    assert np.array_equal(found.values, whole)
    assert (found.source, found.notes) == (path.name, ())


@pytest.mark.parametrize("dtype", [np.uint8, np.uint16])
def test_png_values_are_scaled_and_zero_is_unknown(tmp_path, dtype):
    stored = np.full((4, 6), 200, dtype)
    stored[:, 3:] = 100
    stored[1, 2] = 0
    found = read_disparity(save(tmp_path / "a.png", stored), ImageSize(4, 6), scale=1 / 50)
    assert found.values[0].tolist() == pytest.approx([4, 4, 4, 2, 2, 2])
    assert found.values[1, 2] == pytest.approx(2, abs=0.05)
    assert "filled" in found.notes[0]


def test_nan_inf_and_masked_values_are_filled(tmp_path):
    values = np.full((5, 6), 3.0, np.float32)
    values[0, 0], values[1, 1], values[2, 2] = np.nan, np.inf, -np.inf
    assert (read_disparity(pfm(tmp_path / "a.pfm", values), ImageSize(5, 6)).values == 3).all()
    masked = np.dstack([np.full((5, 6), 3.0), np.ones((5, 6))]).astype(np.float32)
    masked[2, 2] = (77.0, 0.0)
    assert (read_disparity(save(tmp_path / "a.exr", masked, ("Y", "A")), ImageSize(5, 6)).values == 3).all()


def test_another_size_scales_the_values_by_the_width(tmp_path):
    values = np.full((20, 30), 1.0, np.float32)
    values[:, 15:] = 6.0
    found = read_disparity(pfm(tmp_path / "a.pfm", values), ImageSize(40, 60))
    assert set(np.unique(found.values)) == {2.0, 12.0}
    assert "30x20 to 60x40" in found.notes[0]


def test_nothing_known(tmp_path):
    for name, value in [("nan", np.nan), ("inf", np.inf)]:
        with pytest.raises(InputError, match="no value is known"):
            read_disparity(pfm(tmp_path / f"{name}.pfm", np.full((3, 4), value)), ImageSize(3, 4))
    with pytest.raises(InputError, match="no value is known"):
        read_disparity(save(tmp_path / "zero.png", np.zeros((3, 4), np.uint16)), ImageSize(3, 4))
    with pytest.raises(InputError, match="--disparity-scale"):
        read_disparity(save(tmp_path / "large.png", np.full((3, 4), 60000, np.uint16)), ImageSize(3, 4))


def test_one_value_known_makes_a_flat_map(tmp_path):
    lonely = np.full((40, 60), NAN)
    lonely[3, 3] = 1
    found = read_disparity(pfm(tmp_path / "lonely.pfm", lonely), ImageSize(4, 6))
    assert found.values == pytest.approx(0.1)
    assert any("Only 0.042 % of lonely.pfm is known" in note for note in found.notes)


@pytest.mark.parametrize("size", [(40, 60), (20, 30), (33, 50), (80, 120)])
def test_of_a_map_that_is_mostly_unknown_every_known_value_counts(tmp_path, size):
    """Scattered points, one of them wild: finite, between the good ones, and said."""
    values = np.full((40, 60), np.nan, np.float32)
    values[::6, ::6] = 2.0
    values[12:30:6, 18:42:6] = 5.0
    values[0, 0] = 1e9
    found = read_disparity(pfm(tmp_path / "a.pfm", values), ImageSize(*size))
    ratio = size[1] / 60
    assert np.isfinite(found.values).all()
    assert found.values.min() == pytest.approx(2 * ratio)
    assert found.values.max() == pytest.approx(5 * ratio)
    assert sum("was filled" in note for note in found.notes) == 1
    assert sum("beyond" in note for note in found.notes) == 1
