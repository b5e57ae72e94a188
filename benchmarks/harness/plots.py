"""Time against PSNR as a picture: one panel a set of variants, numbered, the Pareto front drawn as a line."""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS = 2
PANEL_INCHES = 3.9, 3.0
LEGEND_INCHES = 3.4
LINE_INCHES = 0.21
LOWEST_DB = -3.0
FRONT_COLOR, OTHER_COLOR = "#c2410c", "#64748b"
CELLS_PER_E, CELLS_PER_DB = 10, 5
"""Points within such a cell, of time and of gain, share one label: else labels hide each other."""


@dataclass(frozen=True)
class Panel:
    """points: (time ratio, gain in dB) by name, both against the one called reference."""

    title: str
    points: dict[str, tuple[float, float]]
    reference: str = "iibr"


def on_the_front(points: Mapping[str, tuple[float, float]]) -> set[str]:
    """Names of the points (cost, gain) that no other beats: none is as cheap and better, or as good and cheaper."""

    def is_beaten(name: str) -> bool:
        cost, gain = points[name]
        return any(c <= cost and g >= gain and (c, g) != (cost, gain) for c, g in points.values())

    return {name for name, (cost, gain) in points.items() if math.isfinite(cost * gain) and not is_beaten(name)}


def plot_panels(panels: Sequence[Panel], kind: str) -> bytes:
    """The panels as a file of this kind ("svg", "png"), with a legend of the numbers beside them."""
    import matplotlib
    from matplotlib.figure import Figure

    names = list(dict.fromkeys(name for panel in panels for name in panel.points))
    rows = math.ceil(len(panels) / COLUMNS)
    width = PANEL_INCHES[0] * COLUMNS
    height = max(PANEL_INCHES[1] * rows, LINE_INCHES * (len(names) + 2))
    with matplotlib.rc_context({"svg.hashsalt": "iibr", "svg.fonttype": "path", "font.size": 9}):
        figure = Figure(figsize=(width + LEGEND_INCHES, height), layout="constrained")
        pictures, legend = figure.subfigures(1, 2, width_ratios=(width, LEGEND_INCHES), squeeze=False)[0]
        axes = list(np.ravel(pictures.subplots(rows, COLUMNS, squeeze=False)))
        for axis, panel in zip(axes, panels):
            _draw_panel(axis, panel, names)
        for axis in axes[len(panels) :]:
            axis.axis("off")
        words = "\n".join(f"{k}  {name}" for k, name in enumerate(names, 1))
        legend.text(0.02, 0.98, words, va="top", linespacing=1.4)
        buffer = io.BytesIO()
        figure.savefig(buffer, format=kind, metadata={"Date": None} if kind == "svg" else None)
        return buffer.getvalue()


def _draw_panel(axis: Axes, panel: Panel, names: Sequence[str]) -> None:
    """Gains far below the rest are drawn as triangles at the lower border: all else would be a line."""
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

    front = on_the_front(panel.points)
    line = sorted((panel.points[name][0], max(panel.points[name][1], LOWEST_DB)) for name in front)
    axis.plot(*zip(*line), color=FRONT_COLOR, linewidth=1, zorder=1)
    numbers: dict[tuple[int, int], list[int]] = {}
    places: dict[tuple[int, int], tuple[float, float]] = {}
    for name, (ratio, gain) in panel.points.items():
        height, marker = (gain, "o") if gain >= LOWEST_DB else (LOWEST_DB, "v")
        axis.scatter(ratio, height, s=26, marker=marker, color=FRONT_COLOR if name in front else OTHER_COLOR, zorder=2)
        place = round(math.log(ratio) * CELLS_PER_E), round(height * CELLS_PER_DB)
        numbers.setdefault(place, []).append(names.index(name) + 1)
        if len(numbers[place]) == 1:
            places[place] = ratio, height
    for place, found in numbers.items():
        words = ", ".join(map(str, found))
        axis.annotate(words, places[place], xytext=(4, 3), textcoords="offset points", fontsize=8)
    axis.set_xscale("log")
    axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.set_title(panel.title, fontsize=9)
    axis.set_xlabel(f"time / {panel.reference}")
    axis.set_ylabel(f"PSNR against {panel.reference}, dB")
    axis.grid(alpha=0.25, which="both")
