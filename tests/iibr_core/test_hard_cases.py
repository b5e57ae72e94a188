"""The hard cases of the design, section 8, by name and the whole way: photo, disparity, plan, every view of the field.

What single steps do with them (readers, candidates, weights, fills) is tested beside those steps. Expected everywhere:
finite values, and what each test's docstring says. Apertures, far offsets on the graphics card and
texture arrays are in tests/viewer/gpu/test_hard_cases_gpu.py, the viewer and its commands in
tests/viewer/test_hard_cases_viewer.py.
"""

from dataclasses import replace

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from iibr_core.color import encoded_from_stored
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.search import find_depth
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.images.write import write_image
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.inpainting.background import fill_background
from iibr_core.inpainting.patch_synthesis import MAX_TEXTURE
from iibr_core.method.ambiguous_rays import FEATURES, SHARE, AmbiguousRays
from iibr_core.method.candidates import find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.light_field import generate
from iibr_core.method.occlusion import view_entropy
from iibr_core.method.plan import plan_for_viewing, plan_literal
from iibr_core.method.ray_transformer import SHAPES, TrainedWeights
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.view import Renderer
from iibr_core.types import (
    Disparity,
    GridShape,
    InputError,
    ViewOffset,
)
from tests.iibr_core.scenes import by_index, disparity_of, photo_of, smooth_texture, square_before_wall

HEIGHT, WIDTH = 20, 26
GRID = GridShape(3, 3)


def field_of(photo, disparity, grid=GRID):
    """The views by index; every number of them is finite and no view is brighter than the photo by more than ringing.

    Colours are stored as floats on the way, for 8 bits would hide what is not finite.
    """
    plan = plan_literal(photo, disparity, grid)
    made = list(generate(replace(photo, is_hdr=True), plan.field_disparity(disparity), plan))
    views = by_index(made)
    assert len(views) == len(made) == grid.rows * grid.columns
    for view in views.values():
        assert view.colors.shape == (*photo.size, 3)
        assert np.isfinite(view.colors).all()
        assert np.isfinite(view.disparity).all()
        assert view.colors.min() >= 0
        assert view.colors.max() <= 1.3 * photo.pixels.max() + 0.01
    return views


def plain_photo():
    return photo_of(smooth_texture(HEIGHT, WIDTH))


def even(value):
    return disparity_of(np.full((HEIGHT, WIDTH), value))


def moved(photo, right, down):
    """What a view shows whose content moved by whole pixels, and where it shows something."""
    height, width = photo.size
    y, x = np.mgrid[0:height, 0:width]
    inside = (x - right >= 0) & (x - right < width) & (y - down >= 0) & (y - down < height)
    return np.roll(photo.pixels, (down, right), axis=(0, 1)), inside


def test_disparity_all_equal():
    """Every view is the photo moved as one, what it does not show is inpainted; for viewing it takes a single view."""
    photo = plain_photo()
    for (row, column), view in field_of(photo, even(2.0)).items():
        truth, inside = moved(photo, -2 * (column - 1), -2 * (row - 1))
        assert np.abs(view.colors - truth)[inside].max() <= 2e-3
        assert not view.inpainted[inside].any()
        assert view.inpainted[~inside].all()
        assert view.disparity == pytest.approx(2.0)
    plan = plan_for_viewing(photo, even(2.0))
    assert plan.grid == (1, 1)
    assert not plan.has_disocclusion


def test_disparity_all_zero():
    """Every view is the photo, exactly."""
    views = field_of(plain_photo(), even(0.0))
    for view in views.values():
        assert (view.colors == views[1, 1].colors).all()
        assert not view.inpainted.any()


@pytest.mark.parametrize("unknown", [np.nan, np.inf, -np.inf])
def test_disparity_with_nan_or_inf(tmp_path, unknown):
    """Unknown values of a file are filled from behind and told."""
    photo, disparity = square_before_wall(HEIGHT, WIDTH)
    holed = disparity.values.copy()
    holed[5:12, 10:14] = unknown
    np.save(tmp_path / "map.npy", holed)
    read = read_disparity(tmp_path / "map.npy", photo.size)
    assert (read.values[np.isfinite(holed)] == holed[np.isfinite(holed)]).all()
    assert any("unknown" in note for note in read.notes)
    field_of(photo, read)


