"""Drawings of inspection over and beside the picture: overlay and legend, comparison, sheet of views, EPIs, status."""

from __future__ import annotations

from itertools import pairwise

from imgui_bundle import imgui

from iibr_core.scenes.lens_limits import clamp
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from viewer.model.app_state import AppState
from viewer.model.colormap import VIRIDIS, map_color
from viewer.model.inspection import Hover, InspectionTextures, Probe, sheet_cells, view_near
from viewer.model.layout import Layout
from viewer.model.units import metres, metres_text
from viewer.ui.overlays.chips import has_guess_badge
from viewer.ui.overlays.reticle import WORD_GAP, hover_text
from viewer.ui.style import DARK, Color, corners, draw_words, pack_color, palette_of

LEGEND_WIDTH, LEGEND_HEIGHT = 150.0, 10.0
BLACK: Color = (0.0, 0.0, 0.0, 1.0)
NO_ENTROPY = "0 everywhere: this view is the photo itself. Drag to look from elsewhere."


def draw_inspection(state: AppState, scene: Scene, layout: Layout, textures: InspectionTextures) -> None:
    """Draw overlay, comparison and sheet over the picture, in colours of no theme, and EPIs and status beside it."""
    picture, frame, scale = layout.picture, layout.frame, layout.ui_scale
    if picture is None or frame is None:
        return
    if textures.overlay is not None:
        _image(textures.overlay, frame)
        _draw_legend(state, scene, layout, frame)
    if state.shows_before:
        draw_words("before", frame.x + 8 * scale, frame.y + 8 * scale, scale)
    if textures.compared is not None:
        _draw_comparison(state, scale, picture, frame, textures.compared)
    if textures.sheet is not None:
        _draw_sheet(state, scene, scale, frame, textures.sheet)
    if layout.strip_across is not None and layout.strip_down is not None:
        _draw_strips(state, scene, layout, layout.strip_across, layout.strip_down, textures)
    if layout.status is not None:
        _draw_status(state, scene, scale, layout.status)


def draw_minimap(layout: Layout, texture: int) -> None:
    """Draw the whole picture small in a corner, a frame around the part that is seen, and the scale."""
    at, part, draw, scale = layout.minimap, layout.part, imgui.get_background_draw_list(), layout.ui_scale
    if at is None:
        return
    _image(texture, at)
    draw.add_rect(*corners(at), pack_color(BLACK, 0.7), 0, scale)
    x, y = at.x + part.x * at.width, at.y + part.y * at.height
    seen = corners(Rect(x, y, part.width * at.width, part.height * at.height))
    draw.add_rect(*seen, pack_color(BLACK, 0.6), 0, 3.5 * scale)
    draw.add_rect(*seen, pack_color(DARK.text), 0, 1.5 * scale)
    words, top = f"{100 * layout.scale:.0f} %", at.y - imgui.get_text_line_height() - 9 * scale
    draw_words(words, at.x + at.width, top, scale, align=1.0)


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


def _draw_legend(state: AppState, scene: Scene, layout: Layout, frame: Rect) -> None:
    """Draw the colours with their values, and a mark for the value under the pointer."""
    kind, scale, hover = state.inspection.overlay, layout.ui_scale, state.hover
    x, y, room = frame.x + 8 * scale, frame.y + 8 * scale, 5 * scale
    if has_guess_badge(state, layout) or state.free_camera is not None:  # a chip stands there
        y += imgui.get_frame_height() + 8 * scale
    if kind == "inpainted" or state.selection is not None:
        draw_words("inpainting" if state.selection is None else "selected surface", x, y, scale)
        return
    draw, line = imgui.get_background_draw_list(), imgui.get_text_line_height()
    if kind == "entropy" and view_near(state.optics.eye, scene.grid) == scene.grid.centre:
        draw_words(NO_ENTROPY, x, y + LEGEND_HEIGHT * scale + line + 4 * room, scale)
    bar = Rect(x + room, y + room, LEGEND_WIDTH * scale, LEGEND_HEIGHT * scale)
    if bar.x + bar.width + room > frame.x + frame.width:
        return
    low, high = scene.disparity_range_px if kind == "disparity" else (0.0, 1.0)
    ground = Rect(x, y, bar.width + 2 * room, bar.height + line + 2.5 * room)
    draw.add_rect_filled(*corners(ground), pack_color(DARK.background, 0.72), 4 * scale)
    steps = len(VIRIDIS) - 1
    colors = [pack_color((*map_color(i / steps), 1.0)) for i in range(steps + 1)]
    for i, (left, right) in enumerate(pairwise(colors)):
        cell = Rect(bar.x + i * bar.width / steps, bar.y, bar.width / steps, bar.height)
        draw.add_rect_filled_multi_color(*corners(cell), left, right, right, left)
    name, labels = legend_words(state, scene, (low, high))
    for words, align, color in ((labels[0], 0.0, DARK.text), (name, 0.5, DARK.quiet), (labels[1], 1.0, DARK.text)):
        place = imgui.ImVec2(bar.x + align * (bar.width - imgui.calc_text_size(words).x), bar.y + bar.height + room / 2)
        draw.add_text(place, pack_color(color), words)
    if kind == "disparity" and hover is not None and hover.disparity is not None and high > low:
        at = bar.x + clamp((hover.disparity - low) / (high - low), 0.0, 1.0) * bar.width
        _line(at, bar.y - 2 * scale, at, bar.y + bar.height + 2 * scale, pack_color(DARK.text), 1.5 * scale)


