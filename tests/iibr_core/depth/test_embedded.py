"""Parts of photos that are no maps, are damaged, or hold more than a map; test_embedded_photos reads whole photos."""

import base64
import json
import random
import zipfile
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.depth.embedded.apple import heic_estimate
from iibr_core.depth.embedded.embedded import embedded_in_jpeg, read_embedded
from iibr_core.depth.search import PhotoWithDepth, open_with_depth
from iibr_core.formats.images.jpeg_xl import has_depth_channel
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.side_by_side import photo_size
from iibr_core.types import ImageSize, InputError
from tests.iibr_core import embedded_files as files
from tests.iibr_core.depth.drawn_photo import assert_disparity, assert_metres, drawn, usual_disparity
from tests.iibr_core.depth.test_embedded_photos import Stored, lytro

SIZE = ImageSize(24, 36)
STORED = np.random.default_rng(5).integers(0, 256, SIZE).astype(np.uint8)
PNG = files.picture(STORED, "PNG")


def opened(tmp_path: Path, name: str, data: bytes) -> PhotoWithDepth:
    (tmp_path / name).write_bytes(data)
    return open_with_depth(tmp_path / name)


def gdepth(depth: bytes = PNG, **options: object) -> bytes:
    return files.with_segments(files.grey_photo(SIZE), files.gdepth_segments(depth, **options))


@pytest.mark.parametrize(
    ("metadata", "expected"),
    [
        ({}, [0.0, 0.5, 1.0]),
        ({"representation_type": 1, "d_min": 1.0, "d_max": 3.0}, [1.0, 2.0, 3.0]),
        ({"representation_type": 0, "d_min": 1.0, "d_max": 3.0}, [1.0, 2.0, 3.0]),
        ({"representation_type": 0, "z_near": 0.5, "z_far": 1.0}, [1.0, 1.5, 2.0]),
        ({"representation_type": 2, "z_near": 1.0, "z_far": 3.0}, [1.0, 0.5, 1 / 3]),
    ],
)
def test_the_ranges_of_a_heic(metadata, expected) -> None:
    found = heic_estimate(np.array([[0, 0.5, 1]], np.float32), metadata)
    np.testing.assert_allclose(found.values, [expected], rtol=1e-6)


def test_copies_gain_maps_and_pictures_of_other_shapes_are_no_maps() -> None:
    stored = Stored()
    picture, gain = Image.fromarray(stored.pixels).convert("L"), files.picture(stored.white)
    gain = gain[:2] + b"\xff\xe1\x00\x25http://ns.adobe.com/xap/1.0/\0<hdrgm>" + gain[2:]
    grey, small, matte = np.asarray(picture), np.asarray(picture.resize((120, 80))), np.where(stored.near > 0.6, 255, 0)
    others = stored.pixels, small, stored.white[:40], np.roll(grey, 12, axis=1), 255 - grey, matte
    for behind in (gain, *(files.picture(other.astype(np.uint8)) for other in others)):
        assert embedded_in_jpeg(stored.photo + behind) is None


JPEG_XL = (
    "AAAADEpYTCANCocKAAAAFGZ0eXBqeGwgAAAAAGp4bCAAAAAJanhsbAoAAADCanhsY/8KD8EEKrIyODo0CQgIEACgAksoNCa+5nOS"
    "UFBQUHIBFBSow4BjjFFRKNsY8y4TC0BExRjMO+ReXswYgyl7ARkAgE7EAQIDKAKKRrqQ2DIyEBhzHDAPI+aBAnHEPIRn89LQkAUX"
    "wgRUa6pq9c7wtls+f588RMsACn3QUhCNodcCZ1CHz1QEXrJoEIk+XbPBVql5J6cQPo5GIHzsXlqqWqzrn1BpwkMQbuPdHJcXtTS3"
    "Mo0mBpAlN+dCAg=="
)
"""A picture of 96x64 pixels with a further channel of depth."""


def test_a_channel_of_depth_in_jpeg_xl_is_named(tmp_path) -> None:
    data = base64.b64decode(JPEG_XL)
    found = opened(tmp_path, "a.jxl", data)
    assert found.origin.kind == "rough"
    (note,) = (note for note in found.disparity.notes if "depth channel" in note)
    assert "a_depth.png" in note
    codestream = data[data.index(b"\xff\x0a") :]
    for start, has_depth in ((codestream, True), (codestream[:5], False), (data[:40], False)):
        (tmp_path / "b.jxl").write_bytes(start)
        assert has_depth_channel(tmp_path / "b.jxl") is has_depth


def test_the_first_frame_of_a_recording(tmp_path) -> None:
    lzfse = pytest.importorskip("lzfse", reason="the extra record3d is not installed")
    stored = Stored()
    stated = {"w": 240, "h": 160, "dw": 120, "dh": 80, "K": [100, 0, 0, 0, 100, 0, 64, 48, 1], "poses": []}
    metres = (1 / stored.near).astype("<f4")
    metres[5:9, 50:60] = 0
    with zipfile.ZipFile(tmp_path / "a.r3d", "w") as archive:
        archive.writestr("metadata", json.dumps(stated))
        for number, photo in ((10, files.grey_photo((160, 240))), (2, stored.photo)):
            archive.writestr(f"rgbd/{number}.jpg", photo)
            archive.writestr(f"rgbd/{number}.depth", lzfse.compress(metres.tobytes()))
    found = open_with_depth(tmp_path / "a.r3d")
    assert_disparity(found, usual_disparity(drawn()[1]))
    assert_metres(found, drawn()[1])
    assert found.disparity.unknown.mean() == pytest.approx(40 / metres.size, rel=0.1)
    assert found.photo.focal_px == pytest.approx(100)
    assert any("first of its 2 pictures" in note for note in found.photo.notes)
    (tmp_path / "b.r3d").write_bytes((tmp_path / "a.r3d").read_bytes()[:500])
    with pytest.raises(InputError, match=r"b\.r3d: is no recording of Record3D, or damaged"):
        read_photo(tmp_path / "b.r3d")


