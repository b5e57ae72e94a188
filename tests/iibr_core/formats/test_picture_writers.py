"""Saved pictures, read by others: Pillow with littleCMS for the colours, OpenCV for 16 bits; and what they say of the
photo that they were made of.
"""

from __future__ import annotations

from io import BytesIO

import cv2
import numpy as np
import OpenImageIO as oiio
import pillow_heif
import pytest
from PIL import Image, ImageCms, PngImagePlugin

from iibr_core.color import convert, linear_from_srgb
from iibr_core.formats.images import exr_parts, oiio_writer
from iibr_core.formats.images.color_profile import color_profile
from iibr_core.formats.images.icc_profile import icc_profile
from iibr_core.formats.images.metadata import (
    PictureMetadata,
    camera_facts,
    exif_for,
    read_metadata,
    text_in_xmp,
    xmp_for,
)
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.picture_kinds import KINDS, PictureFormat
from iibr_core.formats.images.picture_writers import write_picture
from iibr_core.types import DISPLAY_P3, SRGB, ImageSize, InputError
from tests.iibr_core.formats.test_color_profile import converted, profile_bytes

PATCHES = ((200, 80, 60), (255, 0, 0), (0, 255, 0), (20, 30, 250), (128, 128, 128), (255, 255, 255), (3, 2, 1))
SIDE = 16
EIGHT_BITS = [ending for ending, kind in KINDS.items() if 8 in kind.bits]
BEST = PictureFormat(quality=100)
EXIF, GPS = 0x8769, 0x8825
MAKE, ORIENTATION, COMPRESSION = 0x010F, 0x0112, 0x0103
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
            0xA003: 3000,
            PER_UNIT: 1000.0,
        }
    )
    exif.get_ifd(GPS).update({1: "N", 2: (48.0, 51.0, 24.0)})
    return exif


def photo_file(path):
    """A photo that says all it can."""
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
    texts = {"iibr:settings": SETTINGS}
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
    if ending not in (".png",):
        assert text_in_xmp(saved, "iibr:settings") == SETTINGS
    write_picture(saved, patches(), PictureFormat(keeps_position=True), metadata)
    with Image.open(saved) as image:
        assert tuple(map(float, image.getexif().get_ifd(GPS)[2])) == (48.0, 51.0, 24.0)


def test_exr_says_what_it_can(tmp_path):
    metadata = read_metadata(photo_file(tmp_path / "a.jpg"))
    write_picture(tmp_path / "a.exr", patches(), metadata=PictureMetadata(metadata.exif, metadata.xmp, {"x": SETTINGS}))
    spec = oiio.ImageInput.open(str(tmp_path / "a.exr")).spec()
    assert spec.get_string_attribute("Make") == "Maker"
    assert spec.get_float_attribute("ExposureTime") == pytest.approx(1 / 125)
    assert spec.get_string_attribute("x") == SETTINGS
    assert "A &amp; B" in spec.get_string_attribute("xmp")
    assert read_photo(tmp_path / "a.exr").focal_px == pytest.approx(read_photo(tmp_path / "a.jpg").focal_px)


@pytest.mark.parametrize("ending", [".jpg", ".tif", ".webp", ".avif"])
def test_long_texts_are_packed(tmp_path, ending):
    rng = np.random.default_rng(1)
    text = str(rng.integers(0, 99, 30_000).tolist())
    assert len(text) > 100_000
    write_picture(tmp_path / f"a{ending}", patches(), metadata=PictureMetadata(texts={"iibr:settings": text}))
    assert text_in_xmp(tmp_path / f"a{ending}", "iibr:settings") == text


def test_what_a_jpeg_has_no_room_for_is_told(tmp_path):
    text = bytes(np.random.default_rng(1).integers(33, 127, 200_000, np.uint8)).decode()
    with pytest.raises(InputError, match=r"a\.jpg: cannot be written"):
        write_picture(tmp_path / "a.jpg", patches(), metadata=PictureMetadata(texts={"iibr:settings": text}))
    assert not list(tmp_path.iterdir())
    write_picture(tmp_path / "a.tif", patches(), metadata=PictureMetadata(texts={"iibr:settings": text}))
    assert text_in_xmp(tmp_path / "a.tif", "iibr:settings") == text


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
def test_what_a_kind_does_not_have_is_refused(tmp_path, name):
    with pytest.raises(InputError) as error:
        write_picture(tmp_path / name, patches(), BAD[name])
    assert "\n" not in str(error.value)
    assert not list(tmp_path.iterdir())


