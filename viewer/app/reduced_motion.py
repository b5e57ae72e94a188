"""Whether the desktop asks programs to move as little as possible."""

from __future__ import annotations

import subprocess
import sys
from contextlib import suppress

PATIENCE_S = 2.0
_ASKED = {
    "linux": (("gsettings", "get", "org.gnome.desktop.interface", "enable-animations"), "false"),
    "darwin": (("defaults", "read", "com.apple.universalaccess", "reduceMotion"), "1"),
}
"""By platform: who knows, and what it prints where less is to move."""
_CLIENT_AREA_ANIMATION = 0x1042
"""Of Windows' SystemParametersInfo."""


def prefers_reduced_motion() -> bool:
    """False where nobody knows."""
    if sys.platform == "win32":
        import ctypes

        animates = ctypes.c_int(1)
        ctypes.windll.user32.SystemParametersInfoW(_CLIENT_AREA_ANIMATION, 0, ctypes.byref(animates), 0)
        return not animates.value
    if sys.platform not in _ASKED:
        return False
    command, reduced = _ASKED[sys.platform]
    with suppress(OSError, subprocess.SubprocessError):
        return subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S).stdout.strip() == reduced
    return False
