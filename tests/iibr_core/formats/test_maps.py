import re
import struct

import numpy as np
import pytest
import tifffile
from PIL import Image

from iibr_core.formats.images.write import write_image_file
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.formats.maps.pfm import read_pfm, write_pfm
from iibr_core.formats.maps.reader import read_map, read_map_file, read_map_size
from iibr_core.formats.maps.resample import SURFACE_SHARE, nearest_pixels, resample_surfaces
from iibr_core.formats.maps.writer import MAX_PNG_VALUE, write_map
from iibr_core.types import FloatImage, ImageSize, InputError

RNG = np.random.default_rng(3)


def resample_slowly(values: FloatImage, size: ImageSize) -> FloatImage:
    """Twin: tent weights over the whole map, then the vote between the two surfaces."""
    low, high = np.nanpercentile(values, [2, 98])
    weights = []
    for source, target in zip(values.shape, size):
        step = source / target
        centres = (np.arange(target) + 0.5) * step - 0.5
        weights.append(np.maximum(0, 1 - np.abs(np.arange(source) - centres[:, None]) / max(1, step)))
    result = np.full(size, np.nan)
    for y, x in np.ndindex(size):
        weight = np.outer(weights[0][y], weights[1][x])
        inside, weight = values[weight > 0], weight[weight > 0]
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


@pytest.mark.parametrize("size", [(29, 37), (7, 11), (13, 31), (40, 5), (1, 1), (1, 23)])
def test_resampling_agrees_with_its_slow_twin(size) -> None:
    # Values and sizes where no vote is a tie, which rounding would decide.
    rng = np.random.default_rng(3)
    values = rng.uniform(0, 10, (13, 17)).astype(np.float32)
    values[rng.random(values.shape) < 0.2] = np.nan
    expected = resample_slowly(values, ImageSize(*size))
    assert np.allclose(resample_surfaces(values, ImageSize(*size)), expected, 1e-5, equal_nan=True)
    assert nearest_pixels(np.arange(9)[None], ImageSize(1, 3)).tolist() == [[1, 4, 7]], "the middle ones"


@pytest.mark.parametrize("name", ["a.pfm", "a.npy", "a.npz", "a.exr", "a.tif", "32 bits.tif", "a.png"])
def test_every_kind_of_file_gives_the_same_values(tmp_path, name) -> None:
    whole, path = RNG.integers(1, 20, (6, 8)), tmp_path / name
    if path.suffix == ".pfm":
        write_pfm(path, whole.astype(np.float32))
    elif path.suffix == ".npy":
        np.save(path, whole)
    elif path.suffix == ".npz":
        np.savez_compressed(path, depth=whole, other=np.zeros(3))
    elif name == "32 bits.tif":
        tifffile.imwrite(path, whole.astype(np.uint32))
    else:
        kind = "float" if path.suffix == ".exr" else "uint16"
        write_image_file(path, whole[..., None].astype(kind.replace("float", "float32")), kind, channels=("Y",))
    found = read_disparity(path, ImageSize(6, 8), scale=0.5)
    assert found.values.dtype == np.float32
    assert np.array_equal(found.values, whole / 2)
    assert (found.source, found.notes) == (path.name, ())


@pytest.mark.parametrize("shape", [(1, 4, 5), (4, 5, 1), (1, 4, 5, 1), (1, 1, 4, 5)])
def test_axes_of_length_1_beside_a_map_do_not_matter(tmp_path, shape) -> None:
    np.save(tmp_path / "a.npy", np.arange(1.0, 21).reshape(shape))
    np.testing.assert_array_equal(read_map(tmp_path / "a.npy"), np.arange(1.0, 21).reshape(4, 5))
    np.save(tmp_path / "a.npy", np.zeros((2, *shape)))
    with pytest.raises(InputError, match="an array of numbers with shape"):
        read_map(tmp_path / "a.npy")


@pytest.mark.parametrize(("orientation", "expected"), [(1, [[1, 2, 3]]), (2, [[3, 2, 1]]), (6, [[1], [2], [3]])])
def test_a_map_is_turned_upright_with_a_note(tmp_path, orientation, expected) -> None:
    Image.fromarray(np.array([[1, 2, 3]], np.uint8)).save(tmp_path / "a.tif", tiffinfo={0x0112: orientation})
    found = read_map_file(tmp_path / "a.tif")
    assert found.values.tolist() == expected
    assert found.notes == (("a.tif was turned upright, as its Exif says.",) if orientation > 1 else ())


