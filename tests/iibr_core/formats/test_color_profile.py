import struct
from io import BytesIO

import numpy as np
import pytest
import tifffile
from PIL import Image, ImageCms

from iibr_core.color import linear_from_srgb
from iibr_core.formats.images.color_profile import read_profile
from iibr_core.formats.images.photo import read_photo
from iibr_core.types import SRGB

P3 = ((0.51512, 0.24120, -0.00105), (0.29198, 0.69225, 0.04189), (0.15710, 0.06657, 0.78407))
"""XYZ under D50 of Display P3's red, green and blue, as in Apple's profile."""
ADOBE = ((0.60974, 0.31111, 0.01947), (0.20528, 0.62567, 0.06087), (0.14919, 0.06322, 0.74457))
SRGB_PRIMARIES = tuple(zip(*SRGB.xyz_from_linear))
SRGB_CURVE = ("para", 3, (2.4, 1 / 1.055, 0.055 / 1.055, 1 / 12.92, 0.04045))
RNG = np.random.default_rng(4)
COLORS = RNG.integers(0, 256, (40, 60, 3), np.uint8)


def fixed(*values):
    return b"".join(struct.pack(">i", round(65536 * value)) for value in values)


def curve_tag(kind, which, values):
    """ "para", kind of formula, parameters; or "curv", number of entries, entries."""
    if kind == "para":
        return b"para" + bytes(4) + struct.pack(">HH", which, 0) + fixed(*values)
    return b"curv" + bytes(4) + struct.pack(f">I{len(values)}H", which, *values)


def profile_bytes(primaries=P3, curve=SRGB_CURVE, space=b"RGB ", name="made here", leave_out=()):
    text = name.encode("utf-16-be")
    description = b"mluc" + bytes(4) + struct.pack(">II", 1, 12) + b"enUS" + struct.pack(">II", len(text), 28) + text
    tags = {b"desc": description, b"cprt": description, b"wtpt": b"XYZ " + bytes(4) + fixed(0.9642, 1, 0.8249)}
    for channel, xyz in zip("rgb", primaries):
        tags[f"{channel}XYZ".encode()] = b"XYZ " + bytes(4) + fixed(*xyz)
        tags[f"{channel}TRC".encode()] = curve_tag(*curve)
    tags = {signature: data + bytes(-len(data) % 4) for signature, data in tags.items() if signature not in leave_out}
    at = 132 + 12 * len(tags)
    table, body = struct.pack(">I", len(tags)), b""
    for signature, data in tags.items():
        table += struct.pack(">4sII", signature, at + len(body), len(data))
        body += data
    header = struct.pack(">I4s4s4s4s4s12s4s", at + len(body), b"", b"\4\x30\0\0", b"mntr", space, b"XYZ ", b"", b"acsp")
    return header + bytes(28) + fixed(0.9642, 1, 0.8249) + bytes(128 - len(header) - 40) + table + body


def grey_profile(curve):
    data = profile_bytes(curve=curve, space=b"GRAY", leave_out=(b"gTRC", b"bTRC"))
    return data.replace(b"rTRC", b"kTRC")


def converted(colors, data):
    """By Pillow (littleCMS), which has 8 bits."""
    source = ImageCms.ImageCmsProfile(BytesIO(data))
    target = ImageCms.createProfile("sRGB")
    intent = ImageCms.Intent.RELATIVE_COLORIMETRIC
    return np.asarray(ImageCms.profileToProfile(Image.fromarray(colors), source, target, intent))


CURVES = {
    "sRGB": SRGB_CURVE,
    "linear": ("curv", 0, ()),
    "table": ("curv", 1024, tuple(np.rint(65535 * np.linspace(0, 1, 1024) ** 1.8).astype(int))),
    "raised": ("para", 4, (2.4, 0.9, 0.05, 0.5, 0.04, 0.01, 0.0)),
    "shifted": ("para", 1, (2.0, 1.1, -0.1)),
    "lifted": ("para", 2, (2.0, 0.9, -0.05, 0.05)),
}


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
def test_photos_are_converted_as_littlecms_does(tmp_path, curve):
    data = profile_bytes(P3 if curve == SRGB_CURVE else ADOBE, curve)
    Image.fromarray(COLORS).save(tmp_path / "a.png", icc_profile=data)
    photo = read_photo(tmp_path / "a.png")
    difference = np.abs(255 * photo.pixels - converted(COLORS, data).astype(float))
    assert difference.max() < 1.6, "its eight bits are rounded, ours are not"
    assert photo.notes == ("Colours are those of the photo's profile, 'made here'.",)
    assert photo.color_space == SRGB
    assert not photo.is_hdr


