"""Pictures from several viewpoints at once: in time while something moves, converged at rest."""

import math
from dataclasses import replace

import numpy as np
import pytest

from iibr_core.evaluation.metrics import psnr
from iibr_core.gloss.settings import Gloss
from iibr_core.scenes.scene_gloss import make_maps
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from tests.viewer.conftest import headless_with_scene
from viewer.display.stereo_view import StereoView
from viewer.model import lens, stereo
from viewer.model.action import do

SCREEN = ScreenSize(192, 64)


@pytest.mark.parametrize("aperture", [0.0, 2.0])
@pytest.mark.parametrize("count", [2, 9])
def test_pictures_are_quick_first_and_converge(tmp_path, count, aperture):
    with headless_with_scene(tmp_path) as scene:
        scene.do(do(stereo.set_mode, "sbs"), do(lens.set_aperture, aperture), do(lens.move_eye, ViewOffset(0.4, 0)))
        weave = stereo.weave_of(scene.state, scene.scene, SCREEN)
        weave = replace(weave, eyes=stereo.eyes_at(scene.scene, scene.state.optics, scene.state.stereo, count))
        view = StereoView(scene.gl, scene.view)
        first = view.draw(weave, 1e-4)
        quick = view.screen.read()
        assert view.is_drawing
        while view.is_drawing:
            last = view.draw(weave, 1e-4)
        assert view.draw(weave) == last != first
        shown = view.screen.read()
        moved = replace(weave, eyes=weave.eyes[::-1])
        assert view.draw(moved, math.inf) != last
        gloss = Gloss(roughness=0.5, reflectance=0.5)
        glossy = replace(weave, eyes=tuple(replace(eye, optics=replace(eye.optics, gloss=gloss)) for eye in weave.eyes))
        view.draw(glossy, math.inf)
        matt = view.screen.read()
        scene.view.take_gloss(make_maps(scene.view.gloss_request(gloss)))
        view.draw(glossy, math.inf)
        assert view.screen.read().astype(int).sum() > matt.astype(int).sum(), "maps that come later are seen"
        view.release()
        pair = weave.eyes[:2]
        wanted = np.hstack([scene.draw(each) for each in pair])
    assert psnr(shown, wanted) >= 60
    assert 15 < psnr(quick, wanted) < 60
