"""Photos in and pictures out: every kind of file is made here, read back and compared with what was meant."""

import io
import math
import struct
import zlib

import numpy as np
import OpenImageIO as oiio
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image, ImageCms

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.formats.images import oiio_reader
from iibr_core.formats.images.photo import (
    FILM_DIAGONAL_MM,
    focal_px_from_fov,
    read_photo,
    size_within,
    upright,
    write_image,
)
from iibr_core.formats.images.pillow_reader import raster_of
from iibr_core.types import ImageSize, InputError

RNG = np.random.default_rng(7)
RGB = RNG.integers(0, 256, (13, 17, 3), dtype=np.uint8)


def save(path, pixels, kind=None, **attributes):
    pixels = np.atleast_3d(pixels)
    kind = kind or ("float" if pixels.dtype == np.float32 else str(pixels.dtype))
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], pixels.shape[2], kind)
    for name, value in attributes.items():
        spec.attribute(name.replace("__", ":"), value)
    output = oiio.ImageOutput.create(str(path))
    assert output.open(str(path), spec), output.geterror()
    assert output.write_image(np.ascontiguousarray(pixels))
    output.close()
    return path


def area_average(linear, size):
    """Slow twin: overlap of every source pixel with every target pixel, in float64."""

    def overlaps(source, target):
        edges = np.arange(target + 1) * source / target
        low = np.maximum(edges[:-1, None], np.arange(source))
        high = np.minimum(edges[1:, None], np.arange(1, source + 1))
        return np.maximum(high - low, 0) * target / source

    rows, columns = overlaps(linear.shape[0], size[0]), overlaps(linear.shape[1], size[1])
    return np.einsum("ij,jkc,lk->ilc", rows, linear.astype(np.float64), columns)


@pytest.mark.parametrize("name", ["a.png", "a.tif", "a.bmp", "a.ppm"])
def test_8_bit_values_pass_untouched(tmp_path, name):
    photo = read_photo(save(tmp_path / name, RGB))
    assert photo.pixels.dtype == np.float32
    assert np.array_equal(np.round(photo.pixels * 255), RGB)
    assert (photo.name, photo.is_hdr, photo.notes) == ("a", False, ())


@pytest.mark.parametrize(("name", "options"), [("a.webp", {"lossless": True}), ("a.jpg", {"quality": 100})])
def test_compressed_formats(tmp_path, name, options):
    smooth = np.dstack(np.broadcast_arrays(np.arange(40)[:, None] * 5, np.arange(60) * 3, 128)).astype(np.uint8)
    Image.fromarray(smooth).save(tmp_path / name, **options)
    assert np.abs(read_photo(tmp_path / name).pixels * 255 - smooth).max() < 5


def test_16_bit_keeps_its_precision(tmp_path):
    pixels = RNG.integers(0, 65536, (5, 7, 3), dtype=np.uint16)
    photo = read_photo(save(tmp_path / "a.png", pixels))
    assert np.abs(photo.pixels - pixels / 65535.0).max() < 1e-6


@pytest.mark.parametrize("name", ["a.png", "a.tif", "a.exr"])
def test_grey_becomes_rgb(tmp_path, name):
    grey = RNG.random((5, 7)).astype(np.float32)
    pixels = read_photo(save(tmp_path / name, grey, "float" if name.endswith("exr") else "uint8")).pixels
    assert pixels.shape == (5, 7, 3)
    assert np.array_equal(pixels[..., 0], pixels[..., 1])
    assert np.array_equal(pixels[..., 0], pixels[..., 2])


@pytest.mark.parametrize("name", ["a.png", "a.tif", "a.webp"])
def test_alpha_is_dropped_over_black_in_linear_light(tmp_path, name):
    rgba = np.dstack([RGB, np.full(RGB.shape[:2], 255, np.uint8)])
    rgba[2:5, :, 3] = 128
    rgba[5:7, :, 3] = 0
    Image.fromarray(rgba).save(tmp_path / name, **({"lossless": True, "exact": True} if name == "a.webp" else {}))
    photo = read_photo(tmp_path / name)
    expected = srgb_from_linear(linear_from_srgb(rgba[..., :3] / 255) * (rgba[..., 3:] / 255))
    assert np.abs(photo.pixels - expected).max() < 1e-5
    assert len(photo.notes) == 1
    assert "black" in photo.notes[0]


