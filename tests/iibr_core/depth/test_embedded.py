"""Depth within photos: every container read back from files written here, and every way such a file can be wrong."""

from __future__ import annotations

import io
import random
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.depth.embedded.apple import heic_estimate
from iibr_core.depth.embedded.embedded import embedded_in_jpeg, read_embedded
from iibr_core.depth.embedded.images import MAX_MAP_PIXELS, decode_map
from iibr_core.depth.search import open_with_depth
from iibr_core.formats.images.photo import read_photo
from iibr_core.types import ImageSize, InputError
from tests.iibr_core import embedded_files as files

SIZE = ImageSize(24, 36)
RNG = np.random.default_rng(5)
STORED = RNG.integers(0, 256, SIZE).astype(np.uint8)
DEEP = RNG.integers(0, 65536, SIZE).astype(np.uint16)
NEAR, FAR = 2.0, 10.0


def inverse_of(stored: np.ndarray, kind: str = "RangeInverse", near: float = NEAR, far: float = FAR) -> np.ndarray:
    """1 / distance, by the formulas of the GDepth specification, one value after the other."""
    result = np.empty(stored.shape)
    for place, value in np.ndenumerate(stored):
        n = value / np.iinfo(stored.dtype).max
        distance = (far * near) / (far - n * (far - near)) if kind == "RangeInverse" else near + n * (far - near)
        result[place] = 1 / distance
    return result


def gdepth(depth: bytes | None = None, **options: object) -> bytes:
    depth = files.picture(STORED, "PNG") if depth is None else depth
    return files.with_segments(files.grey_photo(SIZE), files.gdepth_segments(depth, **options))  # type: ignore[arg-type]


def relative(data: bytes) -> np.ndarray:
    found = embedded_in_jpeg(data)
    assert found is not None
    assert found.estimate.meaning == "inverse depth"
    assert found.estimate.values.dtype == np.float32
    return found.estimate.values


# ---- Google


@pytest.mark.parametrize("part_bytes", [None, 100])
@pytest.mark.parametrize("kind", ["RangeInverse", "RangeLinear"])
@pytest.mark.parametrize("stored", [STORED, DEEP])
def test_gdepth_is_read_by_its_formula(stored: np.ndarray, kind: str, part_bytes: int | None) -> None:
    found = relative(gdepth(files.picture(stored, "PNG"), kind=kind, part_bytes=part_bytes))
    np.testing.assert_allclose(found, inverse_of(stored, kind), rtol=1e-5)


def test_units_tell_metres_from_a_mere_scale() -> None:
    for units, scale in (("m", 1.0), ("Meters", 1.0), ("mm", 1e-3)):
        found = embedded_in_jpeg(gdepth(units=units))
        assert found is not None
        assert found.estimate.meaning == "metres"
        np.testing.assert_allclose(found.estimate.values, scale / inverse_of(STORED), rtol=1e-5)
    assert relative(gdepth(units="furlongs")).shape == SIZE


def test_an_inverse_range_may_reach_to_infinity() -> None:
    found = relative(gdepth(far="Infinity"))
    np.testing.assert_allclose(found, (1 - STORED / 255) / NEAR, atol=1e-6)
    metric = embedded_in_jpeg(gdepth(far="inf", units="m"))
    assert metric is not None
    assert metric.estimate.meaning == "metres"
    assert np.isfinite(metric.estimate.values).all()


def test_unsure_depth_is_unknown() -> None:
    sure = np.full(SIZE, 200, np.uint8)
    sure[3:5, 7:9] = 2
    found = relative(gdepth(confidence=files.picture(sure, "PNG")))
    assert np.isnan(found[3:5, 7:9]).all()
    assert np.isnan(found).sum() == 4
    # A map that is sure of nothing says nothing.
    assert not np.isnan(relative(gdepth(confidence=files.picture(np.zeros(SIZE, np.uint8), "PNG")))).any()


def test_a_lost_part_is_reported() -> None:
    for lost in (0, 1, -1):
        standard, *parts = files.gdepth_segments(files.picture(STORED, "PNG"), part_bytes=150)
        del parts[lost]
        with pytest.raises(InputError, match="cut short"):
            embedded_in_jpeg(files.with_segments(files.grey_photo(SIZE), [standard, *parts]))


@pytest.mark.parametrize("shared_container", [False, True])
@pytest.mark.parametrize(
    "trailers",
    [
        {},
        {"between": b"somebody else's trailer"},
        {"before": files.grey_photo((3, 4)), "behind": b"..."},
    ],
)
def test_dynamic_depth_is_found_among_trailers(trailers: dict[str, bytes], shared_container: bool) -> None:
    data = files.dynamic_depth_jpeg(
        files.grey_photo(SIZE), files.picture(STORED, "PNG"), shared_container=shared_container, **trailers
    )
    found = embedded_in_jpeg(data)
    assert found is not None
    assert found.estimate.meaning == "metres"
    assert found.format == "Dynamic Depth"
    np.testing.assert_allclose(1 / found.estimate.values, inverse_of(STORED), rtol=1e-5)