def legend_words(state: AppState, scene: Scene, ends: tuple[float, float]) -> tuple[str, list[str]]:
    """Return the name of the values and the words at both ends."""
    numbers = [f"{value:.2f}".replace("-", "−") for value in ends]
    if state.inspection.overlay != "disparity":
        return "entropy", numbers
    if state.preferences.units == "light field":
        return "px per step", numbers
    distances = [metres(scene, disparity) for disparity in ends]
    return "distance", [name if m is None else metres_text(m) for name, m in zip(("far", "near"), distances)]


def _draw_comparison(state: AppState, scale: float, picture: Rect, frame: Rect, texture: int) -> None:
    """Draw the compared image left of the divider, the divider, and the names of both sides."""
    kind, draw, top = state.inspection.comparison or "photo", imgui.get_background_draw_list(), frame.y + 8 * scale
    x, bottom = frame.x + state.inspection.divider * frame.width, frame.y + frame.height
    draw.push_clip_rect(imgui.ImVec2(frame.x, frame.y), imgui.ImVec2(x, bottom), True)
    _image(texture, picture if kind == "photo" else frame)
    draw.pop_clip_rect()
    _line(x, frame.y, x, bottom, pack_color(DARK.text), 1.5 * scale)
    _draw_knob(x, frame.y + frame.height / 2, scale)
    draw.push_clip_rect(*corners(frame), True)
    draw_words(kind, x - 10 * scale, top, scale, align=1.0)
    draw_words("picture", x + 10 * scale, top, scale)
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


def _draw_sheet(state: AppState, scene: Scene, scale: float, frame: Rect, texture: int) -> None:
    """Draw all views, with a frame around the nearest view and a finer frame around the view under the pointer."""
    _image(texture, frame)
    row, column = view_near(state.optics.eye, scene.grid)
    mouse, room = imgui.get_io().mouse_pos, 1.5 * scale
    for i, cell in enumerate(sheet_cells(frame, scene.grid, scale)):
        is_current = i == row * scene.grid.columns + column
        if is_current or cell.contains(mouse.x, mouse.y):
            border = Rect(cell.x - room, cell.y - room, cell.width + 2 * room, cell.height + 2 * room)
            color, width = pack_color(DARK.accent if is_current else DARK.text), (2 if is_current else 1) * room
            imgui.get_background_draw_list().add_rect(*corners(border), color, 2 * scale, width)


def _draw_strips(
    state: AppState, scene: Scene, layout: Layout, across: Rect, down: Rect, textures: InspectionTextures
) -> None:
    """Draw the EPIs with the place of the eye, and the pointer's column and row."""
    draw, place = imgui.get_background_draw_list(), state.inspection.place
    x, y = place or ((scene.width - 1) / 2, (scene.height - 1) / 2)
    for texture, rect in ((textures.strip_across, across), (textures.strip_down, down)):
        if texture is not None:
            _image(texture, rect)
        draw.push_clip_rect(*corners(rect), True)
        _draw_marks(state, scene, rect, layout, (x, y), is_upright=rect is down)
        draw.pop_clip_rect()
    text, quiet = f"x {x:.0f}\ny {y:.0f}", pack_color(palette_of(state.preferences.theme).quiet)
    draw.add_text(imgui.ImVec2(down.x + 2 * layout.ui_scale, across.y + 2 * layout.ui_scale), quiet, text)


def _draw_marks(
    state: AppState, scene: Scene, rect: Rect, layout: Layout, place: tuple[float, float], is_upright: bool
) -> None:
    """Draw a line at the viewpoint, a line at the pointer, and the slope of the surface there."""
    (x_px, y_px), eye = place, state.optics.eye
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
        step = scene.row_step if is_upright else 1.0
        slope = -state.hover.disparity * step / size / span * long_side / band
        ends = [pointer_at + slope * (end - eye_at) for end in (0.0, short_side)]
        line(ends[0], 0, ends[1], short_side, pack_color(DARK.warning, 0.9), 1.5 * scale)


def _draw_status(state: AppState, scene: Scene, scale: float, rect: Rect) -> None:
    """Draw one line of values; the last values are left out where they do not fit."""
    draw, palette = imgui.get_background_draw_list(), palette_of(state.preferences.theme)
    line = imgui.get_text_line_height()
    probe, x, y = state.inspection.probe, rect.x, rect.y + rect.height - line
    if state.hover is None:
        draw.add_text(imgui.ImVec2(x, y), pack_color(palette.quiet), "Point at the picture to see its values.")
        return
    for words in status_text(state, scene, state.hover, probe):
        swatch = line + 5 * scale if words.startswith("RGB") else 0.0
        width = swatch + imgui.calc_text_size(words).x
        if x + width > rect.x + rect.width:
            return
        if swatch and probe is not None:
            red, green, blue = (value / 255 for value in probe.rgb)
            draw.add_rect_filled(*corners(Rect(x, y, line, line)), pack_color((red, green, blue, 1.0)), 3 * scale)
        draw.add_text(imgui.ImVec2(x + swatch, y), pack_color(palette.text), words)
        x += width + 18 * scale