def test_disparity_with_one_outlier_at_1e6(tmp_path):
    """In a file it counts as unknown. As it is, its ray lands nowhere, and the views are those without it but around
    that one pixel, which is a hole now.
    """
    photo, values = plain_photo(), np.zeros((HEIGHT, WIDTH), np.float32)
    values[8, 9] = 1e6
    np.save(tmp_path / "map.npy", values)
    read = read_disparity(tmp_path / "map.npy", photo.size)
    assert (read.values == 0).all()
    assert any("1 values" in note for note in read.notes)
    for index, view in field_of(photo, disparity_of(values)).items():
        if index != GRID.centre:
            far = np.ones(photo.size, np.bool_)
            far[2:15, 3:16] = False
            assert np.abs(view.colors - photo.pixels)[far].max() <= 2e-3
            assert np.abs(view.colors - photo.pixels).max() <= 0.1
            assert np.abs(view.disparity).max() <= 1
    assert plan_for_viewing(photo, disparity_of(values)).grid == (1, 1)


def test_negative_disparity():
    """Farther than what stands still: content moves the other way, and a nearer square still hides the wall."""
    photo, disparity = square_before_wall(HEIGHT, WIDTH, foreground=-1.0, background=-3.0)
    view = field_of(photo, disparity)[1, 2]
    middle = HEIGHT // 2
    assert view.disparity[middle, WIDTH // 2 + 1] == pytest.approx(-1, abs=0.05)
    assert view.colors[middle, WIDTH // 2 + 1] == pytest.approx(photo.pixels[middle, WIDTH // 2], abs=0.02)
    assert view.colors[middle, WIDTH - 3] == pytest.approx(photo.pixels[middle, WIDTH - 6], abs=0.02)


def test_disparity_larger_than_the_image():
    """Nothing of the photo is seen from elsewhere: such views are all hole, and stay black."""
    for index, view in field_of(plain_photo(), even(500.0)).items():
        if index != GRID.centre:
            assert view.inpainted.all()
            assert (view.colors == 0).all()


def test_depth_of_0(tmp_path):
    """No distance at all: unknown, filled from behind. Where every depth is 0 the file is refused by name."""
    depth = np.full((HEIGHT, WIDTH), 4.0, np.float32)
    depth[:, :9] = 1.0
    depth[6:9, 6:9] = 0.0
    write_image(tmp_path / "photo.png", plain_photo().pixels)
    np.save(tmp_path / "a_depth.npy", depth)
    choice = DepthChoice(file=str(tmp_path / "a_depth.npy"), refine=False)
    read = find_depth(tmp_path / "photo.png", plain_photo(), choice).disparity
    assert (read.values[:, :6] > read.values[:, 12:].max()).all()
    field_of(plain_photo(), read)
    np.save(tmp_path / "a_depth.npy", depth * 0)
    with pytest.raises(InputError, match=r"no known value"):
        find_depth(tmp_path / "photo.png", plain_photo(), choice)


@pytest.mark.parametrize("size", [(1, 1), (1, 13), (11, 1), (2, 2), (7, 13), (31, 3)])
def test_tiny_thin_and_prime_sized_images(size):
    """Every size has all its views, and the centre view is the photo."""
    photo = photo_of(np.random.default_rng(0).uniform(0, 1, (*size, 3)))
    disparity = disparity_of(np.random.default_rng(1).uniform(-2, 2, size))
    views = field_of(photo, disparity)
    assert views[GRID.centre].colors == pytest.approx(photo.pixels, abs=1e-3)
    plan_for_viewing(photo, disparity)


def saved_as(kind, folder):
    """A photo file of this kind, and the size it has upright."""
    rgb = (smooth_texture(HEIGHT, WIDTH) * 255).astype(np.uint8)
    image = Image.fromarray(rgb)
    if kind == "EXIF-rotated":
        exif = Image.Exif()
        exif[0x0112] = 6
        image.save(folder / "a.jpg", exif=exif, quality=95)
        return folder / "a.jpg", (WIDTH, HEIGHT)
    if kind in ("16-bit", "float HDR with inf"):
        is_float = kind != "16-bit"
        pixels = smooth_texture(HEIGHT, WIDTH) * 3 if is_float else rgb.astype(np.uint16) * 257
        if is_float:
            pixels[3, 4], pixels[5, 6, 1] = np.inf, np.nan
        path = folder / ("a.exr" if is_float else "a.png")
        output = oiio.ImageOutput.create(str(path))
        output.open(str(path), oiio.ImageSpec(WIDTH, HEIGHT, 3, "float" if is_float else "uint16"))
        output.write_image(pixels)
        output.close()
        return path, (HEIGHT, WIDTH)
    mode = {"grey": "L", "alpha": "RGBA", "palette": "P", "CMYK": "CMYK"}[kind]
    if mode == "RGBA":
        image.putalpha(Image.fromarray(np.tile(np.arange(WIDTH, dtype=np.uint8) * 9, (HEIGHT, 1))))
    path = folder / ("a.tif" if mode == "CMYK" else "a.png")
    image.convert(mode).save(path)
    return path, (HEIGHT, WIDTH)


@pytest.mark.parametrize("kind", ["16-bit", "float HDR with inf", "grey", "alpha", "palette", "CMYK", "EXIF-rotated"])
def test_photos_of_every_kind(tmp_path, kind):
    """Upright, three channels, finite; the centre view is the photo, and what changed on the way in is told."""
    path, size = saved_as(kind, tmp_path)
    photo = read_photo(path)
    assert photo.size == size
    assert photo.is_hdr == (kind == "float HDR with inf")
    assert bool(photo.notes) == (kind in ("float HDR with inf", "alpha", "CMYK"))
    disparity = np.zeros(size, np.float32)
    disparity[6:12, 8:14] = 2.0
    views = field_of(photo, Disparity(disparity, "test"))
    assert views[GRID.centre].colors == pytest.approx(photo.pixels, rel=1e-3, abs=1e-3)


@pytest.mark.parametrize("size", [(1, 1), (1, 2), (2, 2)])
def test_k_larger_than_the_number_of_rays(size):
    """Slots without a ray stay empty."""
    photo = photo_of(np.random.default_rng(0).uniform(0.2, 1, (*size, 3)))
    rays = rays_of_photo(photo.pixels, np.full(size, 0.25, np.float32), 1.0, 0)
    offset = ViewOffset(0.5, -1.0)
    found = find_candidates(rays, offset, (0, size[0]))
    assert found.number.max() <= size[0] * size[1]
    assert (closed_form(found)[0][found.number.max() :] == 0).all()
    assert np.isfinite(view_entropy(rays, offset)).all()
    field_of(photo, disparity_of(np.full(size, 0.25)))


class Scaled(TrainedWeights):
    """A transformer of any weights whose scores are this many times as large."""

    def __init__(self, factor):
        shapes = {
            name: np.random.default_rng(3).normal(0, 1, shape).astype(np.float32) for name, shape in SHAPES.items()
        }
        shapes["score.weight"] *= np.float32(factor)
        self._layers = tuple(np.ascontiguousarray(array.T) for array in shapes.values())


@pytest.mark.parametrize("factor", [1.0, 1e4, 1e30, -1e30])
def test_softmax_of_huge_logits(factor):
    """Weights stay weights: in [0, 1], their sum 1; one hypothesis then takes all."""
    features = np.random.default_rng(0).normal(0, 3, (70, 6, FEATURES)).astype(np.float32)
    features[..., SHARE] = np.random.default_rng(1).uniform(0, 1, (70, 6))
    number = np.arange(70) % 6 + 1
    mask, unused = np.arange(6) < number[:, None], np.zeros((70, 6), np.float32)
    pixel, source = np.zeros((70, 2), np.int64), np.zeros((70, 6), np.uint8)
    ambiguous = AmbiguousRays(
        ViewOffset(0.0, 1.0), pixel, number.astype(np.uint8), unused[:, 0], unused, source, unused, unused, features
    )
    weights = Scaled(factor)(ambiguous)
    assert (weights >= 0).all()
    assert weights.sum(axis=1) == pytest.approx(1, abs=1e-5)
    assert (weights[~mask] == 0).all()
    if abs(factor) == 1e30:
        assert weights.max(axis=1) == pytest.approx(1, abs=1e-5)


def test_entropy_of_one_hot_and_uniform_weights():
    """A pixel that one surface covers has entropy 0; one that nothing covers could show anything: 1."""
    photo = plain_photo()
    rays, offset = rays_of_photo(photo.pixels, even(3.0).values, 1.0, 0), ViewOffset(0.0, 1.0)
    entropy = view_entropy(rays, offset)
    assert entropy[:, : WIDTH - 3] == pytest.approx(0, abs=1e-5)
    assert entropy[:, WIDTH - 3 :] == pytest.approx(1, abs=1e-5)
    assert (Renderer().render(rays, offset).occluded == (entropy > 0.5)).all()


def test_float16_sums_of_289_views():
    """Views of an HDR photo are half floats; their mean in linear light does not drift with their number."""
    photo = photo_of(np.full((5, 7, 3), 3.1415), is_hdr=True)
    views = field_of(photo, disparity_of(np.full((5, 7), 0.001)), GridShape(17, 17))
    total = np.zeros((5, 7, 3), np.float32)
    for view in views.values():
        total += encoded_from_stored(view.colors)
    assert total / 289 == pytest.approx(3.1415, rel=2**-10)


@pytest.mark.parametrize("far", [1e2, 1e4, 1e9, 1e30])
def test_view_offset_far_outside_the_grid(far):
    """What does not move is still there, what moved away is filled: never a number that is none."""
    photo, disparity = square_before_wall(HEIGHT, WIDTH)
    rays = rays_of_photo(photo.pixels, disparity.values, 1.0, 0)
    square = disparity.values > 0
    for offset in (ViewOffset(far, -far), ViewOffset(0.0, far)):
        view = Renderer().render(rays, offset)
        assert np.isfinite(view.colors).all()
        assert np.isfinite(view.disparity).all()
        assert (view.occluded == square).all()
        assert np.abs(view.colors - photo.pixels)[~square].max() <= 0.05


def test_a_hole_that_covers_the_whole_frame_border(tmp_path):
    """It is filled from inside: in a map with unknown border, and in a view whose border nothing shows."""
    photo, disparity = square_before_wall(HEIGHT, WIDTH)
    holed = np.full_like(disparity.values, np.nan)
    holed[4:-4, 4:-4] = disparity.values[4:-4, 4:-4]
    np.save(tmp_path / "map.npy", holed)
    read = read_disparity(tmp_path / "map.npy", photo.size)
    assert (read.values[:4] == 0).all()
    field_of(photo, read)
    hole = np.isnan(holed)
    colors, filled = np.where(hole[..., None], 0, photo.pixels), np.where(hole, 0, np.float32(1.0))
    fill_background(colors, filled, hole, np.ones_like(filled), ViewOffset(2.0, 2.0))
    inside = photo.pixels[~hole]
    assert (colors >= inside.min(axis=0) - MAX_TEXTURE - 1e-6).all()
    assert (colors <= inside.max(axis=0) + MAX_TEXTURE + 1e-6).all()
    assert filled == pytest.approx(1.0)


def test_two_surfaces_1e_4_apart():
    """They are one surface to the eye: no tear, no hole, the views of a constant disparity."""
    photo = plain_photo()
    values = np.where(np.arange(WIDTH) % 5 < 2, 1.0, 1.0001) * np.ones((HEIGHT, 1))
    one = field_of(photo, disparity_of(values), GridShape(5, 5))
    other = field_of(photo, even(1.0), GridShape(5, 5))
    for (row, column), view in one.items():
        _, inside = moved(photo, 2 - column, 2 - row)
        difference = np.abs(view.colors.astype(float) - other[row, column].colors).max(axis=2)
        assert difference[inside].max() <= 4e-3
        assert difference.max() <= 0.05
        assert (view.inpainted == other[row, column].inpainted).all()


@pytest.mark.parametrize("upright", [True, False])
def test_a_one_pixel_wire(upright):
    """It stays one pixel wide, of its own colour, wherever it moves; what it hid is filled with the wall."""
    values, pixels = np.zeros((24, 30)), np.full((24, 30, 3), 0.1)
    at = np.s_[:, 15] if upright else np.s_[12]
    values[at], pixels[at] = 3.0, 0.9
    view = field_of(photo_of(pixels), disparity_of(values))[(1, 2) if upright else (2, 1)]
    across = view.colors[8, :, 0] if upright else view.colors[:, 8, 0]
    place = 12 if upright else 9
    assert across[place] > 0.75
    assert np.delete(across, place).max() < 0.25


def test_a_grid_of_1x1():
    """The photo, and nothing else is made; no odd case for those who show or store it."""
    photo, disparity = square_before_wall(HEIGHT, WIDTH)
    (view,) = field_of(photo, disparity, GridShape(1, 1)).values()
    assert view.colors == pytest.approx(photo.pixels, abs=1e-3)
    assert not view.inpainted.any()
    assert not plan_literal(photo, even(0.0), GridShape(1, 1)).has_disocclusion
