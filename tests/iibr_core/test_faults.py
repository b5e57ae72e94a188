"""What goes wrong around the program: full disks, processes killed, files that vanish or lie. One line, nothing left
half-written, and what was there before is still there.
"""

import io
import os
import resource
import signal
import struct
import subprocess
import sys
import time
import zlib
from contextlib import contextmanager

import numpy as np
import pytest
from torch import nn

from iibr_core.depth.embedded.embedded_depth import read_embedded
from iibr_core.depth.estimates import RelativeInverseDepth
from iibr_core.depth.estimators import estimate_cache
from iibr_core.formats import files
from iibr_core.formats.images.decode import decode
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.views import read_views
from iibr_core.formats.light_fields.write import write_light_field
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.maps.writer import write_map
from iibr_core.formats.weights import save_weights
from iibr_core.types import GridShape, ImageSize, InputError, ViewUpdate
from tests.iibr_core import embedded_files as embedded

NOISE = np.random.default_rng(0).integers(0, 256, (120, 160, 3), dtype=np.uint8)
DEADLINE_S = 120.0


@contextmanager
def full_disk(room):
    """Files cannot grow beyond this many bytes: writes then fail as they do on a disk without room."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


WRITERS = {
    "a.png": lambda path: write_image(path, NOISE),
    "a.exr": lambda path: write_image(path, NOISE),
    "map.exr": lambda path: write_map(path, NOISE[..., 0].astype(np.float32)),
    "a.pfm": lambda path: write_pfm(path, NOISE[..., 0].astype(np.float32)),
    "a.safetensors": lambda path: save_weights(nn.Linear(100, 100), path),
}


@pytest.mark.parametrize("room", [0, 5, 1000, 30_000])
@pytest.mark.parametrize("name", sorted(WRITERS))
def test_a_disk_that_fills_up_leaves_the_file_that_was_there(tmp_path, name, room):
    (tmp_path / name).write_bytes(b"before")
    with full_disk(room), pytest.raises(InputError, match=r"cannot be written") as caught:
        WRITERS[name](tmp_path / name)
    assert str(caught.value).startswith(str(tmp_path / name))
    assert "\n" not in str(caught.value)
    assert (tmp_path / name).read_bytes() == b"before"
    assert [path.name for path in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_a_disk_that_is_full_at_the_last_byte_is_noticed(tmp_path, name):
    """OpenImageIO says that all went well where the end of a file gets lost while it is closed."""
    write_image(tmp_path / name, NOISE)
    size = (tmp_path / name).stat().st_size
    for missing in (1, 13, 500, 4000):
        with full_disk(size - missing), pytest.raises(InputError, match="cannot be written"):
            write_image(tmp_path / name, NOISE)
    assert (tmp_path / name).stat().st_size == size
    with full_disk(size + 4096):
        write_image(tmp_path / name, NOISE)


@pytest.mark.parametrize("room", [1000, 40_000])
def test_a_disk_that_fills_up_leaves_no_half_light_field(tmp_path, room):
    """Neither views nor maps nor the folder, and no name of a temporary one in the message."""
    grid = GridShape(2, 2)
    with full_disk(room), pytest.raises(InputError, match="cannot be written") as caught:
        write_field(tmp_path / "field", grid)
    assert str(caught.value).startswith(str(tmp_path / "field"))
    assert "/." not in str(caught.value).partition(":")[0]
    assert list(tmp_path.iterdir()) == []


def write_field(folder, grid):
    views = (ViewUpdate(*at, NOISE, NOISE[..., 0].astype(np.float32)) for at in np.ndindex(*grid))
    write_light_field(folder, "hci", grid, views, 100.0, "field", with_disparity=True)


def generating(folder, *options):
    """`iibr generate` in a process of its own, in the midst of writing views to `field` in this folder."""
    write_image(folder / "photo.png", NOISE)
    words = ["generate", "photo.png", "--grid", "31", "--out", "field", "--depth", "flat", *options]
    process = subprocess.Popen(
        [sys.executable, "-P", "-m", "viewer", *words],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": os.getcwd()},
        stderr=subprocess.PIPE,
        text=True,
    )
    end = time.monotonic() + DEADLINE_S
    while not list(folder.glob(".iibr-*/new/field/input_Cam*.png")):
        assert process.poll() is None
        assert time.monotonic() < end
    return process


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT, signal.SIGHUP])
def test_a_process_asked_to_end_leaves_nothing(tmp_path, number):
    process = generating(tmp_path)
    process.send_signal(number)
    said = process.communicate(timeout=DEADLINE_S)[1]
    assert process.returncode == 130
    assert said == "iibr: interrupted\n"
    assert [path.name for path in tmp_path.iterdir()] == ["photo.png"]


def test_a_killed_process_leaves_nothing_under_the_name_it_was_to_write(tmp_path):
    """Killed in the midst of its views; the light field that was there is whole. What is left is hidden beside it."""
    write_field(tmp_path / "field", GridShape(1, 1))
    before = {path.name: path.read_bytes() for path in (tmp_path / "field").iterdir()}
    process = generating(tmp_path, "--force")
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert {path.name: path.read_bytes() for path in (tmp_path / "field").iterdir()} == before
    assert len(list(read_views(open_light_field(tmp_path / "field"))[1])) == 1
    again = generating(tmp_path, "--force")
    again.communicate(timeout=DEADLINE_S)
    assert again.returncode == 0


def test_a_cache_that_cannot_be_written_or_is_full_costs_nothing_but_time(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("no folder")
    estimate = RelativeInverseDepth(NOISE[..., 0].astype(np.float32))
    monkeypatch.setattr(estimate_cache, "cache_folder", lambda: tmp_path / "file" / "depth")
    estimate_cache.store("key", estimate)
    assert estimate_cache.load("key") is None
    monkeypatch.setattr(estimate_cache, "cache_folder", lambda: tmp_path / "depth")
    with full_disk(1000):
        estimate_cache.store("key", estimate)
    assert estimate_cache.load("key") is None
    assert list((tmp_path / "depth").iterdir()) == []
    estimate_cache.store("key", estimate)
    kept = estimate_cache.load("key")
    assert np.array_equal(kept.values, estimate.values)


def test_a_damaged_cache_is_an_empty_one(tmp_path, monkeypatch):
    """Cut off, no archive, or (found by fuzzing) compressed in a way that zipfile does not know, or encrypted."""
    monkeypatch.setattr(estimate_cache, "cache_folder", lambda: tmp_path)
    estimate_cache.store("key", RelativeInverseDepth(NOISE[..., 0].astype(np.float32)))
    whole = (tmp_path / "key.npz").read_bytes()
    entry = whole.index(b"PK\x01\x02")
    for at, byte in ((entry + 10, 99), (entry + 8, 1)):
        changed = bytearray(whole)
        changed[at] = byte
        (tmp_path / "key.npz").write_bytes(changed)
        assert estimate_cache.load("key") is None
    for damage in (b"", b"PK\x03\x04", b"\x93NUMPY\x01\x00", whole[:-100], whole[100:]):
        (tmp_path / "key.npz").write_bytes(damage)
        assert estimate_cache.load("key") is None


def test_a_view_deleted_while_the_light_field_is_read(tmp_path):
    write_field(tmp_path / "field", GridShape(2, 2))
    _, views = read_views(open_light_field(tmp_path / "field"))
    next(views)
    (tmp_path / "field" / "input_Cam000.png").unlink()
    with pytest.raises(InputError, match=r"input_Cam000\.png: no such file"):
        list(views)


def test_a_file_that_goes_away_between_two_looks(tmp_path, monkeypatch):
    """Between the look whether it is there and the reading, every reader."""
    monkeypatch.setattr(files, "require_file", lambda path: None)
    for name, read in (
        ("a.png", read_photo),
        ("a.jpg", read_photo),
        ("a.jpg", read_embedded),
        ("a.npy", lambda path: read_disparity(path, ImageSize(4, 4))),
        ("a.pfm", lambda path: read_disparity(path, ImageSize(4, 4))),
    ):
        with pytest.raises(InputError, match=name):
            read(tmp_path / name)


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def bomb_png(width, height, size=0):
    """Claims to be this large; what it really holds would show only while it is decoded. size: of the file or more."""
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return (
        b"\x89PNG\r\n\x1a\n"
        + header
        + chunk(b"juNk", bytes(size))
        + chunk(b"IDAT", zlib.compress(bytes(100_000)))
        + chunk(b"IEND", b"")
    )


@pytest.mark.parametrize(
    ("name", "data", "reason"),
    [
        ("bomb.png", bomb_png(19_000, 20_000), "claims a 1087 MB image"),
        ("bomb.png", bomb_png(60_000, 60_000), "cannot be read"),
        ("bomb.png", bomb_png(19_000, 20_000, 1_200_000), "bytes claim to hold 1,087 MiB"),
        ("bomb.ppm", b"P6 60000 60000 255\n" + bytes(9), "claims a 10299 MB image"),
    ],
)
def test_decompression_bombs_are_refused_by_size_before_decoding(tmp_path, name, data, reason):
    (tmp_path / name).write_bytes(data)
    with pytest.raises(InputError, match=rf"{name}: .*{reason}"):
        decode(tmp_path / name)


def test_a_bomb_within_a_photo_is_refused_too(tmp_path):
    depth = bomb_png(19_000, 20_000)
    path = tmp_path / "a.jpg"
    path.write_bytes(embedded.with_segments(embedded.grey_photo((8, 8)), embedded.gdepth_segments(depth)))
    with pytest.raises(InputError, match=r"a\.jpg: the depth map of GDepth"):
        read_embedded(path)


def test_large_pictures_that_are_no_bombs_are_read(tmp_path, monkeypatch):
    """The limit is on what decodes to much more than the file is large."""
    write_image(tmp_path / "a.png", NOISE)
    monkeypatch.setattr(files, "HARMLESS_BYTES", 10)
    assert read_photo(tmp_path / "a.png").size == NOISE.shape[:2]


class Touches:
    """Unpickled, it makes a file."""

    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


def test_npy_files_run_no_code(tmp_path):
    """Objects and archives with objects are refused before a pickle is touched."""
    for save, name in ((np.save, "a.npy"), (lambda file, array: np.savez(file, array), "b.npy")):
        buffer = io.BytesIO()
        save(buffer, np.array([Touches(tmp_path / "touched")], dtype=object))
        (tmp_path / name).write_bytes(buffer.getvalue())
        with pytest.raises(InputError, match=name):
            read_disparity(tmp_path / name, ImageSize(1, 1))
    assert not (tmp_path / "touched").exists()


@pytest.mark.parametrize(
    "header",
    [
        b"{'descr': '<f4', 'fortran_order': False, 'shape': (1000000, 1000000)}",
        b"{'descr': '<f4', 'fortran_order': False, 'shape': (-1, 4)}",
        b"{'descr': '<f4', 'fortran_order': False, 'shape': (10000000000000000000000, 4)}",
        b"{'descr': '<f4', 'fortran_order': False, 'shape': (0, 10000000000000000000000)}",
        b"{'descr': '<f4', 'fortran_order': False, 'shape': ((((((",
        b"{'descr': '<f4', 'fortran_order': False, 'shape': (4, 4)",
        b"{'descr': [('a', '<f4')], 'fortran_order': False, 'shape': (4, 4)}",
    ],
)
def test_npy_headers_that_lie(tmp_path, header):
    """Found by fuzzing: numpy parses them as Python, and its tokenizer has errors of its own."""
    data = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header) + 1) + header + b"\n" + bytes(64)
    (tmp_path / "a.npy").write_bytes(data)
    with pytest.raises(InputError, match=r"a\.npy") as caught:
        read_disparity(tmp_path / "a.npy", ImageSize(4, 4))
    assert "\n" not in str(caught.value)


def test_names_in_a_picture_that_are_no_text(tmp_path):
    """Found by fuzzing: OpenImageIO's messages and header texts may quote bytes that are no UTF-8."""
    write_image(tmp_path / "a.exr", NOISE[:8, :8], {"Software": "some words"})
    whole = (tmp_path / "a.exr").read_bytes()
    outcomes = set()
    for old, new in (
        (b"some words", b"\xff\xfe words "),
        (b"B\0\1\0", b"\xff\0\1\0"),
        (b"compression\0", b"\xffompression\0"),
    ):
        (tmp_path / "a.exr").write_bytes(whole.replace(old, new))
        try:
            read_photo(tmp_path / "a.exr")
            outcomes.add("read")
        except InputError as error:
            outcomes.add(str(error).partition(":")[0])
    assert outcomes == {"read", str(tmp_path / "a.exr")}


def test_parameters_that_make_no_sense(tmp_path):
    """Found by fuzzing: a focal length beyond all numbers; and a file too large to be one."""
    write_field(tmp_path / "field", GridShape(1, 1))
    path = tmp_path / "field" / "parameters.cfg"
    path.write_text(path.read_text().replace("sensor_size_mm = 36.0", "sensor_size_mm = 1e-320"))
    assert open_light_field(tmp_path / "field").focal_px is None
    path.write_bytes(b"\n" * 2_000_000)
    with pytest.raises(InputError, match=r"parameters\.cfg: is larger than"):
        open_light_field(tmp_path / "field")
