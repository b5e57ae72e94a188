"""Give every reader damaged copies of valid files: each must return finite values or raise an error of one line.

    python -m benchmarks fuzz [--count 1000] [--only jpg,pfm] [--seed 0]

Hypothesis chooses the damage. The least damaged copy on which a reader fails stays in out/fuzz. If a reader ends the
whole process or takes longer than a minute, the file in question is the last one in out/fuzz/now. Exits with 1 if
anything was found.
"""

from __future__ import annotations

import argparse
import faulthandler
import io
import re
import resource
import shutil
import struct
import sys
import traceback
import zlib
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import psutil
from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from PIL import Image, PngImagePlugin

from benchmarks.report import is_wanted
from iibr_core.beyond.aperture_mask import read_mask
from iibr_core.beyond.optics import Optics
from iibr_core.depth.search import open_with_depth
from iibr_core.formats.cameras import FieldCameras, write_nerfstudio
from iibr_core.formats.colmap import write_colmap
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.write import write_image_file
from iibr_core.formats.light_fields.light_field_formats import find_light_field
from iibr_core.formats.light_fields.views import read_views
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.formats.maps.writer import write_map
from iibr_core.method.ray_transformer import TrainedWeights
from iibr_core.runtime.resources import resource_folder
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset
from tests.iibr_core import embedded_files
from viewer.app.picture_files import read_settings
from viewer.app.preferences_store import load_preferences
from viewer.model.app_state import AppState
from viewer.model.saved_settings import settings_text
from viewer.model.saving import SavedSettings

OUT = Path("out/fuzz")
TIME_LIMIT_S = 60.0
MEMORY_LIMIT = 3 << 30
"""Bytes that the process may reserve beyond those at the start."""
SIZE = ImageSize(17, 23)
NUMBERS = (b"-1", b"0", b"1e999", b"nan", b"-inf", b"99999999999999999999", b"4294967295", b"1e-320")
EXTREMES = (b"\0", b"\x7f", b"\xff", b"\x80\0", b"\0\x80", b"\xff\xff", b"\x7f\xff\xff\xff", b"\xff\xff\xff\xff")
NUMBER = re.compile(rb"(?<![0-9A-Za-z+/])-?\d{1,12}(\.\d{1,12})?")
"""Number that is written as text."""
CAMERAS = """[intrinsics]\nfocal_length_mm = 100\nimage_resolution_x_px = 512\nsensor_size_mm = 35
[extrinsics]\nnum_cams_x = 2\nnum_cams_y = 2\nbaseline_mm = 1.0\nfocus_distance_m = 0.0\n"""
PREFERENCES = '{"theme": "light", "font_scale": 1.25, "open_sections": ["view"], "window": [0, 0, 800, 600]}'

Read = Callable[[Path], Any]


