"""Actions of a person on the open picture, one after the other: lens, depth, motions, inspection.

The photo is hard: an even number of rows, fewer than columns, half as far apart; depth that does not begin at 0; views
smaller than the photo; a focal length and metric depth.
"""

import math
from dataclasses import replace

from iibr_core.beyond.optics import ApertureMask, ApertureShape
from iibr_core.depth.choice import DepthChoice, DepthOrigin
from iibr_core.depth.editing.edits import UNEDITED, DepthEdits
from iibr_core.gloss.settings import Gloss, GlossSurface
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.scene import DepthSettings, Scene, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from viewer.model import (
    depth,
    history,
    inspection,
    lens,
    look,
    messages,
    saving,
    selection,
    stereo,
    tracking,
    viewpoint,
    window,
)  # fmt: skip
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.depth import Brush, DepthSample
from viewer.model.inspection import Hover, Probe
from viewer.model.layout import Zoom
from viewer.model.lens import FIRST_GLOSS, GlossBrush

NAN, FAR_OUT = math.nan, 1e6
GRID = GridShape(4, 9)
SOURCE = Source("/photos/b.jpg", DepthChoice(refine=False), GRID)
PLAN = ScenePlan(GRID, 0.5, 8.0, (-2.0, 3.0), 0.1, True, 0, 0, ())
PHOTO = Scene(
    SOURCE, "b", 60, 40, GRID, (-2.0, 3.0), "b.pfm", plan=PLAN, focal_px=700.0, subject_disparity_px=1.5,
    inverse_metres=(0.05, 0.1), own_size=ScreenSize(240, 160), row_step=0.5, depth_origin=DepthOrigin("embedded", "b"),
)  # fmt: skip
FIELD = replace(PHOTO, source=Source("/fields/f"), name="f", plan=None, own_size=None, depth_origin=None)
OPEN = AppState(source=SOURCE, scene=PHOTO, generation=1, depth=DepthSettings(False))
OF_FIELD = AppState(source=FIELD.source, scene=FIELD, generation=1)
EMPTY = AppState()

END, UNDO, REDO = do(window.end_gesture), do(history.undo), do(history.redo)
HOME, RESET = do(viewpoint.return_home), do(lens.reset)
GLOSS = Gloss(GlossSurface(0.2, 0.9, (0.5, 0.25, 1.0), 0.3), 0.1, 0.2)
STAR = ApertureShape("mask", rotation_deg=700.0, mask=ApertureMask("star.png", 1, 2, b"\xff\x80"))
WILD = ApertureShape("mask", 50, -30.0, 2.0, -1.0, None, 3.0)
BRUSH = Brush("level", 0.1, 0.4, 2.0, 0.02, is_on=True)


def brush(**changes):
    return lambda state: do(depth.set_brush, replace(state.brush, **changes))


def tone(is_finished=True, **edits):
    return do(depth.set_tone, DepthEdits(**edits), is_finished)


def eye(t, s):
    return do(lens.move_eye, ViewOffset(t, s))


def ticks(*seconds):
    return tuple(do(viewpoint.tick, at) for at in seconds)


