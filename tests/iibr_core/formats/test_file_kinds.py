import shutil
import struct
from io import BytesIO
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pillow_heif
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from iibr_core.formats.images.file_notes import file_notes
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.photo import read_photo
from iibr_core.types import InputError

PIXELS = np.dstack(np.broadcast_arrays(np.arange(48)[:, None] * 5, 40 + np.arange(64) * 3, 90)).astype(np.uint8)
PICTURE = Image.fromarray(PIXELS)

RAW = "a camera's RAW file; develop it and save it as TIFF or JPEG"
VIDEO = "a video; save one of its frames as PNG or JPEG"
PAGE = "a web page, not a picture; download the picture itself"
SVG = r"a drawing \(SVG\); save it as PNG"
ARCHIVE = "an archive; unpack it and open the picture in it"
CMYK = "CMYK was converted to RGB without its colour profile."
TEXT = "a text file, not a picture; get the picture itself"
FTYP = b"\0\0\0\x20ftyp"
REFUSED: dict[str, tuple[bytes, str]] = {
    "a.dng": (b"II*\0\x08\0\0\0" + bytes(60), RAW),
    "canon.tif": (b"II*\0\x10\0\0\0CR\x02\0" + bytes(60), RAW),
    "a.cr3": (b"\0\0\0\x18ftypcrx \0\0\0\1crx isom" + bytes(60), RAW),
    "unknown.3fr": (b"\x80\x81" * 50, RAW),
    "a.mp4": (FTYP + b"isom" + bytes(60), VIDEO),
    "page.jpg": (b"<!DOCTYPE html><html>404</html>", PAGE),
    "a.svg": (b"<svg xmlns='http://www.w3.org/2000/svg'/>", SVG),
    "a.pdf": (b"%PDF-1.7\n%\xe2\xe3\xcf\xd3" + bytes(60), "a PDF document; save the page or its picture as PNG"),
    "a.npy": (b"\x93NUMPY\1\0" + bytes(60), r"an array of numbers \(NumPy\); give it as a depth map"),
    "pointer.png": (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\n", "a pointer of Git LFS; "),
    "photos.zip": (b"PK\x03\x04" + bytes(60), ARCHIVE),
    "error.jpg": (b'<?xml version="1.0"?><Error><Code>AccessDenied</Code></Error>', TEXT),
}


@pytest.mark.parametrize("name", REFUSED)
def test_other_kinds_of_files_are_named_with_the_way_out(tmp_path, name) -> None:
    content, expected = REFUSED[name]
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(InputError, match=rf"^{path}: is {expected}[^\n]*$"):
        read_photo(path)


def test_a_raw_file_is_refused_though_its_preview_can_be_read(tmp_path) -> None:
    PICTURE.resize((16, 12)).save(tmp_path / "a.tif")
    shutil.copy(tmp_path / "a.tif", tmp_path / "a.dng")
    assert read_photo(tmp_path / "a.tif").size == (12, 16)
    with pytest.raises(InputError, match=RAW):
        read_photo(tmp_path / "a.dng")
    PICTURE.save(tmp_path / "jpeg.dng", "JPEG")  # under a wrong name
    assert open_picture(tmp_path / "jpeg.dng").kind == "JPEG"
    assert read_photo(tmp_path / "jpeg.dng").size == (48, 64)


WRONG_ENDINGS = {"png.jpg": "PNG", "avif.jpg": "AVIF", "jpeg.heic": "JPEG", "noending": "JPEG"}


@pytest.mark.parametrize("name", [*WRONG_ENDINGS, "heic.jpg"])
def test_pictures_open_whatever_their_ending(tmp_path, name) -> None:
    if name == "heic.jpg":
        pillow_heif.from_pillow(PICTURE).save(tmp_path / name, quality=95)
    else:
        PICTURE.save(tmp_path / name, WRONG_ENDINGS[name])
    photo = read_photo(tmp_path / name)
    assert np.abs(255 * photo.pixels - PIXELS).mean() < 4
    assert photo.notes == ()


@pytest.mark.parametrize("ending", ["bmp", "tga", "jp2", "gif", "jxl", "psd"])
def test_other_kinds_of_pictures_open(tmp_path, ending) -> None:
    path = tmp_path / f"a.{ending}"
    if ending == "jxl":
        output = oiio.ImageOutput.create(str(path))
        assert output.open(str(path), oiio.ImageSpec(64, 48, 3, "uint8")), output.geterror()
        assert output.write_image(PIXELS)
        output.close()
    elif ending == "psd":
        # Version 1, 3 channels of 8 bits, RGB, no layers; the picture itself is not packed.
        head = b"8BPS\0\x01" + bytes(6) + struct.pack(">HIIHH", 3, 48, 64, 8, 3)
        path.write_bytes(head + bytes(12) + b"\0\0" + PIXELS.transpose(2, 0, 1).tobytes())
    else:
        PICTURE.save(path)
    photo = read_photo(path)
    assert photo.size == (48, 64)
    assert np.abs(255 * photo.pixels - PIXELS).mean() < 4


@pytest.mark.parametrize(
    ("name", "mode", "note"),
    [
        ("cmyk.jpg", "CMYK", CMYK), ("cmyk.tif", "CMYK", CMYK), ("la.png", "LA", ""), ("one.png", "1", ""),
        ("grey.jpg", "L", ""), ("palette.png", "P", ""),
    ],
)  # fmt: skip
def test_pictures_of_other_colours_open(tmp_path, name, mode, note) -> None:
    PICTURE.convert(mode).save(tmp_path / name)
    photo = read_photo(tmp_path / name)
    assert photo.size == (48, 64)
    assert photo.notes == ((note,) if note else ())
    expected = np.asarray(PICTURE.convert(mode).convert("RGB"))
    assert np.abs(255 * photo.pixels - expected).mean() < 6


AGAIN, ELSEWHERE = "get the whole file again", "if another program opens it, save it there as JPEG, PNG or TIFF"


def as_bytes(kind: str) -> bytes:
    stored = BytesIO()
    if kind == "HEIC":
        pillow_heif.from_pillow(PICTURE).save(stored)
    else:
        PICTURE.save(stored, kind)
    return stored.getvalue()


def with_compression(code: int) -> bytes:
    """Return a TIFF that states another compression: tag 259, one short number."""
    head = struct.pack("<HHI", 259, 3, 1)
    return as_bytes("TIFF").replace(head + struct.pack("<I", 1), head + struct.pack("<I", code))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("lerc.tif", with_compression(34887)),
        ("jpeg_xl.tif", with_compression(50002)),
        ("twelve_bits.jpg", as_bytes("JPEG").replace(b"\xff\xc0\0\x11\x08", b"\xff\xc1\0\x11\x0c")),
        ("lossless.jpg", as_bytes("JPEG").replace(b"\xff\xc0\0\x11", b"\xff\xc3\0\x11")),
        ("vvc.heic", as_bytes("HEIC").replace(b"hvc1", b"vvc1")),
    ],
)
def test_whole_files_of_unread_kinds_are_not_called_damaged(tmp_path, name, content) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=ELSEWHERE) as raised:
        read_photo(tmp_path / name)
    assert AGAIN not in str(raised.value)


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "TIFF", "WEBP", "AVIF", "HEIC"])
@pytest.mark.parametrize("share", [0.2, 0.8])
def test_cut_files_are_to_be_fetched_again(tmp_path, kind, share) -> None:
    path, stored = tmp_path / f"a.{kind.lower()}", as_bytes(kind)
    path.write_bytes(stored[: int(share * len(stored))])
    with pytest.raises(InputError, match=AGAIN):
        read_photo(path)


