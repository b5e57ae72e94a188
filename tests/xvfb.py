"""A private X server for tests and benchmarks of the real window."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def x_server() -> Iterator[str]:
    """Start an X server of our own; yield the name of its display.

    Raises RuntimeError where Xvfb or xdotool are missing: `make test` installs them.
    """
    missing = [name for name in ("Xvfb", "xdotool") if shutil.which(name) is None]
    if missing:
        raise RuntimeError(f"install {' and '.join(missing)}: tests of the window need them")
    readable, writable = os.pipe()
    command = ["Xvfb", "-displayfd", str(writable), "-screen", "0", "1400x900x24", "-noreset", "-nolisten", "tcp"]
    server = subprocess.Popen(command, pass_fds=[writable], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    os.close(writable)
    with os.fdopen(readable) as pipe:
        number = pipe.readline().strip()  # comes when the server is ready, or is empty when it died
    if not number:
        raise RuntimeError(f"Xvfb ended with {server.wait()}")
    try:
        yield f":{number}"
    finally:
        server.terminate()
        server.wait()


@contextmanager
def private_display() -> Iterator[str]:
    """Start an X server of our own; DISPLAY names it while the block runs."""
    with x_server() as name:
        before = {name: os.environ.pop(name, None) for name in ("DISPLAY", "WAYLAND_DISPLAY")}
        os.environ["DISPLAY"] = name
        try:
            yield name
        finally:
            del os.environ["DISPLAY"]
            os.environ.update({name: value for name, value in before.items() if value is not None})