def test_unknown_values_are_filled(tmp_path) -> None:
    values = np.full((5, 6), 3.0, np.float32)
    values[0, 0], values[1, 1], values[2, 2], values[3, 3] = np.nan, np.inf, -np.inf, 1e9
    np.save(tmp_path / "a.npy", values)
    assert (read_disparity(tmp_path / "a.npy", ImageSize(5, 6)).values == 3).all()
    masked = np.dstack([np.full((5, 6), 3.0), np.ones((5, 6))]).astype(np.float32)
    masked[2, 2] = (77.0, 0.0)
    write_image_file(tmp_path / "a.exr", masked, "float", channels=("Y", "A"))
    assert (read_disparity(tmp_path / "a.exr", ImageSize(5, 6)).values == 3).all()
    stored = np.full((5, 6, 1), 200, np.uint16)
    stored[2, 2] = 0
    write_image_file(tmp_path / "a.png", stored, "uint16", channels=("Y",))
    found = read_disparity(tmp_path / "a.png", ImageSize(5, 6), scale=0.01)
    assert found.values == pytest.approx(2)
    assert "filled" in found.notes[0]


def test_another_size_scales_the_values_by_the_width(tmp_path) -> None:
    values = np.full((20, 30), 1.0, np.float32)
    values[:, 15:] = 6.0
    np.save(tmp_path / "a.npy", values)
    found = read_disparity(tmp_path / "a.npy", ImageSize(40, 60))
    assert set(np.unique(found.values)) == {2.0, 12.0}
    assert "30x20 to 60x40" in found.notes[0]


@pytest.mark.parametrize(
    ("value", "message"), [(np.nan, "no value is known"), (np.inf, "no value is known"), (6e4, "disparity scale")]
)
def test_a_map_without_known_values_is_refused(tmp_path, value, message) -> None:
    np.save(tmp_path / "a.npy", np.full((3, 4), value))
    with pytest.raises(InputError, match=message):
        read_disparity(tmp_path / "a.npy", ImageSize(3, 4))


@pytest.mark.parametrize("size", [(4, 6), (40, 60), (33, 50), (80, 120)])
def test_every_known_value_of_a_sparse_map_counts(tmp_path, size) -> None:
    values = np.full((40, 60), np.nan, np.float32)
    values[::6, ::6] = 2.0
    values[12:30:6, 18:42:6] = 5.0
    np.save(tmp_path / "a.npy", values)
    found = read_disparity(tmp_path / "a.npy", ImageSize(*size))
    ratio = size[1] / 60
    assert found.values.min() == pytest.approx(2 * ratio)
    assert found.values.max() == pytest.approx(5 * ratio)
    assert sum("was filled" in note for note in found.notes) == 1


SIZE_BYTES = struct.pack("<ii", 8, 6)
OTHER_MAPS = {
    "a.jpg.geometric.bin": (b"8&6&1&", 1),
    "a.dpt": (struct.pack("<f", 202021.25) + SIZE_BYTES, 1),
    "a.flo": (b"PIEH" + SIZE_BYTES, 2),
    "a.dmb": (struct.pack("<4i", 1, 6, 8, 1), 1),
}
"""Header and number of channels by the name of a map of another program."""


@pytest.mark.parametrize("name", OTHER_MAPS)
def test_maps_of_other_programs(tmp_path, name) -> None:
    header, channels = OTHER_MAPS[name]
    values = np.random.default_rng(0).uniform(1, 9, (6, 8)).astype("<f4")
    stored = np.dstack([-values, 0 * values]) if channels == 2 else values
    (tmp_path / name).write_bytes(header + stored.tobytes())
    found = read_map_file(tmp_path / name)
    np.testing.assert_array_equal(found.values, values)
    assert found.name == ("disparity" if channels == 2 else "depth")
    assert read_map_size(tmp_path / name) == (6, 8)
    (tmp_path / name).write_bytes(header + stored.tobytes()[:-50])
    with pytest.raises(InputError, match=re.escape(name)):
        read_map_file(tmp_path / name)


