"""Maps of every kind, hard ones, as people get them: compared with `tests/golden/maps`."""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import OpenImageIO as oiio
import pytest
import tifffile
from PIL import Image

from iibr_core.formats.images.write import write_image_file
from iibr_core.formats.maps.color_maps import SCALES
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.maps.writer import KEY, START, MapText, write_map
from tests.iibr_core.facts import require_golden
from tests.iibr_core.formats.opened import map_facts

Write = Callable[[Path], Any]
RAMP = 2 + np.indices((32, 48), np.float32)[1] / 12
"""Farther at the left, with a near square right of the middle and above it."""
RAMP[8:20, 28:40] = 9.0
HOLES = RAMP.copy()
HOLES[0, 0], HOLES[9, 30], HOLES[-1, -1], HOLES[20, 3] = np.nan, np.inf, -np.inf, 1e9
WHOLE = np.rint(RAMP * 20).astype(np.uint16)
ZEROS = WHOLE.copy()
ZEROS[:, :6] = 0
SPARSE = np.full((96, 144), np.nan, np.float32)
SPARSE[::7, ::7] = RAMP.repeat(3, 0).repeat(3, 1)[::7, ::7]
SIZE = struct.pack("<ii", 48, 32)
LITTLE, BIG = RAMP.astype("<f4"), RAMP.astype(">f4")


def of_bytes(*parts: bytes) -> Write:
    return lambda path: path.write_bytes(b"".join(parts))


def by_numpy(values: np.ndarray) -> Write:
    return lambda path: np.save(path, values)


def by_pillow(pixels: np.ndarray, **options: Any) -> Write:
    return lambda path: Image.fromarray(pixels).save(path, **options)


def by_oiio(values: np.ndarray, kind: str, channels: tuple[str, ...], header: str = "") -> Write:
    return lambda path: write_image_file(path, values, kind, {KEY: header} if header else {}, channels)


def in_colors(scale: str) -> np.ndarray:
    """Return the map drawn in a scale of colours, unknown at the left."""
    stops = np.array([list(bytes.fromhex(color)) for color in SCALES[scale].split()])
    places = np.linspace(0, 1, len(stops))
    share = (RAMP - RAMP.min()) / np.ptp(RAMP)
    drawn = np.stack([np.interp(share, places, stops[:, c]) for c in range(3)], axis=-1)
    drawn[:, :3] = 0
    return np.rint(drawn).astype(np.uint8)


def channels(path: Path) -> None:
    """Write colours and a depth channel, infinite at the left, as renderers do."""
    spec = oiio.ImageSpec(48, 32, 4, "float")
    spec.channelnames = ("R", "G", "B", "ViewLayer.Depth.Z")
    target = oiio.ImageOutput.create(str(path))
    assert target.open(str(path), spec)
    values = np.dstack([RAMP / 9, RAMP / 18, RAMP / 27, RAMP])
    values[:, :4, 3] = 1e10
    assert target.write_image(np.ascontiguousarray(values, np.float32))
    target.close()


