"""Valid files of every kind that is read, small ones: what fuzzing damages."""

from __future__ import annotations

import io
import json
import struct
import tempfile
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from PIL import Image, PngImagePlugin

from benchmarks.fuzz_damage import Seed, repair_png
from iibr_core.beyond.optics import ApertureMask, ApertureShape, Optics
from iibr_core.formats.images.spatial_photo import write_spatial_photo
from iibr_core.runtime.resources import resource_folder
from iibr_core.scenes.scene import Source
from iibr_core.types import ImageSize
from tests.iibr_core import embedded_files as embedded
from viewer.model.saved_settings import settings_text
from viewer.model.state.saving import SavedSettings

SIZE = ImageSize(17, 23)


def sample(channels: int = 3, dtype: type = np.uint8) -> np.ndarray:
    values = np.random.default_rng(0).integers(0, 256, (*SIZE, channels)).astype(dtype)
    values[4:9, 3:12] = 200
    return values / 255 if dtype == np.float32 else values


def encode_image(extension: str, pixels: np.ndarray, kind: str = "uint8", **attributes: object) -> bytes:
    """A file's bytes as OpenImageIO writes them."""
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/a.{extension}"
        spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
        for name, value in attributes.items():
            spec.attribute(name.replace("__", ":"), value)
        output = oiio.ImageOutput.create(path)
        if output is None or not output.open(path, spec):
            raise ValueError(f"cannot write .{extension}")
        output.write_image(np.ascontiguousarray(pixels))
        output.close()
        return Path(path).read_bytes()


def by_pillow(kind: str, mode: str = "RGB", **options: object) -> bytes:
    file = io.BytesIO()
    Image.fromarray(sample()).convert(mode).save(file, kind, **options)
    return file.getvalue()


def jpegs() -> list[Seed]:
    exif = Image.Exif()
    exif[0x0112] = 6
    exif.get_ifd(0x8769)[0xA405] = 28
    kinds = (
        by_pillow("JPEG", exif=exif),
        by_pillow("JPEG", progressive=True),
        by_pillow("JPEG", "L"),
        by_pillow("JPEG", "CMYK"),
    )
    return [Seed("a.jpg", data) for data in kinds]


def pngs() -> list[Seed]:
    kinds = [by_pillow("PNG", mode) for mode in ("RGB", "RGBA", "L", "P", "1")]
    kinds.append(encode_image("png", sample(4, np.uint16) * np.uint16(257), "uint16"))
    return [Seed("a.png", data, file_of) for data in kinds for file_of in (bytes, repair_png)]


def tiffs() -> list[Seed]:
    kinds = (
        encode_image("tif", sample(), compression="lzw"),
        encode_image("tif", sample(4, np.uint16), "uint16", compression="zip"),
        encode_image("tif", sample(3, np.float32), "float", compression="none"),
        by_pillow("TIFF", "CMYK"),
        by_pillow("TIFF", "P", compression="packbits"),
        by_pillow("TIFF", "RGB", compression="jpeg"),
    )
    return [Seed("a.tif", data) for data in kinds]


def exrs() -> list[Seed]:
    compressions = ("none", "zip", "piz", "rle", "b44", "dwaa")
    return [Seed("a.exr", encode_image("exr", sample(3, np.float32), "half", compression=c)) for c in compressions]


def hdrs() -> list[Seed]:
    return [Seed("a.hdr", encode_image("hdr", sample(3, np.float32), "float"))]


def pnms() -> list[Seed]:
    texts = [
        b"P3 2 2 255\n" + b"1 2 3 " * 4,
        b"P6\n# note\n2 2\n255\n" + bytes(12),
        b"P5 3 2 65535\n" + bytes(12),
        b"P4 9 2\n" + bytes(4),
        b"PF 2 2 -1.0\n" + bytes(48),
    ]
    return [Seed("a.ppm", data) for data in texts]


