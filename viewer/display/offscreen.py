"""Scenes drawn without a window: for `iibr screenshot`, exports, batches and pictures of the documentation.

Worker, state, pictures and panels are those of the window.
"""

from __future__ import annotations

import math
import threading
from collections.abc import Callable, Collection, Iterable
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import Optics
from iibr_core.color import linear_from_srgb
from iibr_core.depth.editing.edits import UNEDITED, DepthEdits
from iibr_core.exports.framing import centred, size_in_frame
from iibr_core.exports.full_picture import is_full
from iibr_core.exports.render_settings import RenderSettings, require_size
from iibr_core.exports.source import ExportSource, OpticsOf
from iibr_core.gloss.settings import Gloss
from iibr_core.scenes.lens_choice import LensChoice
from iibr_core.scenes.scene import DepthSettings, Scene, SceneReady, SceneRequest, Source, ViewReady
from iibr_core.scenes.scene_gloss import make_maps
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace, FloatImage
from viewer.background.maps import Entropy, EntropyWork
from viewer.display.inspection_view import InspectionView
from viewer.display.making import PicturesOf, make_scene
from viewer.display.scene_view import SceneView
from viewer.display.stereo_view import StereoView
from viewer.gpu.context import Backend, create_headless
from viewer.model import opening, stereo, window
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.inspection import NO_INSPECTION_TEXTURES, InspectionTextures, set_probe
from viewer.model.layout import BACKGROUND, Layout, is_narrow

LAYOUT_FRAMES = 3
"""Number of frames until the layout is settled: ImGui knows the size of a text once it was built."""

_threads = threading.local()


def open_drawn(
    source: Source,
    depth_strength: float,
    lens: LensChoice,
    on_ready: Callable[[Scene], None],
    optics_of: OpticsOf | None = None,
) -> ExportSource:
    """Open a scene off screen, see `OpenDrawn`; the previous scene of this thread can no longer be drawn."""
    if not hasattr(_threads, "scene"):  # GL contexts belong to threads
        _threads.scene = OffscreenScene()
    scene: OffscreenScene = _threads.scene
    return scene.open_for_export(source, depth_strength, lens, on_ready, optics_of)


