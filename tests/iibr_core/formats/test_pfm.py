"""PFM: byte order, direction of rows, and files that lie about themselves."""

import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from iibr_core.formats.maps.pfm import read_pfm, write_pfm
from iibr_core.types import InputError

SHAPES = hnp.array_shapes(min_dims=2, max_dims=2, max_side=9)


@given(hnp.arrays(np.float32, SHAPES, elements=st.floats(width=32)))
def test_round_trip_keeps_every_bit_pattern(tmp_path_factory, values):
    path = tmp_path_factory.getbasetemp() / "round_trip.pfm"
    write_pfm(path, values)
    found = read_pfm(path)
    assert found.dtype == np.float32
    assert np.array_equal(found, values, equal_nan=True)


@pytest.mark.parametrize(("order", "scale"), [("<", "-1.0"), (">", "1"), ("<", "-0.003922"), (">", "1e3")])
def test_rows_go_up_and_the_sign_gives_the_byte_order(tmp_path, order, scale):
    path = tmp_path / "a.pfm"
    path.write_bytes(f"Pf\n2 3\n{scale}\n".encode() + struct.pack(order + "6f", 5, 6, 3, 4, 1, 2))
    assert read_pfm(path).tolist() == [[1, 2], [3, 4], [5, 6]]


@pytest.mark.parametrize("header", [b"Pf 2 1 -1 ", b"Pf\r\n2 1\r\n-1.0\r\n", b"Pf\n2\n1\n-1.000000\n"])
def test_white_space_in_the_header(tmp_path, header):
    (tmp_path / "a.pfm").write_bytes(header + struct.pack("<2f", 10.0, 2.0))
    assert read_pfm(tmp_path / "a.pfm").tolist() == [[10, 2]]


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"", "empty"),
        (b"P6 2 2 255\n" + b"\0" * 40, "not a PFM"),
        (b"PF 1 1 -1\n" + b"\0" * 12, "colour"),
        (b"Pf 2 2 -1\n" + b"\0" * 15, "1 bytes are missing"),
        (b"Pf 999999999 999999999 -1\n" + b"\0" * 15, "999999999x999999999"),
        (b"Pf 0 5 -1\n", "0x5"),
        (b"Pf" + b" " * 5000 + b"1 1 -1\n" + b"\0" * 4, "not a PFM"),
    ],
)
def test_bad_files(tmp_path, content, reason):
    path = tmp_path / "a.pfm"
    path.write_bytes(content)
    with pytest.raises(InputError, match=reason) as caught:
        read_pfm(path)
    assert str(path) in str(caught.value)
