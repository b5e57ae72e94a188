"""Opening a scene for one export: what is drawn is opened by whoever draws, the rest here."""

from __future__ import annotations

from collections.abc import Callable, Iterable

from iibr_core.exports.kinds import ExportKind
from iibr_core.exports.options import ExportOptions
from iibr_core.exports.source import ExportSource, undrawn
from iibr_core.exports.writers import optics_of
from iibr_core.rendering.optics import CENTRE, Optics
from iibr_core.runtime.tiling import never
from iibr_core.scenes.lens_limits import LensChoice
from iibr_core.scenes.opening import SceneReady, SceneRequest, results_of
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import ReportProgress, ignore_progress

OpticsOf = Callable[[Scene, Optics], Iterable[Optics]]
"""What pictures of a scene, shown so, are drawn with."""

OpenDrawn = Callable[[Source, float, LensChoice, Callable[[Scene], None], ReportProgress, OpticsOf], ExportSource]
"""Opens a scene, of this depth strength, to be drawn through this lens. Of a photo's views those are made that pictures
with the last function's optics show. The first one is told the scene before any of them; what it raises ends the
opening. Raises InputError.
"""


def open_for_export(
    kind: ExportKind,
    options: ExportOptions,
    source: Source,
    depth_strength: float,
    lens: LensChoice,
    on_ready: Callable[[Scene], None],
    open_drawn: OpenDrawn | None,
    report_progress: ReportProgress = ignore_progress,
) -> ExportSource:
    """What an export of this kind is made of. open_drawn: not asked where nothing is drawn. on_ready,
    and what is raised: see `OpenDrawn`.
    """
    if kind.is_drawn:
        assert open_drawn is not None
        return open_drawn(source, depth_strength, lens, on_ready, report_progress, optics_of(kind, options))
    needs_disparity = not kind.layout  # a light field from disk is else taken as it is
    request = SceneRequest(0, source, depth_strength, takes_drafts=not needs_disparity)
    results = results_of(request, never, lambda: CENTRE, lambda made: made.report_to(report_progress))
    ready = next(results)
    assert isinstance(ready, SceneReady)
    on_ready(ready.scene)
    optics = Optics(gloss=lens.gloss)
    return ExportSource(ready.scene, ready.loaded, optics, undrawn, ignore_progress, never, ready.centre)
