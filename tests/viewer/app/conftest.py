"""A window with a photo, and a system without dialogs."""

from dataclasses import replace

import pytest

from iibr_core.types import GridShape
from viewer.model.preferences import with_sections


@pytest.fixture
def viewer(request, open_window, photo_path):
    """All views of the photo are there; the pointer rests in the picture, off the near square. GRID of the module: of
    the photo's views; OPEN_SECTIONS: of the panel, those that are used most if none.
    """
    driver = open_window(photo_path, grid=getattr(request.module, "GRID", GridShape(3, 3)))
    if sections := getattr(request.module, "OPEN_SECTIONS", ()):
        preferences = replace(driver.app.state.preferences, open_sections=with_sections((), *sections))
        driver.app.state = replace(driver.app.state, preferences=preferences)
    driver.until_idle()
    driver.send("mousemove", *driver.position(0.1, 0.1))
    driver.until_idle()
    return driver


@pytest.fixture
def no_dialogs(monkeypatch):
    """As on a system without zenity and its like: a dialog would wait for a person."""
    monkeypatch.setattr("viewer.app.side_effects.has_dialogs", lambda: False)


@pytest.fixture(autouse=True)
def soon(monkeypatch):
    """A picture is at its best after few passes: how it looks then is tested in tests/viewer/gpu. A window at rest
    looks often whether there is anything new.
    """
    monkeypatch.setattr("viewer.gpu.refocus.picture_lens.EDGE_PASSES", 2)
    monkeypatch.setattr("viewer.app.main_loop.IDLE_WAIT_S", 0.1)
    monkeypatch.setattr("viewer.app.pace.TOOLTIP_S", 0.1)
