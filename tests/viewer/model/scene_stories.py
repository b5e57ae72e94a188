"""Actions that open photos, step by step: reading, folders, depth models, files, the window."""

import json
import math
from dataclasses import replace
from pathlib import Path

from iibr_core.beyond.optics import Optics
from iibr_core.depth.choice import DepthChoice, DepthOrigin
from iibr_core.depth.editing.edits import DepthEdits, Stroke
from iibr_core.exports.photo_folder import FolderPhoto
from iibr_core.formats.images.picture import CUT_OFF
from iibr_core.formats.lenticular import parse_calibration
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.scene import Progress, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.model.picture_stories import BRUSH, EMPTY, END, GRID, OF_FIELD, OPEN, PHOTO, STAR, UNDO, eye
from viewer.model import (
    browsing,
    depth,
    depth_models,
    folder,
    inspection,
    lens,
    look,
    messages,
    opening,
    preferences,
    saving,
    selection,
    stereo,
    tasks,
    viewpoint,
    window,
)  # fmt: skip
from viewer.model.action import do
from viewer.model.browsing import Listing, PathPrompt
from viewer.model.carried_optics import NewDepth
from viewer.model.demo_photo import demo_photo
from viewer.model.depth import DepthSample
from viewer.model.depth_models import Downloading, ModelOffer
from viewer.model.inspection import Hover
from viewer.model.layout import Zoom
from viewer.model.messages import Notice
from viewer.model.saved_settings import settings_text
from viewer.model.saving import ExportPrompt, JobProgress, SavedSettings, SavePrompt
from viewer.model.stereo import Monitor
from viewer.model.tasks import CancelJobTask, PlainTask
from viewer.model.window import DrawReport

ROUGH, MADE = DepthOrigin("rough", "a guess"), DepthOrigin("model", "a model", model="big")
LEFT_OPTICS = Optics(ViewOffset(9.0, -9.0), 1.0, 1.0, 0.5, (0.2, 0.1), 1e6, STAR)
EDITS = DepthEdits(gamma=2.0, strokes=(Stroke("nearer", ((0.1, 0.2),), 0.1, 0.5),))
LEFT = SavedSettings(
    LEFT_OPTICS, 1.5, Source("", DepthChoice(refine=False)), ScreenSize(120, 80), EDITS, view_width=120,
    focused_at=(0.2, -0.4),
)  # fmt: skip
MODELS = (
    ModelOffer("big", "Big", 100, "MIT", is_recommended=True, lacks=""),
    ModelOffer("odd", "Odd", 5, "MIT", lacks="needs the package odd", runs_as_installed=True),
    ModelOffer("small", "Small", 10, "MIT", runs_as_installed=True),
)
HERE = (*MODELS[:2], replace(MODELS[2], is_here=True))
PANEL, TELEVISION = Monitor("eDP-1", 0, 0, 1920, 1080), Monitor("HDMI-1", 1920, 0, 3840, 2160)
LENTICULAR = parse_calibration(
    json.dumps({"pitch": 50, "slope": -7, "center": 0.5, "DPI": 300, "screenW": 3840, "screenH": 2160}), "a display"
)
JOB = JobProgress(1, "export", "a.gif")
NAMES = ("IMG_10.jpg", "img_9.jpg", "b.jpg", "IMG_11.jpg", "Ä.png")
PHOTOS = tuple(FolderPhoto(name, float(-i)) for i, name in enumerate(NAMES))


def shown(new_depth=None, **changes):
    """Show the scene of the source that was asked for last, with changes."""
    return lambda state: do(
        opening.show_scene, state.generation, replace(PHOTO, **{"source": state.source} | changes), new_depth
    )


def planned(scale=0.5, zero=8.0, grid=GRID, reach=(-2.0, 3.0)):
    """Return another plan of a photo, with what a scene repeats of it."""
    plan = ScenePlan(grid, scale, zero, reach, 0.1, True, 0, 0, ())
    return {"plan": plan, "grid": grid, "disparity_range_px": reach}


def progress(done, **options):
    return lambda state: do(opening.set_progress, state.generation, Progress(done, 36, 0.5, **options), (done % 4, 1))


def failed(words):
    return lambda state: do(opening.report_failure, state.generation, words)


def opened(path, **options):
    return do(opening.open_source, Source(path, **options))


def scene(**changes):
    return {"name": "next", "depth_origin": None} | changes


