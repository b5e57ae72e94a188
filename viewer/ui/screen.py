"""The whole screen: the picture behind, overlays, panel, notices and prompts over it. With a window and without."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from imgui_bundle import imgui

from viewer.model.action import Action
from viewer.model.app_state import AppState
from viewer.model.folder import Thumbnail
from viewer.model.inspection import NO_INSPECTION_TEXTURES, InspectionTextures
from viewer.model.layout import Layout
from viewer.ui.overlays.chips import chips, panel_handle
from viewer.ui.overlays.filmstrip import filmstrip
from viewer.ui.overlays.inspection_overlay import draw_inspection, draw_minimap
from viewer.ui.overlays.notice_corner import notices
from viewer.ui.overlays.prompt_overlay import prompts
from viewer.ui.overlays.reticle import draw_marks
from viewer.ui.overlays.welcome import welcome
from viewer.ui.panel import panel
from viewer.ui.style import pack_color, palette_of

NO_THUMBNAILS: Mapping[str, Thumbnail | None] = MappingProxyType({})


def build_screen(
    state: AppState,
    layout: Layout,
    picture_texture: int | None,
    textures: InspectionTextures = NO_INSPECTION_TEXTURES,
    thumbnails: Mapping[str, Thumbnail | None] = NO_THUMBNAILS,
    woven_texture: int | None = None,
) -> list[Action]:
    """Build everything; return edits as actions. picture_texture: GL name of the picture, rows bottom-up. textures: of
    inspection. thumbnails: of the filmstrip, of recent photos and of the prompt for a path, by path. woven_texture: of
    a stereo picture that fills the window instead.
    """
    window, palette = layout.window, palette_of(state.preferences.theme)
    corner = imgui.ImVec2(window.width, window.height)
    imgui.get_background_draw_list().add_rect_filled(imgui.ImVec2(0, 0), corner, pack_color(palette.background))
    scene, picture, frame = state.scene, layout.picture, layout.frame
    if woven_texture is not None:
        _image(woven_texture, (0, 0, window.width, window.height))
    elif picture_texture is not None and scene is not None and picture is not None and frame is not None:
        assert layout.frame_px is not None
        x, y, width, height = (value / layout.pixel_ratio for value in layout.frame_px)
        _image(picture_texture, (x, y, x + width, y + height))
        draw_inspection(state, scene, layout, textures)
        if not state.inspection.shows_views:
            draw_marks(state, scene, layout, picture, frame)
            if textures.minimap is not None:
                draw_minimap(layout, textures.minimap)
    actions = []
    if woven_texture is None:  # each eye sees half of a stereo picture: nothing lies over it unasked
        actions = filmstrip(state, layout, thumbnails) + chips(state, layout) + panel_handle(state, layout)
    actions += panel(state, layout) + welcome(state, layout, thumbnails)
    return actions + notices(state, layout) + prompts(state, layout, thumbnails)


def _image(texture: int, corners: tuple[float, float, float, float]) -> None:
    """Draw a picture pixel for pixel. corners: left, top, right and bottom."""
    first, last = imgui.ImVec2(*corners[:2]), imgui.ImVec2(*corners[2:])
    imgui.get_background_draw_list().add_image(imgui.ImTextureRef(texture), first, last, (0, 1), (1, 0))
