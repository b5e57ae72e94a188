from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.editing.edits import DepthEdits, Stroke
from iibr_core.formats.images.photo import focal_px_from_fov
from iibr_core.formats.images.write import write_image
from iibr_core.gloss.settings import Gloss, GlossSurface
from iibr_core.method.plan import MAX_DEPTH_STRENGTH
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.scenes.large_photo import load_large
from iibr_core.scenes.opening import results_of, scene_of_photo, sketch_of
from iibr_core.scenes.photo import apply_depth_settings, load_photo, make_plan, photo_of_arrays, sketch_photo
from iibr_core.scenes.scene import DepthSettings, SceneReady, SceneRequest, Source, ViewReady, WantedPhoto
from iibr_core.scenes.scene_gloss import add_gloss, gloss_request, make_maps
from iibr_core.types import CENTRE, GridShape, InputError, ViewOffset, ViewUpdate
from tests.iibr_core.scenes import square_before_wall
from tests.viewer.conftest import HEIGHT, WIDTH

GRID = GridShape(3, 3)


def opened(source: Source, **changes: object) -> SceneReady:
    ready = next(results_of(SceneRequest(1, source, **changes), lambda: CENTRE))
    assert isinstance(ready, SceneReady)
    return ready


def test_a_strip_is_opened_within_the_limit_of_graphics_drivers(tmp_path) -> None:
    write_image(tmp_path / "strip.png", np.zeros((8, 40_000, 3), np.uint8))
    loaded = load_photo(Source(str(tmp_path / "strip.png"), DepthChoice("flat")))
    assert 16_000 < loaded.photo.size.width <= 16_384
    assert loaded.own_size == (8, 40_000)


