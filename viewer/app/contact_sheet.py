"""A sheet of small pictures that shows on paper what the window shows in motion."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.scenes.lens_limits import aperture_limit
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from viewer.display.offscreen import OffscreenScene
from viewer.model import lens
from viewer.model.action import do

TILE_WIDTH = 480
GAP = 8


def contact_sheet(viewer: OffscreenScene) -> NDArray[np.uint8]:
    """Two rows of three: the viewpoint from left to right, and the focus from near to far with an open aperture."""
    scene = viewer.state.scene
    assert scene is not None
    size = ScreenSize(TILE_WIDTH, max(round(TILE_WIDTH * scene.height / scene.width), 1))
    reach = scene.grid.columns // 2
    far, near = scene.disparity_range_px
    viewpoints = [(do(lens.move_eye, ViewOffset(0, s)),) for s in (-reach, 0, reach)]
    focused = [
        (do(lens.set_focus, d), do(lens.set_aperture, 0.8 * aperture_limit(scene.grid)))
        for d in (near, (near + far) / 2, far)
    ]
    tiles = []
    for actions in (*viewpoints, *focused):
        viewer.do(do(lens.reset), *actions)
        tiles.append(viewer.picture(size))
    viewer.do(do(lens.reset))
    return _sheet(tiles, columns=3)


def _sheet(tiles: list[NDArray[np.uint8]], columns: int) -> NDArray[np.uint8]:
    framed = [np.pad(tile, ((GAP, 0), (GAP, 0), (0, 0))) for tile in tiles]
    rows = [np.hstack(framed[i : i + columns]) for i in range(0, len(framed), columns)]
    return np.pad(np.vstack(rows), ((0, GAP), (0, GAP), (0, 0)))
