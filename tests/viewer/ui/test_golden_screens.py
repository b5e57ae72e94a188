"""Whole screens against golden ones, on one software rasteriser. `pytest --regenerate-golden` writes them: look then.

Another version of ImGui or of its fonts may draw text otherwise: the screens are then written again.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from iibr_core.beyond.optics import ApertureMask, ApertureShape
from iibr_core.depth.choice import DepthOrigin
from iibr_core.depth.editing.edits import DepthEdits
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.photo_folder import FolderPhoto
from iibr_core.gloss.settings import GlossSurface
from iibr_core.scenes.scene import Progress, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ViewOffset
from tests.image_compare import SAME_RASTERISER, assert_golden
from tests.viewer.conftest import headless_with_scene
from viewer.model import depth, inspection, lens, messages, preferences, selection, stereo, tracking, viewpoint
from viewer.model.action import do
from viewer.model.browsing import Listing, PathPrompt
from viewer.model.commands import PalettePrompt
from viewer.model.depth import Brush, DepthSample
from viewer.model.depth_models import DepthModels, Downloading, ModelOffer, ModelsPrompt
from viewer.model.folder import PhotoFacts, PhotoFolder
from viewer.model.inspection import Hover
from viewer.model.layout import Zoom
from viewer.model.lens import FIRST_GLOSS, GlossBrush
from viewer.model.messages import Notice
from viewer.model.preferences import SECTIONS
from viewer.model.saving import ExportPrompt, FinishedFile, JobProgress, SavePrompt
from viewer.model.stereo import Monitor
from viewer.model.window import DrawReport

GOLDEN = Path(__file__).parents[2] / "golden" / "screens"
TALL, WIDE, PROMPT = ScreenSize(370, 2650), ScreenSize(640, 560), ScreenSize(500, 560)
SOURCE = Source("/photos/b.png")
HOVER = do(inspection.set_hover, Hover(48.0, 26.0, 1.0))
LIGHT, IN_PIXELS = do(preferences.set_theme, "light"), do(preferences.set_units, "light field")
JOBS = JobProgress(1, "export", "a.mp4", "drawing frames", 0.5, 40.0), JobProgress(2, "picture", "b.png")
MODELS = DepthModels(
    (
        ModelOffer("b", "Model B", 25, "MIT", "b.org", "A smaller model.", runs_as_installed=True),
        ModelOffer("a", "Model A", 50, "MIT", "a.org", "A small model of 50 MB, which is here.", True, "", True, True),
    ),
    downloading=Downloading("Model B", 10, 25),
)
SAVED = FinishedFile("/photos/a.png", SavePrompt("/photos/a.png", ScreenSize(96, 64)))
NOTICE = Notice("a.png: damaged", is_error=True, commands=("Open a depth map…",), path="/photos/a.png", details="why")
GUESSED = DepthOrigin("rough", "rough, guessed without a model", ("The photo's own depth was not used.",), "white")
FOLDER = PhotoFolder("/photos", tuple(FolderPhoto(f"{n}.png", 0.0) for n in "abc"), unreadable=frozenset({"c.png"}))
MONITOR = Monitor("HDMI-1", 0, 0, 1920, 1080, 500)


def prompt(shown, **changes):
    return PROMPT, (do(messages.show_prompt, shown),), changes


def export(kind, **options):
    return prompt(ExportPrompt(kind, "/photos/a", ExportOptions(**options)))


MASKED = ApertureShape("mask", mask=ApertureMask("star.png", 2, 2, b"\xff\x80\x00\xff"))
GLOSSY = replace(FIRST_GLOSS, surface=GlossSurface(farthest=0.2, color=(0.6, 0.1, 0.1)))
SCREENS = {
    "panel": (
        TALL, (HOVER, do(lens.set_dolly, -0.5), do(lens.set_aperture_shape, MASKED)),
        {"monitors": (MONITOR,), "facts": PhotoFacts("", ())},
    ),
    "panel in light": (
        TALL,
        (
            LIGHT, IN_PIXELS, do(lens.set_gloss, GLOSSY),
            do(lens.take_gloss_brush, GlossBrush(erases=True, is_on=True)),
            do(lens.set_aperture_shape, ApertureShape("cat_eye")),
            do(viewpoint.set_loop, "circle"), do(inspection.compare, "photo"), do(inspection.take_snapshot),
            do(lens.show_tilt_handles, True), do(tracking.switch, "udp:4242"), HOVER, do(stereo.set_eyes, 2.0),
            do(stereo.swap_eyes), do(lens.set_focus_range, 0.3), do(depth.set_tone, DepthEdits(True, 0.2, 0.7), True),
        ),
        {
            "files": (SAVED,), "progress": Progress(4, 9, 0.3), "report": DrawReport(3, 9, 12.0), "origin": GUESSED,
            "facts": PhotoFacts(SOURCE.path, (("Camera", "A camera"),)), "recent": ("/photos/old.png",),
        },
    ),
    "brush": (
        TALL,
        (
            HOVER, do(depth.set_brush, Brush("fill", is_on=True, sample=DepthSample((0.3, 0.6), 1.0))),
            do(selection.select, (0.5, 0.5)), do(selection.set_range, (0.0, 1.0)),
            do(lens.set_aperture_shape, ApertureShape("polygon", rotation_deg=20.0)),
        ),
        {},
    ),
    "inspected": (
        WIDE,
        (
            do(inspection.show_epis, True), do(inspection.show_values, True), do(inspection.set_overlay, "disparity"),
            do(viewpoint.set_zoom, Zoom(6.0, (0.6, 0.4))), HOVER, do(lens.show_tilt_handles, True),
        ),
        {"origin": GUESSED},
    ),
    "compared": (
        WIDE,
        (
            do(inspection.take_snapshot), do(lens.move_eye, ViewOffset(0.5, 1.0)), do(inspection.compare, "snapshot"),
            do(inspection.move_divider, 0.4), do(messages.notify, NOTICE), HOVER, LIGHT,
        ),
        {
            "jobs": JOBS, "origin": GUESSED, "models": MODELS, "free_progress": 0.3, "folder": FOLDER,
            "report": DrawReport(is_draft=True),
        },
    ),
    "sheet": (WIDE, (do(inspection.show_views, True), do(lens.move_eye, ViewOffset(1.0, 0.0)), HOVER), {}),
    "free camera": (
        PROMPT,
        (do(viewpoint.move_camera, right=0.1), do(depth.set_brush, Brush("nearer", is_on=True)), HOVER),
        {"folder": FOLDER},
    ),
    "offer": (WIDE, (), {"hides_panel": False, "origin": GUESSED, "models": replace(MODELS, downloading=None)}),
    "welcome": (WIDE, (), {"scene": None, "source": None, "progress": Progress(), "existing_recent": ("/a/b.png",)}),
    "help": (PROMPT, (do(messages.show_prompt, "help"),), {}),
    "palette": prompt(PalettePrompt("mo", 2), recent=("/photos/moon.png",)),
    "save": prompt(SavePrompt("/photos/a.png", ScreenSize(96, 64), problem="There is no such folder.")),
    "save a map": prompt(SavePrompt("/photos/a.pfm", ScreenSize(96, 64), True, "map")),
    "files": prompt("files", files=(SAVED, replace(SAVED, problem="the disk is full")), jobs=JOBS),
    "quit": prompt("quit", jobs=JOBS, has_dialogs=True),
    "models": prompt(ModelsPrompt(), models=MODELS),
    "path": prompt(PathPrompt("photo", "/p/", listing=Listing("/p/", "/p", ("holiday",), ("a.jpg",)))),
    "export of a video": export("mp4", motion="swing"),
    "export of a stack": export("focal-stack", bits=16),
    "export for a display": export("quilt", show=True),
    "export of a pair": export("half-sbs", eyes=1.0),
    "export of a mask": export("matte"),
    "export of a page": export("web", budget=2_000_000),
}  # fmt: skip

ENLARGED = "free camera", "models", "path"
"""Screens with larger text."""


@pytest.fixture(scope="module")
def opened(tmp_path_factory):
    """A scene whose views are all its photo: the screens do not depend on how views are made."""
    with headless_with_scene(tmp_path_factory.mktemp("screens"), *SECTIONS) as viewer:
        for row, column in np.ndindex(3, 3):
            viewer.view.add(replace(viewer.view.centre, row=row, column=column))
        viewer.view.upload_all()
        yield viewer


@pytest.mark.parametrize("name", SCREENS)
def test_screens_are_the_golden_ones(viewer, name, tmp_path, regenerate_golden):
    if "llvmpipe" not in viewer.gl.renderer:
        pytest.skip(f"golden images belong to llvmpipe, this is {viewer.gl.renderer}")
    size, actions, changes = SCREENS[name]
    changes = dict(changes)
    font_scale = 0.8 if size == TALL else 1.25 if name in ENLARGED else 1.0
    viewer.do(*actions, do(preferences.set_font_scale, font_scale))
    origin, plan = changes.pop("origin", viewer.scene.depth_origin), replace(viewer.scene.plan, reasons=("A reason.",))
    scene = replace(viewer.scene, source=SOURCE, depth_origin=origin, plan=plan)
    usual = {"source": SOURCE, "scene": scene, "progress": replace(viewer.state.progress, seconds=1.0)}
    shown = {"preferences": replace(viewer.state.preferences, shows_filmstrip=True), "hides_panel": size != TALL}
    viewer.state = replace(viewer.state, **(usual | shown | changes))
    file = f"screens/{name.replace(' ', '-')}"
    assert_golden(viewer.screen(size), file, SAME_RASTERISER, tmp_path, regenerate_golden)
