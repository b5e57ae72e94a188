"""Private X servers for tests and benchmarks of the real window."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

TWO_MONITORS = """
Section "ServerFlags"
  Option "AutoAddDevices" "false"
EndSection
Section "Device"
  Identifier "card"
  Driver "dummy"
  VideoRam 65536
EndSection
Section "Screen"
  Identifier "screen"
  Device "card"
  DefaultDepth 24
EndSection
"""
"""Configuration of Xorg without a graphics card and without mouse and keyboard, as xdotool replaces them."""


@contextmanager
def x_server() -> Iterator[str]:
    """Start an X server of our own; yield the name of its display.

    Raises RuntimeError where Xvfb or xdotool are missing: `make test` installs them.
    """
    missing = [name for name in ("Xvfb", "xdotool") if shutil.which(name) is None]
    if missing:
        raise RuntimeError(f"install {' and '.join(missing)}: tests of the window need them")
    with _x_server("Xvfb", "-screen", "0", "1400x900x24") as name:
        yield name


@contextmanager
def display_with_monitors(folder: Path, *sizes: tuple[int, int]) -> Iterator[str]:
    """Start an X server with monitors side by side, DUMMY0 and so on; DISPLAY names it while the block runs.

    sizes: (width, height) of each, among those that the driver offers: 1024x768, 960x540, 800x600, 640x480. folder:
    for the server's files. Raises RuntimeError where Xorg, its driver or xrandr are missing: `make test` installs them.
    """
    missing = [name for name in ("Xorg", "xrandr", "xdotool") if shutil.which(name) is None]
    if missing:
        raise RuntimeError(f"install {' and '.join(missing)}: tests of two monitors need them")
    (folder / "xorg.conf").write_text(TWO_MONITORS)
    files = "-config", str(folder / "xorg.conf"), "-logfile", str(folder / "xorg.log")
    with _x_server("Xorg", *files, "-novtswitch", "-sharevts") as name, _as_display(name):
        x = 0
        for i, (width, height) in enumerate(sizes):
            place = "--mode", f"{width}x{height}", "--pos", f"{x}x0"
            if i:  # a monitor gets its modes when one is added
                subprocess.run(["xrandr", "--addmode", f"DUMMY{i}", f"{width}x{height}"], check=True)
            subprocess.run(["xrandr", "--output", f"DUMMY{i}", *place], check=True)
            x += width
        subprocess.run(["xrandr", "--query"], check=True, stdout=subprocess.DEVNULL)  # the monitors count from then on
        yield name


@contextmanager
def _x_server(*command: str) -> Iterator[str]:
    """Start a server; yield the name of its display. Raises RuntimeError if it ends at once."""
    readable, writable = os.pipe()
    command += "-displayfd", str(writable), "-noreset", "-nolisten", "tcp"
    server = subprocess.Popen(command, pass_fds=[writable], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(writable)
    with os.fdopen(readable) as pipe:
        number = pipe.readline().strip()  # comes when the server is ready, or is empty when it died
    if not number:
        raise RuntimeError(f"{command[0]} ended with {server.wait()}")
    try:
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()


@contextmanager
def private_display() -> Iterator[str]:
    """Start an X server of our own; DISPLAY names it while the block runs."""
    with x_server() as name, _as_display(name):
        yield name


@contextmanager
def _as_display(name: str) -> Iterator[None]:
    """Let DISPLAY name a server while the block runs."""
    before = {name: os.environ.pop(name, None) for name in ("DISPLAY", "WAYLAND_DISPLAY")}
    os.environ["DISPLAY"] = name
    try:
        yield
    finally:
        del os.environ["DISPLAY"]
        os.environ.update({name: value for name, value in before.items() if value is not None})