def test_cut_lytro_files_are_to_be_fetched_again_and_unknown_ones_exported(tmp_path) -> None:
    data = lytro(Stored(), True)
    (tmp_path / "a.lfp").write_bytes(data)
    assert photo_size(tmp_path / "a.lfp") == (160, 240)
    for cut in (0.1, 0.5, 0.95):
        (tmp_path / "a.lfp").write_bytes(data[: int(cut * len(data))])
        with pytest.raises(InputError, match=r"^[^\n]*a\.lfp: cut off at [^\n]*; get the whole file again$"):
            read_photo(tmp_path / "a.lfp")
    entry = {"imageArray": [{"imageRef": "a", "width": 8}]}
    (tmp_path / "a.lfp").write_bytes(files.lytro_file(entry, {"a": b"x"}))
    with pytest.raises(InputError, match=r"in an unknown way \(no 'height'\); export it with Lytro Desktop"):
        read_photo(tmp_path / "a.lfp")


def test_a_lost_part_is_reported() -> None:
    for lost in (0, 1, -1):
        standard, *parts = files.gdepth_segments(PNG, part_bytes=150)
        del parts[lost]
        with pytest.raises(InputError, match="cut short"):
            embedded_in_jpeg(files.with_segments(files.grey_photo(SIZE), [standard, *parts]))
    segments = [*files.gdepth_segments(PNG, part_bytes=150)[::-1], files.EXTENDED + b"short"]
    whole = embedded_in_jpeg(files.with_segments(files.grey_photo(SIZE), segments))
    assert whole.estimate.values.shape == SIZE, "in any order, beside a damaged one"


@pytest.mark.parametrize(
    "depth",
    [
        b"",
        PNG[:-20],
        files.picture(np.dstack([STORED, STORED[::-1], STORED]), "PNG"),
        PNG[:16] + bytes(8) + PNG[24:],  # a size of 0 x 0
        PNG[:16] + b"\x7f\xff\xff\xff" * 2 + PNG[24:],
    ],
)
def test_depth_pictures_that_are_none(depth) -> None:
    with pytest.raises(InputError):
        embedded_in_jpeg(gdepth(depth))
    found = embedded_in_jpeg(files.samsung_jpeg(gdepth(depth), STORED))
    assert found.format == "Samsung Live focus"


@pytest.mark.parametrize("prolog", ['<!DOCTYPE a [<!ENTITY i "1">]>', '<!DOCTYPE x SYSTEM "file:///etc/passwd">'])
def test_entities_are_never_expanded(prolog) -> None:
    xmp = files.STANDARD + files.packet({f"{files.GDEPTH} Near": "1"}, "&i;", prolog)
    with pytest.raises(InputError, match="document type"):
        embedded_in_jpeg(files.with_segments(files.grey_photo(SIZE), [xmp]))


FUZZED = {
    "gdepth.jpg": gdepth(part_bytes=None),
    "extended.jpg": gdepth(part_bytes=200, confidence=PNG, sharp=files.grey_photo((3, 4))),
    "dynamic.jpg": files.dynamic_depth_jpeg(files.grey_photo(SIZE), PNG),
    "apple.jpg": files.apple_jpeg(files.grey_photo(SIZE), STORED, 0, 1),
    "samsung.jpg": files.samsung_jpeg(files.grey_photo(SIZE), STORED, audio=True),
    "a.heic": files.heic(np.full((48, 64, 3), 100, np.uint8), np.zeros((24, 32), np.uint8)),
}


def damage(data: bytes, rng: random.Random) -> bytes:
    """Overwrite, cut out or double some bytes behind the file's mark."""
    for _ in range(rng.randint(1, 6)):
        at, length = rng.randrange(12, len(data)), rng.choice((1, 1, 2, 4, 40, 400))
        part = data[at : at + length]
        data = data[:at] + rng.choice((rng.randbytes(length), b"", 2 * part, bytes(length))) + data[at + length :]
    return data


@pytest.mark.parametrize("name", FUZZED)
def test_damaged_files_give_depth_or_one_line(tmp_path, name) -> None:
    rng, path, outcomes = random.Random(name), tmp_path / name, set()
    for _ in range(60):
        path.write_bytes(damage(FUZZED[name], rng))
        try:
            found = read_embedded(path)
        except InputError as error:
            outcomes.add("several lines" if "\n" in str(error) else "refused")
            continue
        if found is not None:
            outcomes.add("depth")
            assert 0 < found.estimate.values.size < 1e6
            assert not np.isinf(found.estimate.values).any()
    assert "depth" in outcomes
    assert "several lines" not in outcomes
