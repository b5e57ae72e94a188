"""The panel's text from 60 % to 200 %: nothing cut or covered, contrast of 4.5 : 1, and controls that stay in place."""

from dataclasses import replace
from itertools import combinations

import pytest
from imgui_bundle import imgui

from iibr_core.beyond.optics import APERTURE_KINDS, ApertureMask, ApertureShape
from iibr_core.depth.editing.edits import DepthEdits
from iibr_core.scenes.scene import DepthSettings
from iibr_core.scenes.screen_size import ScreenSize
from tests.viewer.ui.conftest import WORDS_INSIDE
from viewer.background.depth_models import list_models
from viewer.model import depth, depth_models, inspection, lens, messages, preferences, viewpoint
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.browsing import Listing, PathPrompt
from viewer.model.commands import PalettePrompt
from viewer.model.depth import Brush, DepthSample
from viewer.model.depth_models import ModelsPrompt
from viewer.model.layout import PANEL_WIDTH
from viewer.model.lens import FIRST_GLOSS, GlossBrush
from viewer.model.preferences import SECTIONS
from viewer.model.saving import ExportPrompt, JobProgress, SavePrompt
from viewer.ui.style import Look, apply_style, palette_of

WINDOW, SMALL_WINDOW = ScreenSize(1280, 800), ScreenSize(400, 300)
MIN_CONTRAST = 4.5
MIN_HOVER_CONTRAST = 1.5
SCALES = (0.6, 1.0, 2.0)
SLACK_PX = 1.0
WIDGETS = (*WORDS_INSIDE, "text", "text_disabled", "checkbox", "tree_node_ex")
OPEN_SECTIONS = SECTIONS


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("units", ["photographic", "light field"])
def test_no_widget_is_cut_and_none_lies_over_another(viewer, built, scale, units):
    optics = (do(lens.set_aperture, 2.3), do(lens.set_focus_range, 0.7), do(lens.set_focus_tilt, (0.3, -0.2)))
    kind = APERTURE_KINDS[SCALES.index(scale) % (len(APERTURE_KINDS) - 1)]
    viewer.do(
        do(preferences.set_font_scale, scale),
        do(preferences.set_units, units),
        do(lens.set_aperture_shape, ApertureShape(kind)),
        *optics,
    )
    left = 120  # room for a small picture: it is not what is looked at
    right = left + PANEL_WIDTH * scale
    viewer.screen(ScreenSize(round(right), 2600))
    items = [item for item in built if item.kind in WIDGETS and item.window == "panel"]
    assert len(items) > 40
    for item in items:
        assert left - SLACK_PX <= item.left, f"{item} begins outside"
        assert item.right <= right - 14 * scale + SLACK_PX, f"{item} is cut at the right"
        if item.kind in WORDS_INSIDE:
            assert item.words_width <= item.right - item.left + SLACK_PX, f"{item} has no room for its words"
    for one, other in combinations(items, 2):
        across = min(one.right, other.right) - max(one.left, other.left)
        down = min(one.bottom, other.bottom) - max(one.top, other.top)
        assert min(across, down) <= SLACK_PX, f"{one} lies over {other}"


PROMPTS = {
    "help": "help",
    "about": "about",
    "quit": "quit",
    "quit while busy": "quit",
    "palette": PalettePrompt(),
    "save": SavePrompt("a.jpg", ScreenSize(48, 32), problem="There is no such folder: choose another one, or make it."),
    "path": PathPrompt("photo", "/p/", listing=Listing("/p/", "/p", ("one with a long name that is cut",), ("a.jpg",))),
    "export": ExportPrompt("mp4", "a.mp4"),
    "models": ModelsPrompt(),
}
WELCOME, SMALL = "welcome", "welcome in a small window"
"""No prompt, but alike: what an empty window says."""
RECENT = "/photos/a.jpg", "/photos/one with a long name that does not fit into one line.jpg", "/photos/b.jpg"


