from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from iibr_core.depth.multi_view.matching import FINDING
from iibr_core.formats.images.write import write_image_file
from iibr_core.formats.light_fields.order import UNKNOWN, Arrangement
from iibr_core.formats.light_fields.write import FieldScale, write_light_field
from iibr_core.runtime.work import Cancelled, stoppable, watched
from iibr_core.scenes.lens_limits import focus_limits
from iibr_core.scenes.light_fields import FROM_VIEWS, open_settled
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.scene import SceneReady, SceneRequest, Source, ViewReady
from iibr_core.types import CENTRE, GridShape, ViewOffset, ViewUpdate
from tests.iibr_core.depth.multi_view.test_order import HEIGHT, SQUARE_PX, WALL_PX, WIDTH, view_at
from tests.iibr_core.known_scenes import FOREGROUND, view_of_square
from tests.viewer.conftest import reduce
from viewer.model import lens, opening
from viewer.model.action import do
from viewer.model.app_state import AppState


def test_a_light_field_without_disparity_finds_its_own(tmp_path) -> None:
    folder = write_two_planes(tmp_path / "field")
    as_read, coarse, final = showings(results_of(SceneRequest(1, Source(str(folder))), lambda: CENTRE))
    assert [ready.scene.has_view_disparity for ready, _ in (as_read, coarse, final)] == [False, True, True]
    assert [{view.view.is_final for view in views} for _, views in (coarse, final)] == [{False}, {True}]
    for _, views in (coarse, final):
        assert [view.progress.share for view in views] == [k / len(views) for k in range(1, len(views) + 1)]
    assert final[0].scene.depth_source == FROM_VIEWS
    assert final[0].scene.disparity_range_px == pytest.approx((WALL_PX, SQUARE_PX), abs=0.15)
    for view in (result.view for result in final[1]):
        assert view.disparity[36, 48] == pytest.approx(SQUARE_PX, abs=0.1)
        assert view.disparity[8, 8] == pytest.approx(WALL_PX, abs=0.1)


