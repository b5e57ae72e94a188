"""Time in the window's loop: how long a turn may sleep, and how long notices stay."""

from __future__ import annotations

import time
from collections import deque
from dataclasses import dataclass, field

from viewer.model import messages
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.messages import Notice

IDLE_WAIT_S = 1.0
"""Longest sleep in seconds; it only bounds the harm of a lost wake-up."""
TOOLTIP_LOOK_S, TOOLTIP_S = 0.08, 0.5
"""Sleep, and its total time, in seconds, while a pointer rests on the panel: a tooltip needs frames to appear."""
MOTION_FRAME_S = 1 / 60
DIALOG_LOOK_S = 0.1
"""Sleep while a file dialog is open, in seconds."""
FRAMES_OF_A_CLICK = 3
"""Number of frames in which a press, its release and the next press arrive."""
SETTLING_FRAMES = 3
"""Number of equal frames before a sleep: ImGui spreads quick events over several frames and lays out in two."""


@dataclass
class Pace:
    """Record of the last turns of the loop. stepped_at, pointer_moved_at: times on the clock. same_frames: number of
    equal frames. took_s: durations of the last turns.
    """

    is_busy: bool = True
    same_frames: int = 0
    stepped_at: float = 0.0
    pointer_moved_at: float = 0.0
    took_s: deque[float] = field(default_factory=lambda: deque(maxlen=FRAMES_OF_A_CLICK))

    def wait_s(self, is_moving: bool, is_over_panel: bool, idle_s: float) -> float:
        """Return how long the next turn may sleep. is_moving: whether the viewpoint moves by itself. is_over_panel:
        whether the pointer is. idle_s: sleep if nothing is going on.
        """
        now = time.perf_counter()
        if is_moving:
            return max(self.stepped_at + MOTION_FRAME_S - now, 0.0)
        if self.is_busy or self.same_frames < SETTLING_FRAMES:
            return 0.0
        return TOOLTIP_LOOK_S if is_over_panel and now - self.pointer_moved_at < TOOLTIP_S else idle_s


class NoticeClock:
    """Clock of the newest notice: each notice's time begins when it is the newest."""

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
