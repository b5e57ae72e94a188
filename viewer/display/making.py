"""Makes a scene and the views that pictures of it show: off screen, and for jobs whose scene the window has left."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import closing

from iibr_core.beyond.optics import Optics
from iibr_core.runtime.work import report_progress
from iibr_core.scenes.scene import MAKING, Scene, SceneReady, SceneRequest, ViewReady
from iibr_core.types import CENTRE, ViewOffset
from viewer.gpu.refocus.view_sampling import views_seen_by

PicturesOf = Callable[[Scene], Iterable[Optics] | None]
"""Function from a scene to the optics of the pictures that will be drawn of its views, None if any may be."""


def make_scene(request: SceneRequest, show: Callable[[SceneReady | ViewReady], None], pictures_of: PicturesOf) -> Scene:
    """Open a scene and make its views; return the scene.

    show: takes the scene, then each view. pictures_of: called before the views are made; a photo's views that these
    pictures do not show are not made. Its exceptions end the opening. Raises InputError, Cancelled.
    """
    from iibr_core.scenes.opening import results_of  # heavy, and the window comes first

    wanted: set[ViewOffset] | None = None
    with closing(results_of(request, lambda: CENTRE, lambda: wanted)) as results:
        ready = next(results)
        assert isinstance(ready, SceneReady)
        show(ready)
        pictures = pictures_of(ready.scene)
        wanted = None if pictures is None else views_seen_by(pictures, ready.scene)
        for made in () if wanted == set() else results:
            assert isinstance(made, ViewReady)
            show(made)
            report_progress(made.progress.done, made.progress.total, MAKING)
    return ready.scene