# ---- Apple and Samsung


@pytest.mark.parametrize("kind", ["disparity", "depth"])
def test_a_portrait_saved_as_jpeg(kind: str) -> None:
    smooth = np.tile(np.linspace(0, 255, SIZE[1]).astype(np.uint8), (SIZE[0], 1))
    found = relative(files.apple_jpeg(files.grey_photo(SIZE) + b"padding", smooth, 0.5, 2.5, kind))
    linear = 0.5 + smooth / 255 * 2.0
    np.testing.assert_allclose(found, linear if kind == "disparity" else 1 / linear, atol=0.03)


def test_other_pictures_behind_a_photo_are_not_depth() -> None:
    assert embedded_in_jpeg(files.apple_jpeg(files.grey_photo(SIZE), STORED, 0, 1, "urn:matte")) is None
    assert embedded_in_jpeg(files.grey_photo(SIZE) + files.grey_photo(SIZE)) is None


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
def test_the_ranges_of_a_heic(metadata: dict[str, float], expected: list[float]) -> None:
    found = heic_estimate(np.array([[0, 0.5, 1]], np.float32), metadata)
    np.testing.assert_allclose(found.values, [expected], rtol=1e-6)


def test_a_heic_opens_as_a_photo_with_its_focal_length(tmp_path: Path) -> None:
    exif = Image.Exif()
    exif.get_ifd(0x8769)[0xA405] = 26
    pixels = np.zeros((64, 96, 3), np.uint8)
    pixels[:, 48:] = (200, 100, 50)
    path = tmp_path / "a.heic"
    path.write_bytes(files.heic(pixels, exif=exif.tobytes()))
    photo = read_photo(path)
    np.testing.assert_allclose(photo.pixels * 255, pixels, atol=4)
    assert photo.focal_px == pytest.approx(26 / np.hypot(36, 24) * np.hypot(64, 96))
    assert read_embedded(path) is None


@pytest.mark.parametrize("audio", [False, True])
def test_samsung_live_focus(audio: bool) -> None:
    found = relative(files.samsung_jpeg(files.grey_photo(SIZE), STORED, audio=audio))
    np.testing.assert_allclose(found, 1 - STORED / 255, atol=1e-6)


# ---- what is wrong


@pytest.mark.parametrize(
    "range_",
    [
        {"near": 3, "far": 3},
        {"near": 5, "far": 3},
        {"near": -1, "far": 3},
        {"near": "nan", "far": 3},
        {"near": "near", "far": 3},
        {"near": 1, "far": "inf", "kind": "RangeLinear"},
        {"near": 5, "far": 3, "kind": ""},
        {"near": 5, "far": 3, "kind": "RangeLogarithmic"},
    ],
)
def test_of_senseless_ranges_and_formats_the_order_counts(range_: dict[str, object]) -> None:
    """Dark is near."""
    dynamic = files.dynamic_depth_jpeg(files.grey_photo(SIZE), files.picture(STORED, "PNG"), **range_)  # type: ignore[arg-type]
    for data in (gdepth(**range_), dynamic):
        found = relative(data)
        assert np.corrcoef(found.ravel(), STORED.ravel())[0, 1] < -0.7


@pytest.mark.parametrize("white_is_near", [True, False])
def test_a_grey_picture_behind_a_photo_is_its_map(tmp_path: Path, white_is_near: bool) -> None:
    pixels, depth = files.disc_scene()
    stored = depth if white_is_near else 255 - depth
    (tmp_path / "a.jpg").write_bytes(files.picture(pixels, "JPEG") + files.picture(stored[::2, ::2], "JPEG"))
    found = open_with_depth(tmp_path / "a.jpg")
    assert found.origin.kind == "embedded"
    assert found.disparity.values[60, 60] > found.disparity.values[90, 10] > found.disparity.values[4, 10]
    assert any("counts as near" in note for note in found.disparity.notes)


def test_copies_gain_maps_and_pictures_of_other_shapes_are_no_maps() -> None:
    pixels, depth = files.disc_scene()
    photo, grey = files.picture(pixels, "JPEG"), files.picture(depth, "JPEG")
    copy = files.picture(np.asarray(Image.fromarray(pixels).convert("L").resize((64, 48))), "JPEG")
    gain = grey[:2] + b"\xff\xe1\x00\x25http://ns.adobe.com/xap/1.0/\0<hdrgm>" + grey[2:]
    wide = files.picture(depth[:40], "JPEG")
    grey_photo = np.asarray(Image.fromarray(pixels).convert("L"))
    shifted, negative, matte = np.roll(grey_photo, 12, axis=1), 255 - grey_photo, np.where(depth > 200, 255, 0)
    others = [files.picture(other.astype(np.uint8), "JPEG") for other in (shifted, negative, matte)]
    for behind in (photo, copy, gain, wide, *others):
        assert embedded_in_jpeg(photo + behind) is None


