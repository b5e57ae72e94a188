"""The folder that every hostile case gets a copy of: good files, damaged files, and files that lie."""

from __future__ import annotations

import json
import struct
import zlib
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image

from iibr_core.depth.editing.edits import DepthEdits, Stroke
from iibr_core.formats.images.photo import write_image
from iibr_core.formats.images.picture_kinds import PictureFormat
from iibr_core.formats.images.settings_text import ATTRIBUTE
from iibr_core.formats.images.spatial_photo import write_spatial_photo
from iibr_core.formats.light_fields.hci import HciWriter
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.rendering.gloss.gloss_settings import Gloss
from iibr_core.rendering.optics import Optics
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, GridShape, ViewUpdate
from viewer.app.image_export import SavedShot, export_picture
from viewer.model.saved_settings import settings_text
from viewer.model.state.saving import SavedSettings

HEIGHT, WIDTH = 24, 32

BAD_PICTURES = (
    "missing.png", "folder", "empty.png", "text.png", "cut.png", "cut.jpg", "cut.exr", "cut.tif", "noise.png",
    "noise.heic", "bomb.png", "huge.pfm.png", "zero.png", "loop.png", "dangling.png",
)  # fmt: skip
"""Of the template: what no photo is."""

BAD_MAPS = (
    "missing.pfm", "folder", "empty.pfm", "text.pfm", "cut.pfm", "huge.pfm", "zero.pfm", "nan.pfm", "wide.pfm",
    "pickle.npy", "cut.npy", "words.npy", "bomb.png", "text.png",
)  # fmt: skip
"""Of the template: what no disparity map of its photo is."""


BAD_VIEW_FILES = (
    "cut.mpo", "cut.lif", "lie.lif", "cut-pair.heic", "none_qs0x6a1.png", "many_qs32x32a1.png", "odd_eslf.png",
    "uneven_qs2x2a1.png", "raw.lfp", "missing_SBS.png",
)  # fmt: skip
"""Of the template: files that hold no whole light field or stereo photo."""


def make_template(folder: Path) -> None:
    """Fill the folder."""
    folder.mkdir()
    rng = np.random.default_rng(0)
    pixels = rng.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8)
    _make_good(folder, pixels)
    _make_bad_pictures(folder, pixels)
    _make_bad_maps(folder)
    _make_bad_view_files(folder, pixels)
    _make_texts_that_name_files(folder, pixels)
    (folder / "folder").mkdir()
    (folder / "text.txt").write_text("some words")


def _make_good(folder: Path, pixels: np.ndarray) -> None:
    disparity = np.zeros((HEIGHT, WIDTH), np.float32)
    disparity[8:16, 10:20] = 2.0
    write_image(folder / "photo.png", pixels)
    Image.fromarray(pixels).save(folder / "photo.jpg")
    write_pfm(folder / "map.pfm", disparity)
    settings = SavedSettings(Optics(), 1.0, Source(""), ScreenSize(WIDTH, HEIGHT))
    shot = SavedShot(settings, PictureFormat(), SRGB, None)
    export_picture(folder / "saved.png", pixels, shot)
    huge = SavedSettings(Optics(), 1.0, Source(""), ScreenSize(30_000, 30_000))
    export_picture(folder / "saved-huge.png", pixels, replace(shot, settings=huge))
    with HciWriter(folder / "field", GridShape(3, 3), 40.0, "field", False) as writer:
        for row in range(3):
            for column in range(3):
                writer.add(ViewUpdate(row, column, pixels, disparity))
    (folder / "link.png").symlink_to("photo.png")
    (folder / "link-to-folder").symlink_to("folder", target_is_directory=True)
    (folder / "link-to-field").symlink_to("field", target_is_directory=True)
    (folder / "dangling-into-folder").symlink_to("folder/target.png")


def _make_bad_pictures(folder: Path, pixels: np.ndarray) -> None:
    (folder / "empty.png").touch()
    (folder / "text.png").write_text("this is no picture")
    for kind in ("png", "jpg", "tif"):
        Image.fromarray(pixels).save(folder / f"cut.{kind}")
    write_image(folder / "cut.exr", pixels)
    for path in folder.glob("cut.*"):
        path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    (folder / "noise.png").write_bytes(b"\x89PNG\r\n\x1a\n" + np.random.default_rng(1).bytes(500))
    (folder / "noise.heic").write_bytes(b"\x00\x00\x00\x18ftypheic" + np.random.default_rng(2).bytes(500))
    (folder / "bomb.png").write_bytes(_png(60_000, 60_000))
    (folder / "huge.pfm.png").write_bytes(_png(2**31 - 1, 2**31 - 1))
    (folder / "zero.png").write_bytes(_png(0, 0))
    (folder / "loop.png").symlink_to("loop.png")
    (folder / "dangling.png").symlink_to("gone.png")


