"""The update loop of the paper (section 3.3): what the farthest views disocclude is inpainted once and joins the rays.

After that the ray set is final: all views made of it show the same content in a hole, in whatever order they come.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from iibr_core.method.rays import RaySet
from iibr_core.method.view import Renderer, View
from iibr_core.runtime.tiling import THREADS
from iibr_core.types import ViewOffset


def update(rays: RaySet, farthest: Iterable[ViewOffset], renderer: Renderer) -> Iterator[tuple[ViewOffset, View]]:
    """Yield each of these views with its offset, in order, after what was inpainted there has joined the rays."""
    for offset in farthest:
        view = renderer.render(rays, offset, THREADS, reopens=True)
        if view.behind is not None or view.occluded.any():
            rays.add(offset, view.colors, view.disparity, view.occluded, view.behind)
        yield offset, view
