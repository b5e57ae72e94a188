"""The bench's figures as Markdown and as a plot: speed.md, speed.svg, speed.png."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from iibr_core.evaluation.bench.figures import Foretold, Measured, SceneFigures, Target
from iibr_core.evaluation.bench.measure import on_the_front
from iibr_core.evaluation.bench.scaling import Growth
from iibr_core.evaluation.bench.variants import REFERENCE
from iibr_core.evaluation.report import markdown_table
from iibr_core.evaluation.tables import NO_FIGURE, Table, number
from iibr_core.formats.files import written_whole

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MIB = 2**20
FRONT_MARK = "●"
PANEL_INCHES = 3.9, 3.0
LEGEND_INCHES = 2.4
LOWEST_DB = -3.0
FRONT_COLOR, OTHER_COLOR = "#c2410c", "#64748b"
PNG_DPI = 110
COLUMNS = 2


@dataclass(frozen=True)
class Bench:
    """Everything that was measured. machine: in words."""

    scenes: tuple[SceneFigures, ...]
    foretold: tuple[Foretold, ...]
    growths: tuple[Growth, ...]
    targets: tuple[Target, ...]
    machine: str
    command: str


@dataclass(frozen=True)
class Mean:
    """A variant over all scenes that have it: geometric mean of time ratios, mean gain over the reference in dB."""

    name: str
    ratio: float
    gain_db: float
    flip: float
    scenes: int


def write_bench(folder: Path, bench: Bench) -> list[Path]:
    """Write speed.md, speed.svg and speed.png into an existing folder, each whole or not at all; return their paths.

    Raises InputError where that cannot be done.
    """
    pictures = plot(bench.scenes, ("svg", "png"))
    paths = [folder / "speed.md", folder / "speed.svg", folder / "speed.png"]
    for path, content in zip(paths, (markdown_of(bench).encode(), *pictures)):
        with written_whole(path) as temporary:
            temporary.write_bytes(content)
    return paths


def means(scenes: Sequence[SceneFigures]) -> list[Mean]:
    """Every variant that all scenes have, over the scenes."""
    by_name: dict[str, list[tuple[Measured, Measured]]] = {}
    for scene in scenes:
        reference = next(m for m in scene.measured if m.variant.name == REFERENCE.name)
        for measured in scene.measured:
            by_name.setdefault(measured.variant.name, []).append((measured, reference))
    return [
        Mean(
            name,
            float(np.exp(np.mean([math.log(m.ratio) for m, _ in pairs]))),
            float(np.mean([m.psnr_db - reference.psnr_db for m, reference in pairs])),
            float(np.mean([m.flip for m, _ in pairs])),
            len(pairs),
        )
        for name, pairs in by_name.items()
        if len(pairs) == len(scenes)
    ]


def markdown_of(bench: Bench) -> str:
    """All tables."""
    lines = [
        "# Speed against error",
        "",
        f"Made by `{bench.command}`. {bench.machine}.",
        "",
        "Time is of the whole field, processor time against that of *fast* in the same round (median of rounds).",
        "Seconds by the clock depend on what else the machine does. Memory is what a run takes beyond what was there:",
        f"rays, views in flight and those kept. {FRONT_MARK}: on the Pareto front, where nothing else is as cheap and",
        "better, or as good and cheaper. What the renderer trades is in [optics.md](optics.md).",
        "",
        "![Time against PSNR of every variant](speed.svg)",
        "",
    ]
    for title, scenes in _kinds(bench.scenes):
        lines += [f"## {title}", "", *markdown_table(means_table(scenes)), ""]
    for scene in bench.scenes:
        height, width = scene.size
        lines += [
            f"## {scene.name}",
            "",
            f"{scene.views} views of {width}x{height}, {scene.judged} judged. The plan would choose *{scene.planned}*,",
            f"{scene.behind_front_db:.2f} dB behind the best that takes no longer.",
            "",
            *markdown_table(scene_table(scene)),
            "",
        ]
    if bench.foretold:
        lines += ["## The plan beside what was measured", "", *markdown_table(foretold_table(bench.foretold)), ""]
    if bench.growths:
        lines += ["## Growth", "", "Seconds and bytes grow like the varied quantity to these powers.", ""]
        lines += [*markdown_table(growth_table(bench.growths)), ""]
    if bench.targets:
        lines += ["## Targets", "", *markdown_table(targets_table(bench.targets))]
    return "\n".join(lines).rstrip() + "\n"


def means_table(scenes: Sequence[SceneFigures]) -> Table:
    """Means over scenes."""
    found = means(scenes)
    front = on_the_front({mean.name: (mean.ratio, mean.gain_db) for mean in found})
    rows = tuple(
        (
            mean.name,
            FRONT_MARK if mean.name in front else "",
            f"{mean.ratio:.2f}",
            f"{mean.gain_db:+.2f}",
            number(mean.flip, 4),
        )
        for mean in found
    )
    return Table(("variant", "front", "time / fast", "PSNR against fast, dB", "FLIP"), rows)


def scene_table(scene: SceneFigures) -> Table:
    """Every variant on one scene."""
    front = scene.front
    rows = tuple(
        (
            m.variant.name,
            FRONT_MARK if m.variant.name in front else "",
            f"{m.ratio:.2f}",
            f"{m.cost.wall_s:.2f}",
            _mib(m.peak_bytes),
            number(m.psnr_db, 2),
            number(m.flip, 4),
        )
        for m in scene.measured
    )
    return Table(("variant", "front", "time / fast", "s by the clock", "peak MiB", "PSNR dB", "FLIP"), rows)


def foretold_table(foretold: Sequence[Foretold]) -> Table:
    """Memory and the transformer's time, foretold and measured."""
    head = ("scene", "quality", "MiB foretold", "measured", "transformer s foretold", "measured", "s in all")
    rows = tuple(
        (
            f.scene,
            f.quality,
            _mib(f.foretold_bytes),
            f"{_mib(f.measured_bytes)} ({_percent(f.measured_bytes, f.foretold_bytes)})",
            number(f.foretold_transformer_s, 2),
            f"{number(f.measured_transformer_s, 2)} ({_percent(f.measured_transformer_s, f.foretold_transformer_s)})",
            number(f.seconds, 2),
        )
        for f in foretold
    )
    return Table(head, rows)


