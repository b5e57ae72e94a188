"""Ctrl-C and SIGTERM while the window is open."""

import signal

import glfw
import pytest

from viewer.app.interruption import interruptions
from viewer.app.main_loop import run
from viewer.model.action import do
from viewer.model.app_state import AppState


def interrupt_when_resized(state):
    """Have GLFW call what sends the signal; the window closes anyway."""
    window = glfw.get_current_context()

    def on_size(*_):
        glfw.set_window_should_close(window, True)
        signal.raise_signal(signal.SIGINT)

    glfw.set_window_size_callback(window, on_size)
    glfw.set_window_size(window, 300, 300)
    return state


def test_a_signal_during_a_callback_is_not_lost(display, no_egl_context, tmp_path, monkeypatch):
    monkeypatch.setenv("XDG_RUNTIME_DIR", str(tmp_path))
    with pytest.raises(KeyboardInterrupt):
        run(AppState(), None, do(interrupt_when_resized))
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_the_second_signal_is_not_waited_for():
    turns = 0

    def interrupt_each_turn():
        nonlocal turns
        with interruptions():
            while True:
                turns += 1
                signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        interrupt_each_turn()
    assert turns == 2
