"""Notes about files of which one flat picture is shown: panoramas, animations, photos with a right eye's picture."""

from pathlib import Path

import numpy as np
import pillow_heif
import pytest
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from iibr_core.formats.images.file_notes import file_notes
from iibr_core.formats.images.photo import read_photo

PICTURE = Image.fromarray(
    np.dstack(np.broadcast_arrays(np.arange(48)[:, None] * 5, np.arange(64) * 3, 90)).astype("u1")
)
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
def test_panoramas_are_shown_flat_with_a_note(tmp_path: Path, name: str) -> None:
    photo = read_photo(save(tmp_path / name, xmp('GPano:ProjectionType="equirectangular"')))
    assert photo.size == (48, 64)
    note = "Panorama (equirectangular): shown flat, as if it were an ordinary photo, so straight lines look bent."
    assert photo.notes == (note,)


@pytest.mark.parametrize("packet", [xmp(), xmp('GPano:SourcePhotosCount="1"'), f"<broken {GPANO}", ""])
def test_other_photos_have_no_notes(tmp_path: Path, packet: str) -> None:
    assert file_notes(save(tmp_path / "a.jpg", packet)) == ()


def test_a_right_eye_that_is_not_used_is_named(tmp_path: Path) -> None:
    packet = xmp('GPano:FullPanoWidthPixels="8192" GImage:Mime="image/jpeg"')
    panorama, right_eye = file_notes(save(tmp_path / "a.vr.jpg", packet))
    assert panorama.startswith("Panorama")
    assert right_eye == "The right eye's picture in it (Cardboard Camera, VR180) is not used."


@pytest.mark.parametrize("name", ["a.gif", "a.webp", "a.png", "a.avif", "webp.jpg"])
def test_the_first_picture_of_an_animation_is_used(tmp_path: Path, name: str) -> None:
    others = [PICTURE.rotate(90), PICTURE.rotate(180)]
    kind = {"webp.jpg": "WEBP"}.get(name)
    options = {"lossless": True} if "webp" in name else {}
    PICTURE.save(tmp_path / name, kind, save_all=True, append_images=others, duration=100, **options)
    photo = read_photo(tmp_path / name)
    assert photo.notes == ("Animation: the first of its 3 pictures is used.",)
    assert np.abs(255 * photo.pixels - np.asarray(PICTURE)).mean() < 8
