"""Files of every kind that open as a photo, hard ones, as people get them: compared with `tests/golden/photos`."""

import json
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pillow_heif
import pytest
import tifffile
from PIL import Image
from PIL.TiffImagePlugin import IFDRational

from iibr_core.formats.images.color_profile import icc_profile
from iibr_core.formats.images.spatial_photo import write_spatial_photo
from iibr_core.formats.images.write import write_image
from iibr_core.types import DISPLAY_P3
from tests.iibr_core import embedded_files as embedded
from tests.iibr_core.facts import require_golden
from tests.iibr_core.formats.opened import photo_facts
from tests.iibr_core.formats.test_color_profile import ADOBE, profile_bytes
from tests.iibr_core.formats.test_hdr import chunked
from tests.iibr_core.formats.test_side_by_side import LEFT, RIGHT, write_jps
from tests.iibr_core.formats.test_view_files import leia_image, lume_pad_2, write_mpo, write_stereo_jpeg
from tests.iibr_core.hard_scenes import TURNED, lying, photo_colors
from tests.iibr_core.pictures import as_bytes, with_xmp, write_oiio

PICTURE = photo_colors()
HEIGHT, WIDTH, _ = PICTURE.shape
EXIF_FOLDER = 0x8769
P3 = icc_profile(DISPLAY_P3)


def exif_of(orientation: int, **camera: Any) -> Image.Exif:
    """Return Exif with a camera's names. camera: values of its folder by their tags, as in t920a."""
    exif = Image.Exif()
    exif.update({0x0112: orientation, 0x010F: "Maker", 0x0110: "Maker 5", 0x013B: "Ann"})
    values = {tag: IFDRational(value) if isinstance(value, float) else value for tag, value in camera.items()}
    exif.get_ifd(EXIF_FOLDER).update({int(tag[1:], 16): value for tag, value in values.items()})
    return exif


IN_INCHES = exif_of(TURNED, t920a=20.0, ta20e=1000.0, ta002=2 * HEIGHT)
FOCAL_PLANE = exif_of(TURNED, t920a=20.0, ta20e=1000.0, ta210=3, ta002=2 * HEIGHT, t829a=0.008, t829d=1.8)
IN_35_MM = exif_of(8, ta405=50, t8827=100, ta434="wide\nlens", t9003="2024:05:06 07:08:09")


def by_pillow(mode: str = "RGB", pixels: np.ndarray = PICTURE, kind: str | None = None, **options: Any) -> Any:
    """Return a writer of a picture in a mode of Pillow's."""
    return lambda path: Image.fromarray(pixels).convert(mode).save(path, kind, **options)


def by_oiio(pixels: np.ndarray, **attributes: Any) -> Any:
    """Return a writer by OpenImageIO."""
    return lambda path: write_oiio(path, pixels, **attributes)


def of_bytes(content: bytes) -> Any:
    return lambda path: path.write_bytes(content)


def by_heif(pixels: np.ndarray, **options: Any) -> Any:
    return lambda path: pillow_heif.from_pillow(Image.fromarray(pixels)).save(path, quality=100, chroma=444, **options)


def by_tifffile(pages: list[np.ndarray], *, orientation: int = 1, icc: bytes = b"", reduced: int = 1) -> Any:
    """Return a writer of pages; the last one has the orientation and profile."""

    def write(path: Path) -> None:
        tags = [(0x0112, 3, 1, orientation, False), *([(34675, 7, len(icc), icc, True)] if icc else [])]
        with tifffile.TiffWriter(path) as file:
            for page in pages[:-1]:
                file.write(page, photometric="rgb", subfiletype=reduced, metadata=None)
            file.write(pages[-1], photometric="rgb", metadata=None, extratags=tags)

    return write


