"""The paper's update loop (section 3), the only one: what the outer views disocclude is inpainted once and joins the
ray set.

After that the ray set is final: all views made of it show the same content in a hole, in whatever order they come.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from iibr_core.inpainting.background import fill_background
from iibr_core.inpainting.inpainter import Inpainter
from iibr_core.rendering.ray_set import RaySet
from iibr_core.rendering.rendered_view import RenderedView
from iibr_core.rendering.renderer import open_renderer
from iibr_core.types import ViewOffset


def render_outer_views(
    rays: RaySet,
    outer: Iterable[ViewOffset],
    inpainter: Inpainter = fill_background,
    slots: int = 5,
) -> Iterator[tuple[ViewOffset, RenderedView]]:
    """Each of these views with its offset, in order; when it is yielded, what it disoccluded has joined the ray set.

    Weights are the closed form's in every quality: its disparity is smoother, and so is what is inpainted.
    inpainter, slots: see `ViewSynthesis`.
    """
    with open_renderer(slots=slots, inpainter=inpainter, reopens_holes=True) as renderer:
        for offset in outer:
            view = renderer.render(rays, offset)
            renderer.add_rays(rays, offset, view)
            yield offset, view


def complete_ray_set(rays: RaySet, outer: Iterable[ViewOffset]) -> None:
    """`render_outer_views` for those who want the rays only."""
    for _ in render_outer_views(rays, outer):
        pass