def jpeg_of_grey(path: Path) -> None:
    pixels = np.repeat((WHOLE[..., None] // 2).astype(np.uint8), 3, axis=2)
    Image.fromarray(pixels).save(path, quality=95)


SCALED = START + msgspec.json.encode(MapText("depth", 0.05, -1.0, "m")).decode()
MAPS: dict[str, tuple[Write, int]] = {
    "a.pfm": (lambda path: write_pfm(path, HOLES), 0),
    "big.pfm": (of_bytes(b"Pf\r\n48 32\r\n0.5\n", BIG[::-1].tobytes()), 0),
    "color.pfm": (of_bytes(b"PF 1 1 -1\n", bytes(12)), 0),
    "cut.pfm": (of_bytes(b"Pf 48 32 -1\n", LITTLE.tobytes()[:-3]), 0),
    "a.npy": (by_numpy(HOLES.astype(np.float64)[None, ..., None]), 0),
    "whole.npy": (by_numpy(ZEROS.astype(np.int64)), 0),
    "two.npy": (by_numpy(np.zeros((2, 32, 48))), 0), "words.npy": (by_numpy(np.array([["a"]])), 0),
    "a.npz": (lambda path: np.savez_compressed(path, conf=np.zeros(3), pred_depth=RAMP, depth_map=2 * RAMP), 0),
    "only.npz": (lambda path: np.savez(path, values=RAMP), 0),
    "many.npz": (lambda path: np.savez(path, one=RAMP, two=RAMP), 0),
    "a.exr": (by_oiio(np.dstack([HOLES, RAMP > 2.1]).astype(np.float32), "float", ("Y", "A")), 0),
    "half.exr": (by_oiio(RAMP[..., None], "half", ("Y",)), 0), "channels.exr": (channels, 0),
    "a.png": (by_oiio(ZEROS[..., None], "uint16", ("Y",)), 0),
    "scaled.png": (by_oiio(ZEROS[..., None], "uint16", ("Y",), SCALED), 0),
    "ours.png": (lambda path: write_map(path, RAMP), 0), "ours.tif": (lambda path: write_map(path, -RAMP), 0),
    "wide.tif": (lambda path: tifffile.imwrite(path, ZEROS.astype(np.uint32) * 1000), 0),
    "turned.tif": (by_pillow(np.rot90(WHOLE // 2).astype(np.uint8), tiffinfo={0x0112: 6}), 0),
    "alpha.png": (by_pillow(np.dstack([WHOLE // 2, np.where(RAMP > 2.2, 255, 0)]).astype(np.uint8)), 0),
    "grey.jpg": (jpeg_of_grey, 2),
    **{f"{name}.png": (by_pillow(in_colors(name)), 0) for name in ("turbo", "inferno", "Spectral", "HSV")},
    "photo.png": (by_pillow(np.random.default_rng(0).integers(0, 255, (32, 48, 3)).astype(np.uint8)), 0),
    "a.jpg.geometric.bin": (of_bytes(b"48&32&1&", LITTLE.tobytes()), 0),
    "a.dpt": (of_bytes(struct.pack("<f", 202021.25), SIZE, LITTLE.tobytes()), 0),
    "a.flo": (of_bytes(b"PIEH", SIZE, np.dstack([np.where(RAMP > 8.9, 1e10, -RAMP), RAMP]).astype("<f4").tobytes()), 0),
    "a.dmb": (of_bytes(struct.pack("<4i", 1, 32, 48, 1), LITTLE.tobytes()), 0),
    "cut.dmb": (of_bytes(struct.pack("<4i", 1, 32, 48, 1), LITTLE.tobytes()[:-8]), 0),
    "a.mat": (of_bytes(b"MATLAB 5.0 MAT-file"), 0), "a.h5": (of_bytes(b"\x89HDF\r\n\x1a\n", bytes(90)), 0),
    "a.map": (of_bytes(bytes(90)), 0), "page.png": (of_bytes(b"<!DOCTYPE html><html>404</html>"), 0),
    "sparse.npy": (by_numpy(SPARSE), 0), "none.npy": (by_numpy(np.full((32, 48), np.nan)), 0),
    "huge.npy": (by_numpy(RAMP * 1e6), 0), "tall.npy": (by_numpy(RAMP.T), 0), "a_depth.npy": (by_numpy(RAMP), 0),
    "soft.npy": (by_numpy(sum(np.roll(RAMP, k, 1) for k in range(-4, 5)) / 9), 0),
}  # fmt: skip


@pytest.mark.parametrize("name", MAPS)
def test_maps_are_read_as_before(tmp_path, name, regenerate_golden) -> None:
    write, levels = MAPS[name]
    write(tmp_path / name)
    require_golden(map_facts(tmp_path / name), "maps", name, levels, regenerate_golden)
