"""A window with a photo, and a system without dialogs."""

import pytest


@pytest.fixture
def viewer(request, open_window, photo_path):
    """All views of the photo are there; the pointer rests in the picture, off the near square. OPEN_SECTIONS of the
    module: of the panel, those that are used most if none.
    """
    driver = open_window(photo_path)
    if sections := getattr(request.module, "OPEN_SECTIONS", ()):
        driver.open_sections(*sections)
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
