"""Judgements as tables of words, the same for Markdown and for the page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from iibr_core.evaluation.protocol import EvaluationResult
from iibr_core.evaluation.refocus import LENS
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


def figures_table(judgement: EvaluationResult) -> Table:
    """One row a method: means over the judged views, and the worst of them."""
    head = ("method", "full dB", "visible dB", "hole dB", "worst view dB", "SSIM", "FLIP", "LPIPS", "ms a view")
    has_lpips = any(math.isfinite(row.mean.lpips) for row in judgement.rows)
    rows = []
    for row in judgement.rows:
        mean = row.mean
        cells = [number(value, 2) for value in (mean.full_db, mean.visible_db, mean.hole_db)]
        cells.append(f"{number(row.worst_db, 2)} ({row.worst_view})")
        cells += [number(mean.ssim, 4), number(mean.flip, 4), number(mean.lpips, 4)]
        cells.append(number(mean.ms, 0) if mean.ms > 0 else NO_FIGURE)
        rows.append((row.method, *cells))
    if has_lpips:
        return Table(head, tuple(rows))
    return Table(head[:7] + head[8:], tuple(row[:7] + row[8:] for row in rows))


def consistency_table(judgement: EvaluationResult) -> Table:
    """How far the views agree with each other, one row a quality; the truth's own EPIs where it has some."""
    head = (
        "views of",
        "holes, rms / 255",
        "their pixels",
        "surfaces, rms / 255",
        "EPI lines, rms / 255",
        "off the line, px",
    )
    judged = {row.method for row in judgement.rows}
    rows = [
        (
            name,
            number(found.hole_rms, 2),
            str(found.hole_pixels) if name in judged else NO_FIGURE,
            number(found.surface_rms, 2),
            number(found.line_rms, 2),
            number(found.line_off_px, 3),
        )
        for name, found in judgement.consistency.items()
    ]
    return Table(head, tuple(rows))


ABOUT_CONSISTENCY = (
    'The tables "views of" tell whether views agree with each other. What one view shows, carried by its disparity to'
    " the view half-way to the given one, has to look the same there: what was inpainted in both (holes), and what the"
    " photo shows (surfaces). In EPIs of the given view's row, each of its points has to lie on a straight line of its"
    " own colour; the truth's figures there are what gloss and noise make of it. All 0 = they agree."
)


def refocus_table(judgement: EvaluationResult) -> Table:
    """PSNR and FLIP of the refocused pictures, two columns a focus, one row a method."""
    methods = dict.fromkeys(method for found in judgement.refocus for method in found.figures)
    head = ["refocused views of"]
    for found in judgement.refocus:
        head += [f"{found.focus.name} ({number(found.focus.disparity, 2)} px), dB", "FLIP"]
    rows = []
    for method in methods:
        cells = [method]
        for found in judgement.refocus:
            figures = found.figures.get(method)
            cells += [number(figures.db, 2), number(figures.flip, 4)] if figures else [NO_FIGURE, NO_FIGURE]
        rows.append(tuple(cells))
    return Table(tuple(head), tuple(rows))


def about_refocus(judgement: EvaluationResult) -> str:
    """What the refocused pictures are, in a line."""
    views = {found.views for found in judgement.refocus}
    of = f"{max(views)}" if len(views) == 1 else f"{min(views)} to {max(views)}"
    widest = 2 * max(found.focus.radius for found in judgement.refocus)
    with_lens = any(found.focus.name == LENS for found in judgement.refocus)
    lens = " Against the path-traced lens, the true views err too: they are few."
    return (
        f"Refocus: {of} views through an aperture {number(widest, 1)} view steps wide, added up in linear light,"
        f" against the true views added up the same way.{lens if with_lens else ''}"
    )


def summary_table(judgements: Sequence[EvaluationResult]) -> Table:
    """Full-frame PSNR of every method, one row a judgement; means over scenes where there are several."""
    methods = list(dict.fromkeys(row.method for judgement in judgements for row in judgement.rows))
    head = ("scene", "trial", "disparity", "views", *methods)
    rows = []
    for judgement in judgements:
        full = {row.method: row.mean.full_db for row in judgement.rows}
        views = str(len(judgement.rows[0].of_views))
        rows.append(
            (
                judgement.scene,
                judgement.trial,
                judgement.disparity,
                views,
                *(number(full.get(method, math.nan), 2) for method in methods),
            )
        )
    centred = [judgement for judgement in judgements if judgement.trial == CENTRE_TRIAL]
    firsts = [judgements_of[0] for judgements_of in _by_scene(centred)]
    if len(firsts) > 1:
        means = []
        for method in methods:
            values = [row.mean.full_db for judgement in firsts for row in judgement.rows if row.method == method]
            means.append(number(sum(values) / len(values), 2))
        rows.append((f"mean of {len(firsts)} scenes", CENTRE_TRIAL, "the first of each", NO_FIGURE, *means))
    return Table(head, tuple(rows))


def _by_scene(judgements: Sequence[EvaluationResult]) -> list[list[EvaluationResult]]:
    scenes: dict[str, list[EvaluationResult]] = {}
    for judgement in judgements:
        scenes.setdefault(judgement.scene, []).append(judgement)
    return list(scenes.values())


def heading(judgement: EvaluationResult) -> str:
    """A judgement in a line."""
    return f"{judgement.scene}: {judgement.trial}, {judgement.disparity}"


def about(judgement: EvaluationResult) -> str:
    """What was judged, in a line."""
    height, width = judgement.size
    views = len(judgement.rows[0].of_views)
    return (
        f"{judgement.layout}; {width}x{height} px; given {judgement.given}; {views} views judged;"
        f" {100 * judgement.hole_share:.1f} % of their pixels are holes."
    )


def summary_line(judgement: EvaluationResult) -> str:
    """The full-frame PSNR of every method, in a line."""
    figures = ", ".join(f"{row.method} {number(row.mean.full_db, 2)}" for row in judgement.rows)
    return f"{heading(judgement)}: {figures} dB"
