"""Gloss on an open scene: its surfaces, the reflected light, and the views with it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from iibr_core.color import encoded_from_stored, linear_from_srgb
from iibr_core.rendering.gloss.gloss_settings import Gloss, of_maps
from iibr_core.scenes.scene import Scene
from iibr_core.types import Disparity, FloatImage, ViewUpdate

if TYPE_CHECKING:
    from iibr_core.rendering.gloss.geometry import SceneGeometry
    from iibr_core.rendering.gloss.shading import GlossMaps


MOST_ENVIRONMENT_PIXELS = 2_000_000


def geometry_of(scene: Scene, disparity: FloatImage) -> SceneGeometry:
    """Return the positions of a scene's points; a usual field of view is assumed where none is known.

    disparity: (H, W), of its centre view; that of a light field from disk gives the points that may be infinitely far.
    """
    from iibr_core.formats.images.photo import focal_px_from_fov
    from iibr_core.rendering.gloss.geometry import SceneGeometry, infinity_of

    infinity = infinity_of(Disparity(disparity, scene.name)) if scene.plan is None else scene.infinity_px
    return SceneGeometry(scene.focal_px or focal_px_from_fov(scene.width), infinity)


def read_environment(gloss: Gloss) -> FloatImage | None:
    """Linear light (h, w, 3) of the surroundings, None without. Raises InputError where they cannot be read."""
    if not gloss.environment:
        return None
    from iibr_core.formats.images.photo import read_photo

    return linear_from_srgb(read_photo(Path(gloss.environment), MOST_ENVIRONMENT_PIXELS).pixels)


@dataclass(frozen=True, eq=False)
class GlossRequest:
    """A request for the effect of a gloss on a scene. centre: its centre view; normals: of that, where known."""

    gloss: Gloss
    scene: Scene
    centre: ViewUpdate
    normals: FloatImage | None = None

    def is_for(self, gloss: Gloss, centre: ViewUpdate) -> bool:
        """Whether the answer is the same for these."""
        return of_maps(self.gloss) == of_maps(gloss) and self.centre is centre


@dataclass(frozen=True, eq=False)
class GlossFound:
    """maps: None where there is no disparity."""

    request: GlossRequest
    maps: GlossMaps | None


def answer(request: GlossRequest) -> GlossFound:
    """Raises as `maps_of_scene`."""
    maps = maps_of_scene(request.gloss, request.scene, request.centre, request.normals)
    return GlossFound(request, maps)


def maps_of_scene(
    gloss: Gloss,
    scene: Scene,
    centre: ViewUpdate,
    normals: FloatImage | None = None,
) -> GlossMaps | None:
    """Return the effect of the gloss on a scene with this centre view, None if that has no disparity. normals: of its
    disparity, where they are known.

    Raises InputError where the gloss is not sound or its surroundings cannot be read.
    """
    if centre.disparity is None:
        return None
    from iibr_core.rendering.gloss.shading import make_gloss_maps

    photo = encoded_from_stored(centre.colors)
    around = read_environment(gloss)
    return make_gloss_maps(gloss, photo, centre.disparity, geometry_of(scene, centre.disparity), around, normals)


def add_gloss(views: Iterator[ViewUpdate], gloss: Gloss | None, scene: Scene) -> Iterator[ViewUpdate]:
    """The views of a scene, the centre first, with its gloss; the same iterator where there is none.

    Raises as `maps_of_scene`.
    """
    return views if gloss is None else _shaded(views, gloss, scene)


def _shaded(views: Iterator[ViewUpdate], gloss: Gloss, scene: Scene) -> Iterator[ViewUpdate]:
    from iibr_core.rendering.gloss.shading import shade_views

    centre = next(views)
    maps = maps_of_scene(gloss, scene, centre)
    whole = chain((centre,), views)
    return whole if maps is None else shade_views(whole, maps, scene.grid)