def test_too_large_for_its_kind(tmp_path):
    with pytest.raises(InputError, match="16383 a side"):
        write_picture(tmp_path / "a.webp", np.zeros((1, 16_384, 3), np.uint8))


@pytest.mark.parametrize("ending", KINDS)
def test_a_full_disk_is_told_and_leaves_what_was_there(tmp_path, ending, monkeypatch):
    """By the limit that the system has for files; OpenImageIO and Python's own files both meet it."""
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


@pytest.mark.parametrize("space", [SRGB, DISPLAY_P3], ids=lambda space: space.name)
def test_profiles_are_read_as_what_they_are(space):
    assert color_profile(icc_profile(space)).color_space == space
    opened = ImageCms.ImageCmsProfile(BytesIO(icc_profile(space)))
    assert ImageCms.getProfileDescription(opened).strip() == space.name
    colors = np.random.default_rng(2).integers(0, 256, (20, 20, 3), np.uint8)
    other = (
        profile_bytes() if space == DISPLAY_P3 else ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()
    )
    assert np.abs(converted(colors, icc_profile(space)).astype(int) - converted(colors, other)).max() <= 1


@pytest.mark.parametrize("seed", range(40))
def test_damaged_metadata_costs_no_picture(tmp_path, seed):
    rng = np.random.default_rng(seed)
    exif = bytearray(camera_exif().tobytes())
    for at in rng.integers(0, len(exif), 6):
        exif[at] = rng.integers(0, 256)
    xmp = bytearray(XMP)
    xmp[rng.integers(0, len(xmp))] = 0x3C
    kept = exif_for(bytes(exif), ImageSize(4, 4), SRGB, keeps_position=True)
    assert len(kept.tobytes()) < 65_000
    write_picture(tmp_path / "a.jpg", patches(), PictureFormat(), PictureMetadata(bytes(exif), bytes(xmp)))
    write_picture(tmp_path / "a.tif", patches(), PictureFormat(), PictureMetadata(bytes(exif), bytes(xmp)))
    assert read_photo(tmp_path / "a.tif").size == (SIDE, SIDE * len(PATCHES))
    xmp_for(bytes(xmp), {})


def test_nothing_is_said_of_what_is_not_there(tmp_path):
    assert read_metadata(tmp_path / "gone.jpg").exif == b""
    (tmp_path / "text.jpg").write_text("no picture")
    assert read_metadata(tmp_path / "text.jpg").xmp == b""
    assert xmp_for(b"", {}) == b""
    assert text_in_xmp(tmp_path / "text.jpg", "iibr:settings") == ""


def test_what_people_ask_of_a_photo(tmp_path):
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


@pytest.mark.parametrize("seed", range(30))
def test_facts_of_damaged_exif_are_few_words(seed):
    rng = np.random.default_rng(seed)
    exif = bytearray(camera_exif().tobytes())
    for at in rng.integers(6, len(exif), 8):
        exif[at] = rng.integers(0, 256)
    for what, value in camera_facts(PictureMetadata(bytes(exif))):
        assert "\n" not in what + value
        assert len(value) < 130


def test_the_stars_a_photo_has_are_kept_and_what_is_of_its_file_is_not(tmp_path):
    """Windows writes them in two tags; 0x0111 says where the file's strips lie."""
    exif = Image.Exif()
    exif[0x4746], exif[0x4749], exif[0x0111] = 4, 75, 8
    Image.fromarray(patches()).save(tmp_path / "a.jpg", exif=exif)
    write_picture(tmp_path / "b.jpg", patches(), metadata=read_metadata(tmp_path / "a.jpg"))
    with Image.open(tmp_path / "b.jpg") as image:
        kept = image.getexif()
    assert (kept.get(0x4746), kept.get(0x4749), kept.get(0x0111)) == (4, 75, None)


@pytest.mark.parametrize("whole", [exr_parts._is_whole, oiio_writer._is_whole])
def test_what_does_not_even_open_is_not_whole_and_nothing_is_told(tmp_path, capfd, whole):
    (tmp_path / "a.exr").write_bytes(b"cut off")
    assert not whole(tmp_path / "a.exr", 1)
    assert capfd.readouterr().err == ""