def test_found_disparity_is_kept_for_the_next_time_until_a_view_changes(tmp_path, monkeypatch) -> None:
    """Then only the views that are wanted are read; names count from right to left, as parallax shows."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = write_two_planes(tmp_path / "field")
    for row, column in np.ndindex(5, 5):
        (folder / "views" / f"v{row}_u{column}.png").rename(folder / f"v{row}_u{4 - column}.png")
    (folder / "views").rmdir()
    request = SceneRequest(1, Source(str(folder)), takes_drafts=False)
    ((first, _),) = showings(results_of(request, lambda: CENTRE))
    monkeypatch.setattr("iibr_core.scenes.light_fields.settle", None)
    ((again, views),) = showings(results_of(request, lambda: CENTRE, lambda: {ViewOffset(0.0, 1.0)}))
    assert again.scene == first.scene
    assert np.array_equal(again.centre.disparity, first.centre.disparity)
    assert [(view.view.row, view.view.column) for view in views] == [(2, 2), (2, 3)]
    assert views[-1].view.disparity[36, 47] == pytest.approx(SQUARE_PX, abs=0.1)
    (folder / "v0_u0.png").touch()
    with pytest.raises(TypeError):
        list(results_of(request, lambda: CENTRE))


@pytest.mark.parametrize("is_asked", [False, True])
def test_a_field_that_does_not_fit_is_thinned(tmp_path, monkeypatch, is_asked) -> None:
    folder, grid = write_two_planes(tmp_path / "field"), GridShape(3, 3)
    if not is_asked:
        monkeypatch.setattr("iibr_core.scenes.light_fields.MAX_PIXELS", 10 * HEIGHT * WIDTH)
    source = Source(str(folder), arrangement=Arrangement(grid=grid) if is_asked else UNKNOWN)
    ((ready, views),) = showings(results_of(SceneRequest(1, source, takes_drafts=False), lambda: CENTRE))
    assert (ready.scene.grid, len(views)) == (grid, 9)
    found = views[0].view.disparity
    assert (found[8, 8], found[36, 48]) == pytest.approx((2 * WALL_PX, 2 * SQUARE_PX), abs=0.15)
    assert "One of every 2 rows and columns of views is used: 3x3 of 5x5." in ready.scene.notes
    field, notes = open_settled(source)
    assert (field.grid, field.layout) == (grid, "grid folder, 3x3 of 5x5")
    assert notes[0] == ready.scene.notes[0]
    stored = [
        ViewUpdate(v, u, np.zeros((HEIGHT, WIDTH, 3), np.uint8), np.full((HEIGHT, WIDTH), v + u / 8, np.float32))
        for v, u in np.ndindex(5, 5)
    ]
    write_light_field(tmp_path / "known", "hci", GridShape(5, 5), stored, 100.0, "known", True, FieldScale(-1.0))
    known = replace(source, path=str(tmp_path / "known"))
    ((ready, views),) = showings(results_of(SceneRequest(1, known, takes_drafts=False), lambda: CENTRE))
    assert ready.scene.infinity_px == pytest.approx(-2.0, abs=0.01)
    found = {(result.view.row, result.view.column): result.view.disparity[8, 8] for result in views}
    assert found == pytest.approx({(v, u): 2 * (2 * v + 2 * u / 8) for v, u in np.ndindex(3, 3)}, abs=0.01)


def test_views_that_tell_nothing_are_shown_as_they_are(tmp_path) -> None:
    folder = tmp_path / "field"
    (folder / "views").mkdir(parents=True)
    for row, column in np.ndindex(2, 3):
        write_image_file(folder / "views" / f"v{row}_u{column}.png", np.zeros((6, 40, 3), np.uint8), "uint8")
    last, views = list(showings(results_of(SceneRequest(1, Source(str(folder))), lambda: CENTRE)))[-1]
    assert not last.scene.has_view_disparity
    assert any("too small" in note for note in last.scene.problems)
    assert len(views) == 6


def test_large_views_are_matched_as_small_as_memory_asks_with_a_note(tmp_path, monkeypatch) -> None:
    folder = tmp_path / "pair"
    folder.mkdir()
    for s in (0, 1):
        pixels = np.rint(view_of_square(ViewOffset(0, 2 * s)) * 255).astype(np.uint8).repeat(5, 0).repeat(5, 1)
        write_image_file(folder / f"v0_u{s}.png", pixels, "uint8")
    monkeypatch.setattr("iibr_core.depth.multi_view.reduced.budget_bytes", lambda: 4 * 2**20)
    request = SceneRequest(1, Source(str(folder)), takes_drafts=False)
    ((ready, _),) = showings(results_of(request, lambda: CENTRE))
    assert any(note.startswith("Found from views reduced to ") for note in ready.scene.notes)
    assert ready.scene.disparity_range_px[1] == pytest.approx(10 * FOREGROUND, rel=0.2)


def test_focus_that_is_set_while_it_loads_stays(tmp_path) -> None:
    source = Source(str(write_two_planes(tmp_path / "field")))
    state = reduce(AppState(), do(opening.open_source, source))
    results = results_of(SceneRequest(1, source), lambda: CENTRE)
    state = reduce(state, do(opening.show_scene, 1, next(results).scene))
    state = reduce(reduce(state, do(lens.set_aperture, 2.0)), do(lens.set_focus, 3.5))
    for result in results:
        if isinstance(result, SceneReady):
            state = reduce(state, do(opening.show_scene, 1, result.scene))
            # A new aperture checks all limits.
            state = reduce(state, do(lens.set_aperture, state.optics.aperture_diameter + 0.1))
    assert state.optics.focus_disparity == 3.5
    assert focus_limits(state.scene)[1] >= 3.5


def showings(results: Iterator[SceneReady | ViewReady]) -> Iterator[tuple[SceneReady, list[ViewReady]]]:
    ready: SceneReady | None = None
    views: list[ViewReady] = []
    for result in results:
        if isinstance(result, ViewReady):
            views.append(result)
            continue
        if ready is not None:
            yield ready, views
        ready, views = result, []
    assert ready is not None
    yield ready, views


def write_two_planes(folder: Path) -> Path:
    """5x5 views of a textured square before a textured wall, as numbered pictures."""
    (folder / "views").mkdir(parents=True)
    for row, column in np.ndindex(5, 5):
        pixels = np.repeat(view_at(row - 2.0, column - 2.0)[..., None], 3, -1)
        write_image_file(folder / "views" / f"v{row}_u{column}.png", pixels, "uint8")
    return folder


def test_finding_disparity_can_be_stopped(tmp_path) -> None:
    said: list[str] = []
    request = SceneRequest(1, Source(str(write_two_planes(tmp_path / "field"))))
    with pytest.raises(Cancelled), stoppable(lambda: FINDING in said), watched(lambda *now: said.append(now[2])):
        list(results_of(request, lambda: CENTRE))