def test_maps_of_record3d(tmp_path) -> None:
    lzfse = pytest.importorskip("lzfse", reason="the extra record3d is not installed")
    values = np.random.default_rng(0).uniform(1, 9, (256, 192)).astype("<f4")
    (tmp_path / "0.depth").write_bytes(lzfse.compress(values.tobytes()))
    np.testing.assert_array_equal(read_map_file(tmp_path / "0.depth").values, values)
    (tmp_path / "metadata").write_text('{"h": 960, "dw": 256, "dh": 192}')
    assert read_map_file(tmp_path / "0.depth").values.shape == (192, 256)
    (tmp_path / "0.depth").write_bytes(b"bvx2" + bytes(500))
    with pytest.raises(InputError, match="16-bit PNG"):
        read_map_file(tmp_path / "0.depth")


@pytest.mark.parametrize(
    ("content", "words"),
    [(b"MATLAB 5.0 MAT-file", "MATLAB"), (b"\x89HDF\r\n\x1a\n" + bytes(90), "HDF5"), (bytes(90), "of no known kind"),
     (b"%PDF-1.7", "PDF"), (b"\x89PNG\r\n\x1a\n" + bytes(90), "cannot be read as a map")],
)  # fmt: skip
def test_files_that_are_no_maps_are_to_be_saved_as_maps(tmp_path, content, words) -> None:
    (tmp_path / "a.map").write_bytes(content)
    with pytest.raises(InputError, match=f"{words}.*; save it as NPY, PFM or a 16-bit PNG") as error:
        read_map_file(tmp_path / "a.map")
    assert "JPEG" not in str(error.value)


def some_map() -> np.ndarray:
    return np.random.default_rng(0).normal(0, 5, (13, 17)).astype(np.float32)


@pytest.mark.parametrize("suffix", [".pfm", ".npy", ".exr", ".EXR", ".tif"])
def test_floating_point_maps_come_back_exactly(tmp_path, suffix) -> None:
    path = tmp_path / f"map{suffix}"
    assert write_map(path, some_map()) == ""
    np.testing.assert_array_equal(read_map(path), some_map())
    assert [other.name for other in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("name", ["map.jpg", "map", "map_depth.pfm"])
def test_names_that_would_be_read_as_something_else_are_refused(tmp_path, name) -> None:
    with pytest.raises(InputError, match=name):
        write_map(tmp_path / name, some_map())
    assert not list(tmp_path.iterdir())


def test_a_png_says_how_its_values_were_scaled(tmp_path) -> None:
    path, wanted = tmp_path / "map.png", some_map()
    step = (wanted.max() - wanted.min()) / (MAX_PNG_VALUE - 1)
    assert f"{step:.6g}" in write_map(path, wanted)
    np.testing.assert_allclose(read_map(path), wanted, atol=step)
    write_map(path, np.full((4, 5), -3.0, np.float32))
    np.testing.assert_allclose(read_map(path), -3.0)


@pytest.mark.parametrize(("order", "scale"), [("<", "-1.0"), (">", "1"), ("<", "-0.003922"), (">", "1e3")])
def test_rows_go_up_and_the_sign_gives_the_byte_order(tmp_path, order, scale):
    path = tmp_path / "a.pfm"
    path.write_bytes(f"Pf\n2 3\n{scale}\n".encode() + struct.pack(order + "6f", 5, 6, 3, 4, 1, 2))
    assert read_pfm(path).tolist() == [[1, 2], [3, 4], [5, 6]]
    for header in (b"Pf 2 1 -1 ", b"Pf\r\n2 1\r\n-1.0\r\n", b"Pf\n2\n1\n-1.000000\n"):
        path.write_bytes(header + struct.pack("<2f", 10.0, 2.0))
        assert read_pfm(path).tolist() == [[10, 2]]


@pytest.mark.parametrize(
    ("content", "reason"),
    [(b"", "empty"), (b"P6 2 2 255\n" + b"\0" * 40, "not a PFM"), (b"PF 1 1 -1\n" + b"\0" * 12, "colour"),
     (b"Pf 2 2 -1\n" + b"\0" * 15, "1 bytes are missing"),
     (b"Pf 999999999 999999999 -1\n" + b"\0" * 15, "999999999x999999999"), (b"Pf 0 5 -1\n", "0x5"),
     (b"Pf" + b" " * 5000 + b"1 1 -1\n" + b"\0" * 4, "not a PFM")],
)  # fmt: skip
def test_bad_files(tmp_path, content, reason):
    path = tmp_path / "a.pfm"
    path.write_bytes(content)
    with pytest.raises(InputError, match=reason) as caught:
        read_pfm(path)
    assert str(path) in str(caught.value)
