"""Saved pictures: colours, bits, Exif, XMP and settings come back; a full disk leaves the old file."""

from __future__ import annotations

import struct
import zlib
from io import BytesIO

import cv2
import numpy as np
import OpenImageIO as oiio
import pillow_heif
import pytest
from PIL import Image, ImageCms, PngImagePlugin

from iibr_core.color import convert, linear_from_srgb
from iibr_core.formats.images import spatial_photo
from iibr_core.formats.images.metadata import (
    SETTINGS_KEY,
    Caption,
    PictureMetadata,
    camera_facts,
    exif_for,
    read_caption,
    read_metadata,
    settings_text_in,
    xmp_for,
)
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.write import KINDS, PictureFormat, write_image, write_picture
from iibr_core.types import DISPLAY_P3, SRGB, ImageSize, InputError
from tests.iibr_core.formats.test_color_profile import profile_bytes

PATCHES = ((200, 80, 60), (255, 0, 0), (0, 255, 0), (20, 30, 250), (128, 128, 128), (255, 255, 255), (3, 2, 1))
SIDE = 16
EIGHT_BITS = [ending for ending, kind in KINDS.items() if 8 in kind.bits]
BEST = PictureFormat(quality=100)
EXIF, GPS = 0x8769, 0x8825
MAKE, ORIENTATION, COMPRESSION, HEIGHT = 0x010F, 0x0112, 0x0103, 0xA003
EXPOSURE, FOCAL, FOCAL_35, MAKER_NOTE, WIDTH, PER_UNIT = 0x829A, 0x920A, 0xA405, 0x927C, 0xA002, 0xA20E
XMP = b"""<?xpacket begin='' id='W5M0MpCehiHzreSzNTczkc9d'?><x:xmpmeta xmlns:x='adobe:ns:meta/'>
<rdf:RDF xmlns:rdf='http://www.w3.org/1999/02/22-rdf-syntax-ns#'><rdf:Description rdf:about=''
 xmlns:dc='http://purl.org/dc/elements/1.1/' xmlns:xmp='http://ns.adobe.com/xap/1.0/' xmp:Rating='4'
 xmlns:GDepth='http://ns.google.com/photos/1.0/depthmap/' GDepth:Near='0.3' GDepth:Format='RangeInverse'
 xmlns:exif='http://ns.adobe.com/exif/1.0/' exif:GPSLatitude='48,51.4N'
 xmlns:crs='http://ns.adobe.com/camera-raw-settings/1.0/' crs:Exposure2012='+1.00'>
<dc:title><rdf:Alt><rdf:li xml:lang='x-default'>A &amp; B</rdf:li></rdf:Alt></dc:title></rdf:Description></rdf:RDF>
</x:xmpmeta><?xpacket end='w'?>"""
SETTINGS = '{"a": "<&>\\"é", "b": 1}'


def patches():
    row = np.repeat(np.array(PATCHES, np.uint8), SIDE, axis=0)
    return np.repeat(row[None], SIDE, axis=0)


