"""Controls keep their places: what a click switches on moves nothing that might be clicked next."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from imgui_bundle import imgui

from iibr_core.beyond.optics import APERTURE_KINDS, ApertureMask, ApertureShape
from iibr_core.scenes.screen_size import ScreenSize
from tests.viewer.conftest import headless_with_scene
from viewer.display.offscreen import OffscreenScene
from viewer.model import depth, inspection, lens, viewpoint
from viewer.model.action import Action, do
from viewer.model.state.depth import Brush, DepthSample
from viewer.model.state.lens import FIRST_GLOSS, GlossBrush
from viewer.model.state.preferences import SECTIONS

MASK = ApertureMask("star.png", 1, 1, b"\xff")
GLOSSY = do(lens.set_gloss, FIRST_GLOSS)
TALL = ScreenSize(900, 2600)
SWITCHES: dict[str, tuple[Action, ...]] = {
    "loop": (do(viewpoint.set_loop, "circle"),),
    "tilt": (do(lens.show_tilt_handles, True),),
    **{kind: (do(lens.set_aperture_shape, ApertureShape(kind, mask=MASK)),) for kind in APERTURE_KINDS},
    "gloss": (GLOSSY,),
    "gloss of strokes": (
        do(lens.set_gloss, replace(FIRST_GLOSS, surface=replace(FIRST_GLOSS.surface, strokes_only=True))),
    ),
    "gloss of a colour": (
        do(lens.set_gloss, replace(FIRST_GLOSS, surface=replace(FIRST_GLOSS.surface, color=(1, 0, 0)))),
    ),
    "gloss brush": (GLOSSY, do(lens.take_gloss_brush, GlossBrush(is_on=True))),
    "brush": (do(depth.set_brush, Brush("nearer", is_on=True)),),
    "bucket": (do(depth.set_brush, Brush("fill", is_on=True)), do(depth.pick, DepthSample((0.5, 0.5), 1.0))),
    "EPIs": (do(inspection.show_epis, True),),
    "overlay": (do(inspection.set_overlay, "disparity"),),
    "photo": (do(inspection.compare, "photo"),),
    "snapshot": (do(inspection.take_snapshot), do(inspection.compare, "snapshot")),
}


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[OffscreenScene]:
    with headless_with_scene(tmp_path_factory.mktemp("steady"), *SECTIONS) as viewer:
        yield viewer


@pytest.fixture
def tops(monkeypatch: pytest.MonkeyPatch) -> dict[str, float]:
    """Where each label, button and box of the panel was laid out last, by its words."""
    found: dict[str, float] = {}

    def watch(kind: str) -> None:
        real = getattr(imgui, kind)

        def build(words: str, *others: Any) -> Any:
            result = real(words, *others)
            found[words] = imgui.get_item_rect_min().y
            return result

        monkeypatch.setattr(imgui, kind, build)

    for kind in ("text", "button", "checkbox", "invisible_button"):
        watch(kind)
    return found


@pytest.mark.parametrize("name", SWITCHES)
def test_what_is_switched_on_moves_nothing(viewer: OffscreenScene, tops: dict[str, float], name: str) -> None:
    viewer.screen(TALL)
    before = dict(tops)
    assert len(before) > 40
    tops.clear()
    viewer.do(*SWITCHES[name])
    viewer.screen(TALL)
    moved = {words: (top, tops[words]) for words, top in before.items() if words in tops and tops[words] != top}
    assert not moved
    assert "Size" in tops, "the last section was built"