STORIES = {
    "lens": (OPEN, (
        eye(0.5, -1.25), eye(-9.0, 9.0), eye(NAN, 1.0), eye(9.0, -9.0), END, do(lens.set_dolly, 1.5),
        do(lens.set_dolly, -99.0), END, do(lens.set_focus, 1.25), do(lens.set_focus, FAR_OUT), END,
        do(lens.set_focus, -FAR_OUT), END, do(lens.set_focus_range, 0.75), do(lens.set_focus_range, 99.0), END,
        do(lens.set_focus_range, -1.0), END, do(lens.set_focus_tilt, (0.5, -99.0)), do(lens.set_aperture, 2.5), END,
        do(lens.set_aperture, FAR_OUT), END, do(lens.set_aperture, -1.0), END, do(lens.set_aperture_shape, STAR), END,
        do(lens.set_aperture_shape, WILD), do(lens.set_highlights, 1.75), do(lens.set_exposure, -2.5), END,
        do(lens.set_exposure, 99.0), END, do(lens.set_exposure, NAN), do(lens.show_before, True), eye(0.0, 1.0),
        do(lens.set_depth_strength, 1.5, False), do(lens.set_depth_strength, 2.0, True), END,
        do(lens.set_depth_strength, 99.0, True), UNDO, UNDO, UNDO, REDO, do(lens.set_exposure, 1.0), REDO, RESET, END,
        UNDO,
    )),
    "focus": (OPEN, (
        do(lens.focus_on, (0.1, -0.2), 2.5), END, do(lens.focus_on, (-0.5, 0.5), -1.0), END, do(viewpoint.rack_focus),
        *ticks(10.0, 10.05, 10.1, 99.0), do(lens.focus_on, (0.0, 0.0), 0.5), END, do(lens.focus_on, (0.0, 0.0), NAN),
        do(lens.apply_preset, "portrait"), END, do(lens.apply_preset, "macro"), END, eye(1.0, 1.0),
        do(lens.set_exposure, 1.0), do(lens.apply_preset, "everything sharp"), END, do(lens.set_focus, 0.25), END,
        do(lens.show_tilt_handles, True), do(lens.move_tilt_handle, 0, (-0.8, 0.6), 2.5),
        do(lens.move_tilt_handle, 0, (-0.9, 5.0), None), END, do(lens.move_tilt_handle, 1, (0.9, -0.9), 0.5), END,
        do(lens.move_tilt_handle, 1, (NAN, 0.0), NAN), do(lens.move_tilt_handle, 1, (-0.89, 1.0), 1.5), END, UNDO,
        do(lens.focus_on, (0.9, 0.9), 0.25),
        do(viewpoint.return_home, takes_back_click=True), *ticks(0.0, 0.1, 0.2, 0.3, 0.4, 0.5), UNDO, UNDO, REDO,
        do(lens.focus_on, (0.0, 0.0), 2.0), END, do(lens.focus_on, (0.0, 0.0), 2.0),
        do(viewpoint.return_home, takes_back_click=True), do(lens.apply_preset, "portrait"), RESET, UNDO,
    )),
    "gloss": (OPEN, (
        do(lens.set_gloss, FIRST_GLOSS), END, do(depth.set_brush, BRUSH),
        do(lens.take_gloss_brush, GlossBrush(9.0, True, True)), do(lens.paint_gloss, (0.2, 0.5), GlossBrush(0.1), True),
        do(lens.paint_gloss, (0.21, 0.5), GlossBrush(0.1), False),
        do(lens.paint_gloss, (0.2, 0.53), GlossBrush(0.1), False), END,
        do(lens.paint_gloss, (-7.0, 3.5), GlossBrush(0.1, True), True), END, do(lens.set_gloss, GLOSS), END,
        do(depth.set_brush, BRUSH), UNDO, UNDO, RESET, do(lens.set_gloss, None),
        do(lens.paint_gloss, (0.2, 0.5), GlossBrush(), True),
    )),
    "depth": (OPEN, (
        do(depth.set_refine, True), END, tone(False, is_inverted=True, far_clip=0.25, near_clip=0.75, gamma=2.0),
        tone(far_clip=0.9, near_clip=0.75), END, tone(far_clip=0.5, near_clip=0.1), END,
        tone(far_clip=-3.0, near_clip=7.0, gamma=FAR_OUT), END, tone(gamma=NAN), END, do(depth.set_brush, BRUSH),
        do(depth.pick, DepthSample((0.7, 0.2), 1.5)), do(depth.pick, DepthSample((0.7, 0.2), NAN)),
        do(depth.paint, (0.1, 0.1)), do(depth.paint, (0.105, 0.1)), do(depth.paint, (0.1, 0.13)), END, UNDO, REDO,
        brush(tool="nearer", radius=9.0, strength=9.0, tolerance=0.0, feather=9.0), do(depth.paint, (0.5, 0.5)),
        do(selection.move, is_forward=True), do(depth.drop_stroke), do(depth.drop_stroke),
        brush(tool="smooth", radius=-1.0, strength=-1.0, tolerance=9.0, feather=-1.0),
        do(depth.pick, DepthSample((0.5, 0.5), 1.0)), brush(is_on=False), tone(gamma=1.5), do(depth.reset), END, UNDO,
        do(inspection.set_overlay, "inpainted"), brush(tool="farther"), brush(tool="select"), brush(is_on=False),
        do(inspection.set_overlay, None), brush(is_on=True, tool="nearer"), brush(tool="select"), brush(tool="fill"),
        brush(is_on=False),
    )),
    "selection": (OPEN, (
        do(depth.set_brush, Brush("select", 0.06, feather=0.02, tolerance=2.0, is_on=True)),
        do(selection.move, is_forward=True), do(selection.paint, (0.5, 0.5), True, True), do(selection.keep_sharp),
        do(selection.select, (0.25, 0.75)), do(selection.keep_sharp), do(selection.set_range, (1.0, 2.0)),
        do(selection.keep_sharp), END, do(selection.move, is_forward=True), END, UNDO, UNDO,
        do(selection.paint, (0.5, 0.5), True, True), do(selection.paint, (0.505, 0.5), False, False),
        do(selection.paint, (0.5, 0.52), False, False), do(selection.paint, (0.6, 0.5), False, True),
        do(selection.move, is_forward=False), do(selection.deselect), do(selection.set_range, (1.0, 2.0)),
        do(selection.paint, (0.1, 0.2), False, True), do(selection.move, is_forward=True),
        brush(tool="fill"), do(selection.select, (0.5, 0.5)), do(selection.paint, (0.6, 0.5), False, False),
    )),
    "motions": (OPEN, (
        do(viewpoint.rack_focus), eye(1.0, -3.0), do(lens.set_dolly, 1.5), END, HOME,
        *ticks(5.0, 5.1, 5.2, 5.35, 5.4, 5.45, 5.5), UNDO, do(viewpoint.set_speed, 99.0), do(viewpoint.set_speed, 0.5),
        do(viewpoint.set_loop, "circle"), *ticks(0.0, 0.05, 1000.0, 1000.1, 900.0), do(viewpoint.pause, True),
        *ticks(950.0, 950.1), do(viewpoint.pause, False), *ticks(960.0, 960.05), do(viewpoint.set_loop, "eight"),
        *ticks(*(0.1 * i for i in range(12))), do(viewpoint.set_loop, "swing"), *ticks(0.0, 0.1), eye(0.0, 0.0),
        do(viewpoint.set_loop, "swing"), do(viewpoint.set_loop, None), do(viewpoint.move_camera, 0.1, 0.2, 0.05),
        do(viewpoint.move_camera, -9.0, 9.0, 9.0), do(viewpoint.move_camera, 0.0, 0.0, -9.0),
        do(viewpoint.report_camera, 0.5), do(saving.ask_to_save), do(viewpoint.leave_camera),
        do(viewpoint.move_camera, 0.1), HOME, do(viewpoint.move_camera, 0.1), RESET,
        do(viewpoint.move_camera, 0.1), do(saving.ask_to_save), do(messages.show_prompt, None), RESET, END,
        do(viewpoint.return_home, takes_back_click=True),
        do(viewpoint.set_zoom, Zoom(2.0, (0.3, 5.0))), do(viewpoint.set_zoom, Zoom(-2.0, (-1.0, 0.5))),
        do(inspection.set_hover, Hover(10.0, 20.0, 0.5)), do(viewpoint.set_zoom, None),
    )),
    "inspection": (OPEN, (
        do(inspection.show_epis, True), do(inspection.show_values, True), do(inspection.show_views, True),
        do(inspection.set_overlay, "entropy"), do(inspection.set_opacity, 3.0), do(inspection.set_opacity, -1.0),
        do(inspection.compare, "snapshot"), do(inspection.compare, "photo"), do(inspection.move_divider, -5.0), END,
        do(inspection.move_divider, 5.0), do(inspection.move_divider, 0.4), do(inspection.compare, None),
        do(inspection.compare, "photo"), do(inspection.set_overlay, "inpainted"), do(inspection.set_overlay, None),
        do(lens.set_aperture, 2.0), do(inspection.take_snapshot), do(inspection.compare, "snapshot"),
        do(inspection.set_hover, Hover(3.0, 4.0, 0.5)), do(inspection.set_probe, Probe((1, 2, 3), "photo")),
        do(inspection.set_hover, Hover(5.0, 6.0, None)), do(inspection.set_hover, None), END,
    )),
    "look": (OPEN, (
        do(look.paste_look), do(lens.set_aperture, 4.5), do(lens.set_focus_range, 1.2), do(lens.set_exposure, 1.0),
        do(lens.set_highlights, 0.5), do(lens.set_aperture_shape, ApertureShape("ring")), eye(1.0, 1.0),
        do(lens.set_gloss, GLOSS), tone(gamma=1.5), do(depth.set_brush, BRUSH), do(depth.paint, (0.5, 0.5)), END,
        do(lens.set_depth_strength, 2.0, True), END, do(look.copy_look), UNDO, UNDO, UNDO, UNDO,
        do(lens.set_aperture, 0.5), END, do(lens.show_before, True), do(look.paste_look), END, UNDO,
        do(depth.set_brush, BRUSH), do(depth.paint, (0.2, 0.5)), END, do(look.paste_look), END, UNDO,
        do(look.paste_look_to, 0), do(look.paste_look_to, 1),
    )),
    "stereo": (OPEN, (
        do(stereo.show, True), eye(0.5, 2.0), do(stereo.set_screen, 2.0),
        do(stereo.set_eyes, 1.0), do(stereo.set_screen, 1.5), do(stereo.set_eyes, 99.0), do(stereo.set_screen, 99.0),
        do(stereo.set_eyes, -1.0), do(stereo.swap_eyes), do(stereo.set_eyes, 2.0),
        *(do(stereo.set_mode, mode) for mode in stereo.STEREO_MODES),
        do(lens.set_aperture, 1.0), do(lens.show_before, True), do(window.toggle_panel), do(stereo.show, False),
    )),
    "tracking": (OPEN, (
        do(tracking.follow, 3 + 0j, 5.0), do(tracking.set_receiving, False), do(tracking.switch, "udp:5000"),
        do(tracking.set_receiving, False), do(tracking.follow, 10 - 4j, 5.0), do(tracking.follow, 12 - 1j, 6.0),
        do(tracking.set_head_range, 1.0), do(tracking.follow, 12 + 99j, 6.0), do(tracking.set_head_range, 999.0),
        do(tracking.set_receiving, False), do(tracking.follow, 40 + 9j, 6.0), eye(0.5, 1.0),
        do(tracking.follow, 41 + 9j, 7.0), do(viewpoint.set_loop, "circle"), do(tracking.follow, 45 + 9j, 7.0),
        do(viewpoint.set_loop, None), do(tracking.follow, 46 + 9j, 7.0), do(depth.set_brush, BRUSH),
        do(depth.paint, (0.5, 0.5)), do(tracking.follow, 50 + 9j, 7.0), END, do(tracking.follow, 50 + 9j, 7.0),
        do(viewpoint.move_camera, 0.1), do(tracking.follow, 30 + 9j, 7.0), HOME, do(tracking.follow, 30 + 9j, 7.0),
        *ticks(0.0, 0.1, 0.2, 0.3, 0.4, 0.5), do(tracking.follow, 30 + 9j, 7.0), do(tracking.switch, None),
    )),
    "a light field": (OF_FIELD, (
        do(depth.set_brush, BRUSH), tone(gamma=1.5), do(depth.set_refine, False), do(depth.reset),
        do(depth.paint, (0.5, 0.5)), do(depth.pick, DepthSample((0.5, 0.5), 1.0)), do(saving.ask_to_save, "map"),
        do(inspection.set_overlay, "entropy"), do(inspection.set_overlay, "inpainted"),
        do(inspection.set_overlay, "disparity"), do(viewpoint.move_camera, 0.1), do(lens.set_aperture, 99.0),
        do(lens.set_depth_strength, 2.0, True), do(saving.ask_to_save), do(look.copy_look), do(look.paste_look),
    )),
    "nothing open": (EMPTY, (
        eye(1.0, 1.0), do(lens.focus_on, (0.0, 0.0), 1.0), RESET, HOME, do(viewpoint.set_loop, "circle"),
        do(viewpoint.rack_focus), *ticks(1.0), do(viewpoint.move_camera, 0.1), do(viewpoint.set_zoom, Zoom(1.0)),
        do(depth.set_brush, BRUSH), do(depth.paint, (0.5, 0.5)), do(selection.paint, (0.5, 0.5), False, True),
        do(inspection.set_overlay, "disparity"), do(inspection.compare, "photo"), do(inspection.take_snapshot),
        do(saving.ask_to_save), do(saving.ask_to_export), do(look.copy_look), do(look.paste_look), UNDO, REDO,
        do(lens.show_before, True), do(lens.set_gloss, GLOSS), do(messages.show_prompt, "help"), do(stereo.show, True),
        do(depth.set_tone, UNEDITED, True),
    )),
}  # fmt: skip