class OffscreenScene(ExitStack):
    """Open one scene at a time and draw it. Use as a context manager, which frees every GL object.

    state: as in the window; it may be replaced between pictures. gl: the GL context, which has no window. view,
    inspection: the views and the inspection's images on the graphics card.
    """

    def __init__(self, backend: Backend = "auto") -> None:
        """Create a GL context. Raises InputError if there is none."""
        super().__init__()
        self.state = AppState()
        self.gl = create_headless(backend)
        self.view = SceneView(self.gl)
        self.inspection = InspectionView(self.gl, self.view)
        for part in (self.gl, self.view, self.inspection):
            self.callback(part.release)

    def open(
        self,
        source: Source,
        depth_strength: float = 1.0,
        edits: DepthEdits = UNEDITED,
        pictures_of: PicturesOf = lambda scene: None,
    ) -> Scene:
        """Open a scene and make its views, see `make_scene`; return the scene. edits: edits of its depth."""
        depth = DepthSettings(source.depth.refine, edits)
        self.state = AppState(depth_strength=depth_strength)
        self.do(do(opening.open_source, source))
        request = SceneRequest(self.state.generation, source, depth_strength, depth_settings=depth, takes_drafts=False)
        return make_scene(request, partial(self._show, depth), pictures_of)

    def _show(self, depth: DepthSettings, result: SceneReady | ViewReady) -> None:
        """Upload a scene, which has these settings, or a view of it."""
        if isinstance(result, SceneReady):
            self.do(do(opening.show_scene, result.generation, result.scene))
            self.state = replace(self.state, depth=depth)
            self.view.open(result)
            self.inspection.open()
            return
        self.view.add(result.view)
        self.view.take_hidden(result.hidden)
        self.inspection.add(result.view)
        self.view.upload_all()
        self.do(do(opening.set_progress, result.generation, result.progress, (result.view.row, result.view.column)))

    def open_for_export(
        self,
        source: Source,
        depth_strength: float,
        lens: LensChoice,
        on_ready: Callable[[Scene], None],
        optics_of: OpticsOf | None = None,
    ) -> ExportSource:
        """Open a scene to be exported, see `OpenDrawn`."""

        def pictures_of(scene: Scene) -> Iterable[Optics] | None:
            on_ready(scene)
            return None if optics_of is None else optics_of(scene, lens.optics_on(scene, self.disparity))

        scene = self.open(source, depth_strength, pictures_of=pictures_of)
        return ExportSource(scene, self.view.loaded, lens.optics_on(scene, self.disparity), self.draw, self.view.centre)

    @property
    def disparity(self) -> FloatImage | None:
        """The disparity of the centre view, None if the scene has none."""
        return None if self.view.centre is None else self.view.centre.disparity

    @property
    def scene(self) -> Scene:
        """The open scene."""
        assert self.state.scene is not None
        return self.state.scene

    def do(self, *actions: Action) -> None:
        """Change the state."""
        for action in actions:
            self.state = action.apply(self.state)

    def pick(self, x_px: float, y_px: float) -> float | None:
        """Return the disparity seen at a pixel of the picture from the present eye; None if the scene has none."""
        return self.view.pick(self.state.optics.eye, x_px, y_px)

    def draw(self, settings: RenderSettings) -> NDArray[Any]:
        """Return a picture of the open scene, see `iibr_core.exports.source.Draw`."""
        require_size(settings.size_px)
        self._prepare_gloss(settings.optics.gloss)
        return self.view.renderer.converged_picture(settings)

    def draws_own_pixels(self, size: ScreenSize | None) -> bool:
        """Return whether `picture` draws this size from the photo's own pixels, without the views."""
        return self.state.stereo.display is None and is_full(self.scene, self.state.optics, size or self.scene.size)

    def optics_of_picture(self, size: ScreenSize | None) -> Collection[Optics]:
        """Return the optics of all that `picture` draws from the views."""
        if self.state.stereo.display is not None and size is not None:
            return [eye.optics for eye in stereo.weave_of(self.state, self.scene, size).eyes]
        return () if self.draws_own_pixels(size) else (self.state.optics,)

    def picture(
        self, size: ScreenSize | None = None, is_linear: bool = False, color_space: ColorSpace = SRGB
    ) -> NDArray[Any]:
        """Return the picture without panels, (height, width, 3), letterboxed into `size`; None: the size of the views.

        It is uint8, encoded by sRGB's curve, or float32 linear light with 1 = white. Raises InputError for sizes out of
        range, and if the photo cannot be read again at its own size.
        """
        from iibr_core.exports.full_drawing import draw_picture  # heavy, and not for every scene

        frame = ScreenSize(*(size or self.scene.size))
        if self.state.stereo.display is not None:
            return self._woven_picture(frame)
        box_size = size_in_frame(self.scene, frame)
        require_size(box_size)
        settings = RenderSettings(self.state.optics, box_size, is_linear=is_linear, color_space=color_space)
        pixels = draw_picture(self.scene, self.view.loaded, settings, self.draw)
        background = np.array(BACKGROUND[:3])
        return centred(pixels, frame, linear_from_srgb(background) if is_linear else np.round(background * 255))

    def _woven_picture(self, size: ScreenSize) -> NDArray[np.uint8]:
        """Return the picture for a lenticular display, whose screen has this size."""
        self._prepare_gloss(self.state.optics.gloss)
        view, weave = StereoView(self.gl, self.view), stereo.weave_of(self.state, self.scene, size)
        while view.drawn is None or view.is_drawing:
            view.draw(weave, math.inf)
        pixels = view.screen.read()
        view.release()
        return pixels

    def screen(self, size: ScreenSize) -> NDArray[np.uint8]:
        """Return the whole window of this size, (height, width, 3). Not for OSMesa, in which ImGui finds no OpenGL."""
        from viewer.ui.host import UiHost  # pictures alone need no ImGui
        from viewer.ui.screen import build_screen
        from viewer.ui.style import Look

        preferences = self.state.preferences
        look = Look(preferences.font_scale, preferences.theme)
        self.do(do(window.set_narrow, is_narrow(size, 1.0)))
        layout = window.layout_for(self.state, size, 1.0, look.ui_scale)
        texture, textures = self._draw_textures(layout)
        target = self.gl.ctx.simple_framebuffer(size, 4)
        ui = UiHost(look)
        try:
            for _ in range(LAYOUT_FRAMES):
                ui.begin(layout, look)
                build_screen(self.state, layout, texture, textures)
                ui.end()
                target.use()
                ui.draw()
            rows = np.frombuffer(target.read(components=3), np.uint8)
        finally:
            ui.release()
            target.release()
        return rows.reshape(size[1], size[0], 3)[::-1]

    def _draw_textures(self, layout: Layout) -> tuple[int | None, InspectionTextures]:
        """Draw the picture and what inspection shows to the end; return their textures."""
        self._prepare_gloss(self.state.optics.gloss)
        if not layout.frame_px or not self.view.converge(self.state, layout.frame_px.size, layout.part):
            return None, NO_INSPECTION_TEXTURES
        request = self.inspection.entropy_request(self.state)
        if request is not None:
            results: list[Entropy] = []
            EntropyWork()(request, results.append)
            self.inspection.take_entropy(results[0])
        self.do(do(set_probe, self.inspection.probe(self.state)))
        textures = self.inspection.draw(self.state, layout)
        while self.inspection.is_drawing:
            textures = self.inspection.draw(self.state, layout)
        return self.view.renderer.image_texture, textures

    def _prepare_gloss(self, gloss: Gloss | None) -> None:
        """Compute the gloss maps if they are missing."""
        request = self.view.gloss_request(gloss)
        if request is not None:
            self.view.take_gloss(make_maps(request))
