import io
import resource
import struct
import zlib
from contextlib import contextmanager

import numpy as np
import pytest

from iibr_core.depth.embedded.embedded import read_embedded
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.depth.models import cache as estimate_cache
from iibr_core.formats.images.write import write_image
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.types import ImageSize, InputError
from tests.iibr_core import embedded_files as embedded

NOISE = np.random.default_rng(0).integers(0, 256, (120, 160, 3), dtype=np.uint8)


@contextmanager
def full_disk(room):
    """Files cannot grow beyond this many bytes: writes then fail as they do on a disk without room."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_a_disk_that_is_full_at_the_last_byte_is_noticed(tmp_path, name):
    """OpenImageIO says that all went well where the end of a file gets lost while it is closed."""
    write_image(tmp_path / name, NOISE)
    size = (tmp_path / name).stat().st_size
    for missing in (1, 500):
        with full_disk(size - missing), pytest.raises(InputError, match="cannot be written"):
            write_image(tmp_path / name, NOISE)
    assert (tmp_path / name).stat().st_size == size
    with full_disk(size + 4096):
        write_image(tmp_path / name, NOISE)


def test_a_cache_that_cannot_be_written_or_is_full_costs_nothing_but_time(tmp_path, monkeypatch):
    (tmp_path / "file").write_text("no folder")
    estimate = DepthEstimate(NOISE[..., 0].astype(np.float32), "inverse depth")
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
    monkeypatch.setattr(estimate_cache, "MAX_BYTES", NOISE[..., 0].size * 6)
    estimate_cache.store("newer", estimate)
    assert [path.stem for path in (tmp_path / "depth").glob("*.npz")] == ["newer"], "the older one goes"


def test_a_damaged_cache_is_an_empty_one(tmp_path, monkeypatch):
    monkeypatch.setattr(estimate_cache, "cache_folder", lambda: tmp_path)
    estimate_cache.store("key", DepthEstimate(NOISE[..., 0].astype(np.float32), "inverse depth"))
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


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def bomb_png(width, height):
    """Claims to be this large; what it really holds would show only while it is decoded."""
    header = chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
    return b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(bytes(100_000))) + chunk(b"IEND", b"")


def test_a_bomb_within_a_photo_is_refused_too(tmp_path):
    depth = bomb_png(19_000, 20_000)
    path = tmp_path / "a.jpg"
    path.write_bytes(embedded.with_segments(embedded.grey_photo((8, 8)), embedded.gdepth_segments(depth)))
    with pytest.raises(InputError, match=r"a\.jpg: the depth map of GDepth"):
        read_embedded(path)


class Touches:
    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return open, (str(self.path), "w")


def test_npy_files_run_no_code(tmp_path):
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
        *(f"'<f4', 'shape': {shape}" for shape in ("(1000000, 1000000)}", "(-1, 4)}", f"(0, 1{'0' * 22})}}", "((((((")),
        "[('a', '<f4')], 'shape': (4, 4)}",
    ],
)
def test_npy_headers_that_lie(tmp_path, header):
    """Found by fuzzing: numpy parses them as Python, and its tokenizer has errors of its own."""
    header = f"{{'fortran_order': False, 'descr': {header}\n".encode()
    data = b"\x93NUMPY\x01\x00" + struct.pack("<H", len(header)) + header + bytes(64)
    (tmp_path / "a.npy").write_bytes(data)
    with pytest.raises(InputError, match=r"a\.npy") as caught:
        read_disparity(tmp_path / "a.npy", ImageSize(4, 4))
    assert "\n" not in str(caught.value)
