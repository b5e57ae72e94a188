"""The viewer without a window: the same worker's job, state, views and panels, drawn into an image."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import CENTRE
from iibr_core.color import linear_from_srgb
from iibr_core.depth.editing.edits import UNEDITED, DepthEdits
from iibr_core.exports.framing import centred, size_in_frame
from iibr_core.exports.full_picture import FullPicture, encode_light, is_full
from iibr_core.exports.render_settings import RenderSettings, require_size
from iibr_core.runtime.work import report_progress
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.scene import MAKING, DepthSettings, Scene, SceneReady, SceneRequest, Source, ViewReady
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace, FloatImage, ViewOffset
from viewer.background.comparison_job import ComparisonJob
from viewer.display.inspection_view import InspectionView
from viewer.display.scene_drawer import prepare_gloss
from viewer.display.scene_view import SceneView
from viewer.gpu.headless_context import Backend, create_headless
from viewer.gpu.refocus.views_seen import views_seen
from viewer.model.actions import Action, OpenPath, ProgressMade, SceneOpened, SetState
from viewer.model.inspection_request import (
    NO_INSPECTION_TEXTURES,
    InspectionTextures,
    beside_of,
    make_inspection_request,
)
from viewer.model.layout import BACKGROUND, Layout, is_narrow, layout_of
from viewer.model.reducers.root import reduce
from viewer.model.state.app_state import AppState
from viewer.model.state.inspection import SetInspection

LAYOUT_FRAMES = 3
"""ImGui knows the size of a text only after it was built once."""


class HeadlessViewer:
    """Opens a scene to the end, then takes pictures of it. Use as a context manager."""

    def __init__(self, backend: Backend = "auto") -> None:
        """Make a GL context without a display. Raises InputError where that cannot be."""
        self.state = AppState()
        self._gl = create_headless(backend)
        self._scene_view = SceneView(self._gl)
        self._inspection_view = InspectionView(self._gl, self._scene_view)
        self._comparison_job = ComparisonJob()
        self._results: Iterator[SceneReady | ViewReady] = iter(())
        self._wanted: set[ViewOffset] | None = None

    def __enter__(self) -> HeadlessViewer:
        """Nothing more to do."""
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        """Free everything."""
        self._inspection_view.release()
        self._scene_view.release()
        self._gl.release()

    @property
    def has_panels(self) -> bool:
        """Whether `screen` works here: ImGui's own OpenGL loader finds no functions in OSMesa."""
        return self._gl.backend != "osmesa"

    def open(self, source: Source, depth_strength: float = 1.0) -> None:
        """Read and plan the scene and make all its views. Raises InputError."""
        self.open_scene(source, depth_strength)
        self.make_views()

    def open_scene(
        self,
        source: Source,
        depth_strength: float,
        edits: DepthEdits = UNEDITED,
        on_ready: Callable[[Scene], None] = lambda scene: None,
    ) -> None:
        """Read and plan the scene, its depth edited like this: there is one view, the photo.

        on_ready: called with the scene; its exceptions end the opening. Raises InputError.
        """
        self.state = AppState(depth_strength=depth_strength)
        self.do(OpenPath(source))
        depth_settings = DepthSettings(source.depth.refine, edits)
        request = SceneRequest(
            self.state.generation, source, depth_strength, depth_settings=depth_settings, takes_drafts=False
        )
        self._wanted = None
        self._results = results_of(request, lambda: CENTRE, lambda: self._wanted)
        ready = next(self._results)
        assert isinstance(ready, SceneReady)
        on_ready(ready.scene)
        self._scene_view.open(ready)
        self._inspection_view.open()
        self.do(SceneOpened(ready.generation, ready.scene))
        self.state = replace(self.state, depth=depth_settings)
        self._scene_view.upload_all()

    def make_views(self, only_seen: bool = False) -> None:
        """Make the views. only_seen: only those of a photo's grid that its `picture` is made of."""
        if only_seen:
            self._wanted = views_seen(self.state.optics, self.scene.grid)
        for result in self._results:
            assert isinstance(result, ViewReady)
            self._scene_view.add(result.view)
            self._inspection_view.add(result.view)
            self.do(ProgressMade(result.generation, result.progress, (result.view.row, result.view.column)))
            report_progress(result.progress.done, result.progress.total, MAKING)
            self._scene_view.upload_all()

    def pick(self, x_px: float, y_px: float) -> float | None:
        """Disparity seen at a pixel of the picture from the present viewpoint; None where the scene has none."""
        return self._scene_view.pick(self.state.optics.eye, x_px, y_px)

    def do(self, *actions: Action) -> None:
        """Change the state."""
        for action in actions:
            self.state = reduce(self.state, action)

    def picture(
        self,
        size: ScreenSize | None = None,
        is_linear: bool = False,
        color_space: ColorSpace = SRGB,
    ) -> NDArray[Any]:
        """The picture alone, letterboxed into (width, height), the scene's own size by default: (height, width, 3).

        Bytes, encoded, or float32 linear light with 1 = white, of color_space. Raises InputError for absurd sizes, and
        where the photo is no longer there to be read at its own size.
        """
        scene = self.state.scene
        assert scene is not None
        frame = ScreenSize(*(size or scene.size))
        box_size = size_in_frame(scene, frame)
        require_size(box_size)
        prepare_gloss(self._scene_view, self.state.optics.gloss)
        if is_full(scene, self.state.optics, box_size):
            light = self._full_picture(scene, box_size)
            pixels = encode_light(light, is_linear, color_space, scene.color_space)
        else:
            settings = RenderSettings(self.state.optics, box_size, is_linear=is_linear, color_space=color_space)
            pixels = self._scene_view.renderer.converged_picture(settings)
        background = np.array(BACKGROUND[:3])
        return centred(pixels, frame, linear_from_srgb(background) if is_linear else np.round(background * 255))

    def _full_picture(self, scene: Scene, size: ScreenSize) -> FloatImage:
        loaded, optics = self._scene_view.loaded, self.state.optics
        assert loaded is not None
        assert scene.plan is not None
        from iibr_core.exports.full_drawing import draw_full

        full = FullPicture(scene, scene.plan, loaded, optics, size)
        return draw_full(full, self._scene_view.renderer.converged_picture)

    @property
    def scene(self) -> Scene:
        """What is open."""
        assert self.state.scene is not None
        return self.state.scene

    @property
    def own_size(self) -> ScreenSize:
        """Of the photo in its file; of a view where there is none."""
        return self.scene.own_size or self.scene.size

    def needs_views(self, size: ScreenSize | None) -> bool:
        """Whether `picture` at this size shows views other than the photo."""
        return not self.draws_own_pixels(size)

    def draws_own_pixels(self, size: ScreenSize | None) -> bool:
        """Whether `picture` at this size is drawn from the photo's own pixels: it takes long after the views."""
        return is_full(self.scene, self.state.optics, size or self.scene.size)

    def screen(self, size: ScreenSize) -> NDArray[np.uint8]:
        """The whole window as it would look at (width, height): (height, width, 3). Needs `has_panels`."""
        from viewer.ui.host import UiHost  # pictures alone need no ImGui
        from viewer.ui.screen import build_screen
        from viewer.ui.style import Look

        scene, preferences = self.state.scene, self.state.preferences
        self.do(SetState("is_narrow", is_narrow(size, 1.0)))
        look = Look(preferences.font_scale, preferences.theme)
        picture_size = scene.size if scene else None
        layout = layout_of(
            size,
            picture_size,
            ui_scale=look.ui_scale,
            beside=beside_of(self.state),
            has_panel=not self.state.is_panel_hidden,
            zoom=self.state.zoom,
            own_width=self.own_size.width if scene else None,
        )
        prepare_gloss(self._scene_view, self.state.optics.gloss)
        has_picture = layout.frame_px and self._scene_view.converge(self.state, layout.frame_px.size, layout.part)
        texture = self._scene_view.renderer.image_texture if has_picture else None
        textures = self._draw_inspection(layout) if has_picture else NO_INSPECTION_TEXTURES
        target = self._gl.ctx.simple_framebuffer(size, 4)
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

    def _draw_inspection(self, layout: Layout) -> InspectionTextures:
        """What inspection shows, worked out to the end. The pointer is where the state says."""
        request = make_inspection_request(self.state, is_moving=False, before=None)
        inputs = self._inspection_view.inputs(request, self.state)
        if request is not None and inputs is not None:
            for result in self._comparison_job.results_of(request, inputs):
                self.do(*self._inspection_view.take(result))
        self.do(SetInspection("probe", self._inspection_view.probe(self.state)))
        textures = self._inspection_view.draw(self.state, layout)
        while self._inspection_view.is_drawing:
            textures = self._inspection_view.draw(self.state, layout)
        return textures
