"""Drawings of inspection over and beside the picture: overlay and legend, comparison, sheet of views, EPIs, status."""

from __future__ import annotations

from imgui_bundle import imgui

from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from iibr_core.types import ViewOffset
from viewer.model.colormap import VIRIDIS, map_color
from viewer.model.inspection import InspectionTextures, sheet_cells, view_near
from viewer.model.layout import Layout
from viewer.model.state.app_state import AppState, Hover
from viewer.model.state.inspection import Comparison, Probe
from viewer.model.units import metres, metres_text
from viewer.ui.overlays.chips import has_guess_badge
from viewer.ui.overlays.reticle import WORD_GAP, hover_text
from viewer.ui.style import DARK, Color, corners, pack_color, palette_of

LEGEND_WIDTH, LEGEND_HEIGHT = 150.0, 10.0
SIDES: dict[Comparison, tuple[str, str]] = {
    "photo": ("photo", "picture"),
    "snapshot": ("snapshot", "picture"),
}
BLACK: Color = (0.0, 0.0, 0.0, 1.0)


def draw_over_picture(state: AppState, layout: Layout, textures: InspectionTextures) -> None:
    """Draw overlay, comparison and sheet over the picture. Colours do not follow the theme: below is a photo."""
    scene, frame = state.scene, layout.frame
    if scene is None or frame is None:
        return
    if textures.overlay is not None:
        _image(textures.overlay, frame)
        _draw_legend(state, scene, layout, frame)
    if state.shows_before:
        _words("before", frame.x + 8 * layout.ui_scale, frame.y + 8 * layout.ui_scale, layout.ui_scale)
    if textures.compared is not None:
        _draw_comparison(state, layout, frame, textures.compared)
    if textures.sheet is not None:
        _draw_sheet(state, scene, layout, frame, textures.sheet)


def draw_beside_picture(state: AppState, layout: Layout, textures: InspectionTextures) -> None:
    """Draw EPIs and status line."""
    scene, picture = state.scene, layout.picture
    if scene is None or picture is None:
        return
    if layout.strip_across is not None and layout.strip_down is not None:
        _draw_strips(state, scene, layout, picture, textures)
    if layout.status is not None:
        _draw_status(state, scene, layout, layout.status)


def status_text(state: AppState, scene: Scene, hover: Hover, probe: Probe | None) -> list[str]:
    """Return the values under the pointer, the most important first."""
    words = [f"{hover.x_px:.0f}, {hover.y_px:.0f}"]
    if hover.disparity is not None:
        words += hover_text(state.optics, scene, hover, state.preferences.units).split(WORD_GAP)
    return words if probe is None else [*words, probe.origin, "RGB {} {} {}".format(*probe.rgb)]


def _image(texture: int, rect: Rect) -> None:
    imgui.get_background_draw_list().add_image(imgui.ImTextureRef(texture), *corners(rect))


def _line(x0: float, y0: float, x1: float, y1: float, color: int, width: float) -> None:
    """Draw a line with a dark rim, legible on any ground."""
    draw = imgui.get_background_draw_list()
    ends = imgui.ImVec2(x0, y0), imgui.ImVec2(x1, y1)
    draw.add_line(*ends, pack_color(BLACK, 0.55), 2.5 * width)
    draw.add_line(*ends, color, width)


def _words(words: str, x: float, y: float, scale: float, align: float = 0.0) -> None:
    """Draw words on a dark ground. align: 0 begins at x, 1 ends there."""
    draw, size, room = imgui.get_background_draw_list(), imgui.calc_text_size(words), 5 * scale
    left = x - align * (size.x + 2 * room)
    corners = imgui.ImVec2(left, y), imgui.ImVec2(left + size.x + 2 * room, y + size.y + room)
    draw.add_rect_filled(*corners, pack_color(DARK.background, 0.72), 4 * scale)
    draw.add_text(imgui.ImVec2(left + room, y + room / 2), pack_color(DARK.text), words)