def test_opaque_alpha_changes_nothing_and_says_nothing(tmp_path):
    rgba = np.dstack([RGB, np.full(RGB.shape[:2], 255, np.uint8)])
    photo = read_photo(save(tmp_path / "a.png", rgba))
    assert np.abs(photo.pixels * 255 - RGB).max() < 1e-3
    assert photo.notes == ()


def test_grey_with_alpha(tmp_path):
    pixels = np.dstack([RGB[..., 0], np.full(RGB.shape[:2], 255, np.uint8)])
    Image.fromarray(pixels, "LA").save(tmp_path / "a.png")
    assert np.abs(read_photo(tmp_path / "a.png").pixels[..., 2] * 255 - RGB[..., 0]).max() < 1e-3


@pytest.mark.parametrize("name", ["a.png", "a.gif", "a.tif"])
def test_palette(tmp_path, name):
    indexed = Image.fromarray(RGB).quantize(16)
    indexed.save(tmp_path / name)
    found = np.round(read_photo(tmp_path / name).pixels * 255)
    assert np.abs(found - np.asarray(indexed.convert("RGB"))).max() <= 1


@pytest.mark.parametrize("name", ["a.jpg", "a.tif"])
def test_cmyk(tmp_path, name):
    flat = Image.new("RGB", (16, 16), (200, 100, 50))
    flat.convert("CMYK").save(tmp_path / name)
    photo = read_photo(tmp_path / name)
    assert np.abs(photo.pixels * 255 - (200, 100, 50)).max() < 3
    assert "CMYK" in photo.notes[0]


@pytest.mark.parametrize("name", ["a.exr", "a.tif", "a.hdr"])
def test_float_files_hold_linear_light(tmp_path, name):
    linear = RNG.uniform(0.1, 6, (5, 9, 3)).astype(np.float32)
    photo = read_photo(save(tmp_path / name, linear))
    assert photo.is_hdr
    # .hdr keeps one exponent for the three channels of a pixel.
    assert (np.abs(linear_from_srgb(photo.pixels) - linear) <= linear.max(axis=2, keepdims=True) / 128).all()
    assert not read_photo(save(tmp_path / f"dark-{name}", linear / 10)).is_hdr


def test_hdr_with_nan_and_inf_is_finite(tmp_path):
    linear = np.full((4, 5, 3), 0.25, np.float32)
    linear[0, 0] = (np.nan, np.inf, -np.inf)
    linear[1, 1] = (7.0, -3.0, 0.25)
    photo = read_photo(save(tmp_path / "a.exr", linear))
    assert np.isfinite(photo.pixels).all()
    assert np.allclose(photo.pixels[0, 0], srgb_from_linear(np.array([0, 7.0, 0])))
    assert photo.pixels.min() == 0
    assert any(note.startswith("1 pixels held NaN or infinity") for note in photo.notes)


def test_nan_in_alpha_is_transparent(tmp_path):
    rgba = np.full((3, 4, 4), 0.5, np.float32)
    rgba[1, 2, 3] = np.nan
    path = save(tmp_path / "a.tif", rgba, oiio__UnassociatedAlpha=1)
    found = read_photo(path).pixels
    assert np.allclose(found[0], srgb_from_linear(np.float32(0.25)))
    assert not found[1, 2].any()


def test_hdr_of_nothing_finite(tmp_path):
    photo = read_photo(save(tmp_path / "a.exr", np.full((3, 3, 3), np.inf, np.float32)))
    assert np.allclose(photo.pixels, 1)