PNG = files.picture(STORED, "PNG")


@pytest.mark.parametrize(
    "depth",
    [
        b"",
        b"no picture",
        PNG[:100],
        PNG[:-20],
        files.picture(np.dstack([STORED, STORED[::-1], STORED]), "PNG"),
        PNG[:16] + bytes(8) + PNG[24:],  # a size of 0 x 0
        PNG[:16] + b"\x7f\xff\xff\xff" * 2 + PNG[24:],
    ],
)
def test_depth_pictures_that_are_none(depth: bytes) -> None:
    with pytest.raises(InputError):
        embedded_in_jpeg(gdepth(depth))


def test_sizes_are_looked_at_before_memory_is_spent() -> None:
    """A PNG of a few kilobytes that unpacks to more pixels than any phone stores."""
    file = io.BytesIO()
    Image.new("L", (9000, MAX_MAP_PIXELS // 9000 + 1)).save(file, "PNG")
    assert len(file.getvalue()) < 200_000
    with pytest.raises(InputError, match="9000x7112"):
        decode_map(file.getvalue(), "a bomb")


BOMB = (
    '<!DOCTYPE bomb [<!ENTITY a "aaaaaaaaaa">'
    + "".join(f'<!ENTITY {b} "{f"&{a};" * 10}">' for a, b in zip("abcdefgh", "bcdefghi"))
    + "]>"
)


@pytest.mark.parametrize("prolog", [BOMB, '<!DOCTYPE x SYSTEM "file:///etc/passwd">'])
def test_entities_are_never_expanded(prolog: str) -> None:
    xmp = files.STANDARD + files.packet({f"{files.GDEPTH} Near": "1"}, "&i;", prolog)
    with pytest.raises(InputError, match="document type"):
        embedded_in_jpeg(files.with_segments(files.grey_photo(SIZE), [xmp]))


def test_one_damaged_format_does_not_hide_another() -> None:
    damaged = files.with_segments(files.grey_photo(SIZE), files.gdepth_segments(b"no picture"))
    found = embedded_in_jpeg(files.samsung_jpeg(damaged, STORED))
    assert found is not None
    assert found.format == "Samsung Live focus"


def test_a_long_run_of_padding_in_a_scan_takes_no_time() -> None:
    assert embedded_in_jpeg(b"\xff\xd8\xff\xda\0\2" + b"\xff" * 2_000_000 + b"\0") is None


# ---- damaged files

FUZZED = {
    "gdepth.jpg": gdepth(part_bytes=None),
    "extended.jpg": gdepth(part_bytes=200, confidence=PNG, sharp=files.grey_photo((3, 4))),
    "dynamic.jpg": files.dynamic_depth_jpeg(files.grey_photo(SIZE), PNG),
    "apple.jpg": files.apple_jpeg(files.grey_photo(SIZE), STORED, 0, 1),
    "samsung.jpg": files.samsung_jpeg(files.grey_photo(SIZE), STORED, audio=True),
    "a.heic": files.heic(np.full((48, 64, 3), 100, np.uint8), np.zeros((24, 32), np.uint8)),
}


def damage(data: bytes, rng: random.Random) -> bytes:
    """Overwrite, cut out or double some bytes behind the file's mark, or lose the end."""
    result = bytearray(data)
    for _ in range(rng.randint(1, 6)):
        at, length = rng.randrange(12, len(result)), rng.choice((1, 1, 2, 4, 40, 400))
        part = bytes(result[at : at + length])
        noise = bytes(rng.randrange(256) for _ in part)
        result[at : at + length] = rng.choice((noise, b"", 2 * part, b"\xff" * len(part), bytes(len(part))))
    return bytes(result[: rng.randrange(len(result))] if rng.random() < 0.1 else result)


@pytest.mark.parametrize("name", FUZZED)
def test_damaged_files_give_depth_or_one_line(tmp_path: Path, name: str) -> None:
    rng, path, outcomes, lines = random.Random(name), tmp_path / name, set(), []
    for _ in range(200):
        path.write_bytes(damage(FUZZED[name], rng))
        try:
            found = read_embedded(path)
        except InputError as error:
            outcomes.add("refused")
            lines.append(str(error))
            continue
        outcomes.add("none" if found is None else "depth")
        if found is not None:
            values = found.estimate.values
            assert values.ndim == 2
            assert 0 < values.size < 1e6
            assert not np.isinf(values).any()
    assert {"refused", "depth"} <= outcomes
    assert not any("\n" in line for line in lines)
