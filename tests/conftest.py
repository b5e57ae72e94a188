"""Options all tests share."""

import os
import signal
from pathlib import Path

import pytest
from hypothesis import settings

# Before torch and BLAS load: their threads spin while they wait for each other, so that tiny arrays take up to 28 times
# as long where others use the cores.
os.environ.setdefault("OMP_NUM_THREADS", "1")
# The same for pictures that Mesa draws without a GPU: each worker draws in its own thread.
os.environ.setdefault("LP_NUM_THREADS", "0")

# Where the caller ignores signals, as jobs in the background and nohup do, programs that are started here would, too.
if signal.getsignal(signal.SIGINT) == signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)
if hasattr(signal, "SIGHUP"):
    signal.signal(signal.SIGHUP, signal.SIG_DFL)

# The first example of a test may compile a kernel, which takes seconds; nothing is timed in a test anyway.
settings.register_profile("untimed", deadline=None)
settings.load_profile("untimed")


LONG_FILES = {
    "test_batch.py",
    "test_cli.py",
    "test_diffusion.py",
    "test_evaluate.py",
    "test_precompile.py",
    "test_window_optics.py",
}
"""Begun first, so that all workers end together: those that take ten seconds and more."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: item.path.name not in LONG_FILES)


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--regenerate-golden", action="store_true", help="write golden images again; then look at them")


@pytest.fixture
def regenerate_golden(request: pytest.FixtureRequest) -> bool:
    return bool(request.config.getoption("--regenerate-golden"))


@pytest.fixture
def photo_path(tmp_path: Path) -> Path:
    from tests.viewer.conftest import write_scene

    return write_scene(tmp_path)