def _make_bad_view_files(folder: Path, pixels: np.ndarray) -> None:
    picture = Image.fromarray(pixels)
    picture.save(folder / "cut.mpo", "MPO", save_all=True, append_images=[picture])
    write_spatial_photo(folder / "cut-pair.heic", pixels, pixels, 30.0)
    for name in ("cut.mpo", "cut-pair.heic"):
        path = folder / name
        path.write_bytes(path.read_bytes()[: path.stat().st_size * 4 // 5])
    jpeg = (folder / "photo.jpg").read_bytes()
    (folder / "cut.lif").write_bytes(jpeg)
    (folder / "lie.lif").write_bytes(jpeg + struct.pack(">III", 2**31, 8, 2**31) + struct.pack(">I", 18) + b"\x1e\x1a")
    for name in ("none_qs0x6a1.png", "many_qs32x32a1.png", "odd_eslf.png"):
        picture.save(folder / name)
    Image.fromarray(pixels).save(folder / "uneven_qs2x2a1.png")
    (folder / "uneven_qs2x2a1.png").write_bytes((folder / "uneven_qs2x2a1.png").read_bytes()[:-200])
    (folder / "raw.lfp").write_bytes(b"\x89LFP\r\n\x1a\n" + bytes(1000))
    Image.fromarray(pixels[:, :1]).save(folder / "thin_SBS.png")


def _make_texts_that_name_files(folder: Path, pixels: np.ndarray) -> None:
    """Saved pictures whose settings name files, or ask for days of painting; texts that name what is not theirs."""
    plain = SavedSettings(Optics(gloss=Gloss(reflectance=0.5)), 1.0, Source(""), ScreenSize(WIDTH, HEIGHT))
    for name, path in (("saved-link.png", "photo.png"), ("saved-device.png", "/dev/zero"), ("saved-host.png", "//a/b")):
        text = settings_text(plain).replace('"environment":""', f'"environment":"{path}"')
        write_image(folder / name, pixels, {ATTRIBUTE: text})
    strokes = (Stroke("smooth", ((0.5, 0.5),), 0.25, 1.0),) * 11_000
    busy = replace(plain, depth_edits=DepthEdits(strokes=strokes))
    write_image(folder / "saved-busy.png", pixels, {ATTRIBUTE: settings_text(busy)})
    frame = {"file_path": "../../etc/passwd", "transform_matrix": np.eye(4).tolist()}
    (folder / "outside.json").write_text(json.dumps({"fl_x": 40.0, "frames": [frame]}))
    (folder / "gone.toml").write_text('environment = "missing.png"')
    (folder / "device.toml").write_text('environment = "/dev/zero"')
    (folder / "marked.toml").write_text("\ufeffroughness = 0.5", "utf-8")


def _make_bad_maps(folder: Path) -> None:
    good = (folder / "map.pfm").read_bytes()
    (folder / "empty.pfm").touch()
    (folder / "text.pfm").write_text("no map at all")
    (folder / "cut.pfm").write_bytes(good[: len(good) // 2])
    (folder / "huge.pfm").write_bytes(b"Pf\n999999999 999999999\n-1.0\n")
    (folder / "zero.pfm").write_bytes(b"Pf\n0 0\n-1.0\n")
    write_pfm(folder / "nan.pfm", np.full((HEIGHT, WIDTH), np.nan, np.float32))
    write_pfm(folder / "wide.pfm", np.ones((HEIGHT, 5 * WIDTH), np.float32))
    np.save(folder / "pickle.npy", np.array([{}], dtype=object), allow_pickle=True)
    np.save(folder / "cut.npy", np.ones((HEIGHT, WIDTH), np.float32))
    (folder / "cut.npy").write_bytes((folder / "cut.npy").read_bytes()[:-100])
    np.save(folder / "words.npy", np.full((HEIGHT, WIDTH), "word"))


def _png(width: int, height: int) -> bytes:
    """A PNG of few bytes that claims this size."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(b"")) + chunk(b"IEND", b"")