@pytest.mark.parametrize("size", [(1, 1), (1, 31), (31, 1), (7, 11), (127, 3)])
@pytest.mark.parametrize("name", ["a.png", "a.exr", "a.jpg"])
def test_odd_sizes(tmp_path, size, name):
    pixels = np.full((*size, 3), 0.5, np.float32)
    photo = read_photo(save(tmp_path / name, pixels, "float" if name == "a.exr" else "uint8"))
    assert photo.size == size
    assert np.ptp(photo.pixels) < 0.01


# Exif 2.3: where the stored row 0 and column 0 belong in the upright picture.
ORIENTATIONS = {
    1: ("top", "left"),
    2: ("top", "right"),
    3: ("bottom", "right"),
    4: ("bottom", "left"),
    5: ("left", "top"),
    6: ("right", "top"),
    7: ("right", "bottom"),
    8: ("left", "bottom"),
}


@pytest.mark.parametrize("orientation", ORIENTATIONS)
def test_exif_orientation(tmp_path, orientation):
    found = read_photo(save(tmp_path / "a.tif", RGB, Orientation=orientation)).pixels
    row_side, column_side = ORIENTATIONS[orientation]
    stored_height, stored_width = RGB.shape[:2]
    height, width = (stored_width, stored_height) if row_side in ("left", "right") else (stored_height, stored_width)
    expected = np.empty((height, width, 3))
    for i in range(stored_height):
        for j in range(stored_width):
            place = {"top": 0, "left": 0, "bottom": height - 1, "right": width - 1}
            y = {"top": i, "bottom": place["bottom"] - i}.get(row_side)
            x = {"left": i, "right": place["right"] - i}.get(row_side)
            y = {"top": j, "bottom": place["bottom"] - j}.get(column_side, y)
            x = {"left": j, "right": place["right"] - j}.get(column_side, x)
            expected[y, x] = RGB[i, j]
    assert np.array_equal(np.round(found * 255), expected)


def test_orientation_out_of_range_is_ignored():
    assert np.array_equal(upright(RGB, 0), RGB)
    assert np.array_equal(upright(RGB, 99), RGB)


def test_focal_length_without_exif_is_50_degrees(tmp_path):
    photo = read_photo(save(tmp_path / "a.png", RGB))
    assert math.degrees(2 * math.atan(17 / 2 / photo.focal_px)) == pytest.approx(50)
    assert read_photo(tmp_path / "a.png", fov_deg=90).focal_px == pytest.approx(8.5)


def test_focal_length_from_35_mm_equivalent(tmp_path):
    path = save(tmp_path / "a.jpg", np.zeros((200, 300, 3), np.uint8), Exif__FocalLengthIn35mmFilm=50)
    assert read_photo(path).focal_px == pytest.approx(50 / FILM_DIAGONAL_MM * math.hypot(200, 300), rel=1e-5)
    smaller = read_photo(path, max_pixels=15_000)
    assert smaller.size == (100, 150)
    assert smaller.focal_px == pytest.approx(read_photo(path).focal_px / 2, rel=1e-5)


@pytest.mark.parametrize(("unit", "unit_mm"), [(2, 25.4), (3, 10.0)])
def test_focal_length_from_focal_plane(tmp_path, unit, unit_mm):
    attributes = {
        "Exif__FocalLength": 20.0,
        "Exif__FocalPlaneXResolution": 1000.0,
        "Exif__FocalPlaneResolutionUnit": unit,
        "Exif__PixelXDimension": 600,
    }
    path = save(tmp_path / "a.jpg", np.zeros((200, 300, 3), np.uint8), **attributes)
    assert read_photo(path).focal_px == pytest.approx(20 * 1000 / unit_mm / 2, rel=1e-4)


@pytest.mark.parametrize("focal", [0.0, 1e9])
def test_nonsense_focal_length_is_ignored(tmp_path, focal):
    attributes = {"Exif__FocalLength": focal, "Exif__FocalPlaneXResolution": 1000.0}
    path = save(tmp_path / "a.jpg", np.zeros((20, 30, 3), np.uint8), **attributes)
    assert read_photo(path).focal_px == pytest.approx(focal_px_from_fov(30))


