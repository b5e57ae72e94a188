"""The bench's figures as Markdown and as a plot: speed.md, speed.svg, speed.png."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.speed.figures import MeasuredVariant, SceneFigures
from benchmarks.speed.measure import on_the_front
from benchmarks.speed.plot import Panel, plot_panels
from benchmarks.speed.prediction import WITHIN, Prediction, is_near
from benchmarks.speed.rendering_figures import DrawingFigures
from benchmarks.speed.scaling import Growth
from benchmarks.speed.targets import SpeedTarget
from benchmarks.speed.variants import REFERENCE
from iibr_core.evaluation.consistency import Consistency
from iibr_core.evaluation.report import markdown_table
from iibr_core.evaluation.tables import NO_FIGURE, Table, number
from iibr_core.formats.outputs import atomic_write

MIB = 2**20
FRONT_MARK = "●"


@dataclass(frozen=True)
class Bench:
    """Everything that was measured. machine: in words. made_by: the command and the commit, in words.

    agreements: of the views of a field with each other, by scene. window, yardsticks: lines that other programs print.
    """

    scenes: tuple[SceneFigures, ...]
    drawings: tuple[DrawingFigures, ...]
    predicted: tuple[Prediction, ...]
    growths: tuple[Growth, ...]
    targets: tuple[SpeedTarget, ...]
    machine: str
    made_by: str
    agreements: tuple[tuple[str, Consistency], ...] = ()
    window: tuple[str, ...] = ()
    yardsticks: tuple[str, ...] = ()


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
    pictures = plot_panels(panels(bench), ("svg", "png"))
    paths = [folder / "speed.md", folder / "speed.svg", folder / "speed.png"]
    for path, content in zip(paths, (markdown_of(bench).encode(), *pictures)):
        with atomic_write(path) as temporary:
            temporary.write_bytes(content)
    return paths


def means(scenes: Sequence[SceneFigures]) -> list[Mean]:
    """Every variant that all scenes have, over the scenes."""
    by_name: dict[str, list[tuple[MeasuredVariant, MeasuredVariant]]] = {}
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
    """All tables. The first, the means over the scenes, is what to show elsewhere."""
    means_of_kinds = [(title, "", means_table(scenes)) for title, scenes in _kinds(bench.scenes)]
    sections = [*means_of_kinds, *_scene_sections(bench.scenes)]
    sections += [(f"Drawing: {figures.what}", DRAWING, drawing_table(figures)) for figures in bench.drawings]
    if bench.predicted:
        sections.append(("The plan beside what was measured", PREDICTED, prediction_table(bench.predicted)))
    if bench.growths:
        sections.append(("Growth", GROWTH, growth_table(bench.growths)))
    if bench.targets:
        sections.append(("Targets", "", targets_table(bench.targets)))
    if bench.agreements:
        sections.append(("Whether views agree with each other", ABOUT_AGREEMENT, agreement_table(bench.agreements)))
    lines = ["# Speed against error", "", f"{bench.made_by}. {bench.machine}.", "", *HEAD]
    for title, words, table in sections:
        lines += ["", f"## {title}", "", *([words, ""] if words else []), *markdown_table(table)]
    for title, said in (("The window", bench.window), ("Yardsticks", bench.yardsticks)):
        if said:
            lines += ["", f"## {title}", "", "```", *said, "```"]
    return "\n".join(lines) + "\n"


HEAD = (
    "Time is of the whole field, processor time against that of *fast* in the same round (median of rounds). Seconds",
    "by the clock depend on what else the machine does. Memory is what a run takes beyond what was there: rays, views",
    f"in flight and those kept. {FRONT_MARK}: on the Pareto front, where nothing else is as cheap and better, or as",
    "good and cheaper. Colours are looked up by cubic interpolation and kept in 32-bit floats until a view is stored:",
    "neither has a switch.",
    "",
    "![Time against PSNR of every variant](speed.svg)",
)
DRAWING = (
    "Time of one picture against drawing it *at once*, what the viewer shows first; errors are against a float sum of\n"
    "four times as many views in numpy. What a drag leaves out is in [optics.md](optics.md)."
)
PREDICTED = f"Predicted over measured; good is within {WITHIN:.0%}. Time is processor time over all cores."
ABOUT_AGREEMENT = (
    "What one view shows, carried by its disparity to another, against what that one shows: content inpainted in\n"
    "both, and surfaces of the photo; and whether points of the photo lie on straight lines in EPIs. 0 = views agree."
)
GROWTH = "Seconds and bytes grow like the varied quantity to these powers."


def _scene_sections(scenes: Sequence[SceneFigures]) -> list[tuple[str, str, Table]]:
    found = []
    for scene in scenes:
        words = (
            f"{scene.views} views of {scene.size[1]}x{scene.size[0]}, {scene.judged} judged. The plan would choose"
            f" *{scene.planned}*,\n{scene.behind_front_db:.2f} dB behind the best that takes no longer."
        )
        found.append((scene.name, words, scene_table(scene)))
    return found


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


def drawing_table(figures: DrawingFigures) -> Table:
    """Every way to draw a picture."""
    front = figures.front
    rows = tuple(
        (
            drawn.name,
            FRONT_MARK if drawn.name in front else "",
            f"{drawn.ratio:.2f}",
            f"{1e3 * drawn.cost.cpu_s:.0f}",
            str(drawn.samples),
            number(drawn.psnr_db, 2),
            number(drawn.flip, 4),
        )
        for drawn in figures.drawn
    )
    return Table(("variant", "front", "time / at once", "ms", "samples", "PSNR dB", "FLIP"), rows)


def prediction_table(predicted: Sequence[Prediction]) -> Table:
    """Time and memory, predicted and measured."""
    head = ("scene", "quality", "s predicted", "measured", "ratio", "", "MiB predicted", "measured", "ratio", "")
    rows = tuple(
        (
            f.scene,
            f.quality,
            number(f.predicted_s, 2),
            number(f.measured_s, 2),
            *_verdict(f.time_ratio),
            _mib(f.predicted_bytes),
            _mib(f.measured_bytes),
            *_verdict(f.memory_ratio),
        )
        for f in predicted
    )
    return Table(head, rows)


def _verdict(ratio: float) -> tuple[str, str]:
    return number(ratio, 2), {True: "", False: "off", None: ""}[is_near(ratio)]


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


def targets_table(targets: Sequence[SpeedTarget]) -> Table:
    """Figures with their targets."""
    words = {True: "met", False: "missed", None: "not known here"}
    return Table(
        ("figure", "target", "measured", ""),
        tuple((target.what, target.target, target.measured, words[target.is_met]) for target in targets),
    )


def agreement_table(agreements: Sequence[tuple[str, Consistency]]) -> Table:
    """One row a scene."""
    head = ("scene", "holes, rms / 255", "their pixels", "surfaces, rms / 255", "EPI lines, rms / 255", "off, px")
    rows = tuple(
        (
            name,
            number(found.hole_rms, 2),
            str(found.hole_pixels),
            number(found.surface_rms, 2),
            number(found.line_rms, 2),
            number(found.line_off_px, 3),
        )
        for name, found in agreements
    )
    return Table(head, rows)


def _kinds(scenes: Sequence[SceneFigures]) -> list[tuple[str, list[SceneFigures]]]:
    """Scenes with their own maps, and with soft ones; each with a title."""
    kinds = [
        ("Mean over scenes, maps as they are", [scene for scene in scenes if not scene.is_soft]),
        ("Mean over scenes, soft maps", [scene for scene in scenes if scene.is_soft]),
    ]
    return [(title, found) for title, found in kinds if found]


def panels(bench: Bench) -> list[Panel]:
    """Means over scenes, those scenes that have more variants, and drawing."""
    found = []
    for title, scenes in _kinds(bench.scenes):
        found.append(Panel(title, {mean.name: (mean.ratio, mean.gain_db) for mean in means(scenes)}))
    shared = {name for panel in found for name in panel.points}
    for scene in bench.scenes:
        if not scene.is_soft and any(m.variant.name not in shared for m in scene.measured):
            fast_db = next(m.psnr_db for m in scene.measured if m.variant.name == REFERENCE.name)
            found.append(Panel(scene.name, {m.variant.name: (m.ratio, m.psnr_db - fast_db) for m in scene.measured}))
    for figures in bench.drawings:
        first, title = figures.drawn[0], f"drawing: {figures.what}".replace(", ", ",\n", 1)
        points = {drawn.name: (drawn.ratio, drawn.psnr_db - first.psnr_db) for drawn in figures.drawn}
        found.append(Panel(title, points, first.name))
    return found


def _mib(size: float) -> str:
    return f"{size / MIB:.0f}" if math.isfinite(size) else NO_FIGURE
