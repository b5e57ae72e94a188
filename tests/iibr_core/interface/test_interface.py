import re
import subprocess
import sys
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from scipy.ndimage import shift

import iibr_core as iibr
from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.formats.images.write import write_image
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.inpainting.registry import INPAINTERS
from iibr_core.method.plan import plan_literal
from iibr_core.types import Disparity, GridShape, InputError, Photo
from tests.iibr_core import red_inpainter
from tests.iibr_core.scenes import generate, square_before_wall

PAGE = Path(__file__).parents[3] / "docs" / "python.md"
README = Path(__file__).parents[3] / "README.md"
EXAMPLES = [
    code for page in (PAGE, README) for code in re.findall(r"```python\n(.*?)```", page.read_text("utf-8"), re.DOTALL)
]


@pytest.fixture
def photo_folder(tmp_path, monkeypatch) -> Path:
    photo, disparity = square_before_wall(60, 80)
    write_image(tmp_path / "photo.png", np.round(255 * photo.pixels).astype(np.uint8))
    write_pfm(tmp_path / "photo_disparity.pfm", disparity.values)
    monkeypatch.chdir(tmp_path)
    return tmp_path


def square_scene() -> tuple[np.ndarray, np.ndarray]:
    photo, disparity = square_before_wall(60, 80)
    return photo.pixels, disparity.values


@pytest.mark.parametrize("example", EXAMPLES, ids=range(len(EXAMPLES)))
def test_the_examples_of_the_page_run(example, photo_folder) -> None:
    exec(compile(example, str(PAGE), "exec"), {})


def test_every_public_name_is_described() -> None:
    assert set(dir(iibr)) == set(iibr.__all__)
    assert all(getattr(iibr, name).__doc__ for name in iibr.__all__ if name != "FORMATS")


def test_importing_loads_no_library() -> None:
    code = "import sys, iibr_core; print([m for m in ('numpy', 'numba', 'torch', 'OpenImageIO') if m in sys.modules])"
    assert subprocess.check_output([sys.executable, "-c", code], text=True).strip() == "[]"


def test_literal_parallax_is_the_disparity_that_was_given() -> None:
    pixels, values = square_scene()
    field = iibr.from_arrays(pixels, values).light_field((1, 3), parallax="literal")
    photo, disparity = Photo(pixels, 80.0, "a"), Disparity(values, "a")
    plan = plan_literal(photo, disparity, GridShape(1, 3))
    for view in generate(photo, disparity, plan):
        np.testing.assert_array_equal(field.views[view.row, view.column], view.colors)
    np.testing.assert_array_equal(field.disparity[0, 1], values)


def test_a_view_between_is_what_a_denser_field_has_there() -> None:
    pixels, values = square_scene()
    scene = iibr.from_arrays(pixels, values)
    sparse = scene.light_field(3, parallax="literal")
    dense = iibr.from_arrays(pixels, values / 2).light_field(5, parallax="literal")
    assert iibr.compare(sparse.view(0.5, 0), dense.view(1, 0)).psnr_db > 40


def test_views_between_and_refocusing_inpaint_as_the_stored_views_do(monkeypatch) -> None:
    """The rays are completed once: a view between asks the inpainter for itself alone."""
    offsets: list[tuple[float, float]] = []

    def paint_red(*args) -> None:
        offsets.append(args[4])
        red_inpainter.paint_red(*args)

    monkeypatch.setattr(red_inpainter, "counting", paint_red, raising=False)
    monkeypatch.setitem(INPAINTERS, "red", f"{red_inpainter.__name__}:counting")
    field = iibr.from_arrays(*square_scene()).light_field(5, inpaint="red", parallax="literal")

    def red_pixels(view: np.ndarray) -> int:
        return int(np.all(np.abs(view - [1, 0, 0]) < 0.01, axis=-1).sum())

    stored = red_pixels(field.view(2, 0))
    asked = len(offsets)
    assert stored > 20
    assert red_pixels(field.view(1.999, 0)) == pytest.approx(stored, abs=3)
    assert all(max(map(abs, offset)) < 2 for offset in offsets[asked:]), "no corner view is made again"
    reddish = field.refocus(0.0, 4.0)
    assert (reddish[..., 0] - reddish[..., 1:].max(axis=-1)).max() > 0.4


