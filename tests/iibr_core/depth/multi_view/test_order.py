"""The order of a light field's views is found from their parallax, whatever their names say."""

from collections.abc import Callable
from functools import cache
from itertools import product
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from scipy.ndimage import gaussian_filter, map_coordinates

from iibr_core.depth.multi_view.near_side import nearness_ratio
from iibr_core.depth.multi_view.order_by_parallax import find_order
from iibr_core.depth.multi_view.settle import UNSURE
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.order import Arrangement
from iibr_core.formats.light_fields.views import in_order_of, read_views
from iibr_core.scenes.light_fields import find_disparity, open_settled
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, InputError, ViewOffset

HEIGHT, WIDTH = 72, 96
WALL_PX, SQUARE_PX = -0.5, 2.0
Names = dict[str, tuple[float, float]]
"""Viewpoint (t, s) of each view by the stem of its file."""


@cache
def textures() -> np.ndarray:
    rough = np.random.default_rng(5).normal(size=(2, HEIGHT + 80, WIDTH + 80))
    return 110 + 300 * np.stack([gaussian_filter(layer, 1.2) for layer in rough])


def view_at(t: float, s: float) -> np.ndarray:
    """(H, W) of a textured square at SQUARE_PX before a textured wall at WALL_PX."""
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    wall, square = (
        map_coordinates(texture, [y + d * t + 40, x + d * s + 40], order=1)
        for texture, d in zip(textures(), (WALL_PX, SQUARE_PX))
    )
    inside = (abs(y + SQUARE_PX * t - HEIGHT / 2) < 16) & (abs(x + SQUARE_PX * s - WIDTH / 2) < 18)
    return np.where(inside, square, wall).clip(0, 255).astype(np.uint8)


def write_views(folder: Path, names: Names) -> Path:
    folder.mkdir()
    for stem, offset in names.items():
        Image.fromarray(view_at(*offset)).convert("RGB").save(folder / f"{stem}.png")
    return folder


def grid(rows: int, columns: int) -> list[tuple[int, int]]:
    return list(product(range(rows), range(columns)))


