"""Programs compiled ahead: one a turn, those that pictures are then drawn with."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from iibr_core.scenes.screen_size import ScreenSize
from tests.viewer.conftest import headless_with_scene
from viewer.display.offscreen import OffscreenScene
from viewer.display.preparation import NEXT, Preparation
from viewer.gpu.refocus.picture_renderer import Renderer

SIZE = ScreenSize(384, 256)


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[OffscreenScene]:
    """All views are there, and nothing but the photo was drawn."""
    with headless_with_scene(tmp_path) as viewer:
        viewer.view.converge(viewer.state, SIZE)
        yield viewer


def test_a_program_a_turn_is_compiled_and_none_when_pictures_are_drawn(opened: OffscreenScene) -> None:
    renderer, picture = opened.view.renderer, opened.view.picture_drawn
    preparation, shown = Preparation(renderer), renderer.read_image()
    turns, there = 0, len(renderer.programs)
    while preparation.advance(picture, is_resting=True):
        # The last step of a picture smooths and finishes it.
        assert len(renderer.programs) - there <= 2
        turns, there = turns + 1, len(renderer.programs)
    assert turns > 8
    for optics in NEXT:
        renderer.render(optics, SIZE)
        renderer.refine()
    assert len(renderer.programs) == there
    renderer.render(opened.state.optics, SIZE)
    assert (renderer.read_image() == shown).all()


def test_what_every_photo_takes_is_compiled_before_one_is_open(opened: OffscreenScene) -> None:
    renderer = Renderer(opened.gl)
    preparation = Preparation(renderer)
    while preparation.advance(None, is_resting=False):
        pass
    assert renderer.programs._programs.keys() == opened.view.renderer.programs._programs.keys()
    renderer.release()


def test_nothing_is_compiled_while_a_picture_moves_or_views_come(opened: OffscreenScene) -> None:
    renderer = opened.view.renderer
    there = len(renderer.programs)
    preparation = Preparation(renderer)
    assert not preparation.advance(opened.view.picture_drawn, is_resting=False)
    assert len(renderer.programs) == there
