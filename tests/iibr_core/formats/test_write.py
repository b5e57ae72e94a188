import struct
from io import BytesIO

import cv2
import numpy as np
import OpenImageIO as oiio
import pillow_heif
import pytest
from PIL import Image, ImageCms, PngImagePlugin

from iibr_core.color import convert, linear_from_srgb
from iibr_core.formats.images.metadata import (
    SETTINGS_KEY,
    PictureMetadata,
    camera_facts,
    caption_in,
)
from iibr_core.formats.images.open_picture import read_metadata, settings_text_in
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.picture_kinds import KINDS, PictureFormat
from iibr_core.formats.images.write import write_picture
from iibr_core.types import DISPLAY_P3, SRGB
from tests.iibr_core.formats.test_color_profile import profile_bytes

PATCHES = ((200, 80, 60), (255, 0, 0), (0, 255, 0), (20, 30, 250), (128, 128, 128), (255, 255, 255), (3, 2, 1))
SIDE = 16
EIGHT_BITS = [ending for ending, kind in KINDS.items() if 8 in kind.bits]
EXIF, GPS = 0x8769, 0x8825
MAKE, ORIENTATION, COMPRESSION, HEIGHT = 0x010F, 0x0112, 0x0103, 0xA003
EXPOSURE, FOCAL, FOCAL_35, MAKER_NOTE, WIDTH, PER_UNIT = 0x829A, 0x920A, 0xA405, 0x927C, 0xA002, 0xA20E
XMP = b"""<?xpacket begin='' id='W5M0MpCehiHzreSzNTczkc9d'?><x:xmpmeta xmlns:x='adobe:ns:meta/'>
<rdf:RDF xmlns:rdf='http://www.w3.org/1999/02/22-rdf-syntax-ns#'><rdf:Description rdf:about=''
 xmlns:dc='http://purl.org/dc/elements/1.1/' xmlns:xmp='http://ns.adobe.com/xap/1.0/' xmp:Rating='4'
 xmp:Thumbnails='old'
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
    exif.get_ifd(EXIF).update({EXPOSURE: 1 / 125, FOCAL: 4.25, FOCAL_35: 26, MAKER_NOTE: b"bound"})
    exif.get_ifd(EXIF).update({WIDTH: 4000, HEIGHT: 3000, PER_UNIT: 1000.0})
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


@pytest.mark.parametrize(
    ("source", "ending"),
    [
        *((f"a.{kind}", ".jpg") for kind in ("jpg", "png", "tif", "webp", "avif", "heic")),
        *(("a.jpg", ending) for ending in KINDS if ending not in (".exr", ".jpg")),
    ],
)
def test_exif_and_xmp_are_kept(tmp_path, source, ending):
    if source.endswith("heic"):
        image = pillow_heif.from_pillow(Image.fromarray(patches()))
        image.save(tmp_path / source, exif=camera_exif().tobytes(), xmp=XMP)
    else:
        photo_file(tmp_path / source)
    metadata = read_metadata(tmp_path / source)
    saved = tmp_path / f"saved{ending}"
    texts = {SETTINGS_KEY: SETTINGS}
    upright = np.ascontiguousarray(np.rot90(patches(), -1))
    write_picture(saved, upright, metadata=PictureMetadata(metadata.exif, metadata.xmp, texts))
    with Image.open(saved) as image:
        exif, xmp = image.getexif(), image.info["xmp"]
        camera = exif.get_ifd(EXIF)
        assert (exif[MAKE], exif.get(ORIENTATION, 1)) == ("Maker", 1)
        assert float(camera[EXPOSURE]) == pytest.approx(1 / 125)
        assert (camera[FOCAL_35], camera[WIDTH]) == (26, SIDE)
        assert float(camera[PER_UNIT]) == pytest.approx(1000 * SIDE * len(PATCHES) / 4000), "by the longer sides"
        assert MAKER_NOTE not in camera
        assert not exif.get_ifd(GPS)
        xmp = xmp if isinstance(xmp, str) else xmp.decode()
        assert "A &amp; B" in xmp
        assert 'xmp:Rating="4"' in xmp
        for gone in ("GDepth", "GPS", "Exposure2012", "Thumbnails"):
            assert gone not in xmp
    assert settings_text_in(saved) == SETTINGS
    assert caption_in(read_metadata(saved)).title == "A & B"
    write_picture(saved, patches(), PictureFormat(keeps_position=True), metadata)
    with Image.open(saved) as image:
        assert tuple(map(float, image.getexif().get_ifd(GPS)[2])) == (48.0, 51.0, 24.0)


@pytest.mark.parametrize("ending", [".jpg", ".tif", ".webp", ".avif"])
def test_long_texts_are_packed(tmp_path, ending):
    rng = np.random.default_rng(1)
    text = str(rng.integers(0, 99, 30_000).tolist())
    assert len(text) > 100_000
    write_picture(tmp_path / f"a{ending}", patches(), metadata=PictureMetadata(texts={SETTINGS_KEY: text}))
    assert settings_text_in(tmp_path / f"a{ending}") == text


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
    del exif.get_ifd(EXIF)[FOCAL_35]
    Image.fromarray(patches()).save(tmp_path / "b.jpg", exif=exif)
    assert dict(camera_facts(read_metadata(tmp_path / "b.jpg")))["Exposure"] == "f/1.78, 1/125 s, ISO 100, 4.25 mm"
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


def test_exif_of_photos_of_200_megapixels_is_read(tmp_path):
    """A JPEG whose header claims 16320x12240 pixels, more than Pillow allows by itself."""
    path = tmp_path / "a.jpg"
    Image.fromarray(patches()).save(path, exif=camera_exif())
    data = bytearray(path.read_bytes())
    frame = data.rindex(b"\xff\xc0\x00\x11\x08") + 5
    data[frame : frame + 4] = struct.pack(">HH", 12_240, 16_320)
    path.write_bytes(data)
    facts = dict(camera_facts(read_metadata(path)))
    assert facts == {"Camera": "Maker", "Exposure": "1/125 s, 26 mm (35 mm)"}