@pytest.mark.parametrize("curve", CURVES.values(), ids=CURVES)
@pytest.mark.parametrize("is_grey", [False, True])
def test_the_curve_of_a_profile_counts_for_floats_too(tmp_path, curve, is_grey):
    stored = np.where(RNG.random(COLORS.shape) < 0.1, 1.5, COLORS / 255).astype(np.float32)
    stored, data = (stored[..., :1], grey_profile(curve)) if is_grey else (stored, profile_bytes(ADOBE, curve))
    kind = "minisblack" if is_grey else "rgb"
    tifffile.imwrite(tmp_path / "a.tif", stored, photometric=kind, extratags=[(34675, 7, len(data), data, True)])
    photo = read_photo(tmp_path / "a.tif", keeps_primaries=True)
    read = linear_from_srgb(photo.pixels)
    profile = read_profile(data, is_grey)[0]
    channels = zip(np.moveaxis(np.broadcast_to(stored, COLORS.shape), 2, 0), profile.curves)
    expected = np.stack([np.interp(values, np.linspace(0, 1, 65536), curve) for values, curve in channels], -1)
    is_white = np.broadcast_to(stored > 1, expected.shape)
    np.testing.assert_allclose(read[~is_white], expected[~is_white], atol=1e-3)
    assert (read[is_white] > expected[is_white]).all()


@pytest.mark.parametrize(
    "data",
    [profile_bytes(SRGB_PRIMARIES, name="sRGB IEC61966-2.1"), profile_bytes(SRGB_PRIMARIES),
     ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes()], ids=["named", "unnamed", "littleCMS"],
)  # fmt: skip
def test_srgb_passes_untouched(tmp_path, data):
    Image.fromarray(COLORS).save(tmp_path / "a.png", icc_profile=data)
    photo = read_photo(tmp_path / "a.png")
    assert np.array_equal(np.rint(255 * photo.pixels), COLORS)
    assert photo.notes == ()


BAD = {
    "empty": b"",
    "cut off in its table": profile_bytes()[:170],
    "cut off in its curves": profile_bytes()[:-60],
    "garbage": bytes(RNG.integers(0, 256, 3000, np.uint8)),
    "CMYK": profile_bytes(space=b"CMYK"),
    "tables only": profile_bytes(leave_out=(b"rXYZ",)),
    "no curve": profile_bytes(leave_out=(b"gTRC",)),
    "primaries on a line": profile_bytes((P3[0], P3[0], P3[1])),
    "absurd table": profile_bytes(curve=("curv", 2**31, (1, 2))),
    "absurd power": profile_bytes(curve=("para", 0, (-2.0,))),
    "larger than any": profile_bytes() + bytes(5 * 2**20),
}


LOST = "empty", "cut off in its table", "cut off in its curves", "garbage", "CMYK"
"""Bad profiles that the library for PNG drops before we can say why."""


@pytest.mark.parametrize("name", BAD)
def test_unusable_profiles_are_refused_and_photos_with_them_count_as_srgb(tmp_path, name):
    data = BAD[name]
    profile, reason = read_profile(data)
    assert profile is None
    assert reason
    if len(data) > 10**6:  # readers cut it to the size that its header states
        return
    Image.fromarray(COLORS).save(tmp_path / "a.png", icc_profile=data)
    photo = read_photo(tmp_path / "a.png")
    assert np.array_equal(np.rint(255 * photo.pixels), COLORS)
    note = f"The colour profile 'made here' {reason} and is ignored: colours are taken as sRGB."
    assert photo.notes == (() if name in LOST else (note,))