def others() -> list[Seed]:
    """Formats that OpenImageIO reads beside those that are promised."""
    seeds = []
    for extension in ("bmp", "dpx", "gif", "iff", "ico", "jp2", "jxl", "rla", "sgi", "tga", "fits", "zfile"):
        channels, kind = (1, "float") if extension in ("zfile", "fits") else (3, "uint8")
        try:
            pixels = sample(channels, np.float32 if kind == "float" else np.uint8)
            seeds.append(Seed(f"a.{extension}", encode_image(extension, pixels, kind)))
        except ValueError:
            continue  # this build does not write it
    return seeds


def depth_map() -> np.ndarray:
    return np.tile(np.linspace(20, 230, SIZE[1]).astype(np.uint8), (SIZE[0], 1))


def photos_with_depth() -> list[Seed]:
    """Photos that carry depth; damaged as a whole, and in the depth map alone."""
    photo, depth = embedded.grey_photo(SIZE), embedded.picture(depth_map(), "PNG")
    wholes = [
        embedded.with_segments(photo, embedded.gdepth_segments(depth, units="m")),
        embedded.with_segments(photo, embedded.gdepth_segments(depth, part_bytes=300, sharp=photo, confidence=depth)),
        embedded.dynamic_depth_jpeg(photo, depth),
        embedded.apple_jpeg(photo, depth_map(), 0.5, 2.0),
        embedded.samsung_jpeg(photo, depth_map()),
    ]

    def with_gdepth(depth_bytes: bytes) -> bytes:
        return embedded.with_segments(photo, embedded.gdepth_segments(depth_bytes, part_bytes=20_000))

    def with_packet(packet: bytes) -> bytes:
        return embedded.with_segments(photo, [packet])

    inner = [Seed("a.jpg", data, with_gdepth) for data in (depth, embedded.picture(depth_map()))]
    packets = [Seed("a.jpg", embedded.gdepth_segments(depth)[0], with_packet)]
    return [Seed("a.jpg", data) for data in wholes] + inner + packets


def heics() -> list[Seed]:
    pixels, depth = np.repeat(sample(), 4, axis=1).repeat(4, axis=0)[:64, :64], np.full((64, 64), 90, np.uint8)
    return [Seed("a.heic", embedded.heic(pixels)), Seed("a.heic", embedded.heic(pixels, depth))]


def view_files() -> list[Seed]:
    """Files that hold several views."""
    with tempfile.TemporaryDirectory() as folder:
        spatial = Path(folder) / "a.heic"
        write_spatial_photo(spatial, sample(), sample(), 20.0)
        pair = spatial.read_bytes()
    second = Image.fromarray(sample())
    multiple = by_pillow("MPO", save_all=True, append_images=[second])
    said = json.dumps({"views": [{"image": {"blob_id": number}, "position": [number]} for number in (-1, 10)]}).encode()
    fields = [(8, said), (10, by_pillow("JPEG"))]
    region = struct.pack(">I", len(fields))
    region += b"".join(struct.pack(">II", number, len(data)) + data for number, data in fields)
    leia = by_pillow("JPEG") + region + struct.pack(">I", len(region) + 6) + b"\x1e\x1a"
    png = by_pillow("PNG")
    tiled = [Seed(name, png, repair_png) for name in ("a_qs2x2a1.png", "a_SBS.png", "a_eslf.png")]
    return [Seed("a.heic", pair), Seed("a.mpo", multiple), Seed("a.lif", leia), *tiled]


def pfms() -> list[Seed]:
    values = np.linspace(-1, 1, SIZE[0] * SIZE[1], dtype="<f4").tobytes()
    headers = (b"Pf\n23 17\n-1.0\n", b"Pf 23 17 1\n", b"Pf\r\n23 17\r\n-0.003\r\n")
    return [Seed("a.pfm", header + values) for header in headers]


def npys() -> list[Seed]:
    seeds = []
    for array in (np.zeros(SIZE, np.float32), np.zeros(SIZE, np.int16), np.zeros(SIZE, ">f8"), np.array([{}, 1])):
        file = io.BytesIO()
        np.save(file, array, allow_pickle=True)
        seeds.append(Seed("a.npy", file.getvalue()))
    file = io.BytesIO()
    np.savez(file, a=np.zeros(3))
    return [*seeds, Seed("a.npy", file.getvalue())]


