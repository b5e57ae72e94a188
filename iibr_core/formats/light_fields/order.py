"""The order in which names count the views of a light field, and the places on a grid that it gives them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from iibr_core.types import GridShape, InputError, ViewOffset

if TYPE_CHECKING:
    from iibr_core.formats.light_fields.multi_view_scene import GridIndex, MultiView

Order = Literal["rows", "columns", "snake", "snake-columns"]
ORDERS: tuple[Order, ...] = ("rows", "columns", "snake", "snake-columns")
"""Row by row, or the row's number first; the same by columns; and both with every other line backwards."""
Flip = Literal["none", "x", "y", "xy"]
FLIPS: tuple[Flip, ...] = ("none", "x", "y", "xy")
"""Axes along which names count from right to left, or from bottom to top; "xy" is a field seen from behind."""


@dataclass(frozen=True)
class Arrangement:
    """The order of views; None where it is to be found.

    row_step: distance between rows, in distances between columns.
    """

    order: Order | None = None
    grid: GridShape | None = None
    flip: Flip | None = None
    row_step: float | None = None

    @property
    def is_complete(self) -> bool:
        """Whether nothing is left to be found."""
        return None not in (self.order, self.grid, self.flip, self.row_step)


UNKNOWN = Arrangement()


def numbers_of(scene: MultiView) -> Sequence[tuple[int, ...]]:
    """Return the numbers in the names of the views, else their rows and columns; none if they fill no grid."""
    places = tuple(view.place for view in scene.views if view.place is not None)
    return scene.numbers or (places if len(places) == len(scene.views) else ())


def possible_arrangements(scene: MultiView, given: Arrangement = UNKNOWN) -> list[Arrangement]:
    """Return the orders and grids that the names admit, the likeliest first.

    A flip is that given, or one of the two ways to count the tiles of a quilt: from the bottom left or the top left.
    Raises InputError if a grid or an order is given that the views do not fill.
    """
    numbers = numbers_of(scene)
    if not numbers:
        return []
    if len(numbers[0]) == 2:
        rows, columns = _lattice(numbers)
        shapes = [GridShape(rows, columns), GridShape(columns, rows)]
        pairs = [(order, shapes["columns" in order]) for order in ORDERS[: 4 if min(rows, columns) > 1 else 2]]
        if is_quilt(scene):
            pairs = [("rows", GridShape(1, rows * columns)), *pairs[:1]]
    else:
        shapes = [scene.stated_grid] if scene.stated_grid is not None else _shapes(len(numbers))
        pairs = [(order, shape) for shape in shapes for order in ORDERS[: 4 if min(shape) > 1 else 1]]
    if given.grid is not None and given.grid not in {shape for _, shape in pairs}:
        grids = ", ".join(dict.fromkeys(f"{shape.rows}x{shape.columns}" for _, shape in pairs))
        raise InputError(
            f"{scene.place}: its {len(numbers)} views do not fill a grid of {given.grid.rows}x{given.grid.columns};"
            f" give {grids}"
        )
    ordered = [(order, shape) for order, shape in pairs if given.order in (None, order)]
    possible = [
        Arrangement(order, shape, flip)
        for order, shape in ordered
        if given.grid in (None, shape)
        for flip in ((given.flip,) if given.flip or not _is_line_of(numbers, shape) else ("none", "y"))
    ]
    if not possible:
        ways = ", ".join(f"{order} {shape.rows}x{shape.columns}" for order, shape in pairs)
        raise InputError(f"{scene.place}: its views are not counted by {given.order} of this grid; give {ways}")
    return possible


def is_quilt(scene: MultiView) -> bool:
    """Return whether the views are one line, counted along the rows of the tiles of a picture, the lowest first."""
    return scene.grid is not None and bool(scene.numbers) and _is_line_of(scene.numbers, scene.grid)


def _is_line_of(numbers: Sequence[tuple[int, ...]], grid: GridShape) -> bool:
    """Return whether a grid is one line of views whose names have a row and a column."""
    return len(numbers[0]) == 2 and min(grid) == 1 < min(_lattice(numbers))


