"""Results as tables of words, the same for Markdown and for the page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from iibr_core.evaluation.focal_stacks import LENS
from iibr_core.evaluation.results import EvaluationResult
from iibr_core.evaluation.trials import CENTRE_TRIAL

NO_FIGURE = "–"


@dataclass(frozen=True)
class Table:
    """head: column names; rows: cells, the first of each a name."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def number(value: float, digits: int) -> str:
    """A figure, a dash where there is none."""
    return f"{value:.{digits}f}" if math.isfinite(value) else NO_FIGURE


def figures_table(result: EvaluationResult) -> Table:
    """One row a method: means over the judged views, and the worst of them."""
    head = ("method", "full dB", "visible dB", "hole dB", "worst view dB", "SSIM", "FLIP", "LPIPS", "ms a view")
    has_lpips = any(math.isfinite(row.mean.lpips) for row in result.rows)
    rows = []
    for row in result.rows:
        mean = row.mean
        cells = [number(value, 2) for value in (mean.full_db, mean.visible_db, mean.hole_db)]
        cells.append(f"{number(row.worst_db, 2)} ({row.worst_view})")
        cells += [number(mean.ssim, 4), number(mean.flip, 4), number(mean.lpips, 4)]
        cells.append(number(mean.ms, 0) if mean.ms > 0 else NO_FIGURE)
        rows.append((row.method, *cells))
    if has_lpips:
        return Table(head, tuple(rows))
    return Table(head[:7] + head[8:], tuple(row[:7] + row[8:] for row in rows))


def consistency_table(result: EvaluationResult) -> Table:
    """How far the views agree with each other, one row a quality; the truth's own EPIs where it has some."""
    head = (
        "views of",
        "holes, rms / 255",
        "their pixels",
        "surfaces, rms / 255",
        "EPI lines, rms / 255",
        "off the line, px",
    )
    judged = {row.method for row in result.rows}
    rows = [
        (
            name,
            number(found.hole_rms, 2),
            str(found.hole_pixels) if name in judged else NO_FIGURE,
            number(found.surface_rms, 2),
            number(found.line_rms, 2),
            number(found.line_off_px, 3),
        )
        for name, found in result.consistency.items()
    ]
    return Table(head, tuple(rows))


ABOUT_CONSISTENCY = (
    'The tables "views of" measure whether views agree with each other; 0 is full agreement. Each view is warped by its'
    " disparity to the view half-way to the given one and compared with it: in pixels inpainted in both (holes) and in"
    " pixels that the photo shows (surfaces). In EPIs of the given view's row, each point should draw a straight line"
    " of one colour. The row of the true views shows how far gloss and noise alone change these figures."
)


def refocus_table(result: EvaluationResult) -> Table:
    """PSNR and FLIP of the refocused pictures, two columns a focus, one row a method."""
    methods = dict.fromkeys(method for found in result.refocus for method in found.figures)
    head = ["refocused views of"]
    for found in result.refocus:
        head += [f"{found.focus.name} ({number(found.focus.disparity, 2)} px), dB", "FLIP"]
    rows = []
    for method in methods:
        cells = [method]
        for found in result.refocus:
            figures = found.figures.get(method)
            cells += [number(figures.db, 2), number(figures.flip, 4)] if figures else [NO_FIGURE, NO_FIGURE]
        rows.append(tuple(cells))
    return Table(tuple(head), tuple(rows))


def about_refocus(result: EvaluationResult) -> str:
    """What the refocused pictures are, in a line."""
    views = {found.views for found in result.refocus}
    of = f"{max(views)}" if len(views) == 1 else f"{min(views)} to {max(views)}"
    widest = 2 * max(found.focus.radius for found in result.refocus)
    with_lens = any(found.focus.name == LENS for found in result.refocus)
    lens = " Against the path-traced lens, the true views err too: they are few."
    return (
        f"Refocus: {of} views through an aperture {number(widest, 1)} view steps wide, added up in linear light,"
        f" against the true views added up the same way.{lens if with_lens else ''}"
    )


def summary_table(results: Sequence[EvaluationResult]) -> Table:
    """Full-frame PSNR of every method, one row a result; means over scenes where there are several."""
    methods = list(dict.fromkeys(row.method for result in results for row in result.rows))
    head = ("scene", "trial", "disparity", "views", *methods)
    rows = []
    for result in results:
        full = {row.method: row.mean.full_db for row in result.rows}
        views = str(len(result.rows[0].of_views))
        rows.append(
            (
                result.scene,
                result.trial,
                result.disparity,
                views,
                *(number(full.get(method, math.nan), 2) for method in methods),
            )
        )
    centred = [result for result in results if result.trial == CENTRE_TRIAL]
    firsts = [results_of[0] for results_of in _by_scene(centred)]
    if len(firsts) > 1:
        means = []
        for method in methods:
            values = [row.mean.full_db for result in firsts for row in result.rows if row.method == method]
            means.append(number(sum(values) / len(values), 2))
        rows.append((f"mean of {len(firsts)} scenes", CENTRE_TRIAL, "the first of each", NO_FIGURE, *means))
    return Table(head, tuple(rows))


def _by_scene(results: Sequence[EvaluationResult]) -> list[list[EvaluationResult]]:
    scenes: dict[str, list[EvaluationResult]] = {}
    for result in results:
        scenes.setdefault(result.scene, []).append(result)
    return list(scenes.values())


def heading(result: EvaluationResult) -> str:
    """A result in a line."""
    return f"{result.scene}: {result.trial}, {result.disparity}"


def about(result: EvaluationResult) -> str:
    """What was judged, in a line."""
    height, width = result.size
    views = len(result.rows[0].of_views)
    return (
        f"{result.layout}; {width}x{height} px; given {result.given}; {views} views judged;"
        f" {100 * result.hole_share:.1f} % of their pixels are holes."
    )


def summary_line(result: EvaluationResult) -> str:
    """The full-frame PSNR of every method, in a line."""
    figures = ", ".join(f"{row.method} {number(row.mean.full_db, 2)}" for row in result.rows)
    return f"{heading(result)}: {figures} dB"
