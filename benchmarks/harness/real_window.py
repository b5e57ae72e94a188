"""The real window on a private X server, as programs look at it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

from iibr_core.scenes.scene import Source
from tests.xvfb import private_display
from viewer.app.main_loop import App, initial_state
from viewer.model.actions import OpenPath


@contextmanager
def open_window(source: Source) -> Iterator[App]:
    """A window that has been asked for this."""
    with private_display():
        app = App(initial_state(OpenPath(source)))
        try:
            yield app
        finally:
            app.close()


def run_until_idle(app: App) -> None:
    """Turn the loop until nothing is left to do."""
    while not is_idle(app):
        app.step()


def is_idle(app: App) -> bool:
    """Whether every view is on the screen and nothing is left to do."""
    state = app.state
    is_made = state.progress.is_complete and state.shown_generation == state.generation
    return is_made and app.wait_s > 0 and app.scene_view.shows_all_views()
