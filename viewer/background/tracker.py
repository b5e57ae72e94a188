"""Poses of the head that a tracker sends by UDP: a thread receives them, the newest counts."""

from __future__ import annotations

import math
import select
import socket
import threading
import time
from collections import deque
from collections.abc import Callable

from iibr_core.types import InputError
from viewer.model import messages, tracking
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.messages import Notice

WAIT_S = 0.2
"""Longest wait for a packet, in seconds: closing takes as long."""
PAUSE_S = 0.004
"""Shortest time between two looks at the socket, in seconds, as opentrack sends: a flood takes little of a core."""
BUFFER_BYTES = 2048
"""Size of the system's buffer: some five packets, so none is old when it is read."""
MAX_PACKETS = 32
"""Largest number of packets that are read at a time."""
MIN_STEP_CM = 0.02
"""Shortest movement of the head that moves the viewpoint: the picture becomes fine while the head rests."""
SILENCE_S = 2.0
"""Time without a pose after which the window shows that none come, in seconds."""
LATENCY_WEIGHT = 0.1
"""Weight of the newest latency in the running mean."""


class Listener:
    """A thread that receives poses at an address and smooths them.

    news: at most one place of the head that the window has not taken, with the time of its packet on the clock.
    seen_s: time of the last pose, that of the start before the first.
    """

    def __init__(self, address: str, wake: Callable[[], None]) -> None:
        """wake: called in the thread when there are news. Raises InputError."""
        host, port = tracking.address_of(address)
        self.address, self.seen_s = address, time.perf_counter()
        self.news: deque[tuple[complex, float]] = deque(maxlen=1)
        self._wake, self._is_closing = wake, threading.Event()
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, BUFFER_BYTES)
        self._socket.setblocking(False)
        try:
            self._socket.bind((host, port))
        except (OSError, UnicodeError) as error:
            self._socket.close()
            reason = f"cannot listen at {host}:{port} ({getattr(error, 'strerror', None) or error})"
            raise InputError(f"{reason}: end what listens there, or give another --tracker udp:HOST:PORT") from error
        self._thread = threading.Thread(target=self._run, name="iibr-tracker", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """End the thread and close the socket."""
        self._is_closing.set()
        self._thread.join()
        self._socket.close()

    def _run(self) -> None:
        smoothed: tracking.Smoothed | None = None
        shown = complex(math.inf)
        while not self._is_closing.wait(PAUSE_S):
            head = self._newest() if select.select([self._socket], [], [], WAIT_S)[0] else None
            if head is None:
                continue
            self.seen_s = time.perf_counter()
            smoothed = tracking.smooth(smoothed, head, self.seen_s)
            if abs(smoothed.place - shown) >= MIN_STEP_CM:
                shown = smoothed.place
                self.news.append((shown, self.seen_s))
                self._wake()

    def _newest(self) -> complex | None:
        """Read the packets that wait; return the place of the head in the newest pose, None without."""
        packets: list[bytes] = []
        for _ in range(MAX_PACKETS):
            try:
                packets.append(self._socket.recv(tracking.POSE.size + 1))
            except BlockingIOError:
                break
            except OSError:  # Windows reports a packet that is too long, and a sender that is gone
                continue
        heads = map(tracking.head_in, reversed(packets))
        return next((head for head in heads if head is not None), None)


class Tracker:
    """Listens while the state asks for it, and moves the viewpoint."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: called, in a thread, when the head has moved."""
        self._wake = wake
        self._listener: Listener | None = None
        self._taken_s: float | None = None
        self._latency_ms = 0.0

    def advance(self, state: AppState) -> list[Action]:
        """Begin or end listening as the state asks; return what came in, and problems."""
        self._taken_s, wanted = None, state.tracking
        if (wanted and wanted.address) != (self._listener and self._listener.address):
            self.close()
            try:
                self._listener = Listener(wanted.address, self._wake) if wanted else None
            except InputError as error:
                return [do(tracking.switch, None), do(messages.notify, Notice(str(error), is_error=True))]
        if wanted is None or self._listener is None:
            return []
        actions = list[Action]()
        is_receiving = time.perf_counter() - self._listener.seen_s < SILENCE_S
        if is_receiving != wanted.is_receiving:
            actions.append(do(tracking.set_receiving, is_receiving))
        if self._listener.news:
            head, self._taken_s = self._listener.news.popleft()
            actions.append(do(tracking.follow, head, self._latency_ms))
        return actions

    def note_shown(self) -> None:
        """Measure the latency: what was taken in this turn of the loop is on the screen now."""
        if self._taken_s is not None:
            newest_ms = 1e3 * (time.perf_counter() - self._taken_s)
            self._latency_ms += LATENCY_WEIGHT * (newest_ms - self._latency_ms)

    def close(self) -> None:
        """End listening."""
        if self._listener is not None:
            self._listener.close()
        self._listener = None