XMP_TAG = 700
GPANO = "http://ns.google.com/photos/1.0/panorama/"
GIMAGE = "http://ns.google.com/photos/1.0/image/"


def xmp(attributes: str = "") -> str:
    return (
        '<x:xmpmeta xmlns:x="adobe:ns:meta/"><rdf:RDF xmlns:rdf="http://www.w3.org/1999/02/22-rdf-syntax-ns#">'
        f'<rdf:Description rdf:about="" xmlns:GPano="{GPANO}" xmlns:GImage="{GIMAGE}" {attributes}>'
        "</rdf:Description></rdf:RDF></x:xmpmeta>"
    )


def save(path: Path, packet: str) -> Path:
    if path.suffix == ".png":
        info = PngInfo()
        info.add_itxt("XML:com.adobe.xmp", packet)
        PICTURE.save(path, pnginfo=info)
    elif path.suffix == ".tif":
        PICTURE.save(path, tiffinfo={XMP_TAG: packet.encode()})
    elif path.suffix == ".heic":
        file = pillow_heif.from_pillow(PICTURE)
        file.info["xmp"] = packet.encode()
        file.save(path, quality=90)
    else:
        PICTURE.save(path, xmp=packet.encode())
    return path


@pytest.mark.parametrize("name", ["a.jpg", "a.png", "a.tif", "a.heic"])
def test_panoramas_are_shown_flat_with_a_note(tmp_path, name) -> None:
    photo = read_photo(save(tmp_path / name, xmp('GPano:ProjectionType="equirectangular"')))
    assert photo.size == (48, 64)
    note = "Panorama (equirectangular): shown flat, as if it were an ordinary photo, so straight lines look bent."
    assert photo.notes == (note,)


@pytest.mark.parametrize("packet", [xmp(), xmp('GPano:SourcePhotosCount="1"'), f"<broken {GPANO}", ""])
def test_other_photos_have_no_notes(tmp_path, packet) -> None:
    assert file_notes(save(tmp_path / "a.jpg", packet)) == ()


def test_a_right_eye_that_is_not_used_is_named(tmp_path) -> None:
    packet = xmp('GPano:FullPanoWidthPixels="8192" GImage:Mime="image/jpeg"')
    panorama, right_eye = file_notes(save(tmp_path / "a.vr.jpg", packet))
    assert panorama.startswith("Panorama")
    assert right_eye == "The right eye's picture in it (Cardboard Camera, VR180) is not used."


@pytest.mark.parametrize("name", ["a.gif", "a.webp", "a.png", "a.avif", "webp.jpg"])
def test_the_first_picture_of_an_animation_is_used(tmp_path, name) -> None:
    others = [PICTURE.rotate(90), PICTURE.rotate(180)]
    kind = {"webp.jpg": "WEBP"}.get(name)
    options = {"lossless": True} if "webp" in name else {}
    PICTURE.save(tmp_path / name, kind, save_all=True, append_images=others, duration=100, **options)
    photo = read_photo(tmp_path / name)
    assert photo.notes == ("Animation: the first of its 3 pictures is used.",)
    assert np.abs(255 * photo.pixels - np.asarray(PICTURE)).mean() < 8