def centred(row: int, column: int, rows: int = 5, columns: int = 5, row_step: float = 1.0) -> tuple[float, float]:
    return (row - rows // 2) * row_step, float(column - columns // 2)


def snake(rows: int, columns: int) -> list[tuple[int, int]]:
    return [(row, columns - 1 - column if row % 2 else column) for row, column in grid(rows, columns)]


def named(rows: int, columns: int, stem: Callable[[int, int], str], row_step: float = 1.0) -> Names:
    return {stem(r, c): centred(r, c, rows, columns, row_step) for r, c in grid(rows, columns)}


BACKWARDS = "every other row runs backwards."
FIELDS: dict[str, tuple[Names, str]] = {
    "as named": (named(5, 5, "v{}_u{}".format), ""),
    "columns first": (named(5, 5, "lf_{1}_{0}".format), "columns are counted before rows."),
    "columns first, 3 rows of 5": (named(3, 5, "lf_{1}_{0}".format), "3 rows of 5, columns are counted before rows."),
    "column by column": (
        named(5, 5, lambda r, c: f"img_{5 * c + r:03d}"),
        "5 rows of 5, columns are counted before rows.",
    ),
    "columns mirrored": (named(5, 5, lambda r, c: f"v{r}_u{4 - c}"), "columns run from right to left."),
    "from behind": (named(5, 5, lambda r, c: f"v{4 - r}_u{4 - c}"), "as seen from behind."),
    "serpentine": (
        {f"shot{k:02d}": centred(*at) for k, at in enumerate(snake(5, 5))},
        f"5 rows of 5, {BACKWARDS}",
    ),
    "serpentine, 4 rows of 6": (
        {f"shot{k:02d}": centred(*at, 4, 6) for k, at in enumerate(snake(4, 6))},
        f"4 rows of 6, {BACKWARDS}",
    ),
    "a row of 25": ({f"DSC_{1000 + k}": (0.0, (k - 12) / 2) for k in range(25)}, "one line of views."),
    "rows 0.4 apart": (named(5, 5, "v{}_u{}".format, 0.4), "rows are 0.4 times as far apart as columns."),
}


@pytest.mark.parametrize("name", FIELDS)
def test_views_in_any_order_give_the_same_disparity(tmp_path: Path, name: str) -> None:
    names, note = FIELDS[name]
    _, values, notes = find_disparity(Source(str(write_views(tmp_path / "field", names))))
    step = 0.5 if "row of" in name else 1.0
    assert np.median(values[28:44, 40:56]) == pytest.approx(SQUARE_PX * step, abs=0.1)
    assert np.median(values[:, :20]) == pytest.approx(WALL_PX * step, abs=0.1)
    assert len(notes) == bool(note)
    assert all(found.endswith(note) for found in notes)


def test_a_field_that_hides_nothing_leaves_the_near_side_open(tmp_path: Path) -> None:
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(float)
    for row, column in grid(3, 3):
        shown = map_coordinates(textures()[0], [y + row - 1 + 40, x + column - 1 + 40], order=1).clip(0, 255)
        Image.fromarray(shown.astype(np.uint8)).convert("RGB").save(tmp_path / f"lf_{column}_{row}.png")
    _, values, notes = find_disparity(Source(str(tmp_path)))
    assert np.abs(values[8:-8, 8:-8] - 1).max() < 0.1
    assert notes == ("The parallax of 8 views shows their order: columns are counted before rows.", UNSURE)


def test_what_the_user_says_about_the_order_counts(tmp_path: Path) -> None:
    folder = write_views(tmp_path / "field", FIELDS["from behind"][0])
    named = Arrangement("rows", GridShape(5, 5), "none", 1.0)
    _, values, notes = find_disparity(Source(str(folder), arrangement=Arrangement(flip="none")))
    assert np.median(values[28:44, 40:56]) == pytest.approx(-SQUARE_PX, abs=0.1)
    assert notes == ()
    field, _ = open_settled(Source(str(folder), arrangement=named))
    assert [view.place for view in field.views] == grid(5, 5)
    with pytest.raises(InputError, match="its 25 views do not fill a grid of 4x6; give 5x5"):
        open_settled(Source(str(folder), arrangement=Arrangement(grid=GridShape(4, 6))))


def test_an_order_that_contradicts_its_grid_and_a_single_view_are_named(tmp_path: Path) -> None:
    folder = write_views(tmp_path / "field", {f"v{r}_u{c}": centred(r, c) for r, c in grid(3, 5)})
    given = Arrangement("columns", GridShape(3, 5))
    with pytest.raises(InputError, match="not counted by columns of this grid; give rows 3x5, columns 5x3"):
        find_disparity(Source(str(folder), arrangement=given))
    alone = write_views(tmp_path / "alone", {"v0_u0": (0.0, 0.0)})
    assert open_settled(Source(str(alone)))[0].grid == (1, 1)
    with pytest.raises(InputError, match="same viewpoint"):
        find_disparity(Source(str(alone)))


def test_views_in_no_order_are_refused_unless_the_layout_or_the_user_states_one(tmp_path: Path) -> None:
    places = np.random.default_rng(4).permutation(grid(5, 5))
    folder = write_views(tmp_path / "field", {f"lf_{k // 5}_{k % 5}": centred(*at) for k, at in enumerate(places)})
    with pytest.raises(InputError, match="fits no order that their names suggest"):
        find_disparity(Source(str(folder)))
    field, (note,) = open_settled(Source(str(folder), arrangement=Arrangement("columns")))
    assert [view.place for view in field.views] == [(k % 5, k // 5) for k in range(25)]
    assert "in the given order, though their parallax fits none" in note
    stated = write_views(tmp_path / "stated", {f"v{k // 5}_u{k % 5}": centred(*at) for k, at in enumerate(places)})
    field, (note,) = open_settled(Source(str(stated)))
    assert [view.place for view in field.views] == grid(5, 5)
    assert "in the order of their names, though their parallax fits none" in note


def write_drawn(folder: Path, drawing: str, disparity: float) -> Path:
    """Write 7x7 views of a pattern that repeats or is thin, under names that state their order."""
    folder.mkdir()
    rng = np.random.default_rng(7)
    noise = gaussian_filter(rng.normal(size=(HEIGHT + 40, WIDTH + 40)), 0.8)
    for row, column in grid(7, 7):
        y, x = np.mgrid[: 4 * HEIGHT, : 4 * WIDTH] / 4.0
        y, x = y + disparity * (row - 3) + 20, x + disparity * (column - 3) + 20
        if drawing == "wedges":  # before noise that moves the other way
            edge = WIDTH * (0.1 + 0.8 * np.abs(2 * (y / 6 % 1) - 1)) + 20
            behind = map_coordinates(noise, [y - 2 * disparity * (row - 3), x - 2 * disparity * (column - 3)], order=1)
            luma = np.where(x < edge, 170, 90 + 25 * behind)
        else:
            luma = {"squares": (x // 9 + y // 9) % 2 * 120, "stripes": x // 5 % 2 * 120}[drawing] + 60
        pixels = luma.reshape(HEIGHT, 4, WIDTH, 4).mean((1, 3)) + rng.normal(0, 1.5, (HEIGHT, WIDTH))
        Image.fromarray(pixels.clip(0, 255).astype(np.uint8)).convert("RGB").save(
            folder / f"v{row:02d}_u{column:02d}.png"
        )
    return folder


@pytest.mark.parametrize(("drawing", "disparity"), [("wedges", 0.35), ("squares", -0.8), ("stripes", -0.8)])
def test_repeating_and_thin_patterns_do_not_change_a_stated_order(
    tmp_path: Path, drawing: str, disparity: float
) -> None:
    field, _ = open_settled(Source(str(write_drawn(tmp_path / "field", drawing, disparity))))
    assert [view.place for view in field.views] == grid(7, 7)
    assert {view.offset for view in field.views} == {ViewOffset(float(r), float(c)) for r, c in grid(7, 7)}


@pytest.mark.parametrize(
    ("is_from_top", "is_leftwards", "words"),
    [(False, False, ""), (True, False, "top left"), (False, True, "bottom right"), (True, True, "top right")],
)
def test_quilts_may_begin_in_any_corner(tmp_path: Path, is_from_top: bool, is_leftwards: bool, words: str) -> None:
    quilt = np.zeros((3 * HEIGHT, 4 * WIDTH), np.uint8)
    for view, (row, column) in enumerate(grid(3, 4)):
        row, column = row if is_from_top else 2 - row, 3 - column if is_leftwards else column
        quilt[row * HEIGHT :, column * WIDTH :][:HEIGHT, :WIDTH] = view_at(0.0, (view - 6) / 4)
    Image.fromarray(quilt).convert("RGB").save(tmp_path / "a_qs4x3.png")
    _, values, notes = find_disparity(Source(str(tmp_path / "a_qs4x3.png")))
    assert np.median(values[28:44, 40:56]) == pytest.approx(SQUARE_PX / 4, abs=0.1)
    assert all(words in note for note in notes)
    assert bool(notes) == bool(words)


def test_a_quilt_may_be_a_mosaic_of_a_grid_of_views(tmp_path: Path) -> None:
    mosaic = np.vstack([np.hstack([view_at(*centred(r, c, 3, 4)) for c in range(4)]) for r in range(3)])
    Image.fromarray(mosaic).convert("RGB").save(tmp_path / "lightfield_4x3.png")
    field, (note,) = open_settled(Source(str(tmp_path / "lightfield_4x3.png")))
    assert field.grid == (3, 4)
    assert "3 rows of 4" in note


@pytest.mark.parametrize("orientation", [3, 6, 8])
@pytest.mark.parametrize("is_turned", [False, True])
def test_views_are_turned_by_their_exif_and_counted_along_either_axis(
    tmp_path: Path, orientation: int, is_turned: bool
) -> None:
    """The names count rows and columns of the pictures as shown, or (is_turned) as stored."""
    turns = {3: 2, 6: 1, 8: 3}[orientation]
    exif = Image.Exif()
    exif[0x112] = orientation
    places = np.arange(9).reshape(3, 3)
    for row, column in grid(3, 3):
        v, u = divmod(int(np.rot90(places, turns)[row, column]), 3) if is_turned else (row, column)
        stored = Image.fromarray(np.rot90(view_at(*centred(v, u, 3, 3)), turns)).convert("RGB")
        stored.save(tmp_path / f"v{row:02d}_u{column:02d}.png", exif=exif)
    _, values, _ = find_disparity(Source(str(tmp_path)))
    assert np.median(values[28:44, 40:56]) == pytest.approx(SQUARE_PX, abs=0.1)
    assert np.median(values[:, :20]) == pytest.approx(WALL_PX, abs=0.1)


def test_plain_surfaces_do_not_turn_a_quilt_round(tmp_path: Path) -> None:
    quilt = np.full((2 * HEIGHT, 6 * WIDTH), 100, np.uint8)
    for view, (x, y, d, size, light) in product(range(12), ((60, 24, 0.3, 9, 230), (28, 44, 1.2, 14, 150))):
        row, column = divmod(view, 6)
        left = column * WIDTH + round(x - d * (view - 6))
        quilt[(1 - row) * HEIGHT + y :][:size, left : left + size] = light
    path = tmp_path / "plain_qs6x2a1.333.png"
    Image.fromarray(quilt).convert("RGB").save(path)
    assert not any("order" in note for note in find_disparity(Source(str(path)))[2])


@pytest.mark.parametrize("sign", [1, -1])
def test_hidden_places_show_which_side_is_near(sign: int) -> None:
    offsets = [ViewOffset(0.0, 0.0), ViewOffset(0.0, 2.0), ViewOffset(-2.0, 0.0), ViewOffset(2.0, -2.0)]
    truth = np.full((HEIGHT, WIDTH), WALL_PX, np.float32)
    truth[HEIGHT // 2 - 15 : HEIGHT // 2 + 16, WIDTH // 2 - 17 : WIDTH // 2 + 18] = SQUARE_PX
    lumas = [np.float32(view_at(*at) / 255) for at in offsets]
    ratio = nearness_ratio(lumas, [ViewOffset(sign * t, sign * s) for t, s in offsets], sign * truth)
    assert ratio**sign > 2
    assert nearness_ratio(lumas, offsets, np.zeros_like(truth)) == 1


def test_the_disparity_of_a_pair_is_that_of_its_left_view(tmp_path: Path) -> None:
    pair = write_views(tmp_path / "pair", {"v0_u0": (0.0, 0.0), "v0_u1": (0.0, 4.0)})
    values = find_disparity(Source(str(pair)))[1]
    assert (values[36, 62], values[36, 80]) == pytest.approx((4 * SQUARE_PX, 4 * WALL_PX), abs=0.3)


def test_views_that_disagree_about_the_near_side_leave_it_open() -> None:
    rng = np.random.default_rng(4)
    lumas = [np.float32(rng.random((60, 80))) for _ in range(5)]
    values = np.float32(gaussian_filter(rng.normal(size=(60, 80)), 3) * 30)
    offsets = [ViewOffset(0.0, 0.0), *(ViewOffset(0.0, float(s)) for s in (-2, -1, 1, 2))]
    assert nearness_ratio(lumas, offsets, values) == pytest.approx(1, abs=0.05)


@pytest.mark.parametrize(("disparity_px", "is_uneven"), [(0.2, False), (14.0, False), (0.6, True)])
def test_the_order_is_found_by_tiny_and_large_parallax_and_in_uneven_light(
    tmp_path: Path, disparity_px: float, is_uneven: bool
) -> None:
    """The large one is a seventh of the width; exposure and vignetting differ from view to view."""
    rough = np.random.default_rng(5).normal(size=(2, 140, 160))
    halves = [0.5 + gaussian_filter(half, 1.5) for half in rough]
    for row, column in grid(3, 3):
        y, x = np.mgrid[:80, :100] + 30.0
        views = [
            map_coordinates(half, [y + d * (row - 1), x + d * (column - 1)], order=1)
            for half, d in zip(halves, (disparity_px, -disparity_px / 2))
        ]
        luma = np.where(x < 80, *views)
        if is_uneven:
            v, u = np.mgrid[-1:1:80j, -1:1:100j]
            luma *= (0.8 + 0.03 * (3 * row + column)) * (1 - 0.15 * (v**2 + (u - 0.1 * column) ** 2))
        Image.fromarray((255 * luma).clip(0, 255).astype(np.uint8)).convert("RGB").save(
            tmp_path / f"lf_{column}_{row}.png"
        )
    field = open_light_field(tmp_path)
    views = [view.colors for view in in_order_of(field, list(read_views(field)[1]))]
    fit, verdict = find_order(field, views)
    assert fit is not None
    assert verdict == "clear"
    assert (fit.arrangement.order, fit.arrangement.flip, fit.arrangement.row_step) == ("columns", "none", 1.0)