def main() -> None:
    """Fuzz all readers and print what was found."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--count", type=int, default=1000, help="damaged copies of each file")
    parser.add_argument("--only", default="", help="files whose names contain one of these words")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    shutil.rmtree(OUT / "now", ignore_errors=True)
    readers = {path: read for path, read in samples(OUT / "now").items() if is_wanted(path.name, options.only)}
    limit = psutil.Process().memory_info().vms + MEMORY_LIMIT
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    findings = list(fuzz(readers, options.count, options.seed, OUT))
    print("\n".join(findings) or "nothing found")
    sys.exit(bool(findings))


def fuzz(readers: Mapping[Path, Read], count: int, first_seed: int, out: Path) -> Iterator[str]:
    """Yield a line for each file of which a damaged copy is neither read nor refused, and keep the copy."""
    originals = {path: path.read_bytes() for path in readers}
    for path, read in readers.items():
        copies = damaged(originals[path], list(originals.values()))
        check = given(st.just(path), st.just(read), copies)(_check)
        try:
            seed(first_seed)(settings(USUAL, max_examples=count)(check))()
        except AssertionError as error:
            shutil.copy(path, out / path.name)
            yield f"{path.name}: {error}".splitlines()[0]
        path.write_bytes(originals[path])


def _check(path: Path, read: Read, data: bytes) -> None:
    path.write_bytes(data)
    faulthandler.dump_traceback_later(TIME_LIMIT_S, exit=True)
    fault = fault_of(read, path)
    faulthandler.cancel_dump_traceback_later()
    assert not fault, fault


def fault_of(read: Read, path: Path) -> str:
    """Return what went wrong in reading, "" if the file was read or refused in one line."""
    try:
        result = read(path)
    except InputError as error:
        return "a message of several lines" if "\n" in str(error) else ""
    except Exception as error:
        frame = traceback.extract_tb(error.__traceback__)[-1]
        return f"{type(error).__name__} in {Path(frame.filename).name}, {frame.name}: {str(error)[:80]!r}"
    is_finite = all(np.isfinite(array).all() for array in result or ())
    return "" if is_finite else "values that are not finite"


def samples(folder: Path) -> dict[Path, Read]:
    """Write a small file of every kind below a folder; return the function that reads each as arrays."""
    pixels = np.random.default_rng(0).integers(0, 256, (*SIZE, 3)).astype(np.uint8)
    picture, depth = Image.fromarray(pixels), np.tile(np.linspace(20, 230, SIZE[1]).astype(np.uint8), (SIZE[0], 1))
    readers: dict[Path, Read] = {}

    def add(name: str, read: Read, data: bytes | str = b"") -> Path:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(data.encode() if isinstance(data, str) else data)
        readers[path] = read
        return path

    def saved(kind: str, mode: str = "RGB", **options: Any) -> bytes:
        picture.convert(mode).save(file := io.BytesIO(), kind, **options)
        return file.getvalue()

    for name, mode in (("a.jpeg", "RGB"), ("b.jpeg", "CMYK"), ("a.png", "P"), ("b.png", "1"), ("a.webp", "RGB")):
        add(name, _photo, saved(name[2:], mode))
    for name, dtype in (("a.tif", "uint16"), ("a.exr", "half"), ("a.hdr", "float"), ("a.ppm", "uint8")):
        write_image_file(add(name, _photo), pixels / np.float32(255), dtype)
    photo, map_png = embedded_files.grey_photo(SIZE), embedded_files.picture(depth, "PNG")
    gdepth = embedded_files.gdepth_segments(map_png, units="m")
    add("gdepth.jpg", _with_depth, embedded_files.with_segments(photo, gdepth))
    add("dynamic.jpg", _with_depth, embedded_files.dynamic_depth_jpeg(photo, map_png))
    add("apple.jpg", _with_depth, embedded_files.apple_jpeg(photo, depth, 0.5, 2.0))
    add("samsung.jpg", _with_depth, embedded_files.samsung_jpeg(photo, depth))
    add("depth.heic", _with_depth, embedded_files.heic(np.resize(pixels, (64, 64, 3)), np.full((64, 64), 90, np.uint8)))
    for name in ("map.pfm", "map.npy", "map.png"):
        write_map(add(name, lambda path: [read_disparity(path, SIZE).values]), depth / np.float32(100))
    for name in ("a_qs2x2a1.png", "a_SBS.png", "a_eslf.png"):
        add(name, _views, saved("png"))
    add("a.mpo", _views, saved("mpo", save_all=True, append_images=[picture]))
    add("hci/parameters.cfg", lambda path: _views(path.parent), CAMERAS)
    pose = np.array([[0.0, 1, 0, 0, 17], [1, 0, 0, 0, 23], [0, 0, -1, 0, 30]])
    rows = [[*(pose + np.outer([0, k, 0], [0, 0, 0, 1, 0])).ravel(), 1.0, 9.0] for k in range(4)]
    np.save(add("llff/poses_bounds.npy", lambda path: _views(path.parent)), np.array(rows))
    for name in (f"{layout}/input_Cam{number:03d}.png" for layout in ("hci", "llff") for number in range(4)):
        (folder / name).write_bytes(saved("png"))
    for name in ("colmap/sparse/0/cameras.bin", "colmap/sparse/0/images.bin", "nerfstudio/transforms.json"):
        root = folder / name.split("/")[0]
        if not (folder / name).is_file():
            _write_cameras(root, saved("png"))
        add(name, lambda path, root=root: _views(root), (folder / name).read_bytes())
    info = PngImagePlugin.PngInfo()
    info.add_text("iibr:settings", settings_text(SavedSettings(Optics(), 1.0, Source(""), (64, 48))))
    add("settings.png", lambda path: read_settings(path) and None, saved("png", pnginfo=info))
    add("mask.png", lambda path: read_mask(path) and None, saved("png"))
    add("preferences.json", lambda path: load_preferences(AppState(), path.parent) and None, PREFERENCES)
    weights = resource_folder("assets") / "weights" / "ray_transformer.safetensors"
    add("a.safetensors", lambda path: TrainedWeights(path) and None, weights.read_bytes())
    return readers


def _write_cameras(root: Path, picture: bytes) -> None:
    """Write two views with their cameras as COLMAP's model, or for nerfstudio."""
    (root / "images").mkdir(parents=True)
    offsets = {f"{k}.png": ViewOffset(0.0, float(k)) for k in range(2)}
    for name in offsets:
        (root / "images" / name).write_bytes(picture)
    cameras = FieldCameras(GridShape(1, 2), SIZE, 30.0, (1.0, 2.0), 0.0)
    if root.name == "colmap":
        write_colmap(root, cameras, offsets, np.zeros((1, 3), np.float32), np.zeros((1, 3), np.uint8))
    else:
        write_nerfstudio(root, cameras, offsets)