def test_refocusing_is_the_mean_of_the_views_inside_the_aperture() -> None:
    """A plain sum of views made at the cameras' places, by another way of moving them."""
    pixels, values = square_scene()
    field = iibr.from_arrays(pixels, values).light_field(5, parallax="literal")
    total, cameras = np.zeros_like(pixels, np.float64), 0
    for t, s in product(np.linspace(-0.75, 0.75, 9), repeat=2):
        if np.hypot(t, s) <= 0.75:
            light = linear_from_srgb(field.view(s, t))
            total += shift(light, (2.0 * t, 2.0 * s, 0), order=3, mode="nearest")
            cameras += 1
    expected, drawn = srgb_from_linear(total / cameras), field.refocus(2.0, 1.5)
    assert iibr.compare(drawn[8:-8, 8:-8], expected[8:-8, 8:-8].astype(np.float32)).psnr_db > 38


def test_refocusing_reports_progress_and_stops():
    field, reports = iibr.from_arrays(*square_scene()).light_field(3), []
    field.refocus(0.0, 1.0, 20, report_progress=lambda done, total, doing: reports.append((doing, done, total)))
    doing, done, total = reports[-1]
    assert (doing, done) == ("refocusing", total - 1)
    assert [each[1] for each in reports if each[0] == "refocusing"] == list(range(total))
    with pytest.raises(iibr.Cancelled):
        field.refocus(0.0, 1.0, should_stop=lambda: True)


def test_choices_of_the_lens_that_change_nothing_warn():
    field = iibr.from_arrays(*square_scene()).light_field(3)
    with pytest.warns(UserWarning, match="closed lens shows nothing of shape"):
        field.refocus(aperture=0.0, blades=5)


@pytest.mark.parametrize("format", iibr.FORMATS)
def test_saved_fields_open_again_and_are_refocused_from_their_stored_views(format, tmp_path) -> None:
    pixels, values = square_scene()
    made = iibr.from_arrays(pixels, values).light_field(5, parallax="literal")
    path = tmp_path / ("a_eslf.png" if format == "eslf" else "a")
    made.save(path, format)
    with pytest.raises(InputError, match="already exists"):
        made.save(path, format)
    made.save(path, format, may_replace=True)
    scene = iibr.open(path)
    reports: list[tuple[float, float]] = []
    for grid in (None, 5):
        read = scene.light_field(grid, report_progress=lambda done, total, doing: reports.append((done, total)))
        np.testing.assert_array_equal(read.views, made.views)
    assert reports == [(done, 25) for done in range(1, 26)] * 2
    assert scene.depth_source == ("the light field" if format == "hci" else "none")
    assert iibr.compare(read.refocus(float(values.min()), 3.0), made.refocus(float(values.min()), 3.0)).psnr_db > 30
    np.testing.assert_array_equal(read.refocus(0.0, 0.0), read.view(0, 0))
    for place in ((2.5, 0), (0, -2.5), (0.5, 0)):
        with pytest.raises(InputError, match="view"):
            read.view(*place)
    for options in ({"parallax": "literal"}, {"depth_strength": 2.0}):
        with pytest.raises(InputError, match="are for photos"):
            scene.light_field(**options)


def test_views_come_once_the_middle_one_first() -> None:
    scene = iibr.from_arrays(*square_scene())
    views = list(scene.views((3, 5), depth_strength=0.5))
    assert (views[0].row, views[0].column) == scene.plan((3, 5)).grid.centre
    assert {(view.row, view.column) for view in views} == set(np.ndindex(3, 5))
    whole = scene.light_field((3, 5), depth_strength=0.5)
    np.testing.assert_array_equal(np.round(255 * whole.view(2, -1)), whole.views[0, 4], "to the right and down")
    np.testing.assert_array_equal(np.round(255 * whole.view(0, 0)), np.round(255 * scene.photo))
    np.testing.assert_array_equal(whole.views[2, 4], next(v for v in views if (v.row, v.column) == (2, 4)).colors)
    assert scene.plan(3, depth_strength=0.5).disparity_scale == 0.5 * scene.plan(3).disparity_scale


