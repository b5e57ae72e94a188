"""An estimate of depth belongs to the photo that it was made for, whatever is open when it comes."""

from contextlib import closing
from threading import Event

import numpy as np
import pytest

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.models import cache
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.scene import SceneRequest, Source
from iibr_core.types import CENTRE, GridShape
from tests.iibr_core.depth.onnx_graphs import weighing
from tests.viewer.conftest import reduce, write_scene
from viewer.background.depth_models import DepthFinder, focus_before_and_now
from viewer.model import depth_models, opening
from viewer.model.action import do
from viewer.model.app_state import AppState

DEADLINE_S = 60.0


def opened(state, source):
    """Return the state with a photo open whose depth is guessed, and the photo."""
    state = reduce(state, do(opening.open_source, source))
    ready = next(results_of(SceneRequest(state.generation, source, asks_model=False), lambda: CENTRE))
    return reduce(state, do(opening.show_scene, ready.generation, ready.scene)), ready.loaded


@pytest.mark.parametrize(
    ("place", "row", "column"),
    [((-1, -1), 0, 0), ((1, 1), 3, 4), ((0, 0), 2, 2), ((0.5, -0.3), 1, 3), ((-0.7, 0.3), 2, 0), ((9, -9), 0, 4)],
)
def test_the_place_in_focus_is_found_in_both_maps(place, row, column):
    before = np.arange(20, dtype=np.float32).reshape(4, 5)
    assert focus_before_and_now(before, -before, place) == (before[row, column], -before[row, column])
    assert focus_before_and_now(before, -before, None) is None


def test_an_estimate_that_comes_after_the_next_photo_was_asked_for_is_not_shown_with_it(tmp_path, monkeypatch):
    monkeypatch.setattr(cache, "cache_folder", lambda: tmp_path / "estimates")
    model = str(weighing(tmp_path / "own.onnx", (1, 1, 1)))
    paths = (write_scene(tmp_path, name) for name in ("a", "b"))
    first, second = (Source(str(path), DepthChoice(start="rough"), GridShape(3, 3)) for path in paths)
    came = Event()
    before, photo = opened(AppState(), first)
    shown = [photo]
    with closing(DepthFinder(lambda: shown[-1], came.set)) as finder:
        wanted = reduce(before, do(depth_models.use_model, model))
        assert finder.advance(wanted) == []
        assert came.wait(DEADLINE_S)
        asked = reduce(wanted, do(opening.open_source, second))
        (late,) = finder.advance(asked)
        assert reduce(asked, late) is asked
        shown.append(opened(asked, second)[1])
        assert finder.newest() is shown[-1]
        same = reduce(wanted, do(opening.open_source, Source(first.path)))
        assert (asked.preferences.depth_model, same.preferences.depth_model) == (model, ""), "chosen for further photos"
