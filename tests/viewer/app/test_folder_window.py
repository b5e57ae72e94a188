"""A folder of photos in a real window: keys and clicks go on, neighbours are read ahead, small pictures appear."""

import os
import threading

import numpy as np
import pytest
from imgui_bundle import imgui
from PIL import ImageGrab

from iibr_core.scenes.scene import Source, WantedPhoto
from iibr_core.types import GridShape
from tests.iibr_core.scenes.test_opening import write_large_photo
from tests.viewer.conftest import says, shows, write_scene
from viewer.model import folder, history, lens, look
from viewer.model.action import do


@pytest.fixture
def viewer(open_window, tmp_path):
    for i in range(3):
        write_scene(tmp_path, f"photo{i}", seed=i)
    driver = open_window(tmp_path)
    driver.settle(lambda app: app.state.folder is not None)
    return driver


def middle_tile(app):
    """The tile of the open photo, in the middle, as it is on the screen."""
    strip = app.layout().filmstrip
    left, middle, width = app.window.place[0], strip.x + strip.width / 2, strip.height
    top = app.window.place[1] + strip.y
    screen = ImageGrab.grab(xdisplay=os.environ["DISPLAY"])
    box = left + middle - width / 2, top + 8, left + middle + width / 2, top + strip.height - 8
    return np.asarray(screen.crop(tuple(map(round, box))))


def test_keys_go_to_the_next_photo_and_back_and_it_was_read_before(viewer, tmp_path):
    next_photo = WantedPhoto(Source(str(tmp_path / "photo1.png"), grid=GridShape(3, 3)), 1.0)
    viewer.until(lambda app: app.scene_loader.ahead.get(next_photo) is not None)
    (tmp_path / "photo1.png").write_bytes(b"no photo any more")  # so that what is shown now was read before
    viewer.key("Page_Down", settle=shows("photo1"))
    viewer.key("Page_Up", settle=shows("photo0"))
    viewer.send("key", "Page_Up")
    viewer.until_idle()
    assert viewer.app.state.scene.name == "photo0"


def test_the_next_photos_are_there_in_small_before_they_are_asked_for(open_window, tmp_path):
    paths = [write_large_photo(tmp_path, f"photo{i}") for i in range(3)]
    driver = open_window(tmp_path)
    driver.until(lambda app: app.state.scene is not None and app.state.scene.is_sketch)
    driver.until(lambda app: app.scene_view.picture_drawn is not None)
    driver.until(lambda app: not app.state.scene.is_sketch)
    last = WantedPhoto(Source(str(paths[2]), grid=GridShape(3, 3)), 1.0)
    driver.until(lambda app: app.scene_loader.sketches.get(last) is not None)
    for path in paths[1:]:
        path.write_bytes(b"no photo any more")
    driver.app.do(do(folder.step, 2))
    driver.app.step()
    scene, drawn = driver.app.state.scene, driver.app.scene_view.picture_drawn
    assert (scene.name, scene.is_sketch) == ("photo2", True)
    assert drawn.generation == driver.app.state.generation


def test_photos_that_cannot_be_read_have_their_names_in_the_filmstrip_and_keys_go_past_them(open_window, tmp_path):
    first, bad = tmp_path / "photo0.jpg", tmp_path / "photo2.jpg"
    write_scene(tmp_path, "photo1")
    write_scene(tmp_path, "photo3")
    for path in (first, bad):
        path.write_bytes(b"no photo")
    driver = open_window(tmp_path)
    driver.until(lambda app: app.state.folder is not None)
    assert driver.app.state.scene is None
    driver.key("Page_Down", settle=shows("photo1"))
    driver.key("Page_Down", until=says("photo2.jpg"))
    driver.settle(lambda app: app._filmstrip.thumbnails((str(bad),)) == {str(bad): None})
    assert (middle_tile(driver.app).max(axis=2) > 150).sum() > 20  # letters
    driver.key("Page_Down", settle=shows("photo3"))


@pytest.mark.usefixtures("wide_window")
def test_the_filmstrip_shows_all_photos_and_opens_one(viewer, tmp_path):
    paths = tuple(str(tmp_path / f"photo{i}.png") for i in range(3))
    viewer.until(lambda app: len(app._filmstrip.thumbnails(paths)) == 3)
    viewer.settle(shows("photo0"))
    tile = middle_tile(viewer.app).astype(int)
    square = np.ptp(np.argwhere(tile[..., 0] > tile[..., 1] + 100), axis=0) + 1
    assert square == pytest.approx([viewer.app.layout().filmstrip.height / 2] * 2, abs=9), "as large as it fits"
    viewer.press("photo photo2.png", "filmstrip", settle=shows("photo2"))
    generation = viewer.app.state.generation
    viewer.press("photo photo2.png", "filmstrip")
    viewer.until_idle()
    assert viewer.app.state.generation == generation, "a click on the open photo changes nothing"


@pytest.mark.usefixtures("wide_window")
def test_the_menu_of_another_photo_gives_it_the_look_that_was_copied(viewer):
    viewer.settle(shows("photo0"))
    viewer.app.do(do(lens.set_exposure, 1.0), do(look.copy_look), do(lens.set_exposure, 0.0))
    viewer.find("photo photo2.png", "filmstrip")
    viewer.send("click", 3)
    name = f"##Popup_{imgui.internal.find_window_by_name('filmstrip').get_id('menu 2'):08x}"
    viewer.until(lambda app: imgui.internal.find_window_by_name(name) is not None)
    viewer.until_idle()
    menu = imgui.internal.find_window_by_name(name)
    viewer.send("mousemove", round(menu.pos.x + 30), round(menu.pos.y + 0.7 * menu.size.y))
    viewer.app.step()
    viewer.send("click", 1)
    viewer.settle(shows("photo2"))
    viewer.until(lambda app: app.state.optics.exposure_stops == 1.0)
    viewer.app.do(do(history.undo))
    assert viewer.app.state.optics.exposure_stops == 0.0
    viewer.until_idle()
    assert viewer.app.state.optics.exposure_stops == 0.0, "it comes once"


def test_no_thread_is_left_when_the_window_closes(viewer):

    viewer.send("key", "Page_Down")
    viewer.app.step()
    viewer.close()
    # Pools of the core, which other tests use in this process, are nobody's to close.
    names = [thread.name for thread in threading.enumerate()]
    assert not [name for name in names if name.startswith("iibr-") and not name.startswith("iibr-bands")]