def test_pictures_of_all_kinds_of_numbers_are_taken() -> None:
    pixels, values = square_scene()
    one = iibr.from_arrays(pixels, values)
    other = iibr.from_arrays((255 * pixels).round().astype("u1"), values, 70.0, "b")
    np.testing.assert_allclose(one.photo, other.photo, atol=0.51 / 255)
    assert (other.focal_px, other.name) == (70, "b")
    assert one.focal_px == pytest.approx(80 / 2 / np.tan(np.deg2rad(25)))
    bright = iibr.from_arrays(pixels * 4, values).light_field((1, 3))
    assert (bright.views.dtype, one.light_field((1, 3)).views.dtype) == (np.float16, np.uint8)
    same = iibr.compare(pixels, pixels)
    assert (same.psnr_db, same.ssim, same.flip) == (np.inf, pytest.approx(1), 0)
    assert iibr.compare(pixels, pixels + 0.1).psnr_db == pytest.approx(20, abs=0.01)


ONE_VIEW = np.zeros((1, 1, 6, 8, 3), np.uint8)
BAD = {
    "a disparity of another size": lambda p, d: iibr.from_arrays(p, d[1:]),
    "an unknown disparity": lambda p, d: iibr.from_arrays(p, np.where(d > 1, np.nan, d)),
    "a colour that is infinite": lambda p, d: iibr.from_arrays(np.where(p > 0.5, np.inf, p), d),
    "half a view": lambda p, d: iibr.from_arrays(p, d).light_field((2.5, 1)),
    "literal without a grid": lambda p, d: iibr.from_arrays(p, d).light_field(parallax="literal"),
    "a view outside": lambda p, d: iibr.from_arrays(p, d).light_field(3).view(1.5, 0),
    "a negative aperture": lambda p, d: iibr.from_arrays(p, d).light_field(3).refocus(0, -1),
    "two places in focus": lambda p, d: iibr.from_arrays(p, d).light_field(3).refocus(0.0, at=(1, 1)),
    "a place outside": lambda p, d: iibr.from_arrays(p, d).light_field(3).refocus(at=(80, 1), f_number=2),
    "an f-number without depth": lambda p, d: iibr.LightField(ONE_VIEW, None, None, 8.0).refocus(f_number=2),
    "a lens wider than stored views": lambda p, d: iibr.LightField(ONE_VIEW, None, None, 8.0).refocus(0.0, 1.1),
    "a photo that is not there": lambda p, d: iibr.open("nowhere.png"),
    "literal with a strength": lambda p, d: iibr.from_arrays(p, d).light_field(3, parallax="literal", depth_strength=2),
    "a layout that is none": lambda p, d: iibr.from_arrays(p, d).light_field(3).save("a", "zip"),
}


@pytest.mark.parametrize("call", BAD.values(), ids=BAD)
def test_what_means_nothing_is_refused_in_one_line(call, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as refusal:
        call(*square_scene())
    assert "\n" not in str(refusal.value)
    assert not list(tmp_path.iterdir())


def test_stopping_raises_cancelled(tmp_path) -> None:
    scene, made = iibr.from_arrays(*square_scene()), 0
    with pytest.raises(iibr.Cancelled):
        scene.light_field(3, should_stop=lambda: True)
    scene.light_field(3).save(tmp_path / "field")

    def count(*_: object) -> None:
        nonlocal made
        made += 1

    with pytest.raises(iibr.Cancelled):
        iibr.open(tmp_path / "field").light_field(5, should_stop=lambda: made > 3, report_progress=count)


def test_depth_is_estimated_by_contours_alone_and_photos_are_read_smaller(photo_folder) -> None:
    assert iibr.open(photo_folder / "photo.png", max_pixels=1200).photo.shape == (30, 40, 3)
    pixels, _ = square_scene()
    guess = iibr.estimate_depth(pixels, "guess")
    assert guess.shape == (60, 80)
    assert guess[-10:].mean() > guess[:10].mean(), "the ground is near"
    with pytest.raises(InputError, match="no-such-model"):
        iibr.estimate_depth(pixels, "no-such-model")
