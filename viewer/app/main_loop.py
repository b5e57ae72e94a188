"""The window's loop: poll, take results, build panels, apply actions, draw if something changed, sleep."""

from __future__ import annotations

import time
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Protocol

from iibr_core.scenes.scene import Source
from iibr_core.scenes.scene_gloss import GlossRequest
from iibr_core.types import InputError
from viewer.app.dialogs import has_dialogs
from viewer.app.free_camera_view import FreeCameraView
from viewer.app.handover import Receiver
from viewer.app.interruption import interruptions
from viewer.app.keys import actions_from_keys, read_keys
from viewer.app.pace import DIALOG_LOOK_S, IDLE_WAIT_S, NoticeClock, Pace
from viewer.app.pointer import NO_POINTER, Pointer, actions_from_hover, actions_from_pointer, read_pointer
from viewer.app.preferences_store import PreferencesKeeper, load_preferences
from viewer.app.scene_loader import SceneLoader
from viewer.app.session_store import SessionStore
from viewer.app.sharpener import Sharpener
from viewer.app.side_effects import SAVE_BUDGET_S, SideEffects
from viewer.app.stereo_screen import StereoScreen
from viewer.app.window import Window
from viewer.background.maps import EntropyWork, SurfaceWork, find_gloss
from viewer.background.newest import Finder, Newest, noting
from viewer.background.tracker import Tracker
from viewer.display.filmstrip_view import FilmstripView
from viewer.display.inspection_view import InspectionView
from viewer.display.scene_view import VIEW_REFRESH_S, Picture, SceneView
from viewer.gpu.context import create_for_window
from viewer.model import inspection, opening, preferences, saving, selection, viewpoint, window
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.inspection import NO_INSPECTION_TEXTURES
from viewer.model.layout import Layout, is_narrow
from viewer.model.tasks import PlainTask, ask
from viewer.ui.host import UiHost
from viewer.ui.overlays.filmstrip import filmstrip_paths
from viewer.ui.overlays.path_prompt import browsed_paths
from viewer.ui.overlays.welcome import recent_paths
from viewer.ui.screen import build_screen
from viewer.ui.style import Look

VIEWS_BUDGET_S = 0.006
"""Time for uploading views in a turn of the loop, in seconds."""


class Worker(Protocol):
    """Work beside the window."""

    def advance(self, state: AppState) -> list[Action]:
        """Begin what the state asks for, and return what came of it."""

    def close(self) -> None:
        """Stop the work and wait for its threads."""