def _lattice(numbers: Sequence[tuple[int, ...]]) -> GridShape:
    """Return the rows and columns in names of two numbers."""
    return GridShape(*(len(set(axis)) for axis in zip(*numbers)))


def _shapes(count: int) -> list[GridShape]:
    """Return the grids of rows and columns that `count` views fill, squarish ones first."""
    rows = [number for number in range(1, count + 1) if count % number == 0]
    shapes = [GridShape(number, count // number) for number in rows]
    return sorted(shapes, key=lambda shape: (abs(math.log(shape.rows / shape.columns)), shape.rows))


def places_in(numbers: Sequence[tuple[int, ...]], arrangement: Arrangement) -> list[GridIndex]:
    """Return the row and column of each view. numbers: counted from 0 without gaps."""
    assert arrangement.grid is not None
    if _is_line_of(numbers, arrangement.grid):
        tiles = _lattice(numbers)
        return [(0, v * tiles.columns + u) for v, u in places_in(numbers, replace(arrangement, grid=tiles))]
    grid, order, flip = arrangement.grid, arrangement.order or "rows", arrangement.flip or "none"
    lines, places = grid.columns if "columns" not in order else grid.rows, []
    for number in numbers:
        line, at = number if len(number) == 2 else divmod(number[0], lines)
        if "snake" in order and line % 2:
            at = lines - 1 - at
        row, column = (at, line) if "columns" in order else (line, at)
        places.append(
            (grid.rows - 1 - row if "y" in flip else row, grid.columns - 1 - column if "x" in flip else column)
        )
    return places


def as_given(scene: MultiView, given: Arrangement) -> Arrangement:
    """Return the arrangement with the likeliest order and grid where they are not given. Raises InputError as above."""
    first = possible_arrangements(scene, given)[0]
    return replace(given, order=first.order, grid=first.grid)


def grid_of(scene: MultiView) -> GridShape:
    """Return the grid that the views fill."""
    if scene.grid is None:
        raise InputError(
            f"{scene.place}: the views ({scene.layout}) fill no regular grid,"
            " so they cannot be shown as a light field; only an evaluation reads them"
        )
    return scene.grid


def indices_of(scene: MultiView) -> dict[GridIndex, int]:
    """Return the index of the view at each place that has one."""
    return {view.place: index for index, view in enumerate(scene.views) if view.place is not None}


def step_length(scene: MultiView) -> float:
    """Return the view steps of the scene between neighbouring columns of its grid; between rows if it has one column.

    It exceeds 1 where views were left out, as every second column.
    """
    grid, indices = grid_of(scene), indices_of(scene)
    if len(indices) == 1:
        return 1.0
    first = (0, 0) if (0, 0) in indices else (grid.rows // 2, 0)  # a star may have no corners
    last = (first[0], grid.columns - 1) if grid.columns > 1 else (grid.rows - 1, 0)
    start, end = (scene.views[indices[at]].offset for at in (first, last))
    return math.hypot(end.t - start.t, end.s - start.s) / max(last[0] - first[0], last[1])


def arranged(scene: MultiView, arrangement: Arrangement) -> MultiView:
    """Return the scene with its views on the grid of an arrangement, whose order and grid are known.

    Views stay as far apart as they are: the disparity that a file states is that of its own steps.
    """
    assert arrangement.grid is not None
    step, across = arrangement.row_step or 1.0, 1.0 if scene.grid is None else step_length(scene) or 1.0
    views = tuple(
        replace(view, place=place, offset=ViewOffset(place[0] * step * across, place[1] * across))
        for view, place in zip(scene.views, places_in(numbers_of(scene), arrangement))
    )
    layout = scene.layout
    if scene.grid is not None:
        named, found = (f"{grid.columns}x{grid.rows}" for grid in (scene.grid, arrangement.grid))
        layout = layout.replace(named, found)
    return replace(scene, layout=layout, views=views, grid=arrangement.grid, numbers=(), is_guess=False)
