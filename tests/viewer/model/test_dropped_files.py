"""What files dropped on the window ask for."""

import pytest

from iibr_core.depth.choice import DepthChoice
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import GridShape
from viewer.model import opening
from viewer.model.app_state import AppState

SCENE = Scene(Source("photo.png", max_pixels=7), "photo", 600, 400, GridShape(9, 9), (-2.0, 3.0), "photo.pfm")
STATE = AppState(source=SCENE.source, scene=SCENE)


@pytest.mark.parametrize(
    ("paths", "opened", "disparity"),
    [
        (["a.jpg"], "a.jpg", None),
        (["a.jpg", "b.jpg"], "a.jpg", None),
        (["a.PFM", "b.jpg"], "b.jpg", "a.PFM"),
        (["better.npy"], "photo.png", "better.npy"),
        (["dog_depth.png", "dog.jpg"], "dog.jpg", "dog_depth.png"),
        (["dog_depth.JPG"], "photo.png", "dog_depth.JPG"),
    ],
)
def test_dropped_files(paths, opened, disparity):
    choice = DepthChoice(file=disparity, stretches=disparity is not None)
    assert opening.open_paths(STATE, paths).source == Source(opened, choice, max_pixels=7)