def test_foreign_colour_profile_is_noted(tmp_path):
    for kind, count in (("XYZ", 1), ("sRGB", 0)):
        profile = ImageCms.ImageCmsProfile(ImageCms.createProfile(kind)).tobytes()
        Image.fromarray(RGB).save(tmp_path / "a.jpg", icc_profile=profile)
        assert len(read_photo(tmp_path / "a.jpg").notes) == count


@pytest.mark.parametrize("max_pixels", [1, 5, 40, 100, 220])
def test_downsampling_averages_linear_light_by_area(tmp_path, max_pixels):
    photo = read_photo(save(tmp_path / "a.png", RGB), max_pixels=max_pixels)
    assert photo.pixels.shape[0] * photo.pixels.shape[1] <= max_pixels
    expected = area_average(linear_from_srgb(RGB / 255), photo.size)
    assert np.allclose(linear_from_srgb(photo.pixels), expected, atol=2e-5)
    assert "17x13" in photo.notes[0]


def test_downsampling_in_several_bands(tmp_path):
    pixels = RNG.random((211, 53, 3)).astype(np.float32)
    photo = read_photo(save(tmp_path / "a.exr", pixels), max_pixels=3000)
    assert np.allclose(linear_from_srgb(photo.pixels), area_average(pixels, photo.size), atol=2e-5)


def test_one_bright_pixel_does_not_disturb_its_row(tmp_path):
    pixels = np.ones((8, 64, 3), np.float32)
    pixels[0, 0] = 1e30
    photo = read_photo(save(tmp_path / "a.exr", pixels), max_pixels=128)
    assert np.array_equal(photo.pixels[1:], np.full_like(photo.pixels[1:], photo.pixels[-1, -1, 0]))
    assert np.allclose(photo.pixels[0, 1:], 1)


@given(st.integers(1, 10**5), st.integers(1, 10**5), st.integers(1, 10**7))
def test_size_within_fits_and_keeps_its_shape(height, width, max_pixels):
    new_height, new_width = size_within(ImageSize(height, width), max_pixels)
    assert 1 <= new_height <= height
    assert 1 <= new_width <= width
    assert new_height * new_width <= max_pixels
    if min(new_height, new_width) > 100:
        assert abs(new_width * height / (new_height * width) - 1) < 0.02


def test_max_pixels_of_zero_is_refused(tmp_path):
    with pytest.raises(InputError, match="--max-pixels 0"):
        read_photo(save(tmp_path / "a.png", RGB), max_pixels=0)


def test_missing_folder_empty_or_no_picture(tmp_path):
    (tmp_path / "empty.png").touch()
    (tmp_path / "text.jpg").write_text("this is no picture")
    (tmp_path / "notes.txt").write_text("this is no picture")
    (tmp_path / "folder.png").mkdir()
    for name, reason in [
        ("notes.txt", "is a text file, not a picture"),
        ("none.png", "no such file"),
        ("empty.png", "empty"),
        ("text.jpg", "is a text file, not a picture"),
        ("folder.png", "is a folder"),
    ]:
        with pytest.raises(InputError, match=reason) as caught:
            read_photo(tmp_path / name)
        assert str(tmp_path / name) in str(caught.value)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("share", [0.01, 0.3, 0.6, 0.95])
@pytest.mark.parametrize("name", ["a.png", "a.jpg", "a.tif", "a.exr", "a.webp"])
def test_truncated_files(tmp_path, name, share, capfd):
    pixels = RNG.integers(0, 256, (64, 64, 3), dtype=np.uint8)
    path = save(tmp_path / name, pixels)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(len(whole) * share)])
    with pytest.raises(InputError, match=rf"{name}: (damaged|cannot be read)") as caught:
        read_photo(path)
    assert str(caught.value).count(name) == 1
    assert capfd.readouterr().err == ""


