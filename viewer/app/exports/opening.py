"""Opening a scene for one export: with a graphics card for what is drawn, without for what is made of the views."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from iibr_core.rendering.gloss.settings import Gloss
from iibr_core.runtime.tiling import never
from iibr_core.types import ReportProgress, ignore_progress
from viewer.app.exports.source import ExportSource, undrawn
from viewer.background.scene_worker import SceneReady, SceneRequest, results_of
from viewer.model.state.optics import CENTRE, Optics

if TYPE_CHECKING:
    from viewer.app.headless import HeadlessViewer
    from viewer.model.actions import Action
    from viewer.model.state.scene import Scene, Source


def open_drawn(
    viewer: HeadlessViewer,
    source: Source,
    depth_strength: float,
    lens: Sequence[Action],
    on_ready: Callable[[Scene], None],
    report_progress: ReportProgress = ignore_progress,
) -> ExportSource:
    """With all views made and shown, the lens set by these actions.

    on_ready: is told the scene before any view is made; what it raises ends the opening. Raises InputError.
    """
    viewer.open(
        source,
        depth_strength,
        lambda made: report_progress(made.share, float(made.total > 0), made.doing),
        on_ready=on_ready,
    )
    viewer.do(*lens)
    return ExportSource(
        viewer.scene, viewer.loaded, viewer.state.optics, viewer.draw, ignore_progress, never, viewer.centre
    )


def open_undrawn(
    source: Source,
    depth_strength: float,
    needs_disparity: bool,
    on_ready: Callable[[Scene], None],
    report_progress: ReportProgress = ignore_progress,
    gloss: Gloss | None = None,
) -> ExportSource:
    """Read and planned, for kinds that make the views themselves. needs_disparity: of a light field too, which else is
    taken as it is. gloss: of these views. on_ready, and what is raised: as `open_drawn`.
    """
    request = SceneRequest(0, source, depth_strength, takes_drafts=not needs_disparity)
    results = results_of(
        request, never, lambda: CENTRE, lambda made: report_progress(made.share, float(made.total > 0), made.doing)
    )
    ready = next(results)
    assert isinstance(ready, SceneReady)
    on_ready(ready.scene)
    return ExportSource(ready.scene, ready.loaded, Optics(gloss=gloss), undrawn, ignore_progress, never, ready.centre)
