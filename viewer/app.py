"""The window's loop, and nothing else: poll, drain results, panels and input, apply actions, draw if changed, sleep."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

from iibr_core.types import InputError
from viewer.actions import Action, OpenFailed, OpenPath, ProgressMade, Quit, SceneOpened, apply
from viewer.gpu.context import create_for_window
from viewer.input import actions_from_drop, actions_from_keys, actions_from_pointer, read_keys, read_pointer
from viewer.layout import Layout, layout_of
from viewer.stage import VIEW_REFRESH_S, Stage
from viewer.state import AppState, Picture
from viewer.ui.host import UiHost
from viewer.ui.screen import build_screen
from viewer.window import Window, wake
from viewer.worker import Request, Result, SceneReady, ViewReady, Worker

UPLOAD_BUDGET_S = 0.006
IDLE_WAIT_S = 1.0
"""Nothing is expected to happen unannounced; this only bounds the harm of a lost wake-up."""

SETTLING_FRAMES = 3
"""ImGui hands out quick events over several frames and lays out in two: so many must look the same before a sleep."""

EMPTY = AppState()


@dataclass(frozen=True)
class Frame:
    """Everything the window shows: the picture, the panels (as a digest), where they lie, and repairs asked for."""

    picture: Picture | None
    panels: bytes
    layout: Layout
    damages: int


class App:
    """The viewer: one window, one worker. state changes only through `apply`; frames_shown counts what was shown."""

    def __init__(self, state: AppState = EMPTY) -> None:
        """Open the window. Raises InputError where that cannot be."""
        self.state = state
        self.frames_shown = 0
        self.window = Window("iibr")
        try:
            self._gl = create_for_window(self.window.handle)
        except InputError:
            self.window.close()
            raise
        self.stage = Stage(self._gl)
        self._ui = UiHost(self.window.ui_scale, self.window.handle)
        self._worker = Worker(wake)
        self._submitted = 0
        self._shown: Frame | None = None
        self._same_frames = 0
        self._is_busy = True

    def run(self) -> None:
        """Show frames until the user quits."""
        while not self.state.should_quit:
            self.step()

    def step(self) -> None:
        """One turn of the loop; sleeps first where nothing was going on in the last ones."""
        self.window.poll(self.wait_s)
        heard = self._drained() + self._dropped()
        self._do(heard)
        self._is_busy = self.stage.upload(UPLOAD_BUDGET_S) or bool(heard)
        layout = self.layout()
        picture = self.stage.draw(self.state, layout.picture_px[2:]) if layout.picture_px else None
        self._ui.begin(layout)
        actions = build_screen(self.state, layout, self.stage.texture if picture else None) + self._input(layout)
        self._show(Frame(picture, self._ui.end(), layout, self.window.damages))
        self._do(actions)
        self._is_busy |= bool(actions)
        self._restart_worker()

    @property
    def wait_s(self) -> float:
        """How long the next turn may sleep before it looks."""
        if self._is_busy or self._same_frames < SETTLING_FRAMES:
            return 0.0
        return IDLE_WAIT_S if self.stage.shows_all_views() else VIEW_REFRESH_S

    def layout(self) -> Layout:
        """Where things lie in the window as it is now."""
        scene = self.state.scene
        size = (scene.width, scene.height) if scene else None
        return layout_of(self.window.size, size, self.window.pixel_ratio, self.window.ui_scale)

    def close(self) -> None:
        """Stop the worker and free everything."""
        self._worker.close()
        self._ui.release()
        self.stage.release()
        self._gl.release()
        self.window.close()

    def _do(self, actions: list[Action]) -> None:
        for action in actions:
            self.state = apply(self.state, action)
        self._worker.eye = self.state.optics.eye

    def _drained(self) -> list[Action]:
        """The worker's results, as actions; the one place where they arrive."""
        actions: list[Action] = []
        while self.stage.has_room and (result := self._worker.next_result()) is not None:
            actions += self._taken(result)
        return actions

    def _taken(self, result: Result) -> list[Action]:
        try:
            if isinstance(result, SceneReady):
                self.stage.open(result)
                self.window.set_title(f"{result.scene.name} - iibr")
                return [SceneOpened(result.generation, result.scene)]
            if isinstance(result, ViewReady):
                self.stage.add(result.view)
                return [ProgressMade(result.generation, result.progress)]
        except InputError as error:  # no room on the graphics card: there is no use in more views
            self._worker.cancel()
            return [OpenFailed(result.generation, str(error))]
        return [OpenFailed(result.generation, result.message)]

    def _dropped(self) -> list[Action]:
        paths = self.window.take_dropped()
        return actions_from_drop(paths, self.state) if paths else []

    def _input(self, layout: Layout) -> list[Action]:
        pick = partial(self.stage.pick, self.state.optics.eye)
        actions = actions_from_pointer(read_pointer(), layout, self.state, pick)
        actions += actions_from_keys(read_keys(), self.state)
        return [*actions, Quit()] if self.window.should_close else actions

    def _restart_worker(self) -> None:
        """A new generation is a new job. The photo is read again only if a file was opened since."""
        if self.state.generation == self._submitted or self.state.source is None:
            return
        scene = self.state.scene
        loaded = self.stage.loaded if scene and scene.source is self.state.source else None
        self._submitted = self.state.generation
        self._worker.submit(Request(self.state.generation, self.state.source, self.state.depth_strength, loaded))

    def _show(self, frame: Frame) -> None:
        if frame == self._shown or not all(self.window.framebuffer_size):
            self._same_frames += 1
            return
        self._gl.ctx.screen.use()
        self._ui.draw()
        self.window.show_frame()
        self._shown, self._same_frames = frame, 0
        self.frames_shown += 1


def run(state: AppState) -> None:
    """Open the window on this state and show it until the user quits. Raises InputError where none can be opened."""
    app = App(state)
    try:
        app.run()
    finally:
        app.close()


def opening(action: OpenPath, depth_strength: float = 1.0) -> AppState:
    """The state to start with: nothing open yet, this asked for."""
    return apply(AppState(depth_strength=depth_strength), action)
