"""What comes of opening a scene, in order: the scene, its first view, every other; what stops it, what it refuses."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from iibr_core.beyond.optics import CENTRE
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.scenes.opening import results_of, sketch_of
from iibr_core.scenes.photo import load_photo, sketch_photo
from iibr_core.scenes.scene import SceneReady, SceneRequest, Source, ViewReady, WantedPhoto
from iibr_core.types import GridShape, InputError
from tests.iibr_core.scenes.test_light_fields import showings


def write_large_photo(folder: Path, name: str = "large", ending: str = "jpg") -> Path:
    """A photo that takes a while to read."""
    rows, columns = np.mgrid[:1200, :1600]
    pixels = np.stack([rows % 256, columns % 256, (rows // 100 + columns // 100) % 2 * 200], axis=2)
    path = folder / f"{name}.{ending}"
    Image.fromarray(pixels.astype(np.uint8)).save(path)
    return path


@pytest.mark.parametrize("ending", ["jpg", "png"])
def test_a_large_photo_has_a_sketch(tmp_path: Path, ending: str) -> None:
    source = Source(str(write_large_photo(tmp_path, ending=ending)), grid=GridShape(3, 3))
    sketch = sketch_of(WantedPhoto(source, 1.0))
    whole = next(results_of(SceneRequest(1, source), lambda: CENTRE))
    assert isinstance(whole, SceneReady)
    assert sketch is not None
    assert (sketch.scene.size, sketch.scene.own_size) == ((480, 360), (1600, 1200))
    assert sketch.scene.is_sketch
    assert sketch.loaded is None
    assert sketch.centre.colors.shape == (360, 480, 3)
    assert sketch.scene.name == whole.scene.name
    assert (whole.scene.size, whole.scene.is_sketch) == ((1600, 1200), False)
    assert whole.loaded is not None


@pytest.mark.parametrize("changes", [{"max_pixels": 10_000}, {"is_literal": True}], ids=str)
def test_what_is_read_in_no_time_or_taken_literally_has_no_sketch(tmp_path: Path, changes: dict[str, object]) -> None:
    source = replace(Source(str(write_large_photo(tmp_path)), grid=GridShape(3, 3)), **changes)  # type: ignore[arg-type]
    assert sketch_photo(source) is None


def test_a_cut_jpeg_has_no_sketch_and_fails_as_it_did_without(tmp_path: Path) -> None:
    path = write_large_photo(tmp_path)
    path.write_bytes(path.read_bytes()[:20_000])
    assert sketch_of(WantedPhoto(Source(str(path)), 1.0)) is None
    with pytest.raises(InputError, match=r"large\.jpg"):
        list(results_of(SceneRequest(1, Source(str(path))), lambda: CENTRE))


def test_progress_counts_every_view_once(photo_path: Path) -> None:
    request = SceneRequest(1, Source(str(photo_path), grid=GridShape(3, 3)))
    ready, *results = results_of(request, lambda: CENTRE)
    views = [result for result in results if isinstance(result, ViewReady)]
    assert isinstance(ready, SceneReady)
    assert [view.progress.done for view in views] == list(range(1, 10))
    assert [view.progress.is_complete for view in views] == [False] * 8 + [True]
    assert all(view.view.is_final for view in views)


def test_a_photo_tells_its_focal_length_only_where_it_knows_it(photo_path: Path, tmp_path: Path) -> None:
    from iibr_core.formats.images.photo import read_photo
    from iibr_core.formats.images.write import write_image

    known = tmp_path / "known.png"
    write_image(known, np.zeros((20, 30, 3), np.uint8), {"Exif:FocalLengthIn35mmFilm": 50})
    for path, expected in ((photo_path, None), (known, read_photo(known).focal_px)):
        ready = next(results_of(SceneRequest(1, Source(str(path))), lambda: CENTRE))
        assert isinstance(ready, SceneReady)
        assert ready.scene.focal_px == expected
    assert read_photo(known).focal_px == pytest.approx(50 / np.hypot(36, 24) * np.hypot(20, 30))


def test_the_subject_is_what_fills_the_middle(photo_path: Path) -> None:
    ready = next(results_of(SceneRequest(1, Source(str(photo_path))), lambda: CENTRE))
    assert isinstance(ready, SceneReady)
    assert ready.scene.subject_disparity_px == ready.scene.disparity_range_px[1], "the near square"


def test_a_loaded_photo_is_not_read_again(photo_path: Path) -> None:
    source = Source(str(photo_path), grid=GridShape(1, 1))
    first = next(results_of(SceneRequest(1, source), lambda: CENTRE))
    assert isinstance(first, SceneReady)
    photo_path.unlink()
    again = next(results_of(SceneRequest(2, source, 2.0, first.loaded), lambda: CENTRE))
    assert isinstance(again, SceneReady)
    assert again.loaded is first.loaded
    assert again.scene.plan is not None
    assert first.scene.plan is not None
    assert again.scene.plan.disparity_scale == pytest.approx(2 * first.scene.plan.disparity_scale)


@pytest.mark.parametrize("with_disparity", [True, False])
def test_a_light_field_folder_goes_the_same_way(tmp_path: Path, photo_path: Path, with_disparity: bool) -> None:
    from iibr_core.formats.light_fields.write import write_light_field

    request = SceneRequest(1, Source(str(photo_path), grid=GridShape(3, 3)))
    made = list(results_of(request, lambda: CENTRE))
    folder = tmp_path / "field"
    views = (result.view for result in made if isinstance(result, ViewReady))
    write_light_field(folder, "hci", GridShape(3, 3), views, 100.0, "field", with_disparity)
    results = results_of(SceneRequest(2, Source(str(folder))), lambda: CENTRE)
    ready, views = next(showings(results))
    assert (ready.scene.grid, ready.scene.plan, ready.loaded) == ((3, 3), None, None)
    assert ready.scene.has_view_disparity == with_disparity
    assert ready.scene.disparity_range_px[0] < ready.scene.disparity_range_px[1]
    assert len(views) == 9


def test_a_folder_without_views_is_told_what_would_be_some(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no photos in it"):
        next(results_of(SceneRequest(1, Source(str(tmp_path))), lambda: CENTRE))
    (tmp_path / "notes.txt").touch()
    with pytest.raises(InputError, match="holds no light field; laid out as HCI, Stanford"):
        next(results_of(SceneRequest(1, Source(str(tmp_path))), lambda: CENTRE))


def test_generating_stops_between_row_bands(photo_path: Path) -> None:
    """Asked to stop once the scene is there, it ends without another view."""
    kinds: list[type] = []
    asked = []

    def should_stop() -> bool:
        asked.append(len(kinds))
        return bool(kinds)

    with stoppable(should_stop):
        for result in results_of(SceneRequest(1, Source(str(photo_path), grid=GridShape(3, 3))), lambda: CENTRE):
            kinds.append(type(result))
    assert asked[-1] > 0
    assert kinds[0] is SceneReady
    assert kinds.count(ViewReady) <= 1  # the photo's own view costs nothing


def test_reading_stops_too(photo_path: Path) -> None:
    """Asked to stop while it refines depth."""
    request = SceneRequest(1, Source(str(photo_path), grid=GridShape(3, 3)))
    with pytest.raises(Cancelled), stoppable(lambda: True):
        next(results_of(request, lambda: CENTRE))


def test_an_avif_photo_opens(tmp_path: Path) -> None:
    """It is read by another library than the settings in saved pictures."""
    from PIL import Image

    Image.new("RGB", (48, 32), (200, 80, 60)).save(tmp_path / "a.avif")
    loaded = load_photo(Source(str(tmp_path / "a.avif")))
    assert (loaded.photo.size, loaded.settings) == ((32, 48), "")
