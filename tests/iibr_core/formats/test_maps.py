import struct

import numpy as np
import pytest

from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.formats.maps.reader import read_map_file
from iibr_core.formats.maps.resample import SURFACE_SHARE, nearest_pixels, resample_surfaces
from iibr_core.formats.maps.writer import write_map
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


def some_map() -> np.ndarray:
    return np.random.default_rng(0).normal(0, 5, (13, 17)).astype(np.float32)


@pytest.mark.parametrize("name", ["map.jpg", "map", "map_depth.pfm"])
def test_names_that_would_be_read_as_something_else_are_refused(tmp_path, name) -> None:
    with pytest.raises(InputError, match=name):
        write_map(tmp_path / name, some_map())
    assert not list(tmp_path.iterdir())


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