def _photo(path: Path) -> list[np.ndarray]:
    return [read_photo(path, 100_000).pixels]


def _with_depth(path: Path) -> list[np.ndarray]:
    found = open_with_depth(path, max_pixels=100_000)
    return [found.photo.pixels, found.disparity.values]


def _views(path: Path) -> list[np.ndarray] | None:
    scene = find_light_field(path)
    return scene and [view.colors for view in read_views(scene)[1]]


def damaged(data: bytes, others: list[bytes]) -> st.SearchStrategy[bytes]:
    """Return copies of a file with exchanged pieces. others: files of which parts may be copied into it."""
    shares, lengths = st.floats(0, 1, exclude_max=True), st.integers(0, 1024)
    # Rather near the beginning: headers come first.
    spans = st.tuples(shares, lengths).map(lambda drawn: _span(data, drawn[0] ** 2, drawn[1]))
    spans |= shares.map(lambda share: _span(data, share, len(data)))
    if numbers := [slice(*found.span()) for found in NUMBER.finditer(data)]:
        spans |= st.sampled_from(numbers)
    parts = st.tuples(st.sampled_from(others), shares, lengths).map(lambda drawn: drawn[0][_span(*drawn)])
    piece = st.sampled_from((b"", *EXTREMES, *NUMBERS)) | st.binary(min_size=1, max_size=64) | parts
    edits = st.lists(st.tuples(spans, piece), min_size=1, max_size=6)
    return st.tuples(edits, st.booleans()).map(lambda drawn: _edited(data, *drawn))


def _span(data: bytes, share: float, length: int) -> slice:
    first = int(len(data) * share)
    return slice(first, first + length)


def _edited(data: bytes, edits: list[tuple[slice, bytes]], repairs: bool) -> bytes:
    """Return a file with pieces in the place of spans. repairs: whether a PNG gets right lengths and checksums."""
    is_png = data.startswith(b"\x89PNG")
    for span, piece in sorted(edits, key=lambda edit: edit[0].start, reverse=True):
        data = data[: span.start] + piece + data[span.stop :]
    return _repaired_png(data) if is_png and repairs else data


USUAL = settings(
    deadline=None, database=None, phases=(Phase.generate, Phase.shrink), suppress_health_check=list(HealthCheck)
)


def _repaired_png(data: bytes) -> bytes:
    """Return the chunks of a PNG with right lengths and checksums, so that damage gets past the first check."""
    at, chunks = 8, [data[:8]]
    while at + 8 <= len(data):
        length, kind = int.from_bytes(data[at : at + 4], "big"), data[at + 4 : at + 8]
        content = data[at + 8 : at + 8 + length]
        chunks.append(struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content)))
        at += 12 + length
    return b"".join(chunks)


if __name__ == "__main__":
    main()
