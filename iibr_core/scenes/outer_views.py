"""The outer views of a scene, which have seen some of what lies behind the centre view's surfaces."""

from contextlib import suppress

import numpy as np

from iibr_core.beyond.hidden_surfaces import HiddenSurface, SeenBehind, hidden_surface
from iibr_core.color import encoded_from_stored
from iibr_core.method.farthest_views import outer_views_of_grid
from iibr_core.runtime.tiling import THREADS
from iibr_core.runtime.work import Cancelled
from iibr_core.scenes.lens_limits import aperture_limit
from iibr_core.scenes.scene import Scene
from iibr_core.types import ViewUpdate


class OuterViews:
    """Keeps the outer views among those of a scene until the surface behind the centre view's is asked for."""

    def __init__(self, scene: Scene) -> None:
        self._scene = scene
        self._wanted = {scene.grid.index_of(at) for at in outer_views_of_grid(scene.grid)}
        self._seen = dict[tuple[int, int], SeenBehind]()

    def take(self, view: ViewUpdate) -> bool:
        """Keep a view if it is an outer one, final and with disparity; return whether all are there that this adds to.

        A scene without outer views has nothing to wait for.
        """
        place = view.row, view.column
        if view.disparity is None or not view.is_final:
            return False
        if place in self._wanted:
            inpainted = view.inpainted if self._scene.plan else None
            self._seen[place] = SeenBehind(self._scene.viewpoint(*place), view.colors, view.disparity, inpainted)
        return self._seen.keys() == self._wanted and (place in self._wanted or not self._wanted)

    def hidden_behind(self, centre: ViewUpdate) -> HiddenSurface | None:
        """Return the surface behind the centre view's, None if it has no disparity or the work is stopped."""
        if centre.disparity is None:
            return None
        with suppress(Cancelled):
            colors = np.ascontiguousarray(encoded_from_stored(centre.colors), np.float32)
            radius = aperture_limit(self._scene) / 2
            return hidden_surface(colors, centre.disparity, radius, self._seen.values(), THREADS)
        return None
