"""Draw scenes without a window, for exports and for the workers of a batch."""

from __future__ import annotations

import threading
from collections.abc import Callable
from contextlib import ExitStack
from types import TracebackType
from typing import Any

from numpy.typing import NDArray

from iibr_core.beyond.optics import CENTRE
from iibr_core.exports.render_settings import RenderSettings, require_size
from iibr_core.exports.source import ExportSource, OpticsOf
from iibr_core.gloss.settings import Gloss
from iibr_core.runtime.work import report_progress
from iibr_core.scenes.lens_limits import LensChoice
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.scene import MAKING, Scene, SceneReady, SceneRequest, Source, ViewReady
from iibr_core.scenes.scene_gloss import make_maps
from iibr_core.types import ViewOffset
from viewer.display.scene_view import SceneView
from viewer.gpu.headless_context import create_headless
from viewer.gpu.refocus.views_seen import views_seen_by

_own = threading.local()
"""The drawer of each thread, kept from photo to photo, because GL contexts belong to threads."""


def open_drawn(
    source: Source,
    depth_strength: float,
    lens: LensChoice,
    on_ready: Callable[[Scene], None],
    optics_of: OpticsOf | None = None,
) -> ExportSource:
    """Open a scene with the drawer of this thread, see `OpenDrawn`; the previous scene can no longer be drawn."""
    if not hasattr(_own, "drawer"):
        _own.drawer = SceneDrawer()
    drawer: SceneDrawer = _own.drawer
    return drawer.open(source, depth_strength, lens, on_ready, optics_of)


class SceneDrawer:
    """Draws one scene at a time off screen; the first scene creates the GL context. Use as a context manager."""

    def __init__(self) -> None:
        self._view: SceneView | None = None
        self._held = ExitStack()

    def __enter__(self) -> SceneDrawer:
        """Return the drawer."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Free the GL context."""
        self._held.close()

    def open(
        self,
        source: Source,
        depth_strength: float,
        lens: LensChoice,
        on_ready: Callable[[Scene], None],
        optics_of: OpticsOf | None = None,
    ) -> ExportSource:
        """Open a scene, see `OpenDrawn`. Raises InputError without GL, too."""
        wanted: set[ViewOffset] | None = None
        view = self._view = self._view or self._make_view()
        request = SceneRequest(0, source, depth_strength, takes_drafts=False)
        results = results_of(request, lambda: CENTRE, lambda: wanted)
        ready = next(results)
        assert isinstance(ready, SceneReady)
        on_ready(ready.scene)
        optics = lens.optics_on(ready.scene)
        if optics_of is not None:
            wanted = views_seen_by(optics_of(ready.scene, optics), ready.scene.grid)
        view.open(ready)
        for made in results:
            assert isinstance(made, ViewReady)
            view.add(made.view)
            view.upload_all()
            report_progress(made.progress.done, made.progress.total, MAKING)
        return ExportSource(ready.scene, ready.loaded, optics, self.draw, view.centre)

    def draw(self, settings: RenderSettings) -> NDArray[Any]:
        """Return a picture of the open scene, see `iibr_core.exports.source.Draw`."""
        assert self._view is not None
        require_size(settings.size_px)
        prepare_gloss(self._view, settings.optics.gloss)
        return self._view.renderer.converged_picture(settings)

    def _make_view(self) -> SceneView:
        gl = create_headless("auto")
        self._held.callback(gl.release)
        view = SceneView(gl)
        self._held.callback(view.release)
        return view


def prepare_gloss(view: SceneView, gloss: Gloss | None) -> None:
    """Compute the gloss maps if they are missing."""
    request = view.gloss_request(gloss)
    if request is not None:
        view.take_gloss(make_maps(request))
