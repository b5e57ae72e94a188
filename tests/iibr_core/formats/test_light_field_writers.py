"""Light fields as others lay them out: read again by our readers, and by OpenImageIO and Pillow."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import OpenImageIO as oiio
import pytest
from PIL import Image

from iibr_core.color import linear_from_srgb
from iibr_core.formats.light_fields.light_field_formats import WRITERS, open_light_field, writer_for
from iibr_core.formats.light_fields.views import read_views
from iibr_core.types import GridShape, InputError, ViewUpdate

GRID = GridShape(3, 4)
HEIGHT, WIDTH = 5, 7
ENDINGS = {"eslf": "_eslf.png", "exr": ".exr"}


def made_views() -> list[ViewUpdate]:
    rng = np.random.default_rng(0)
    views = [
        ViewUpdate(
            row,
            column,
            rng.integers(0, 256, (HEIGHT, WIDTH, 3), np.uint8),
            rng.normal(size=(HEIGHT, WIDTH)).astype(np.float32),
        )
        for row in range(GRID.rows)
        for column in range(GRID.columns)
    ]
    return [views[i] for i in rng.permutation(len(views))]


def written(tmp_path: Path, layout: str, views: list[ViewUpdate]) -> Path:
    path = tmp_path / f"field{ENDINGS.get(layout, '')}"
    with writer_for(layout)(path, GRID, 100.0, "field", True) as writer:
        for view in views:
            writer.add(view)
    return path


@pytest.mark.parametrize("layout", ["hci", "numbered-grid", "stanford"])
def test_folders_are_read_again(tmp_path: Path, layout: str) -> None:
    views = {(view.row, view.column): view for view in made_views()}
    folder = written(tmp_path, layout, list(views.values()))
    scene = open_light_field(folder)
    assert scene.grid == GRID
    for view in read_views(scene)[1]:
        made = views[view.row, view.column]
        assert np.array_equal(view.colors, made.colors)
        if layout != "stanford":  # has no place for it
            assert view.disparity is not None
            assert made.disparity is not None
            np.testing.assert_array_equal(view.disparity, made.disparity)


def test_lenslet_image_has_the_views_of_a_place_together(tmp_path: Path) -> None:
    pixels = np.asarray(Image.open(written(tmp_path, "eslf", made_views())))
    assert pixels.shape == (HEIGHT * GRID.rows, WIDTH * GRID.columns, 3)
    for view in made_views():
        assert np.array_equal(pixels[view.row :: GRID.rows, view.column :: GRID.columns], view.colors)


def test_exr_has_a_part_a_view(tmp_path: Path) -> None:
    path = written(tmp_path, "exr", made_views())
    views = {f"v{view.row:02d}_u{view.column:02d}": view for view in made_views()}
    names = []
    for index in range(len(views)):
        part = oiio.ImageBuf(str(path), index, 0)
        names.append(part.spec().get_string_attribute("oiio:subimagename"))
        view, pixels = views[names[-1]], part.get_pixels(oiio.FLOAT)
        assert part.spec().channelnames == ("R", "G", "B", "disparity")
        np.testing.assert_allclose(pixels[..., :3], linear_from_srgb(view.colors / 255), rtol=1e-3, atol=1e-6)
        np.testing.assert_array_equal(pixels[..., 3], view.disparity)
    assert sorted(names) == names == sorted(views)
    oiio.geterror()


@pytest.mark.parametrize("layout", WRITERS)
def test_a_field_with_a_gap_is_not_written(tmp_path: Path, layout: str) -> None:
    with pytest.raises(InputError, match="11 of 12 views"):
        written(tmp_path, layout, made_views()[:-1])
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("layout", ENDINGS)
def test_files_have_their_endings_and_replace_nothing_unasked(tmp_path: Path, layout: str) -> None:
    with pytest.raises(InputError, match="must end in"):
        writer_for(layout).require_place(tmp_path / "a.gif", (), False)
    there = tmp_path / f"a{ENDINGS[layout]}"
    there.touch()
    with pytest.raises(InputError, match="--force"):
        writer_for(layout).require_place(there, (), False)
    writer_for(layout).require_place(there, (), True)


def test_views_of_two_sizes_are_a_mistake_of_the_caller(tmp_path: Path) -> None:
    small = ViewUpdate(0, 0, np.zeros((2, 2, 3), np.uint8), None)
    for layout in WRITERS:
        with pytest.raises(ValueError, match="2x2"):
            written(tmp_path, layout, [made_views()[0], small])
