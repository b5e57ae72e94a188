import shutil
import struct

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.images.file_notes import file_notes
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.photo import read_photo
from iibr_core.types import InputError
from tests.iibr_core.embedded_files import GIMAGE, packet
from tests.iibr_core.pictures import as_bytes, with_xmp, write_oiio

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
    "IMG_0001.lfr": (b"\x89LFP\r\n\x1a\n" + bytes(100), r"a raw light field \(Lytro\), .* decoded first: PlenoptiCam"),
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


def psd() -> bytes:
    """Version 1, 3 channels of 8 bits, RGB, no layers; the picture itself is not packed."""
    head = b"8BPS\0\x01" + bytes(6) + struct.pack(">HIIHH", 3, 48, 64, 8, 3)
    return head + bytes(12) + b"\0\0" + PIXELS.transpose(2, 0, 1).tobytes()


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("png.jpg", "PNG"), ("avif.jpg", "AVIF"), ("heic.jpg", "HEIC"), ("jpeg.heic", "JPEG"), ("noending", "JPEG"),
        ("a.bmp", "BMP"), ("a.tga", "TGA"), ("a.jp2", "JPEG2000"), ("a.gif", "GIF"), ("a.jxl", ""), ("a.psd", ""),
    ],
)  # fmt: skip
def test_pictures_of_every_kind_open_whatever_their_ending(tmp_path, name, kind) -> None:
    path = tmp_path / name
    if name == "a.jxl":
        write_oiio(path, PIXELS)
    else:
        path.write_bytes(as_bytes(PICTURE, kind) if kind else psd())
    photo = read_photo(path)
    assert photo.size == (48, 64)
    assert np.abs(255 * photo.pixels - PIXELS).mean() < 4
    assert photo.notes == ()


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


def with_compression(code: int) -> bytes:
    """Return a TIFF that states another compression: tag 259, one short number."""
    head = struct.pack("<HHI", 259, 3, 1)
    return as_bytes(PICTURE, "TIFF").replace(head + struct.pack("<I", 1), head + struct.pack("<I", code))


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("lerc.tif", with_compression(34887)),
        ("jpeg_xl.tif", with_compression(50002)),
        ("twelve_bits.jpg", as_bytes(PICTURE, "JPEG").replace(b"\xff\xc0\0\x11\x08", b"\xff\xc1\0\x11\x0c")),
        ("lossless.jpg", as_bytes(PICTURE, "JPEG").replace(b"\xff\xc0\0\x11", b"\xff\xc3\0\x11")),
        ("vvc.heic", as_bytes(PICTURE, "HEIC").replace(b"hvc1", b"vvc1")),
    ],
)
def test_whole_files_of_unread_kinds_are_not_called_damaged(tmp_path, name, content) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=ELSEWHERE) as raised:
        read_photo(tmp_path / name)
    assert AGAIN not in str(raised.value)


CUT = [(kind, share) for kind in ("JPEG", "PNG", "TIFF", "WEBP", "AVIF", "HEIC") for share in (0.01, 0.2, 0.8)]
CUT.remove(("JPEG", 0.8))
"""A JPEG is read as far as it goes."""


@pytest.mark.parametrize(("kind", "share"), CUT)
def test_cut_files_are_to_be_fetched_again(tmp_path, kind, share) -> None:
    """Also where rows are read and made smaller one after the other."""
    path, stored = tmp_path / f"a.{kind.lower()}", as_bytes(PICTURE, kind)
    path.write_bytes(stored[: max(int(share * len(stored)), 16)])
    for most in (1000, 2_000_000):
        with pytest.raises(InputError, match=AGAIN) as caught:
            read_photo(path, most)
        assert str(caught.value).count(path.name) == 1


GPANO = "http://ns.google.com/photos/1.0/panorama/"


FLAT = "Panorama (equirectangular): shown flat, as if it were an ordinary photo, so straight lines look bent."
RIGHT_EYE = "The right eye's picture in it (Cardboard Camera, VR180) is not used."


@pytest.mark.parametrize("kind", ["JPEG", "PNG", "TIFF", "HEIC"])
def test_panoramas_are_shown_flat_with_a_note(tmp_path, kind) -> None:
    """A right eye that is not used is named; other photos have no notes."""
    path = tmp_path / "a.jpg"
    path.write_bytes(with_xmp(PICTURE, kind, packet({f"{GPANO} ProjectionType": "equirectangular"})))
    photo = read_photo(path)
    assert (photo.size, photo.notes) == ((48, 64), (FLAT,))
    stereo = {f"{GPANO} FullPanoWidthPixels": "8192", f"{GIMAGE} Mime": "image/jpeg"}
    path.write_bytes(with_xmp(PICTURE, kind, packet(stereo)))
    panorama, right_eye = file_notes(path)
    assert (panorama.startswith("Panorama"), right_eye) == (True, RIGHT_EYE)
    for other in (packet({f"{GPANO} SourcePhotosCount": "1"}), f"<broken {GPANO}".encode()):
        path.write_bytes(with_xmp(PICTURE, kind, other))
        assert file_notes(path) == ()


@pytest.mark.parametrize("name", ["a.gif", "a.webp", "a.png", "a.avif", "webp.jpg"])
def test_the_first_picture_of_an_animation_is_used(tmp_path, name) -> None:
    others = [PICTURE.rotate(90), PICTURE.rotate(180)]
    kind = {"webp.jpg": "WEBP"}.get(name)
    options = {"lossless": True} if "webp" in name else {}
    PICTURE.save(tmp_path / name, kind, save_all=True, append_images=others, duration=100, **options)
    photo = read_photo(tmp_path / name)
    assert photo.notes == ("Animation: the first of its 3 pictures is used.",)
    assert np.abs(255 * photo.pixels - np.asarray(PICTURE)).mean() < 8
