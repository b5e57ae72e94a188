"""Gloss on an open scene: the maps of its glossy surface, and its views with gloss."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import chain
from typing import TYPE_CHECKING

from iibr_core.color import encoded_from_stored
from iibr_core.formats.cameras import infinity_of
from iibr_core.gloss.geometry import SceneGeometry
from iibr_core.gloss.settings import Gloss, GlossSurface
from iibr_core.scenes.scene import Scene
from iibr_core.types import FloatImage, ViewUpdate

if TYPE_CHECKING:
    from iibr_core.gloss.shading import GlossMaps


@dataclass(frozen=True)
class GlossRequest:
    """A request for the maps of a glossy surface; equal requests have the same answer.

    centre: has a disparity. normals: of the centre view, if known.
    """

    surface: GlossSurface
    scene: Scene = field(compare=False)
    centre: ViewUpdate
    normals: FloatImage | None = field(default=None, compare=False)


def gloss_request(
    gloss: Gloss | None, scene: Scene, centre: ViewUpdate, known: GlossMaps | None = None
) -> GlossRequest | None:
    """Return the request for the maps that a gloss needs.

    None if they are `known`, the last maps of this centre view, or if it has no disparity.
    """
    if gloss is None or centre.disparity is None:
        return None
    if known is None:
        return GlossRequest(gloss.surface, scene, centre)
    return None if known.surface == gloss.surface else GlossRequest(gloss.surface, scene, centre, known.normals)


def make_maps(request: GlossRequest) -> GlossMaps:
    """Return the maps of a glossy surface.

    A usual field of view is assumed where none is known. For a light field from disk, the disparity at infinity is
    guessed from the centre view.
    """
    from iibr_core.formats.images.photo import focal_px_from_fov
    from iibr_core.gloss.shading import make_gloss_maps

    scene, disparity = request.scene, request.centre.disparity
    assert disparity is not None
    infinity = scene.infinity_px
    if infinity is None:
        infinity = infinity_of(float(disparity.min()), float(disparity.max()))
    geometry = SceneGeometry(scene.focal_px or focal_px_from_fov(scene.width), infinity)
    photo = encoded_from_stored(request.centre.colors)
    return make_gloss_maps(request.surface, photo, disparity, geometry, request.normals)


def add_gloss(views: Iterator[ViewUpdate], gloss: Gloss | None, scene: Scene) -> Iterator[ViewUpdate]:
    """Yield the views of a scene, the centre first, with its gloss if there is any."""
    if gloss is None:
        yield from views
        return
    from iibr_core.gloss.shading import shade_views

    centre = next(views)
    request = gloss_request(gloss, scene, centre)
    views = chain((centre,), views)
    yield from views if request is None else shade_views(views, gloss, make_maps(request), scene.viewpoint)