def write_large_photo(folder: Path, name: str = "large", ending: str = "jpg") -> Path:
    rows, columns = np.mgrid[:1200, :1600]
    pixels = np.stack([rows % 256, columns % 256, (rows // 100 + columns // 100) % 2 * 200], axis=2)
    path = folder / f"{name}.{ending}"
    Image.fromarray(pixels.astype(np.uint8)).save(path)
    return path


def test_a_large_photo_has_a_sketch(tmp_path) -> None:
    source = Source(str(write_large_photo(tmp_path)), grid=GRID)
    sketch = sketch_of(WantedPhoto(source, 1.0))
    whole = opened(replace(source, depth=DepthChoice("flat")))
    assert (sketch.scene.size, sketch.scene.own_size) == ((480, 360), (1600, 1200))
    assert (sketch.scene.is_sketch, sketch.loaded, sketch.scene.name) == (True, None, whole.scene.name)
    assert sketch.centre.colors.shape == (360, 480, 3)
    assert sketch.centre.colors.mean() == pytest.approx(whole.centre.colors.mean(), abs=2), "as bright"
    assert (whole.scene.size, whole.scene.is_sketch) == ((1600, 1200), False)
    for changes in ({"max_pixels": 1_499_999}, {"is_literal": True}):
        assert sketch_photo(replace(source, **changes)) is None
    assert sketch_photo(replace(source, max_pixels=1_500_000)) is not None


def test_a_small_photo_has_a_sketch_of_its_own_size_while_kernels_are_missing(tmp_path, monkeypatch) -> None:
    write_image(tmp_path / "small.png", np.full((HEIGHT, WIDTH, 3), 99, np.uint8))
    source = Source(str(tmp_path / "small.png"))
    assert sketch_photo(source) is None
    monkeypatch.setattr("iibr_core.scenes.photo.kernel_count", lambda: 0)
    sketch = sketch_photo(source)
    assert sketch is not None
    assert sketch.photo.size == (HEIGHT, WIDTH)


def test_a_cut_jpeg_has_no_sketch_and_fails_as_it_did_without(tmp_path) -> None:
    path = write_large_photo(tmp_path)
    path.write_bytes(path.read_bytes()[:500])
    assert sketch_of(WantedPhoto(Source(str(path)), 1.0)) is None
    with pytest.raises(InputError, match=r"large\.jpg"):
        opened(Source(str(path)))


def test_progress_counts_every_view_once(photo_path) -> None:
    request = SceneRequest(1, Source(str(photo_path), grid=GRID))
    ready, *results = results_of(request, lambda: CENTRE)
    views = [result for result in results if isinstance(result, ViewReady)]
    assert isinstance(ready, SceneReady)
    progress = [view.progress for view in views]
    assert [(now.done, now.total, now.doing) for now in progress] == [(done, 9, "") for done in range(1, 10)]
    assert [(now.share, now.is_complete) for now in progress] == [(done / 9, done == 9) for done in range(1, 10)]
    assert all(view.view.is_final for view in views)
    (hidden,) = (view.hidden for view in views if view.hidden is not None)
    assert 0.05 < hidden.colors[hidden.mask].mean() <= hidden.colors.max() < 1.01
    assert 0 < progress[0].seconds <= progress[-1].seconds < 600
    few = list(results_of(request, lambda: CENTRE, lambda: [ViewOffset(1.0, 1.0)]))[1:]
    assert [(view.view.row, view.view.column, view.progress.total) for view in few] == [(1, 1, 2), (2, 2, 2)]


@pytest.mark.parametrize("static", [None, 0.5])
@pytest.mark.parametrize("strength", [1.0, -0.5])
def test_edits_change_no_parallax_elsewhere(static, strength) -> None:
    loaded = photo_of_arrays(*square_before_wall())
    source = Source("", grid=GRID, focus_disparity=static)
    stroke = DepthEdits(strokes=(Stroke("nearer", ((0.5, 0.5),), 0.1, 1.0),))
    edited = apply_depth_settings(loaded, DepthSettings(False, stroke))
    before, after = make_plan(source, loaded, strength), make_plan(source, edited, strength)
    assert np.ptp(edited.disparity.values) > 2.5
    assert sum(edited.levels.counts) == edited.disparity.values.size, "the histogram counts every pixel once"
    elsewhere = np.s_[45:, :]
    unchanged = before.field_disparity(loaded.disparity).values[elsewhere]
    np.testing.assert_allclose(after.field_disparity(edited.disparity).values[elsewhere], unchanged, atol=1e-4)
    scene = scene_of_photo(source, edited, after)
    assert scene.found_span_px == pytest.approx(np.ptp(before.field_disparity(loaded.disparity).values), rel=1e-3)
    assert scene.inverse_metres is None
    assert apply_depth_settings(edited, edited.depth_settings) is edited
    back = apply_depth_settings(edited, DepthSettings(False))
    np.testing.assert_array_equal(back.disparity.values, loaded.disparity.values)
    assert make_plan(source, edited, MAX_DEPTH_STRENGTH).disparity_scale > 0


def test_gloss_maps_are_made_once_for_a_surface(photo_path) -> None:
    ready, gloss = opened(Source(str(photo_path), grid=GRID)), Gloss(reflectance=1.0, roughness=1.0)
    scene, centre = ready.scene, ready.centre
    request = gloss_request(gloss, scene, centre)
    maps = make_maps(request)
    assert maps.geometry == (focal_px_from_fov(scene.width), scene.infinity_px)
    of_field = make_maps(replace(request, scene=replace(scene, plan=None, focal_px=50.0)))
    low, high = float(centre.disparity.min()), float(centre.disparity.max())
    assert of_field.geometry == (50.0, pytest.approx(low - (high - low) / 19))
    assert gloss_request(gloss, scene, centre, maps) is None
    assert gloss_request(None, scene, centre) is None
    assert gloss_request(gloss, scene, replace(centre, disparity=None)) is None
    again = gloss_request(replace(gloss, surface=GlossSurface(0.5)), scene, centre, maps)
    assert again.normals is maps.normals
    assert request == gloss_request(gloss, scene, centre)
    assert request != again
    views = [centre, ViewUpdate(0, 0, centre.colors, centre.disparity)]
    assert list(add_gloss(iter(views), None, scene)) == views
    assert any((shown.colors != view.colors).any() for shown, view in zip(add_gloss(iter(views), gloss, scene), views))


def test_a_loaded_photo_is_not_read_again(photo_path) -> None:
    source = Source(str(photo_path), grid=GridShape(1, 1))
    first = opened(source)
    assert first.scene.subject_disparity_px == first.scene.disparity_range_px[1], "the near square fills the middle"
    photo_path.unlink()
    again = opened(source, depth_strength=2.0, loaded=first.loaded)
    assert again.loaded is first.loaded
    assert again.scene.plan.disparity_scale == pytest.approx(2 * first.scene.plan.disparity_scale)


def test_generating_stops_between_row_bands_and_reading_too(photo_path) -> None:
    kinds: list[type] = []
    request = SceneRequest(1, Source(str(photo_path), grid=GRID))
    with stoppable(lambda: bool(kinds)):
        for result in results_of(request, lambda: CENTRE):
            kinds.append(type(result))
    assert kinds[0] is SceneReady
    assert kinds.count(ViewReady) <= 1  # the photo's own view costs nothing
    with pytest.raises(Cancelled), stoppable(lambda: True):
        next(results_of(request, lambda: CENTRE))


SMALLER = 4
MOST = 10**6
STROKE = DepthEdits(strokes=(Stroke("nearer", ((0.2, 0.2),), 0.1, 0.5),))


def source_of(photo: Path, **changes: object) -> Source:
    return Source(str(photo), grid=GridShape(3, 3), max_pixels=HEIGHT * WIDTH // SMALLER**2, **changes)


@pytest.mark.parametrize("edits", [DepthEdits(), STROKE], ids=["as found", "with a stroke"])
@pytest.mark.parametrize("stored", ["larger", "smaller", "guess"])
def test_disparity_grows_with_the_pixels(photo_path, stored, edits) -> None:
    """Whether the map's file holds more than the light field's views do, less, or there is none."""
    map_path = photo_path.with_name("scene_disparity.npy")
    if stored == "smaller":
        np.save(map_path, np.load(map_path)[::8, ::8])
    elif stored == "guess":
        map_path.unlink()
    source = source_of(photo_path, depth=DepthChoice(start="rough" if stored == "guess" else "auto"))
    loaded = load_photo(source, depth_settings=DepthSettings(0.0, edits))
    assert loaded.photo.size == (HEIGHT // SMALLER, WIDTH // SMALLER)
    plan = make_plan(source, loaded, 1.0)
    small = plan.field_disparity(loaded.disparity).values
    large = load_large(source, loaded, plan, MOST)
    assert large.size == (HEIGHT, WIDTH)
    middles = large.disparity[SMALLER // 2 :: SMALLER, SMALLER // 2 :: SMALLER]
    assert np.ptp(small) > 0.1
    assert np.median(np.abs(middles / SMALLER - small)) < 0.03 * np.ptp(small)
    for share in (1, 50, 99):
        grown, expected = (np.percentile(values, share) for values in (large.disparity, small))
        assert grown == pytest.approx(SMALLER * expected, abs=SMALLER * 0.06 * float(np.ptp(small)))


def test_a_photo_that_another_one_took_the_place_of_is_refused(photo_path) -> None:
    source = source_of(photo_path)
    loaded = load_photo(source)
    Image.new("RGB", (WIDTH, HEIGHT)).save(photo_path)
    with pytest.raises(InputError, match=r"scene\.png: was changed since it was opened; open it again"):
        load_large(source, loaded, make_plan(source, loaded, 1.0), MOST)
