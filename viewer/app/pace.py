"""Time in the window's loop: how long it may sleep before it looks again, how long notices are read."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field

from viewer.model import messages
from viewer.model.action import Action, do
from viewer.model.state.app_state import AppState
from viewer.model.state.notices import Notice

IDLE_WAIT_S = 1.0
"""Nothing is expected to happen unannounced; this only bounds the harm of a lost wake-up."""

TOOLTIP_LOOK_S, TOOLTIP_S = 0.08, 0.5
"""How often, and for how long, a pointer that rests on the panel is looked at: ImGui tells what it points at after
0.15 s, counted in frames, and needs one to measure the words.
"""

MOTION_FRAME_S = 1 / 60
DIALOG_LOOK_S = 0.1
"""How often an open file dialog is asked for its answer."""

FRAMES_OF_A_CLICK = 3
"""A press and its release, and the next press, are heard of in as many frames."""

SETTLING_FRAMES = 3
"""ImGui hands out quick events over several frames and lays out in two: so many must look the same before a sleep."""


@dataclass
class Pace:
    """What the last turns of the loop were about. stepped_at, pointer_moved_at: on the clock. same_frames: that looked
    the same. took_s: the last turns.
    """

    is_busy: bool = True
    same_frames: int = 0
    stepped_at: float = 0.0
    pointer_moved_at: float = 0.0
    took_s: deque[float] = field(default_factory=lambda: deque(maxlen=FRAMES_OF_A_CLICK))

    def wait_s(self, is_moving: bool, is_over_panel: bool, idle_s: float) -> float:
        """How long the next turn may sleep. is_moving: the picture, by itself. is_over_panel: the pointer.
        idle_s: where nothing is going on.
        """
        now = time.perf_counter()
        if is_moving:
            return max(self.stepped_at + MOTION_FRAME_S - now, 0.0)
        if self.is_busy or self.same_frames < SETTLING_FRAMES:
            return 0.0
        if is_over_panel and now - self.pointer_moved_at < TOOLTIP_S:
            return TOOLTIP_LOOK_S
        return idle_s


class NoticeClock:
    """Says when the newest notice was read: the others' time begins when they are the newest."""

    def __init__(self) -> None:
        self._shown: Notice | None = None
        self._shown_at = 0.0

    def expire(self, state: AppState, now_s: float, is_held: bool) -> list[Action]:
        """Dismiss the newest notice once its time is over. is_held: the pointer rests on it: its time begins again."""
        notice = state.notices[-1] if state.notices else None
        if notice is not self._shown or is_held:
            self._shown, self._shown_at = notice, now_s
        is_over = notice is not None and now_s - self._shown_at > notice.seconds
        return [do(messages.dismiss, notice)] if notice is not None and is_over else []
