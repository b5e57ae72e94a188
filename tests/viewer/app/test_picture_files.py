"""Pictures on disk: with more than 8 bits where the file holds them, and with the settings that made them."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from iibr_core.color import srgb_from_linear
from iibr_core.depth.choice import DepthChoice, DepthOrigin
from iibr_core.formats.images.metadata import camera_facts
from iibr_core.formats.images.open_picture import read_metadata
from iibr_core.formats.images.picture_kinds import PictureFormat, is_float
from iibr_core.formats.outputs import AlreadyThereError
from iibr_core.scenes.scene import Scene, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, InputError, ViewOffset
from tests.viewer.conftest import HEIGHT, WIDTH, write_scene
from viewer.app.picture_files import export_picture, inputs_of_scene, read_settings, shot_of
from viewer.app.saving import checked_path
from viewer.display.offscreen import OffscreenScene
from viewer.model import lens
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.saving import SavePrompt


@pytest.fixture(scope="module")
def photo(tmp_path_factory):
    from iibr_core.formats.images.write import write_image

    folder = tmp_path_factory.mktemp("saving")
    y, x = np.indices((HEIGHT, WIDTH))
    pixels = np.stack([x * 255 / WIDTH, y * 255 / HEIGHT, (x + y) % 256], axis=-1)
    write_image(folder / "photo.png", pixels.astype(np.uint8))
    np.save(folder / "photo_disparity.npy", np.hypot(x - WIDTH / 2, y - HEIGHT / 2).astype(np.float32) < 25)
    return folder / "photo.png"


@pytest.fixture(scope="module")
def opened(photo):
    with OffscreenScene("egl") as viewer:
        viewer.open(Source(str(photo), grid=GridShape(3, 3)))
        viewer.do(do(lens.move_eye, ViewOffset(0.3, -0.4)), do(lens.set_aperture, 2.0), do(lens.set_focus, 0.2))
        yield viewer


def saved(viewer, path, size_px):
    shot = shot_of(viewer.state, size_px, PictureFormat())
    export_picture(path, viewer.picture(size_px, is_float(path), shot.color_space), shot)
    return np.asarray(oiio.ImageBuf(str(path)).get_pixels(oiio.FLOAT))[..., :3]


def test_exr_holds_light_finer_than_png(opened, tmp_path):
    png = saved(opened, tmp_path / "a.png", (WIDTH, HEIGHT)) * 255
    light = saved(opened, tmp_path / "a.exr", (WIDTH, HEIGHT))
    assert oiio.ImageBuf(str(tmp_path / "a.exr")).spec().format == oiio.FLOAT
    encoded = srgb_from_linear(light) * 255
    assert np.abs(encoded - png).max() <= 0.51, "the same picture"
    assert np.mean(np.abs(encoded - np.rint(encoded)) > 0.05) > 0.5, "not rounded to 8 bits on the way"


def test_a_saved_picture_states_how_its_photo_was_taken(opened, tmp_path):
    exif, facts = Image.Exif(), (("Camera", "Maker"), ("Exposure", "1/60 s, ISO 200"))
    exif[0x010F] = "Maker"
    exif.get_ifd(0x8769).update({0x829A: 1 / 60, 0x8827: 200})
    Image.new("RGB", (8, 8)).save(tmp_path / "taken.jpg", exif=exif)
    state = replace(opened.state, source=replace(opened.state.source, path=str(tmp_path / "taken.jpg")))
    out = export_picture(tmp_path / "a.png", opened.picture(), shot_of(state, opened.scene.size, PictureFormat()))
    assert camera_facts(read_metadata(out)) == facts
    assert read_settings(out).optics == opened.state.optics


@pytest.mark.parametrize("what", ["picture", "map"])
def test_a_place_is_checked_before_anything_is_drawn(tmp_path, what):
    photo, taken = write_scene(tmp_path), tmp_path / "taken.png"
    taken.write_bytes(b"mine")
    (tmp_path / "link.png").symlink_to(photo)

    def place(name, may_replace=False):
        prompt = SavePrompt(f" {tmp_path / name} " if name else "", ScreenSize(8, 8), what=what)
        return checked_path(prompt, may_replace, (photo,))

    assert place("a") == tmp_path / ("a.png" if what == "picture" else "a.pfm")
    assert place("taken.png", may_replace=True) == taken
    with pytest.raises(AlreadyThereError, match=r"taken\.png"):
        place("taken.png")
    for name in ("", "missing-folder/a.png", "scene.png", "link.png"):
        with pytest.raises(InputError) as caught:
            place(name, may_replace=True)
        assert not isinstance(caught.value, AlreadyThereError)


@pytest.mark.parametrize("size", [ScreenSize(0, 5), ScreenSize(5, -1), ScreenSize(16384, 16384)])
def test_absurd_sizes_are_refused(tmp_path, size):
    with pytest.raises(InputError, match="1 to 100 million"):
        checked_path(SavePrompt(str(tmp_path / "a.png"), size), False, ())


def test_the_inputs_of_a_scene_are_its_files(tmp_path):
    """The open scene with the map that was found, and what is being opened; models by name are no files."""
    scene = Scene(Source("open.png"), "open", 9, 6, GridShape(1, 1), (0.0, 1.0), "map")
    scene = replace(scene, depth_origin=DepthOrigin("file", "map", file="open_disparity.npy"))
    names = ("next.png", "map.pfm", "open.png", "open_disparity.npy")
    state = AppState(source=Source("next.png", DepthChoice(file="map.pfm", model="depth-pro")), scene=scene)
    assert inputs_of_scene(state) == tuple(map(Path, names))
    assert inputs_of_scene(AppState()) == ()