CHANGED = (
    eye(1.0, 2.0), END, do(lens.focus_on, (0.1, 0.2), 1.5), END, do(lens.focus_on, (0.5, 0.2), 0.5), END,
    do(lens.set_dolly, 1.0), do(lens.set_focus_range, 0.5), do(lens.set_focus_tilt, (0.4, 0.2)), END,
)  # fmt: skip
STORIES = {
    "opening": (replace(EMPTY, depth_strength=3.0), (
        do(opening.stop), opened("/a/first.jpg"), do(opening.stop), opened("/a/first.jpg"), failed("first.jpg: broken"),
        opened("/a/b.jpg", grid=GRID), shown(is_sketch=True), progress(1), do(opening.stop), opened("/a/b.jpg"),
        shown(is_sketch=True), do(lens.focus_on, (0.0, 0.0), 1.0), END,
        shown(notes=("Smaller.", CUT_OFF, "Damaged."), problems=("Damaged.",), depth_origin=ROUGH), progress(3),
        do(opening.set_progress, 0, Progress(1, 9)), failed("no memory"), progress(9, doing="compiling", share=0.3),
        do(opening.stop), progress(10), progress(36), do(opening.stop), opened("/c/b.jpg"), do(opening.stop),
        shown(), progress(36), do(inspection.set_overlay, "disparity"), do(inspection.show_epis, True),
        do(inspection.take_snapshot), do(inspection.compare, "snapshot"), do(selection.select, (0.2, 0.2)),
        do(lens.show_tilt_handles, True), do(inspection.set_hover, Hover(3.0, 4.0, 0.5)),
        do(viewpoint.set_zoom, Zoom(2.0)), *CHANGED, do(viewpoint.set_loop, "swing"), do(stereo.set_eyes, 3.0),
        do(stereo.set_screen, 1.0), do(lens.set_depth_strength, 2.0, True), do(viewpoint.move_camera, 0.1),
        do(depth.set_brush, BRUSH), do(depth.pick, DepthSample((0.5, 0.5), 1.0)), do(depth.paint, (0.5, 0.5)),
        do(messages.notify, Notice("Saved c.png", is_result=True)), opened("/c/broken.jpg"), failed("broken"),
        opened("/c/next.jpg", depth=DepthChoice(refine=False)), shown(**scene(settings=settings_text(LEFT))),
        do(opening.take_settings, LEFT), UNDO, do(opening.set_existing_recent, ("/a/b.jpg", "/c/next.jpg")),
        opened(str(demo_photo())), shown(**scene(settings="{")), do(saving.ask_to_save), do(saving.ask_to_export),
        do(opening.open_paths, ("/d/x.jpg", "/d/y.PFM", "/d/z.jpg")), do(opening.open_paths, ("/d/x_depth.png",)),
        do(opening.open_paths, ()), shown(**scene(depth_origin=DepthOrigin("file", "y"))),
        do(saving.ask_to_save, "map"),
        opened("/e/m.jpg", depth=DepthChoice("model")), failed("no model"),
        opened("/cache/iibr/clipboard/pasted/p.png"), shown(), do(saving.ask_to_save), do(saving.ask_to_save, "map"),
    )),
    "dropped files": (replace(OPEN, source=replace(OPEN.source, max_pixels=7)), (
        do(opening.open_paths, ("a.jpg",)), do(opening.open_paths, ("b.jpg", "c.jpg")),
        do(opening.open_paths, ("a.PFM", "d.jpg")), do(opening.open_paths, ("better.npy",)),
        do(opening.open_paths, ("dog_depth.png", "dog.jpg")), do(opening.open_paths, ("dog_depth.JPG",)),
    )),
    "another plan": (OPEN, (
        do(inspection.show_epis, True), *CHANGED, do(viewpoint.set_zoom, Zoom(2.0)), do(lens.set_aperture, 1.5),
        END, shown(**planned(0.25, 9.0, GridShape(7, 17), (-1.5, 1.5))),
        UNDO, shown(**planned(0.0, 8.0, GridShape(1, 1), (0.0, 0.0))), shown(**planned()),
        shown(**planned(-0.5, 8.0)), shown(NewDepth((0.5, -1.0)), **planned(1.0, 8.0, GRID, (-4.0, 4.0))),
        do(lens.focus_on, (0.5, 0.2), -1.0), END, shown(NewDepth((-1.0, 2.0)), **planned(1.0, 7.0, GRID, (-3.0, 5.0))),
        do(lens.reset), shown(NewDepth(), **planned(1.0, 8.0, GRID, (-4.0, 4.0))),
        do(lens.set_focus, 2.0), do(lens.set_focus_tilt, (0.5, 0.25)), do(lens.set_focus_range, 0.5), END,
        shown(NewDepth(), **planned(2.0, 8.0, GRID, (-2.0, 8.0))),
    )),
    "light fields": (OF_FIELD, (
        do(lens.set_focus, 2.9), do(lens.set_aperture, 3.0), eye(-2.0, 3.0), progress(3, share=0.5), END,
        shown(name="f", plan=None, grid=GridShape(3, 17), disparity_range_px=(-1.0, 1.0), has_view_disparity=False),
        progress(36), shown(name="f", plan=None, grid=GridShape(3, 17), disparity_range_px=(-0.5, 0.5)), END,
        shown(name="f", plan=None, grid=GridShape(3, 17), disparity_range_px=(-9.0, 9.0), has_view_disparity=False),
        do(lens.reset), do(look.copy_look), opened("/fields/g"),
        shown(name="g", plan=None, has_view_disparity=False, notes=("Said.",)), do(inspection.set_overlay, "disparity"),
        lambda state: do(opening.restore_session, replace(LEFT, depth_model="big")), UNDO,
    )),
    "sessions": (OPEN, (
        do(opening.restore_session, replace(LEFT, optics=replace(LEFT_OPTICS, dolly=math.nan))),
        do(opening.restore_session, LEFT), END,
        shown(**planned(0.75, 9.0, GridShape(6, 13), (-2.0, 4.0))), UNDO, shown(), do(opening.restore_session, LEFT),
        END, do(lens.set_focus, 0.75), END, shown(**planned(0.75, 9.0)), UNDO, UNDO, shown(),
        do(opening.restore_session, LEFT),
        END, UNDO, do(opening.restore_session, replace(LEFT, depth_edits=DepthEdits())),
        do(opening.restore_session, replace(LEFT, depth_model="gone.onnx"), "gone.onnx: no such file"),
        do(opening.focus_again, (0.2, -0.4), 2.25), END, do(depth_models.set_known, HERE),
        do(opening.restore_session, replace(LEFT, depth_model="small")), do(depth_models.take_estimate, "small"),
        shown(NewDepth(), depth_model="small", depth_origin=MADE, **planned(1.0, 8.0, GRID, (-4.0, 4.0))),
        do(opening.focus_again, (0.2, -0.4), 99.0), do(opening.restore_session, replace(LEFT, depth_model="big")),
        opened("/photos/c.jpg"), shown(depth_origin=ROUGH), shown(NewDepth(), **planned(1.0, 8.0, GRID, (-4.0, 4.0))),
    )),
    "models": (EMPTY, (
        do(depth_models.get_depth), do(depth_models.use_model, "big"), do(depth_models.give_up),
        do(depth_models.show_offer, True), do(depth_models.take_estimate, "big"), opened("/a/b.jpg"),
        shown(depth_origin=ROUGH), do(depth_models.set_known, MODELS), do(depth_models.show_offer, True),
        do(depth_models.get_depth), do(depth_models.set_downloading, Downloading("Big", 3, 100)),
        do(depth_models.use_model, "big"), do(depth_models.set_downloading, Downloading("Big", 4, 100)),
        do(depth_models.set_downloading, None), do(depth_models.offer_no_more),
        do(depth_models.show_offer, True), do(depth_models.set_known, HERE),
        do(depth_models.report_failure, "small", "bad"),
        do(preferences.guess_depth_always, True), do(depth_models.get_depth), do(depth_models.take_estimate, "small"),
        shown(NewDepth(), depth_origin=MADE, depth_model="small"), do(depth_models.get_depth),
        do(depth_models.use_model, "/own.onnx"), opened("/a/c.jpg"), shown(depth_origin=ROUGH),
        do(preferences.guess_depth_always, True), do(depth_models.use_model, "small"),
        do(depth_models.report_failure, "/own.onnx", "gone"), do(depth_models.show_models),
        do(depth_models.use_model, "small"), opened("/a/d.jpg", depth=DepthChoice("rough")), shown(depth_origin=ROUGH),
        do(depth_models.give_up), opened("/a/e.jpg", depth=DepthChoice("model", model="/one.onnx")),
        shown(depth_origin=DepthOrigin("file", "f")), do(depth_models.report_failure, "/one.onnx", "no model"),
        shown(is_sketch=True),
        do(depth_models.use_model, "big"),
    )),
    "a folder": (OPEN, (
        do(folder.step, 1), do(folder.scroll, 1), do(folder.set_order, "time"), do(folder.set_order, "name"),
        do(folder.set_photos, "/photos", PHOTOS), do(folder.set_photos, "/photos", PHOTOS), do(folder.step, 0),
        do(preferences.show_filmstrip, True), do(folder.scroll, 99), do(folder.scroll, -1), do(folder.scroll, -99),
        do(look.copy_look), do(inspection.set_overlay, "disparity"), do(folder.step, 1),
        failed("img_9.jpg: damaged"), do(folder.step, 1), do(opening.stop), do(folder.set_order, "time"),
        do(folder.step, -1), do(opening.stop), do(folder.set_order, "name"), do(folder.step, 1), shown(name="IMG_9"),
        do(folder.step, 1), shown(name="IMG_10"),
        do(folder.step, 1), do(folder.step, 9), do(folder.step, -9), shown(name="IMG_9"), do(folder.step, -1),
        do(lens.set_aperture, 4.5), do(lens.set_focus_range, 1.2), do(lens.set_exposure, 1.0), do(look.copy_look),
        do(look.paste_look_to, 2), shown(**planned(1.0, 8.0, GridShape(5, 5), (-1.0, 1.5))), do(look.paste_look),
        opened("/photos/b.jpg"), shown(), opened("/other/b.jpg"), shown(),
        do(folder.step, 1),
    )),
    "files": (OPEN, (
        do(saving.ask_to_save), do(saving.ask_to_save, "map"), do(saving.ask_to_export),
        do(saving.begin_job, Path("/out/a.gif"), ExportPrompt("gif", "a.gif")), do(saving.set_jobs, (JOB,)),
        do(saving.quit_window), do(saving.begin_job, Path("/out/a.gif")), do(saving.quit_when_done),
        do(messages.notify, Notice("hello")), do(saving.set_jobs, (replace(JOB, done=0.5),)),
        do(saving.fail_job, Path("/out/a.gif"), "disk full", ExportPrompt("gif", "a.gif")), do(saving.set_jobs, ()),
        do(saving.ask_to_export), do(saving.ask_to_save), do(saving.ask_to_save, "map"),
        do(messages.show_prompt, "files"),
        do(saving.finish_job, Path("/out/b.png"), "", SavePrompt("b.png", ScreenSize(60, 40))),
        do(saving.finish_job, Path("/out/c.gif"), "12 MB.", ExportPrompt("gif", "c.gif")),
        do(saving.fail_job, Path("/out/d"), "gone"), do(saving.set_jobs, (JOB,)), do(saving.quit_when_done),
        do(saving.set_jobs, ()), do(saving.quit_window),
    )),
    "messages": (OPEN, (
        *(do(messages.notify, Notice(f"{i}", is_error=i == 2, details="why" * (i == 6))) for i in range(7)),
        do(messages.notify, Notice("4")), do(messages.show_details, Notice("6", details="why")),
        do(messages.dismiss, Notice("3")), do(messages.dismiss), do(tasks.ask, PlainTask("copy")),
        do(tasks.ask, CancelJobTask(3)), do(tasks.forget_tasks, 1),
        do(browsing.set_listing, Listing("/a/", "/a")), do(browsing.edit_path, PathPrompt("photo", "/a/b", top=3)),
        do(browsing.edit_path, PathPrompt("photo", "/a/bc", top=3)),
        do(browsing.edit_path, PathPrompt("photo", "/a/bc", top=7)), do(browsing.set_listing, Listing("/b/", "/b")),
        do(browsing.set_listing, Listing("/a/", "/a", ("bcd",), ("bce.png",))),
        do(browsing.edit_path, PathPrompt("photo", "/a/c/d")),
    )),
    "the window": (OPEN, (
        do(window.set_narrow, True), do(window.toggle_panel), do(window.toggle_panel), do(window.set_narrow, False),
        do(window.toggle_panel), do(window.set_fullscreen, True), do(window.set_fullscreen, True),
        do(window.toggle_panel), do(window.set_fullscreen, False), do(window.set_report, DrawReport(3)),
        do(preferences.set_font_scale, 99.0), do(preferences.set_font_scale, 0.0), do(preferences.set_theme, "light"),
        do(preferences.set_units, "light field"), do(preferences.toggle_section, "scene"),
        do(preferences.toggle_section, "view"), do(preferences.toggle_section, "more"),
        do(preferences.toggle_section, "gloss"), do(preferences.toggle_section, "gloss"),
        do(preferences.place_window, (1, 2, 3, 4)), do(preferences.place_window, None),
        do(stereo.set_monitors, (PANEL, TELEVISION)), do(stereo.show, True), do(stereo.choose_monitor, PANEL),
        do(stereo.show, True), do(stereo.show, False), do(stereo.choose_monitor, TELEVISION), do(stereo.show, True),
        do(stereo.set_monitors, (PANEL, replace(TELEVISION, x=9))), do(stereo.set_monitors, (PANEL,)),
        do(stereo.show_on, LENTICULAR), do(stereo.set_monitors, (PANEL, replace(TELEVISION, name="A"), TELEVISION)),
        do(stereo.show_on, LENTICULAR, (1920, 0)), do(stereo.choose_monitor, PANEL), do(stereo.set_eyes, 1.0),
        do(stereo.set_mode, "rows"),
    )),
}  # fmt: skip