def cfgs() -> list[Seed]:
    text = (
        "[intrinsics]\nfocal_length_mm = 100\nimage_resolution_x_px = 512\nsensor_size_mm = 35\nfstop = 100\n\n"
        "[extrinsics]\nnum_cams_x = 2\nnum_cams_y = 2\nbaseline_mm = 1.0\nfocus_distance_m = 0.0\n\n"
        "[meta]\nscene = a\ndisp_min = -1.5\ndisp_max = 2.25\n"
    )
    return [Seed("parameters.cfg", text.encode()), Seed("parameters.cfg", text.replace("\n", "\r\n").encode("utf-16"))]


def saved_settings() -> list[Seed]:
    mask = ApertureShape("mask", mask=ApertureMask("m", 2, 2, b"\x01\xff\x00\x10"))
    text = settings_text(SavedSettings(Optics(aperture_shape=mask), 1.0, Source(""), (64, 48))).encode()

    def in_png(settings: bytes) -> bytes:
        info = PngImagePlugin.PngInfo()
        info.add_text("iibr:settings", settings.decode("latin-1"))
        file = io.BytesIO()
        Image.fromarray(sample()).save(file, "PNG", pnginfo=info)
        return file.getvalue()

    def in_exr(settings: bytes) -> bytes:
        return encode_image("exr", sample(3, np.float32), "half", iibr__settings=settings.decode("latin-1"))

    whole = [Seed("a.png", in_png(text), repair_png), Seed("a.exr", in_exr(text))]
    return [Seed("a.png", text, in_png), Seed("a.png", text, in_png), Seed("a.exr", text, in_exr), *whole]


def weights() -> list[Seed]:
    data = (resource_folder("assets") / "weights" / "ray_transformer.safetensors").read_bytes()
    split = 8 + int.from_bytes(data[:8], "little")

    def with_length(header: bytes) -> bytes:
        return struct.pack("<Q", len(header)) + header + data[split:]

    halves = json.dumps(
        {"__metadata__": {"content": "iibr-weights", "version": "1"}}
        | {kind: {"dtype": kind, "shape": [2], "data_offsets": [0, 4]} for kind in ("F16", "BF16")}
    ).encode()
    return [Seed("a.safetensors", data), *(Seed("a.safetensors", d, with_length) for d in (data[8:split], halves))]


def poses() -> list[Seed]:
    """Return the positions of four cameras side by side."""
    rotation = np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, -1]]).T
    rows = []
    for k in range(4):
        matrix = np.column_stack([rotation, [0.0, k, 0.0], [17.0, 23.0, 30.0]])
        rows.append([*matrix.ravel(), 1.0, 9.0])
    file = io.BytesIO()
    np.save(file, np.array(rows))
    return [Seed("poses_bounds.npy", file.getvalue())]


def preferences() -> list[Seed]:
    """Return the files that the viewer keeps between two runs."""
    kept = {"theme": "light", "font_scale": 1.25, "open_sections": ["view"], "window": [0, 0, 800, 600]}
    return [
        Seed("preferences.json", json.dumps(kept).encode()),
        Seed("recent.json", json.dumps(["/a.png", "/b.jpg"]).encode()),
    ]


def estimates() -> list[Seed]:
    """Kept estimates of depth."""
    file = io.BytesIO()
    np.savez(file, kind="relative", values=np.ones(SIZE, np.float32), focal_px=0.0)
    return [Seed("key.npz", file.getvalue())]


def model_configs() -> list[Seed]:
    """How a depth model wants its pictures."""
    config = {
        "size": {"height": 518, "width": 518},
        "ensure_multiple_of": 14,
        "image_mean": [0.5] * 3,
        "image_std": 0.5,
    }
    return [Seed("preprocessor_config.json", json.dumps(config).encode())]
