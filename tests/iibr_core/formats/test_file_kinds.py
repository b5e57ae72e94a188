import shutil
import struct

import numpy as np
import pytest
from PIL import Image

from iibr_core.formats.images.photo import read_photo
from iibr_core.types import InputError
from tests.iibr_core.pictures import as_bytes

PIXELS = np.dstack(np.broadcast_arrays(np.arange(48)[:, None] * 5, 40 + np.arange(64) * 3, 90)).astype(np.uint8)
PICTURE = Image.fromarray(PIXELS)

RAW = "a camera's RAW file; develop it and save it as TIFF or JPEG"
VIDEO = "a video; save one of its frames as PNG or JPEG"
PAGE = "a web page, not a picture; download the picture itself"
SVG = r"a drawing \(SVG\); save it as PNG"
ARCHIVE = "an archive; unpack it and open the picture in it"
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