def growth_table(growths: Sequence[Growth]) -> Table:
    """Exponents, and what was measured."""
    rows = tuple(
        (
            g.name,
            number(g.time_exponent, 2),
            number(g.memory_exponent, 2),
            ", ".join(f"{x:.3g}: {seconds:.2f} s, {_mib(size)} MiB" for x, seconds, size in g.points),
        )
        for g in growths
    )
    return Table(("varied", "time", "memory", "processor seconds and peak memory"), rows)


def targets_table(targets: Sequence[Target]) -> Table:
    """Figures with their targets."""
    words = {True: "met", False: "missed", None: "not known here"}
    return Table(
        ("figure", "target", "measured", ""),
        tuple((target.what, target.target, target.measured, words[target.is_met]) for target in targets),
    )


def _kinds(scenes: Sequence[SceneFigures]) -> list[tuple[str, list[SceneFigures]]]:
    """Scenes with their own maps, and with soft ones; each with a title."""
    kinds = [
        ("Mean over scenes, maps as they are", [scene for scene in scenes if not scene.is_soft]),
        ("Mean over scenes, soft maps", [scene for scene in scenes if scene.is_soft]),
    ]
    return [(title, found) for title, found in kinds if found]


def plot(scenes: Sequence[SceneFigures], formats: Sequence[str]) -> list[bytes]:
    """Time against PSNR, as files of these formats: means over scenes, and those scenes that have more variants."""
    import matplotlib
    from matplotlib.figure import Figure

    panels = [(title, {m.name: (m.ratio, m.gain_db) for m in means(found)}) for title, found in _kinds(scenes)]
    shared = {name for _, points in panels for name in points}
    for scene in scenes:
        if not scene.is_soft and any(m.variant.name not in shared for m in scene.measured):
            reference = next(m.psnr_db for m in scene.measured if m.variant.name == REFERENCE.name)
            panels.append((scene.name, {m.variant.name: (m.ratio, m.psnr_db - reference) for m in scene.measured}))
    names = list(dict.fromkeys(name for _, points in panels for name in points))
    rows = math.ceil(len(panels) / COLUMNS)
    with matplotlib.rc_context({"svg.hashsalt": "iibr", "svg.fonttype": "path", "font.size": 9}):
        size = PANEL_INCHES[0] * COLUMNS + LEGEND_INCHES, PANEL_INCHES[1] * rows
        figure = Figure(figsize=size, layout="constrained")
        parts = figure.subfigures(1, 2, width_ratios=(size[0] - LEGEND_INCHES, LEGEND_INCHES), squeeze=False)
        pictures, legend = parts[0]
        axes = list(np.ravel(pictures.subplots(rows, COLUMNS, squeeze=False)))
        for axis, (title, points) in zip(axes, panels):
            _draw_panel(axis, title, points, names)
        for axis in axes[len(panels) :]:
            axis.axis("off")
        words = "\n".join(f"{k}  {name}" for k, name in enumerate(names, 1))
        legend.text(0.02, 0.97, words, va="top", linespacing=1.5)
        return [_rendered(figure, kind) for kind in formats]


def _draw_panel(axis: Axes, title: str, points: dict[str, tuple[float, float]], names: Sequence[str]) -> None:
    """Gains far below the rest are drawn as triangles at the lower border: all else would be a line."""
    from matplotlib.ticker import FormatStrFormatter, LogLocator, NullFormatter

    front = on_the_front(points)
    line = sorted((points[name][0], max(points[name][1], LOWEST_DB)) for name in front)
    axis.plot(*zip(*line), color=FRONT_COLOR, linewidth=1, zorder=1)
    for name, (ratio, gain) in points.items():
        height, marker = (gain, "o") if gain >= LOWEST_DB else (LOWEST_DB, "v")
        axis.scatter(ratio, height, s=26, marker=marker, color=FRONT_COLOR if name in front else OTHER_COLOR, zorder=2)
        label = str(names.index(name) + 1)
        axis.annotate(label, (ratio, height), xytext=(4, 3), textcoords="offset points", fontsize=8)
    axis.set_xscale("log")
    axis.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
    axis.xaxis.set_major_formatter(FormatStrFormatter("%g"))
    axis.xaxis.set_minor_formatter(NullFormatter())
    axis.set_title(title, fontsize=9)
    axis.set_xlabel("time / fast")
    axis.set_ylabel("PSNR against fast, dB")
    axis.grid(alpha=0.25, which="both")


def _rendered(figure: Figure, kind: str) -> bytes:
    buffer = io.BytesIO()
    figure.savefig(buffer, format=kind, dpi=PNG_DPI, metadata={"Date": None} if kind == "svg" else None)
    return buffer.getvalue()


def _mib(size: float) -> str:
    return f"{size / MIB:.0f}" if math.isfinite(size) else NO_FIGURE


def _percent(measured: float, foretold: float) -> str:
    return f"{measured / foretold - 1:+.0%}" if foretold > 0 and math.isfinite(measured) else NO_FIGURE