def _draw_legend(state: AppState, scene: Scene, layout: Layout, frame: Rect) -> None:
    """Draw the colors with their values, and a mark for the value under the pointer."""
    kind, scale = state.inspection.overlay, layout.ui_scale
    x, y, room = frame.x + 8 * scale, frame.y + 8 * scale, 5 * scale
    if has_guess_badge(state, layout):
        y += imgui.get_frame_height() + 8 * scale
    if kind == "inpainted" or state.selection is not None:
        _words("inpainting" if state.selection is None else "selected surface", x, y, scale)
        return
    draw, line = imgui.get_background_draw_list(), imgui.get_text_line_height()
    width, height = LEGEND_WIDTH * scale, LEGEND_HEIGHT * scale
    ends = scene.disparity_range_px if kind == "disparity" else (0.0, 1.0)
    name, labels = legend_words(state, scene, ends)
    far = imgui.ImVec2(x + width + 2 * room, y + height + line + 2.5 * room)
    draw.add_rect_filled(imgui.ImVec2(x, y), far, pack_color(DARK.background, 0.72), 4 * scale)
    left, top = x + room, y + room
    step = width / (len(VIRIDIS) - 1)
    for i in range(len(VIRIDIS) - 1):
        low, high = (pack_color((*map_color(j / (len(VIRIDIS) - 1)), 1.0)) for j in (i, i + 1))
        corner, end = imgui.ImVec2(left + i * step, top), imgui.ImVec2(left + (i + 1) * step, top + height)
        draw.add_rect_filled_multi_color(corner, end, low, high, high, low)
    below = top + height + room / 2
    draw.add_text(imgui.ImVec2(left, below), pack_color(DARK.text), labels[0])
    draw.add_text(
        imgui.ImVec2(left + width - imgui.calc_text_size(labels[1]).x, below), pack_color(DARK.text), labels[1]
    )
    middle = left + (width - imgui.calc_text_size(name).x) / 2
    draw.add_text(imgui.ImVec2(middle, below), pack_color(DARK.quiet), name)
    if kind == "disparity" and state.hover is not None and state.hover.disparity is not None and ends[1] > ends[0]:
        share = min(max((state.hover.disparity - ends[0]) / (ends[1] - ends[0]), 0.0), 1.0)
        at = left + share * width
        _line(at, top - 2 * scale, at, top + height + 2 * scale, pack_color(DARK.text), 1.5 * scale)


def legend_words(state: AppState, scene: Scene, ends: tuple[float, float]) -> tuple[str, list[str]]:
    """Return the name of the values and the words at both ends."""
    numbers = [f"{value:.2f}".replace("-", "−") for value in ends]
    if state.inspection.overlay != "disparity":
        return "entropy", numbers
    if state.preferences.units == "light field":
        return "px per step", numbers
    distances = [metres(scene, disparity) for disparity in ends]
    return "distance", [name if m is None else metres_text(m) for name, m in zip(("far", "near"), distances)]


def _draw_comparison(state: AppState, layout: Layout, frame: Rect, texture: int) -> None:
    """Draw the compared image left of the divider, the divider, and the names of both sides."""
    kind, scale, draw = state.inspection.comparison, layout.ui_scale, imgui.get_background_draw_list()
    if kind is None or layout.picture is None:
        return
    x, bottom = frame.x + state.inspection.divider * frame.width, frame.y + frame.height
    draw.push_clip_rect(imgui.ImVec2(frame.x, frame.y), imgui.ImVec2(x, bottom), True)
    _image(texture, layout.picture if kind == "photo" else frame)
    draw.pop_clip_rect()
    _line(x, frame.y, x, bottom, pack_color(DARK.text), 1.5 * scale)
    _draw_knob(x, frame.y + frame.height / 2, scale)
    names, top = SIDES[kind], frame.y + 8 * scale
    draw.push_clip_rect(*corners(frame), True)
    _words(names[0], x - 10 * scale, top, scale, align=1.0)
    _words(names[1], x + 10 * scale, top, scale)
    draw.pop_clip_rect()


def _draw_knob(x: float, y: float, scale: float) -> None:
    """Draw the knob of the divider, with arrows to both sides."""
    draw, knob = imgui.get_background_draw_list(), imgui.ImVec2(x, y)
    draw.add_circle_filled(knob, 9 * scale, pack_color(BLACK, 0.55))
    draw.add_circle_filled(knob, 7.5 * scale, pack_color(DARK.text))
    for side in (-1, 1):
        tip, back = x + side * 5 * scale, x + side * 1.5 * scale
        base = imgui.ImVec2(back, y - 3 * scale), imgui.ImVec2(back, y + 3 * scale)
        draw.add_triangle_filled(imgui.ImVec2(tip, y), *base, pack_color(DARK.background))


def _draw_sheet(state: AppState, scene: Scene, layout: Layout, frame: Rect, texture: int) -> None:
    """Draw all views, with a frame around the nearest view and a finer frame around the view under the pointer."""
    draw, scale = imgui.get_background_draw_list(), layout.ui_scale
    _image(texture, frame)
    cells = sheet_cells(frame, scene.grid, scale)
    row, column = view_near(state.optics.eye, scene.grid)
    mouse = imgui.get_io().mouse_pos
    for i, cell in enumerate(cells):
        is_current = i == row * scene.grid.columns + column
        if is_current or cell.contains(mouse.x, mouse.y):
            room = 1.5 * scale
            corner = imgui.ImVec2(cell.x - room, cell.y - room)
            far = imgui.ImVec2(cell.x + cell.width + room, cell.y + cell.height + room)
            color = pack_color(DARK.accent if is_current else DARK.text)
            draw.add_rect(corner, far, color, 2 * scale, 3 * scale if is_current else 1.5 * scale)


