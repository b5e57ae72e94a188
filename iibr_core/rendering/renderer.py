"""The seam for engines that render views: all that makes them goes through this protocol, whatever stands behind it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from contextlib import AbstractContextManager
from typing import Protocol, TypeVar

from iibr_core.rendering.ambiguous_rays import UndecidedRays
from iibr_core.rendering.ray_set import RaySet
from iibr_core.rendering.rendered_view import DecidedRays, RenderedView
from iibr_core.rendering.view_synthesis import ViewSynthesis
from iibr_core.types import FloatImage, ViewOffset

Item = TypeVar("Item")
Result = TypeVar("Result")

open_renderer = ViewSynthesis
"""The engine in use, with its options; a context manager."""


class Renderer(AbstractContextManager["Renderer"], Protocol):
    """Renders views of ray sets. All raise Cancelled once it is told to stop, ValueError for offsets not finite."""

    def add_rays(self, rays: RaySet, offset: ViewOffset, view: RenderedView) -> None:
        """What was filled in the view at an offset joins the ray set."""

    def render(self, rays: RaySet, offset: ViewOffset, alone: bool = False) -> RenderedView:
        """The view at an offset, its holes filled. alone: in the calling thread."""

    def draft(self, rays: RaySet, offset: ViewOffset) -> tuple[RenderedView, list[UndecidedRays]]:
        """The view in closed form, alone; and the rays that are the transformer's, none where there is nothing to
        decide. Written over with what `decide` says of them, it is the view of `render`.
        """

    def decide(self, rays: RaySet, undecided: UndecidedRays) -> DecidedRays:
        """What undecided rays show is the transformer's choice."""

    def seen(self, rays: RaySet, offset: ViewOffset) -> tuple[RenderedView, FloatImage]:
        """What the set itself shows, in closed form and alone, its holes left open (`occluded`); and how much of each
        ray is covered (H, W).
        """

    def side_by_side(self, work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """The results of work on all items, in their order. An item is only taken when a thread is free for it."""