@pytest.mark.parametrize("scale", [0.6, 2.0])
@pytest.mark.parametrize("name", [*PROMPTS, WELCOME, SMALL])
def test_prompts_fit_the_window_and_their_words_fit_them(viewer, built, monkeypatch, name, scale):
    ended = []
    end = imgui.end

    def note_and_end():
        corner, size = imgui.get_window_pos(), imgui.get_window_size()
        if imgui.internal.get_current_window_read().name.startswith(("prompt", WELCOME)):
            ended.append((corner.x, corner.y, corner.x + size.x, corner.y + size.y, imgui.get_scroll_max_x()))
        end()

    monkeypatch.setattr(imgui, "end", note_and_end)
    if name == "quit while busy":
        jobs = JobProgress(1, "export", "a.mp4", "drawing frames", 0.5), JobProgress(2, "picture", "b.png")
        edited = DepthSettings(edits=DepthEdits(gamma=1.5))
        viewer.state = replace(viewer.state, jobs=jobs, depth=edited)
    if name in (WELCOME, SMALL):
        viewer.state = AppState(recent=RECENT, existing_recent=RECENT)
    viewer.do(
        do(preferences.set_font_scale, scale),
        do(depth_models.set_known, list_models()),
        do(messages.show_prompt, PROMPTS.get(name)),
    )
    window = SMALL_WINDOW if name == SMALL else WINDOW
    viewer.screen(window)
    left, top, right, bottom, hidden = ended[-1]
    assert (left >= 0, top >= 0, right <= window.width, bottom <= window.height) == (True,) * 4, ended[-1]
    assert hidden == 0, "cut at the right"
    within = [item for item in built if left <= item.left < right and top <= item.top < bottom]
    assert within
    for item in within:
        assert item.kind not in WORDS_INSIDE or item.words_width <= item.right - item.left + SLACK_PX, item


def contrast(one, other):
    """Of two sRGB colours, as the Web Content Accessibility Guidelines have it: 1 to 21."""

    def light(color):
        linear = [v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4 for v in color[:3]]
        return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]

    low, high = sorted((light(one), light(other)))
    return (high + 0.05) / (low + 0.05)


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_words_stand_out_from_what_they_stand_on(theme):
    palette = palette_of(theme)
    assert contrast((0, 0, 0, 1), (1, 1, 1, 1)) == pytest.approx(21)
    pairs = {
        (words, ground): contrast(getattr(palette, words), getattr(palette, ground))
        for words, ground in [
            *(
                ("text", ground)
                for ground in ("panel", "frame", "frame_hovered", "accent_dim", "selected", "background")
            ),
            *(("quiet", ground) for ground in ("panel", "frame", "background")),
            ("error", "panel"),
            ("warning", "panel"),
        ]
    }
    assert not {pair: round(value, 2) for pair, value in pairs.items() if value < MIN_CONTRAST}


@pytest.mark.parametrize("theme", ["dark", "light"])
def test_an_entry_under_the_pointer_stands_out_from_its_list(theme):
    context = imgui.create_context()
    try:
        apply_style(Look(theme=theme))
        color, c = imgui.get_style().color_, imgui.Col_
        hovered, ground = (tuple(color(which)) for which in (c.header_hovered, c.popup_bg))
    finally:
        imgui.destroy_context(context)
    assert contrast(hovered, ground) > MIN_HOVER_CONTRAST


MASK = ApertureMask("star.png", 1, 1, b"\xff")
GLOSSY = do(lens.set_gloss, FIRST_GLOSS)
TALL = ScreenSize(900, 2600)
SWITCHES = {
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


def test_what_is_switched_on_moves_nothing(viewer, built):
    def tops():
        viewer.screen(TALL)
        kinds = ("text", "button", "checkbox", "invisible_button")
        return {item.name: item.top for item in built if item.kind in kinds and item.window == "panel"}

    before, state = tops(), viewer.state
    assert len(before) > 40
    for name, actions in SWITCHES.items():
        viewer.state = state
        viewer.do(*actions)
        after = tops()
        assert {words for words, top in before.items() if words in after and after[words] != top} == set(), name
        assert "Size" in after, "the last section was built"