def test_padded_jpeg_is_read(tmp_path):
    buffer = io.BytesIO()
    Image.fromarray(RGB).save(buffer, "jpeg")
    whole = buffer.getvalue()
    assert whole.endswith(b"\xff\xd9")
    (tmp_path / "a.jpg").write_bytes(whole[:-2] + b"\0" * 40 + whole[-2:])
    assert read_photo(tmp_path / "a.jpg").size == (13, 17)


def test_hostile_sizes_are_refused_by_header(tmp_path):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))

    header = chunk(b"IHDR", struct.pack(">IIBBBBB", 60000, 60000, 8, 2, 0, 0, 0))
    png = b"\x89PNG\r\n\x1a\n" + header + chunk(b"IDAT", zlib.compress(b"\0" * 9)) + chunk(b"IEND", b"")
    (tmp_path / "a.png").write_bytes(png)
    with pytest.raises(InputError, match=r"a\.png: cannot be read"):
        read_photo(tmp_path / "a.png")


def test_too_many_pixels_are_refused_before_decoding(tmp_path, monkeypatch):
    path = save(tmp_path / "a.ppm", RGB)
    path.write_bytes(path.read_bytes()[:30])  # decoding would fail
    monkeypatch.setattr(oiio_reader, "MAX_FILE_PIXELS", 13 * 17 - 1)
    with pytest.raises(InputError, match="17x13 exceed 220 pixels"):
        read_photo(path)


@pytest.mark.parametrize("shape", [(5, 7, 3), (5, 7), (1, 1, 3)])
def test_png_round_trip(tmp_path, shape):
    pixels = RNG.integers(0, 256, shape, dtype=np.uint8)
    write_image(tmp_path / "a.png", pixels)
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.png")), pixels)
    write_image(tmp_path / "a.png", pixels.astype(np.float32) / 255)
    assert np.array_equal(np.asarray(Image.open(tmp_path / "a.png")), pixels)


@pytest.mark.parametrize("dtype", [np.float16, np.float32])
def test_exr_holds_linear_light_and_comes_back(tmp_path, dtype):
    encoded = RNG.uniform(0, 3, (5, 7, 3)).astype(dtype)
    write_image(tmp_path / "a.exr", encoded)
    source = oiio.ImageInput.open(str(tmp_path / "a.exr"))
    assert str(source.spec().format) == ("half" if dtype == np.float16 else "float")
    assert np.allclose(source.read_image(), linear_from_srgb(encoded), rtol=1e-3)
    assert np.allclose(read_photo(tmp_path / "a.exr").pixels, encoded, rtol=2e-3, atol=1e-4)


def test_values_outside_the_range_of_the_file_are_clipped(tmp_path):
    wild = np.array([[-1, np.nan, np.inf, 0.5]], np.float32)
    write_image(tmp_path / "a.png", wild)
    assert np.asarray(Image.open(tmp_path / "a.png")).tolist() == [[0, 0, 255, 128]]
    write_image(tmp_path / "a.exr", np.full((2, 2, 3), 60000, np.float16))
    assert np.isfinite(oiio.ImageInput.open(str(tmp_path / "a.exr")).read_image()).all()


def test_metadata_is_written(tmp_path):
    write_image(tmp_path / "a.png", RGB, {"Software": "iibr", "focus": "1.5"})
    assert Image.open(tmp_path / "a.png").text["Software"] == "iibr"


def test_nothing_is_left_where_writing_fails(tmp_path):
    (tmp_path / "taken.png").mkdir()
    for path in (tmp_path / "none" / "a.png", tmp_path / "taken.png", tmp_path / "a.gif"):
        with pytest.raises(InputError, match=path.name):
            write_image(path, RGB)
    assert [path.name for path in tmp_path.iterdir()] == ["taken.png"]


@pytest.mark.parametrize(("told", "taken"), [(None, 1), (0, 1), (1, 1), (2, 2), (8, 8), (9, 1)])
def test_an_orientation_that_there_is_none_of_counts_as_upright(told, taken):
    image = Image.new("RGB", (3, 2))
    if told is not None:
        image.getexif()[0x0112] = told
    assert raster_of(image).spec.get_int_attribute("Orientation") == taken
