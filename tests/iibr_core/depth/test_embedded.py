import random

import numpy as np
import pytest

from iibr_core.depth.embedded.apple import heic_estimate
from iibr_core.depth.embedded.embedded import embedded_in_jpeg, read_embedded
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
    return files.with_segments(files.grey_photo(SIZE), files.gdepth_segments(depth, **options))


def relative(data: bytes) -> np.ndarray:
    found = embedded_in_jpeg(data)
    assert found.estimate.meaning == "inverse depth"
    assert found.estimate.values.dtype == np.float32
    return found.estimate.values


# ---- Google


@pytest.mark.parametrize("part_bytes", [None, 100])
@pytest.mark.parametrize("kind", ["RangeInverse", "RangeLinear"])
@pytest.mark.parametrize("stored", [STORED, DEEP])
def test_gdepth_is_read_by_its_formula(stored, kind, part_bytes) -> None:
    found = relative(gdepth(files.picture(stored, "PNG"), kind=kind, part_bytes=part_bytes))
    np.testing.assert_allclose(found, inverse_of(stored, kind), rtol=1e-5)


@pytest.mark.parametrize(("units", "scale"), [("m", 1.0), ("Meters", 1.0), ("mm", 1e-3), ("furlongs", None)])
def test_units_tell_metres_from_a_mere_scale(units, scale) -> None:
    found = embedded_in_jpeg(gdepth(units=units))
    assert found.estimate.meaning == ("metres" if scale else "inverse depth")
    if scale:
        np.testing.assert_allclose(found.estimate.values, scale / inverse_of(STORED), rtol=1e-5)


def test_an_inverse_range_may_reach_to_infinity() -> None:
    np.testing.assert_allclose(relative(gdepth(far="Infinity")), (1 - STORED / 255) / NEAR, atol=1e-6)
    metric = embedded_in_jpeg(gdepth(far="inf", units="m"))
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
@pytest.mark.parametrize("trailers", [{}, {"between": b"other"}, {"before": files.grey_photo((3, 4)), "behind": b"."}])
def test_dynamic_depth_is_found_among_trailers(trailers, shared_container) -> None:
    data = files.dynamic_depth_jpeg(
        files.grey_photo(SIZE), files.picture(STORED, "PNG"), shared_container=shared_container, **trailers
    )
    found = embedded_in_jpeg(data)
    assert found.estimate.meaning == "metres"
    assert found.format == "Dynamic Depth"
    np.testing.assert_allclose(1 / found.estimate.values, inverse_of(STORED), rtol=1e-5)


# ---- Apple and Samsung


@pytest.mark.parametrize("kind", ["disparity", "depth"])
def test_a_portrait_saved_as_jpeg(kind) -> None:
    smooth = np.tile(np.linspace(0, 255, SIZE[1]).astype(np.uint8), (SIZE[0], 1))
    found = relative(files.apple_jpeg(files.grey_photo(SIZE) + b"padding", smooth, 0.5, 2.5, kind))
    linear = 0.5 + smooth / 255 * 2.0
    np.testing.assert_allclose(found, linear if kind == "disparity" else 1 / linear, atol=0.03)


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


@pytest.mark.parametrize("audio", [False, True])
def test_samsung_live_focus(audio) -> None:
    found = relative(files.samsung_jpeg(files.grey_photo(SIZE), STORED, audio=audio))
    np.testing.assert_allclose(found, 1 - STORED / 255, atol=1e-6)


# ---- what is wrong


PNG = files.picture(STORED, "PNG")


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