def _draw_strips(state: AppState, scene: Scene, layout: Layout, picture: Rect, textures: InspectionTextures) -> None:
    """Draw the EPIs with the place of the eye, and the pointer's column and row."""
    across, down, scale = layout.strip_across, layout.strip_down, layout.ui_scale
    assert across is not None
    assert down is not None
    for texture, rect in ((textures.strip_across, across), (textures.strip_down, down)):
        if texture is not None:
            _image(texture, rect)
    draw = imgui.get_background_draw_list()
    for rect in (across, down):
        draw.push_clip_rect(*corners(rect), True)
        _draw_marks(state, scene, rect, layout, is_upright=rect is down)
        draw.pop_clip_rect()
    x, y = state.inspection.place or ((scene.width - 1) / 2, (scene.height - 1) / 2)
    quiet = pack_color(palette_of(state.preferences.theme).quiet)
    text, line = imgui.ImVec2(down.x + 2 * scale, across.y + 2 * scale), imgui.get_text_line_height()
    for i, words in enumerate((f"x {x:.0f}", f"y {y:.0f}")):
        draw.add_text(imgui.ImVec2(text.x, text.y + i * line), quiet, words)


def _draw_marks(state: AppState, scene: Scene, rect: Rect, layout: Layout, is_upright: bool) -> None:
    """Draw a line at the viewpoint, a line at the pointer, and the slope of the surface there."""
    x_px, y_px = state.inspection.place or ((scene.width - 1) / 2, (scene.height - 1) / 2)
    eye: ViewOffset = state.optics.eye
    part, scale = layout.part, layout.ui_scale
    if is_upright:
        views, at_view, size, pixel = scene.grid.rows, eye.t, scene.height, y_px
        long_side, short_side, start, span = rect.height, rect.width, part.y, part.height
    else:
        views, at_view, size, pixel = scene.grid.columns, eye.s, scene.width, x_px
        long_side, short_side, start, span = rect.width, rect.height, part.x, part.width
    band = short_side / views
    eye_at = (at_view + views // 2 + 0.5) * band
    pointer_at = ((pixel + 0.5) / size - start) / span * long_side

    def line(along0: float, across0: float, along1: float, across1: float, color: int, width: float) -> None:
        first, second = (along0, across0), (along1, across1)
        if is_upright:
            first, second = first[::-1], second[::-1]
        _line(rect.x + first[0], rect.y + first[1], rect.x + second[0], rect.y + second[1], color, width)

    line(0, eye_at, long_side, eye_at, pack_color(DARK.accent), 2 * scale)
    line(pointer_at, 0, pointer_at, short_side, pack_color(DARK.text, 0.8), scale)
    if state.hover is not None and state.hover.disparity is not None:
        slope = -state.hover.disparity / size / span * long_side / band
        ends = [pointer_at + slope * (end - eye_at) for end in (0.0, short_side)]
        line(ends[0], 0, ends[1], short_side, pack_color(DARK.warning, 0.9), 1.5 * scale)


def _draw_status(state: AppState, scene: Scene, layout: Layout, rect: Rect) -> None:
    """Draw one line of values; the last values are left out where they do not fit."""
    draw, palette, scale = imgui.get_background_draw_list(), palette_of(state.preferences.theme), layout.ui_scale
    hover, probe = state.hover, state.inspection.probe
    y = rect.y + rect.height - imgui.get_text_line_height()
    if hover is None:
        draw.add_text(imgui.ImVec2(rect.x, y), pack_color(palette.quiet), "Point at the picture to see its values.")
        return
    x, gap = rect.x, 18 * scale
    for words in status_text(state, scene, hover, probe):
        is_color = words.startswith("RGB")
        swatch = imgui.get_text_line_height() if is_color else 0.0
        width = imgui.calc_text_size(words).x + (swatch + 5 * scale if swatch else 0)
        if x + width > rect.x + rect.width:
            return
        if is_color and probe is not None:
            red, green, blue = (value / 255 for value in probe.rgb)
            draw.add_rect_filled(*corners(Rect(x, y, swatch, swatch)), pack_color((red, green, blue, 1.0)), 3 * scale)
            x, width = x + swatch + 5 * scale, width - swatch - 5 * scale
        draw.add_text(imgui.ImVec2(x, y), pack_color(palette.text), words)
        x += width + gap
