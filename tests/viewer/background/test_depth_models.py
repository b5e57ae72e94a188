"""An estimate of depth belongs to the photo that it was made for, whatever is open when it comes."""

from contextlib import closing
from threading import Event

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.models import cache
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.scene import SceneRequest, Source
from iibr_core.types import CENTRE, GridShape
from tests.iibr_core.depth.onnx_graphs import weighing
from tests.viewer.conftest import reduce, write_scene
from viewer.background.depth_models import DepthFinder
from viewer.model import depth_models, opening
from viewer.model.action import do
from viewer.model.app_state import AppState

DEADLINE_S = 60.0


def opened(state, source):
    """Return the state with a photo open whose depth is guessed, and the photo."""
    state = reduce(state, do(opening.open_source, source))
    ready = next(results_of(SceneRequest(state.generation, source, asks_model=False), lambda: CENTRE))
    return reduce(state, do(opening.show_scene, ready.generation, ready.scene)), ready.loaded


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