def middles(picture):
    return np.asarray(picture)[SIDE // 2, SIDE // 2 :: SIDE].astype(float)


def camera_exif():
    exif = Image.Exif()
    exif.update({MAKE: "Maker", ORIENTATION: 6, COMPRESSION: 6})
    exif.get_ifd(EXIF).update(
        {
            EXPOSURE: 1 / 125,
            FOCAL: 4.25,
            FOCAL_35: 26,
            MAKER_NOTE: b"bound",
            WIDTH: 4000,
            HEIGHT: 3000,
            PER_UNIT: 1000.0,
        }
    )
    exif.get_ifd(GPS).update({1: "N", 2: (48.0, 51.0, 24.0)})
    return exif


def photo_file(path):
    """A photo with all the metadata that its kind can hold."""
    options, exif = {"xmp": XMP}, camera_exif()
    if path.suffix == ".png":
        options = {"pnginfo": PngImagePlugin.PngInfo()}
        options["pnginfo"].add_itxt("XML:com.adobe.xmp", XMP.decode())
    elif path.suffix == ".tif":
        exif = {**exif, EXIF: exif.get_ifd(EXIF), GPS: exif.get_ifd(GPS), 700: XMP}
        exif, options = None, {"tiffinfo": exif}
    Image.fromarray(patches()).save(path, exif=exif, icc_profile=profile_bytes(), **options)
    return path


@pytest.mark.parametrize("space", [SRGB, DISPLAY_P3], ids=lambda space: space.name)
@pytest.mark.parametrize("ending", EIGHT_BITS)
def test_a_colour_managed_reader_sees_the_same_colours(tmp_path, ending, space):
    path = tmp_path / f"a{ending}"
    write_picture(path, patches(), PictureFormat(bits=8, quality=100), color_space=space)
    with Image.open(path) as image:
        source = ImageCms.ImageCmsProfile(BytesIO(image.info["icc_profile"]))
        target = ImageCms.ImageCmsProfile(BytesIO(profile_bytes()))
        seen = ImageCms.profileToProfile(image.convert("RGB"), source, target, ImageCms.Intent.RELATIVE_COLORIMETRIC)
    p3 = patches() / np.float32(255)
    expected = middles(255 * convert(p3.astype(np.float32), DISPLAY_P3, space))
    exact = {".jpg": 1, ".jpeg": 1, ".avif": 2}.get(ending, 0)
    assert np.abs(middles(seen) - expected).max() <= max(exact, 1) + 0.5, "and its own rounding"
    with Image.open(path) as image:
        assert np.abs(middles(image.convert("RGB")) - PATCHES).max() <= exact


@pytest.mark.parametrize("ending", [".png", ".tif"])
def test_sixteen_bits(tmp_path, ending):
    path = tmp_path / f"a{ending}"
    ramp = np.linspace(0.2, 0.21, 600, dtype=np.float32)
    light = np.repeat(ramp.reshape(100, 6)[..., None], 3, axis=2) * np.float32((1, 0.9, 0.8))
    write_picture(path, light, PictureFormat(bits=16), color_space=DISPLAY_P3)
    read = cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[..., ::-1]
    assert read.dtype == np.uint16
    assert np.abs(linear_from_srgb(read / 65535.0) - light).max() < 3e-5
    ours = read_photo(path, keeps_primaries=True)
    assert ours.color_space == DISPLAY_P3
    assert np.abs(ours.pixels * 65535 - read).max() < 2
    write_picture(path, patches(), PictureFormat(bits=16))
    assert np.array_equal(cv2.imread(str(path), cv2.IMREAD_UNCHANGED)[..., ::-1], patches() * np.uint16(257))


@pytest.mark.parametrize("bits", [16, 32])
@pytest.mark.parametrize("space", [SRGB, DISPLAY_P3], ids=lambda space: space.name)
def test_exr_holds_all_light(tmp_path, space, bits):
    light = np.array([[[4.0, -0.25, 0.5], [0.0, 1.0, 60000.0]]], np.float32)
    write_picture(tmp_path / "a.exr", light, PictureFormat(bits=bits), color_space=space)
    source = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    assert np.array_equal(source.read_image("float"), light)
    assert str(source.spec().format) == ("half" if bits == 16 else "float")
    assert read_photo(tmp_path / "a.exr", keeps_primaries=True).color_space == space


@pytest.mark.parametrize("ending", [ending for ending in KINDS if ending != ".exr"])
@pytest.mark.parametrize("source", ["a.jpg", "a.png", "a.tif", "a.webp", "a.avif", "a.heic"])
def test_exif_and_xmp_are_kept(tmp_path, source, ending):
    if source.endswith("heic"):
        image = pillow_heif.from_pillow(Image.fromarray(patches()))
        image.save(tmp_path / source, exif=camera_exif().tobytes(), xmp=XMP)
    else:
        photo_file(tmp_path / source)
    metadata = read_metadata(tmp_path / source)
    saved = tmp_path / f"saved{ending}"
    texts = {SETTINGS_KEY: SETTINGS}
    write_picture(saved, patches(), metadata=PictureMetadata(metadata.exif, metadata.xmp, texts))
    with Image.open(saved) as image:
        exif, xmp = image.getexif(), image.info["xmp"]
        camera = exif.get_ifd(EXIF)
        assert (exif[MAKE], exif.get(ORIENTATION, 1)) == ("Maker", 1)
        assert float(camera[EXPOSURE]) == pytest.approx(1 / 125)
        assert (camera[FOCAL_35], camera[WIDTH]) == (26, SIDE * len(PATCHES))
        assert float(camera[PER_UNIT]) == pytest.approx(1000 * SIDE * len(PATCHES) / 4000)
        assert MAKER_NOTE not in camera
        assert not exif.get_ifd(GPS)
        xmp = xmp if isinstance(xmp, str) else xmp.decode()
        assert "A &amp; B" in xmp
        assert 'xmp:Rating="4"' in xmp
        for gone in ("GDepth", "GPS", "Exposure2012"):
            assert gone not in xmp
    assert settings_text_in(saved) == SETTINGS
    assert read_caption(saved).title == "A & B"
    write_picture(saved, patches(), PictureFormat(keeps_position=True), metadata)
    with Image.open(saved) as image:
        assert tuple(map(float, image.getexif().get_ifd(GPS)[2])) == (48.0, 51.0, 24.0)


def test_an_exr_keeps_camera_facts_and_settings(tmp_path):
    metadata = read_metadata(photo_file(tmp_path / "a.jpg"))
    write_picture(
        tmp_path / "a.exr", patches(), metadata=PictureMetadata(metadata.exif, metadata.xmp, {SETTINGS_KEY: SETTINGS})
    )
    spec = oiio.ImageInput.open(str(tmp_path / "a.exr")).spec()
    assert spec.get_string_attribute("Make") == "Maker"
    assert spec.get_float_attribute("ExposureTime") == pytest.approx(1 / 125)
    assert settings_text_in(tmp_path / "a.exr") == SETTINGS
    assert "A &amp; B" in spec.get_string_attribute("xmp")
    assert read_photo(tmp_path / "a.exr").focal_px == pytest.approx(read_photo(tmp_path / "a.jpg").focal_px)


@pytest.mark.parametrize("ending", [".jpg", ".tif", ".webp", ".avif"])
def test_long_texts_are_packed(tmp_path, ending):
    rng = np.random.default_rng(1)
    text = str(rng.integers(0, 99, 30_000).tolist())
    assert len(text) > 100_000
    write_picture(tmp_path / f"a{ending}", patches(), metadata=PictureMetadata(texts={SETTINGS_KEY: text}))
    assert settings_text_in(tmp_path / f"a{ending}") == text


def test_settings_too_long_for_a_jpeg_are_refused(tmp_path):
    text = bytes(np.random.default_rng(1).integers(33, 127, 200_000, np.uint8)).decode()
    with pytest.raises(InputError, match=r"a\.jpg: cannot be written"):
        write_picture(tmp_path / "a.jpg", patches(), metadata=PictureMetadata(texts={SETTINGS_KEY: text}))
    assert not list(tmp_path.iterdir())
    write_picture(tmp_path / "a.tif", patches(), metadata=PictureMetadata(texts={SETTINGS_KEY: text}))
    assert settings_text_in(tmp_path / "a.tif") == text


def test_less_quality_makes_smaller_files(tmp_path):
    noise = np.random.default_rng(0).integers(0, 256, (64, 64, 3), np.uint8)
    for ending in (".jpg", ".webp", ".avif"):
        sizes = []
        for quality in (30, 95):
            write_picture(tmp_path / f"a{ending}", noise, PictureFormat(quality=quality))
            sizes.append((tmp_path / f"a{ending}").stat().st_size)
        assert 1.5 * sizes[0] < sizes[1]


BAD = {
    "a.gif": PictureFormat(),
    "a": PictureFormat(),
    "a.jpg": PictureFormat(bits=16),
    "a.tif": PictureFormat(bits=32),
    "a.png": PictureFormat(bits=0),
    "b.jpg": PictureFormat(quality=0),
    "b.webp": PictureFormat(quality=101),
}


@pytest.mark.parametrize("name", BAD)
def test_formats_that_a_kind_lacks_are_refused(tmp_path, name):
    with pytest.raises(InputError) as error:
        write_picture(tmp_path / name, patches(), BAD[name])
    assert "\n" not in str(error.value)
    assert not list(tmp_path.iterdir())


def test_too_large_for_its_kind(tmp_path):
    with pytest.raises(InputError, match="16383 a side"):
        write_picture(tmp_path / "a.webp", np.zeros((1, 16_384, 3), np.uint8))


@pytest.mark.parametrize("ending", KINDS)
def test_a_full_disk_is_an_error_and_leaves_the_old_file(tmp_path, ending, monkeypatch):
    """The system's limit for files stands for the disk; OpenImageIO and Python's own files both meet it."""
    import resource
    import signal

    path = tmp_path / f"a{ending}"
    write_picture(path, patches())
    before = path.read_bytes()
    noise = np.random.default_rng(0).integers(0, 256, (400, 400, 3), np.uint8)
    limits, ignored = resource.getrlimit(resource.RLIMIT_FSIZE), signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, limits[1]))
    try:
        with pytest.raises(InputError, match=rf"a\{ending}: .*cannot be written") as error:
            write_picture(path, noise, BEST)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, ignored)
    assert "\n" not in str(error.value)
    assert path.read_bytes() == before
    assert [item.name for item in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("seed", range(30))
def test_damaged_metadata_costs_no_picture(tmp_path, seed):
    rng = np.random.default_rng(seed)
    exif = bytearray(camera_exif().tobytes())
    for at in rng.integers(0, len(exif), 6):
        exif[at] = rng.integers(0, 256)
    xmp = bytearray(XMP)
    xmp[rng.integers(0, len(xmp))] = 0x3C
    kept = exif_for(bytes(exif), ImageSize(4, 4), SRGB, keeps_position=True)
    assert len(kept.tobytes()) < 65_000
    assert all("\n" not in name + fact for name, fact in camera_facts(PictureMetadata(bytes(exif))))
    write_picture(tmp_path / "a.jpg", patches(), PictureFormat(), PictureMetadata(bytes(exif), bytes(xmp)))
    write_picture(tmp_path / "a.tif", patches(), PictureFormat(), PictureMetadata(bytes(exif), bytes(xmp)))
    assert read_photo(tmp_path / "a.tif").size == (SIDE, SIDE * len(PATCHES))
    xmp_for(bytes(xmp), {})


def test_missing_and_other_files_have_no_metadata(tmp_path):
    (tmp_path / "text.jpg").write_text("no picture")
    for name in ("gone.jpg", "text.jpg"):
        assert read_metadata(tmp_path / name).exif == read_metadata(tmp_path / name).xmp == b""
        assert read_caption(tmp_path / name) == Caption()
        with pytest.raises(InputError, match=name):
            settings_text_in(tmp_path / name)
    assert xmp_for(b"", {}) == b""


def large_jpeg(path):
    """A JPEG whose header claims 16320x12240 pixels, more than Pillow allows by itself."""
    Image.fromarray(patches()).save(path, exif=camera_exif())
    data = bytearray(path.read_bytes())
    frame = data.rindex(b"\xff\xc0\x00\x11\x08") + 5
    data[frame : frame + 4] = struct.pack(">HH", 12_240, 16_320)
    path.write_bytes(data)


def large_png(path):
    """A PNG whose header claims 16320x12240 pixels."""
    Image.fromarray(patches()).save(path, exif=camera_exif())
    data = path.read_bytes()
    header = b"IHDR" + struct.pack(">II", 16_320, 12_240) + data[24:29]
    path.write_bytes(data[:12] + header + struct.pack(">I", zlib.crc32(header)) + data[33:])


@pytest.mark.parametrize(("name", "write"), [("a.jpg", large_jpeg), ("a.png", large_png)])
def test_exif_of_photos_of_200_megapixels_is_read(tmp_path, name, write):
    write(tmp_path / name)
    with Image.open(tmp_path / name) as image:
        assert image.size == (16_320, 12_240)
    facts = dict(camera_facts(read_metadata(tmp_path / name)))
    assert facts == {"Camera": "Maker", "Exposure": "1/125 s, 26 mm (35 mm)"}


@pytest.mark.parametrize("size", [ImageSize(1500, 2000), ImageSize(2000, 1500)], ids=["landscape", "portrait"])
def test_the_focal_plane_has_as_many_pixels_as_the_saved_picture(size):
    """The camera stored 4000x3000 pixels, also where it was held upright: 1000 of them in a unit of length."""
    camera = exif_for(camera_exif().tobytes(), size, SRGB, keeps_position=False).get_ifd(EXIF)
    assert float(camera[PER_UNIT]) == pytest.approx(500)
    assert (camera[WIDTH], camera[HEIGHT]) == (size.width, size.height)


def test_camera_facts_are_short_texts_for_people(tmp_path):
    exif = camera_exif()
    exif.update({MAKE: "Apple", 0x0110: "Apple iPhone 15"})
    exif.get_ifd(EXIF).update({0x829D: 1.78, 0x8827: 100, 0x9003: "2024:05:06 07:08:09", 0xA434: "wide\nlens"})
    Image.fromarray(patches()).save(tmp_path / "a.jpg", exif=exif)
    assert camera_facts(read_metadata(tmp_path / "a.jpg")) == (
        ("Camera", "Apple iPhone 15"),
        ("Lens", "wide lens"),
        ("Exposure", "f/1.78, 1/125 s, ISO 100, 26 mm (35 mm)"),
        ("Taken", "2024-05-06 07:08"),
    )
    assert camera_facts(PictureMetadata()) == ()


def test_the_rating_of_a_photo_is_kept_and_places_in_its_file_are_not(tmp_path):
    """Windows writes ratings in two tags; 0x0111 holds the places of the file's strips."""
    exif = Image.Exif()
    exif[0x4746], exif[0x4749], exif[0x0111] = 4, 75, 8
    Image.fromarray(patches()).save(tmp_path / "a.jpg", exif=exif)
    write_picture(tmp_path / "b.jpg", patches(), metadata=read_metadata(tmp_path / "a.jpg"))
    with Image.open(tmp_path / "b.jpg") as image:
        kept = image.getexif()
    assert (kept.get(0x4746), kept.get(0x4749), kept.get(0x0111)) == (4, 75, None)


@pytest.mark.parametrize("shape", [(5, 7, 3), (5, 7), (1, 1, 3)])
def test_views_come_back_from_png(tmp_path, shape):
    pixels = np.random.default_rng(1).integers(0, 256, shape, dtype=np.uint8)
    for values in (pixels, pixels.astype(np.float32) / 255):
        write_image(tmp_path / "a.png", values, {"Software": "iibr"})
        with Image.open(tmp_path / "a.png") as image:
            assert np.array_equal(np.asarray(image), pixels)
            assert image.text["Software"] == "iibr"


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_views_come_back_from_exr_as_linear_light(tmp_path, dtype):
    encoded = np.random.default_rng(1).uniform(0, 3, (5, 7, 3)).astype(dtype)
    write_image(tmp_path / "a.exr", encoded)
    source = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    assert str(source.spec().format) == ("half" if dtype == np.float16 else "float")
    assert np.allclose(source.read_image(), linear_from_srgb(encoded), rtol=1e-3)
    assert np.allclose(read_photo(tmp_path / "a.exr").pixels, encoded, rtol=2e-3, atol=1e-4)


def test_values_outside_the_range_of_the_file_are_clipped(tmp_path):
    write_image(tmp_path / "a.png", np.array([[-1, np.nan, np.inf, 0.5]], np.float32))
    assert np.asarray(Image.open(tmp_path / "a.png")).tolist() == [[0, 0, 255, 128]]
    write_image(tmp_path / "a.exr", np.full((2, 2, 3), 60000, np.float16))
    assert np.isfinite(oiio.ImageInput.open(str(tmp_path / "a.exr")).read_image()).all()


def test_nothing_is_left_where_writing_fails(tmp_path):
    (tmp_path / "taken.png").mkdir()
    for path in (tmp_path / "none" / "a.png", tmp_path / "taken.png", tmp_path / "a.gif"):
        with pytest.raises(InputError, match=path.name):
            write_image(path, patches())
    assert [path.name for path in tmp_path.iterdir()] == ["taken.png"]


def test_spatial_photos_of_unknown_form_are_refused(tmp_path, monkeypatch):
    """A newer libheif may write other versions of the boxes that are changed."""
    path, encode = tmp_path / "a.heic", spatial_photo._encode
    with pytest.raises(InputError, match=r"a\.heic: the left picture is"):
        spatial_photo.write_spatial_photo(path, patches(), patches()[1:], 100.0)
    for kind in (b"iloc", b"ipma"):
        monkeypatch.setattr(spatial_photo, "_encode", lambda *a, kind=kind: encode(*a).replace(kind, kind + b"\1")[:-1])
        with pytest.raises(InputError, match=r"a\.heic: cannot be written as a spatial photo"):
            spatial_photo.write_spatial_photo(path, patches(), patches(), 100.0)
    assert not list(tmp_path.iterdir())