RGBA = np.dstack([PICTURE, np.full((HEIGHT, WIDTH), 255, np.uint8)])
RGBA[8:24, :40, 3], RGBA[24:32, :40, 3] = 128, 0
LIGHT = (PICTURE / 100.0).astype(np.float32)
ODD_LIGHT = LIGHT.copy()
ODD_LIGHT[3, 4], ODD_LIGHT[40, 60], ODD_LIGHT[50, 9] = np.inf, (0.5, np.nan, -np.inf), 7.0
FRAMES = [Image.fromarray(np.rot90(PICTURE, k, axes=(0, 1))[:HEIGHT, :HEIGHT]) for k in range(3)]
DEPTH = np.tile(np.arange(WIDTH, dtype=np.uint8) * 2, (HEIGHT, 1))
SHARP = {0.5: PICTURE, 2.5: PICTURE // 2}


def by_frames(**options: Any) -> Any:
    return lambda path: FRAMES[0].save(path, save_all=True, append_images=FRAMES[1:], duration=100, **options)


def lytro(is_illum: bool) -> Any:
    pictures = {at: as_bytes(Image.fromarray(pixels), "PNG") for at, pixels in SHARP.items()}
    focus = np.repeat(np.float32([[0.2, 1.0, 2.0, 4.0]]), 3, axis=0)
    return of_bytes(embedded.lytro_stack(pictures, focus, (HEIGHT, WIDTH), is_illum))


def png_in_numbers(*codes: int, profile: bytes = b"") -> Any:
    """Return a writer of a deep PNG that states its colours in numbers, beside a profile."""

    def write(path: Path) -> None:
        write_oiio(path, DEEP, ICCProfile=profile) if profile else write_oiio(path, DEEP)
        data = path.read_bytes()
        path.write_bytes(chunked(data, b"cICP", bytes((*codes, 0, 1))))

    return write


def avif_in_numbers(*codes: int) -> Any:
    """Return a writer of an AVIF whose numbers for sRGB, which Pillow writes, are replaced."""
    stored = as_bytes(Image.fromarray(PICTURE), "AVIF", quality=100, subsampling="4:4:4")
    assert stored.count(b"nclx\0\x01\0\x0d") == 1
    return of_bytes(stored.replace(b"nclx\0\x01\0\x0d", b"nclx" + struct.pack(">HH", *codes)))


def profile_with_numbers(*codes: int) -> bytes:
    """Return a profile of version 4.4 with such a tag: ICC.1:2022, clause 9.2.17."""
    profile = bytearray(profile_bytes())
    at = 132 + 12 * (int.from_bytes(profile[128:132], "big") - 1)
    profile[at : at + 12] = struct.pack(">4sII", b"cicp", len(profile), 12)
    profile += b"cicp\0\0\0\0" + bytes((*codes, 0, 1))
    return len(profile).to_bytes(4, "big") + bytes(profile[4:])


def recording(path: Path) -> None:
    """Write a recording of Record3D; the photo is stored at half the size that the camera's numbers are for."""
    stated = {"h": 2 * HEIGHT, "w": 2 * WIDTH, "dw": 24, "dh": 16, "K": [180.0, 0, 0, 0, 180.0, 0, 96.0, 64.0, 1]}
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("metadata", json.dumps(stated))
        for number, pixels in ((10, PICTURE // 2), (2, PICTURE)):
            archive.writestr(f"rgbd/{number}.jpg", as_bytes(Image.fromarray(pixels), "JPEG", quality=95))
            archive.writestr(f"rgbd/{number}.depth", b"bvx-")


GPANO = "http://ns.google.com/photos/1.0/panorama/"


def psd() -> bytes:
    """Version 1, 3 channels of 8 bits, RGB, no layers; the picture itself is not packed."""
    head = b"8BPS\0\x01" + bytes(6) + struct.pack(">HIIHH", 3, HEIGHT, WIDTH, 8, 3)
    return head + bytes(12) + b"\0\0" + PICTURE.transpose(2, 0, 1).tobytes()


def panorama(kind: str, **about: str) -> bytes:
    return with_xmp(
        Image.fromarray(PICTURE), kind, embedded.packet({f"{GPANO} {name}": text for name, text in about.items()})
    )


def every_other_row(right_first: bool) -> np.ndarray:
    first, second = (RIGHT, LEFT) if right_first else (LEFT, RIGHT)
    return np.stack([first[::2], second[::2]], axis=1).reshape(LEFT.shape)


def with_bad_end(kind: str, share: float) -> bytes:
    stored = as_bytes(Image.fromarray(PICTURE), kind)
    return stored[: int(share * len(stored))]


RIGHT_EYE = {f"{GPANO} ProjectionType": "cylindrical ", f"{embedded.GIMAGE} Mime": "image/jpeg"}
DEEP = PICTURE.astype(np.uint16) * 257
DOUBLE = np.hstack([PICTURE, np.repeat(DEPTH[..., None], 3, 2)])
TILES = np.vstack([np.hstack([LEFT[:48, :64], RIGHT[:48, :64], LEFT[:48, :64], RIGHT[:48, :64]])] * 3)
FILES: dict[str, tuple[Callable[[Path], object], int]] = {
    "turned.jpg": (by_pillow(pixels=lying(PICTURE), exif=FOCAL_PLANE, quality=95, subsampling=0, icc_profile=P3), 3),
    "turned_left.webp": (by_pillow("RGBA", RGBA, exif=IN_35_MM, lossless=True, exact=True), 1),
    "turned.avif": (by_pillow(pixels=lying(PICTURE), exif=IN_INCHES, quality=95, icc_profile=P3), 4),
    "turned.heic": (by_heif(lying(PICTURE), exif=FOCAL_PLANE.tobytes(), icc_profile=P3), 4),
    "mirrored.tif": (by_oiio(PICTURE, Orientation=5), 1),
    "codes.heic": (by_heif(PICTURE, color_primaries=12, transfer_characteristics=13, matrix_coefficients=6,
                           full_range_flag=1, save_nclx_profile=True), 4),
    "deep.png": (by_oiio(DEEP, Exif__FocalLengthIn35mmFilm=28), 1),
    "codes.jxl": (by_oiio(DEEP, CICP=(9, 18, 0, 1)), 1),
    "pq.png": (png_in_numbers(9, 16), 1), "p3.png": (png_in_numbers(12, 13, profile=profile_bytes(ADOBE)), 1),
    "dci.png": (png_in_numbers(11, 4), 1), "hlg.avif": (avif_in_numbers(9, 18), 4),
    "pq.avif": (avif_in_numbers(9, 16), 4),
    "pq.heic": (by_heif(PICTURE, color_primaries=9, transfer_characteristics=16, matrix_coefficients=9,
                        full_range_flag=1, save_nclx_profile=True), 4),
    "float.jxl": (by_oiio(PICTURE / np.float32(255), CICP=(9, 16, 0, 1)), 1),
    "pq.jpg": (by_pillow(icc_profile=profile_with_numbers(9, 16), quality=100, subsampling=0), 5),
    "pq.tif": (by_pillow(icc_profile=profile_with_numbers(9, 16)), 1),
    "absurd.jpg": (by_pillow(exif=exif_of(1, ta405=60_000), quality=95), 3),
    "la.png": (by_pillow("LA"), 1), "one.png": (by_pillow("1"), 1), "palette.png": (by_pillow("P"), 1),
    "grey.jpg": (by_pillow("L", quality=95), 3), "cmyk.jpg": (by_pillow("CMYK", quality=95), 3),
    "cmyk.tif": (by_pillow("CMYK"), 1), "lab.tif": (by_pillow("LAB"), 1),
    "a.bmp": (by_pillow(), 1), "a.tga": (by_pillow("RGBA", RGBA), 1), "a.jp2": (by_pillow(), 1),
    "a.psd": (of_bytes(psd()), 1), "wrong.png": (by_pillow(kind="JPEG", quality=95), 3),
    "noending": (by_pillow(kind="TIFF"), 1), "jpeg.dng": (by_pillow(kind="JPEG", quality=95), 3),
    "straight.tif": (by_oiio(RGBA, oiio__UnassociatedAlpha=1), 1),
    "premultiplied.exr": (by_oiio(np.dstack([LIGHT, RGBA[..., 3] / np.float32(255)])), 1),
    "wide.tif": (by_tifffile([PICTURE.astype(np.int32) * 16], orientation=3), 1),
    "short.tif": (by_tifffile([PICTURE.astype(np.int16) * 9 - 100]), 1),
    "pages.tif": (by_tifffile([PICTURE[::2, ::2], PICTURE[:, :40]], reduced=0), 1),
    "larger.tif": (by_tifffile([PICTURE[::4, ::4], PICTURE], reduced=0), 1),
    "preview.tif": (by_tifffile([PICTURE[::4, ::4], lying(PICTURE)], orientation=TURNED), 1),
    "profile.tif": (by_tifffile([LIGHT / 3], icc=P3), 1),
    "odd.exr": (by_oiio(ODD_LIGHT, Orientation=2), 1), "half.exr": (by_oiio(LIGHT, kind="half"), 1),
    "light.hdr": (by_oiio(LIGHT), 2), "grey.exr": (by_oiio(LIGHT[..., 1] / 3), 1),
    "a.gif": (by_frames(), 4), "a.png": (by_frames(), 1), "a.webp": (by_frames(lossless=True), 1),
    "panorama.jpg": (of_bytes(panorama("JPEG", ProjectionType="equirectangular")), 3),
    "panorama.png": (of_bytes(panorama("PNG", FullPanoWidthPixels="8192")), 1),
    "stitched.tif": (of_bytes(panorama("TIFF", SourcePhotosCount="1")), 1),
    "broken.jpg": (of_bytes(with_xmp(Image.fromarray(PICTURE), "JPEG", f"<broken {GPANO}".encode())), 3),
    "right_eye.jpg": (of_bytes(with_xmp(Image.fromarray(PICTURE), "JPEG", embedded.packet(RIGHT_EYE))), 3),
    "narrow.png": (by_pillow(pixels=np.ascontiguousarray(PICTURE[:1].repeat(5, 1))), 1),
    "crossed.jps": (by_pillow(pixels=np.hstack([RIGHT, LEFT]), kind="JPEG", quality=95), 3),
    "half_HTAB - Copy (2).png": (by_pillow(pixels=np.vstack([LEFT[::2], RIGHT[::2]])), 1),
    "flipped.right-left.png": (by_pillow(pixels=np.hstack([RIGHT, LEFT])), 1),
    "IMG_0001_TB.png": (by_pillow(), 1), "half.h-sbs.png": (by_pillow(), 1),
    "rows.jpg": (lambda path: write_jps(path, every_other_row(True), 1, 0), 4),
    "half.jpg": (lambda path: write_jps(path, np.hstack([LEFT[:, ::2], RIGHT[:, ::2]]), 2, 6), 4),
    "over.jpg": (lambda path: write_jps(path, np.vstack([RIGHT, LEFT]), 3, 0), 3),
    "low.jpg": (lambda path: write_jps(path, np.vstack([LEFT[::2], RIGHT[::2]]), 3, 5), 4),
    "a_sbs.exr": (lambda path: write_image(path, np.hstack([LEFT, RIGHT])), 1),
    "a_sbs.tif": (by_pillow("I;16", np.hstack([LEFT, RIGHT])[..., 1].astype(np.uint16) * 257), 1),
    "a_sbs.heic": (by_heif(np.hstack([LEFT, RIGHT])), 4),
    "eyes.mpo": (lambda path: write_mpo(path, LEFT, RIGHT), 3),
    "eyes.jpg": (lambda path: write_stereo_jpeg(path, LEFT, RIGHT), 3),
    "eyes.lif": (of_bytes(leia_image(LEFT, RIGHT)), 3), "lume.jpg": (of_bytes(lume_pad_2(LEFT, RIGHT[::2, ::2])), 3),
    "cut lume.jpg": (of_bytes(lume_pad_2(LEFT, RIGHT[:24])), 3),
    "eyes.heic": (lambda path: write_spatial_photo(path, LEFT, RIGHT, 80.0), 4),
    "a_RGBD.png": (by_pillow(pixels=np.vstack([DOUBLE[:, WIDTH:], PICTURE])), 1),
    "tall.rgbd.png": (by_pillow(pixels=np.hstack([DOUBLE[:, -24:], PICTURE[:, :24]])), 1),
    "beside.png": (by_pillow(pixels=DOUBLE), 1), "tiles.png": (by_pillow(pixels=TILES), 1),
    "stack-stk.lfp": (lytro(False), 1), "illum.LFP": (lytro(True), 1), "a.r3d": (recording, 3),
    "depth.jpg": (of_bytes(embedded.with_segments(as_bytes(Image.fromarray(PICTURE), "JPEG", quality=95),
                                                  embedded.gdepth_segments(embedded.picture(DEPTH, "PNG")))), 3),
    "cut.jpg": (of_bytes(with_bad_end("JPEG", 0.6)), 3), "header.jpg": (of_bytes(with_bad_end("JPEG", 0.02)), 1),
    **{f"cut.{kind.lower()}": (of_bytes(with_bad_end(kind, 0.6)), 1)
       for kind in ("PNG", "TIFF", "WEBP", "AVIF", "HEIC", "GIF", "BMP")},
    "empty.png": (of_bytes(b""), 1), "text.jpg": (of_bytes("größe 1\n".encode()), 1),
    "zeros.tif": (of_bytes(bytes(300)), 1), "a.cr2": (of_bytes(b"II*\0\x10\0\0\0CR\x02\0" + bytes(60)), 1),
    "a.mp4": (of_bytes(struct.pack(">I", 32) + b"ftypisom" + bytes(60)), 1),
}  # fmt: skip


@pytest.mark.parametrize("name", FILES)
def test_photos_are_read_as_before(tmp_path, name, regenerate_golden) -> None:
    write, levels = FILES[name]
    write(tmp_path / name)
    require_golden(photo_facts(tmp_path / name), "photos", name, levels, regenerate_golden)