class App:
    """The viewer with one window. `do` is the only place where the state changes."""

    def __init__(self, state: AppState | None = None, kept_in: Path | None = None) -> None:
        """Open the window. kept_in: folder of preferences and sessions; None keeps nothing. Raises InputError."""
        state = state or AppState()
        self.state = replace(load_preferences(state, kept_in) if kept_in else state, has_dialogs=has_dialogs())
        self.frames_shown = 0
        self.window = Window("iibr", self.state.preferences.window, self.state.preferences.is_maximized)
        self.state = replace(self.state, monitors=self.window.monitors)
        try:
            self._gl = create_for_window(self.window.handle)
        except InputError:
            self.window.close()
            raise
        wake = self.window.wake
        self.scene_view = SceneView(self._gl)
        self.stereo_screen = StereoScreen(self._gl, self.scene_view, self.window)
        self.inspection_view = InspectionView(self._gl, self.scene_view)
        self.sharpener = Sharpener(self._gl, self.scene_view, wake)
        self.free_camera_view = FreeCameraView(self.scene_view, wake)
        self._tracker = Tracker(wake)
        self.receiver = Receiver(wake)
        self._ui = UiHost(self.look(), self.window.handle)
        self._filmstrip = FilmstripView(self._gl, wake)
        self.scene_loader = SceneLoader(self.scene_view, self.inspection_view, self.window.set_title, wake)
        self._side_effects = SideEffects(self.scene_view, wake, self.window.clipboard_text)
        self._sessions = SessionStore(kept_in, wake)
        self._preferences = PreferencesKeeper(self.state, kept_in)
        view = self.inspection_view
        entropy, surface = Newest("iibr-entropy", EntropyWork(), wake), Newest("iibr-surface", SurfaceWork(), wake)
        gloss = Newest("iibr-gloss", find_gloss, wake)
        self._workers: tuple[Worker, ...] = (
            Finder(entropy, view.entropy_request, view.take_entropy, noting(do(inspection.set_overlay, None))),
            Finder(surface, view.surface_request, view.take_surface, noting(do(selection.deselect))),
            Finder(gloss, self._gloss_request, self.scene_view.take_gloss),
            self.free_camera_view,
            self.stereo_screen,
            self._tracker,
            self._sessions,
            self._side_effects,
            self.scene_loader,
        )
        self._notice_clock = NoticeClock()
        self._shown: tuple[object, ...] = ()
        self._pointer = NO_POINTER
        self._pace = Pace()
        self._drawn_at = 0.0
        self.do(do(ask, PlainTask("find recent")))

    def run(self, signals: Sequence[int]) -> None:
        """Show frames until the user quits or one of these signals came, see `interruptions`."""
        while not (self.state.should_quit or signals):
            self.step()

    def step(self) -> None:
        """Take one turn of the loop; it sleeps first if nothing was going on in the last ones."""
        self.window.poll(self.wait_s)
        start = self._pace.stepped_at = time.perf_counter()
        news = [*chain.from_iterable(worker.advance(self.state) for worker in self._workers), *self._take_events()]
        self.do(*news)
        self._pace.is_busy = self.scene_view.upload(VIEWS_BUDGET_S) or bool(news)
        layout, look = self.layout(), self.look()
        picture = self._draw_picture(layout)
        if picture and self.scene_view.report != self.state.report:
            self.do(do(window.set_report, self.scene_view.report))
        textures = self.inspection_view.draw(self.state, layout) if picture else NO_INSPECTION_TEXTURES
        self._ui.begin(layout, look, sum(self._pace.took_s))
        self._pointer = pointer = read_pointer(self._pointer)
        if pointer.step_x or pointer.step_y:
            self._pace.pointer_moved_at = time.perf_counter()
        actions = [do(window.end_gesture)] if pointer.is_pressed and self.state.history.gesture else []
        paths = filmstrip_paths(self.state, layout) + recent_paths(self.state) + browsed_paths(self.state)
        thumbnails = self._filmstrip.thumbnails(paths)
        sharp = self.sharpener.texture(picture) if picture else None
        texture = sharp or (self.scene_view.renderer.image_texture if picture else None)
        woven = self.stereo_screen.texture
        actions += build_screen(self.state, layout, texture, textures, thumbnails, woven)
        pointer = self.stereo_screen.pointer(pointer, layout)
        actions += self._input(pointer, layout)
        woven_picture = woven and self.stereo_screen.view.drawn
        self._show((picture, textures, self._ui.end(), layout, look, self.window.damages, sharp, woven_picture))
        if self.frames_shown and (picture or self.state.source is None):  # the first picture is more urgent
            self.window.show_icon()
        is_still = not actions and not pointer.is_down and not pointer.pulls
        self.do(*actions)
        probe = self.inspection_view.probe(self.state)
        if probe != self.state.inspection.probe:
            self.do(do(inspection.set_probe, probe))
        self.do(*self.sharpener.advance(picture, self.state, is_still and self._is_resting, SAVE_BUDGET_S))
        drawn = self._side_effects, self.sharpener, self.inspection_view, self.stereo_screen.view
        self._pace.is_busy |= bool(actions) or any(part.is_drawing for part in drawn)
        self._pace.took_s.append(time.perf_counter() - start)

    def _draw_picture(self, layout: Layout) -> Picture | None:
        """Draw the stereo picture, and the picture beside the panel, which waits for a moving stereo picture."""
        before, now = self.scene_view.picture_drawn, time.perf_counter()
        if self.stereo_screen.draw(self.state, layout):
            self._pace.same_frames = 0
            if before is not None and now - self._drawn_at < VIEW_REFRESH_S:
                return before
        self._drawn_at = now
        return self.scene_view.draw(self.state, layout.frame_px.size, layout.part) if layout.frame_px else None

    @property
    def _is_resting(self) -> bool:
        """Whether nothing moves, all views are there and nothing is being drawn for a file."""
        state, view = self.state, self.scene_view
        is_shown = view.generation == state.generation and view.renderer.is_converged
        is_moving = state.motion.is_running or state.stroke is not None
        return not state.is_making_views and is_shown and not is_moving and not self._side_effects.is_drawing

    @property
    def wait_s(self) -> float:
        """Time that the next turn may sleep, in seconds."""
        is_behind = self.scene_loader.holds_progress or not self.scene_view.shows_all_views()
        is_behind |= not self.stereo_screen.view.shows_all_views
        is_behind |= self.state.is_making_views and not self.scene_view.renderer.is_converged
        idle_s = VIEW_REFRESH_S if is_behind else IDLE_WAIT_S
        idle_s = DIALOG_LOOK_S if self._side_effects.is_waiting else idle_s
        return self._pace.wait_s(self.state.motion.is_running, self._pointer.is_over_panel, idle_s)

    def layout(self) -> Layout:
        """Return the layout of the window."""
        return window.layout_for(self.state, self.window.size, self.window.pixel_ratio, self.look().ui_scale)

    def look(self) -> Look:
        """Return the theme, and the scale of text and widgets on this display."""
        return Look(self.window.ui_scale * self.state.preferences.font_scale, self.state.preferences.theme)

    def close(self) -> None:
        """Keep preferences and session, stop all threads, finish files that are being written, and free everything."""
        self.window.hide()
        self._preferences.keep(self.state)
        self._sessions.keep(self.state)
        self.receiver.close()
        self.sharpener.close()
        for worker in reversed(self._workers):
            worker.close()
        for part in (self._ui, self._filmstrip, self.inspection_view, self.scene_view, self._gl):
            part.release()
        self.window.close()

    def do(self, *actions: Action) -> None:
        """Apply actions to the state."""
        if actions:
            self._pace.same_frames = 0
        for action in actions:
            self.state = action.apply(self.state)
        self.scene_loader.look_from(self.state.optics.eye)

    def _take_events(self) -> list[Action]:
        """Return actions that come from the clock, the window, and later starts of the program."""
        pointer = self._pointer
        is_on_notice = pointer.is_over_panel and not self.layout().panel.contains(pointer.x, pointer.y)
        actions = self._notice_clock.expire(self.state, self._pace.stepped_at, is_on_notice)
        if self.state.motion.is_running:
            actions.append(do(viewpoint.tick, self._pace.stepped_at))
        actions += self._preferences.advance(self.state) + self._place_window()
        if dropped := self.window.take_dropped():
            actions.append(do(opening.open_paths, dropped))
        if (received := self.receiver.take()) is not None:
            self.window.ask_for_attention()
            actions.append(do(opening.open_paths, received))
        if is_narrow(self.window.size, self.window.ui_scale) != self.state.is_narrow:
            actions.append(do(window.set_narrow, not self.state.is_narrow))
        return actions

    def _place_window(self) -> list[Action]:
        """Return where the window is, if that is news."""
        before, place = self.state.preferences, self.window.place
        self.window.set_fullscreen(self.state.is_fullscreen or self.state.stereo.fills_window)
        if self.window.is_fullscreen or self.window.is_hidden or (place is None and before.is_maximized):
            return []
        is_known = place == before.window and not before.is_maximized
        return [] if is_known else [do(preferences.place_window, place)]

    def _input(self, pointer: Pointer, layout: Layout) -> list[Action]:
        pick = partial(self.scene_view.pick, self.state.optics.eye)
        actions = actions_from_pointer(pointer, layout, self.state, pick)
        actions += actions_from_hover(pointer, layout, self.state, pick)
        actions += actions_from_keys(read_keys(self.window.held_at), self.state)
        actions += [do(window.end_gesture)] if pointer.is_released else []  # after the edits of the frame
        return [*actions, do(saving.quit_window)] if self.window.take_closing() else actions

    def _gloss_request(self, state: AppState) -> GlossRequest | None:
        return self.scene_view.gloss_request(state.optics.gloss)

    def _show(self, frame: tuple[object, ...]) -> None:
        """Draw a frame, unless all that the window shows is as in the frame before."""
        if frame == self._shown or not all(self.window.framebuffer_size):
            self._pace.same_frames += 1
            return
        self._gl.ctx.screen.use()
        self._ui.draw()
        self.window.show_frame()
        self._tracker.note_shown()
        self._shown, self._pace.same_frames = frame, 0
        self.frames_shown += 1


def run(state: AppState, kept_in: Path | None = None, *actions: Action) -> None:
    """Open the window on this state, take actions, and show it until the user quits. Raises InputError."""
    with interruptions() as signals, closing(App(state, kept_in)) as app:
        if app.receiver.has_another():
            app.window.step_aside()
        app.receiver.listen()
        app.do(*actions)
        app.run(signals)


def initial_state(source: Source, depth_strength: float = 1.0) -> AppState:
    """Return the state to start with: this source is to be opened."""
    return opening.open_source(AppState(depth_strength=depth_strength), source)
