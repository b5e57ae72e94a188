"""The window's picture and panels without a window, under EGL."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from iibr_core.types import GridShape, InputError, ViewOffset
from tests.viewer.conftest import HEIGHT, WIDTH
from viewer.app.contact_sheet import GAP, TILE_WIDTH, contact_sheet
from viewer.app.headless import HeadlessViewer
from viewer.model.actions import MoveEye, ResetOptics, SetAperture
from viewer.model.layout import layout_of
from viewer.model.state.app_state import Source


@pytest.fixture
def viewer(photo_path: Path) -> Iterator[HeadlessViewer]:
    try:
        viewer = HeadlessViewer("egl")
    except InputError as error:
        pytest.skip(str(error))
    with viewer:
        viewer.open(Source(str(photo_path), grid=GridShape(3, 3)), 1.0, lambda progress: None)
        yield viewer


def test_the_centre_view_is_the_photo(viewer: HeadlessViewer, photo_path: Path) -> None:
    from iibr_core.formats.images.photo import read_photo

    picture = viewer.picture()
    assert picture.shape == (HEIGHT, WIDTH, 3)
    assert np.abs(picture / 255 - read_photo(photo_path).pixels).max() < 2.5 / 255


def test_progress_counts_every_view(viewer: HeadlessViewer) -> None:
    seen = []
    assert viewer.state.source is not None
    viewer.open(viewer.state.source, 1.0, seen.append)
    assert [progress.done for progress in seen] == list(range(10))
    assert seen[0].doing


def test_pictures_are_letterboxed_and_upright(viewer: HeadlessViewer) -> None:
    plain, wide = viewer.picture((WIDTH, HEIGHT)), viewer.picture((WIDTH + 40, HEIGHT))
    np.testing.assert_array_equal(wide[:, 20:-20], plain)
    assert (wide[:, :20] == wide[0, 0]).all()


def test_panels_stand_beside_the_same_picture(viewer: HeadlessViewer) -> None:
    size = (1000, 700)
    viewer.do(MoveEye(ViewOffset(0.5, 1)), SetAperture(2))
    screen = viewer.screen(size)
    layout = layout_of(size, (WIDTH, HEIGHT))
    assert layout.picture_px is not None
    x, y, width, height = layout.picture_px
    box = screen[y : y + height, x : x + width].astype(int)
    notices_are_below = height - 120  # the notice about the scene may lie over the lower edge
    expected = viewer.picture((width, height)).astype(int)
    assert np.abs(box - expected)[:notices_are_below].max() <= 1
    panel = screen[:, int(layout.panel.x) :]
    assert panel.std() > 10, "text and sliders"
    assert (panel[0, -1] == panel[-1, -1]).all()
    np.testing.assert_array_equal(viewer.screen(size), screen)


def test_reset_gives_the_first_picture_back(viewer: HeadlessViewer) -> None:
    before = viewer.picture()
    viewer.do(MoveEye(ViewOffset(1, 1)))
    assert np.abs(viewer.picture().astype(int) - before).max() > 8
    viewer.do(ResetOptics())
    np.testing.assert_array_equal(viewer.picture(), before)


def test_the_contact_sheet_shows_six_different_pictures(viewer: HeadlessViewer) -> None:
    sheet = contact_sheet(viewer)
    tile_height = round(TILE_WIDTH * HEIGHT / WIDTH)
    assert sheet.shape == (2 * tile_height + 3 * GAP, 3 * TILE_WIDTH + 4 * GAP, 3)
    tiles = [
        sheet[y : y + tile_height, x : x + TILE_WIDTH]
        for y in (GAP, 2 * GAP + tile_height)
        for x in (GAP + i * (TILE_WIDTH + GAP) for i in range(3))
    ]
    assert len({tile.tobytes() for tile in tiles}) == 6


@pytest.mark.parametrize("pixels", [np.zeros((1, 1, 3)), np.full((7, 1, 3), 128), np.full((1, 5, 3), 255)])
def test_tiny_photos_open(tmp_path: Path, viewer: HeadlessViewer, pixels: np.ndarray) -> None:
    from iibr_core.formats.images.photo import write_image

    write_image(tmp_path / "tiny.png", pixels.astype(np.uint8))
    viewer.open(Source(str(tmp_path / "tiny.png")), 1.0, lambda progress: None)
    np.testing.assert_array_equal(viewer.picture(), pixels)
    assert viewer.screen((800, 600)).shape == (600, 800, 3)
