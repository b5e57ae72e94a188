"""A stroke under way, seen in the colours of depth before the views are made."""

from dataclasses import replace

import numpy as np

from iibr_core.depth.editing.edits import Stroke
from iibr_core.scenes.screen_size import ScreenSize
from tests.viewer.conftest import headless_with_scene
from viewer.display.depth_preview import DepthPreview
from viewer.model import inspection
from viewer.model.action import do
from viewer.model.window import layout_for

SIZE = ScreenSize(640, 800)


def test_a_stroke_is_seen_where_it_is_painted_and_nowhere_else(tmp_path):
    with headless_with_scene(tmp_path) as viewer:
        viewer.do(do(inspection.set_overlay, "disparity"), do(inspection.set_opacity, 1.0))
        x, y, width, height = layout_for(viewer.state, SIZE, 1.0, 1.0).frame_px
        preview, before = DepthPreview(viewer.view), viewer.screen(SIZE).astype(int)
        for stroke in (Stroke("farther", ((0.5, 0.5),), 0.1, 1.0), None):
            viewer.state = replace(viewer.state, stroke=stroke)
            preview.update(viewer.state)
            changed = np.abs(viewer.screen(SIZE) - before).max(axis=2)[y : y + height, x : x + width] > 24
            rows, columns = np.nonzero(changed)
            assert (rows.size > 200) == (stroke is not None)
            away = np.hypot((columns - width / 2) / width, (rows - height / 2) / width)
            assert (away < 0.12).all()
