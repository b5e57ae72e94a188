"""Writes the measurements of the bench as tables and as a plot: speed.md, speed.svg."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.harness.plots import Panel, on_the_front, plot_panels
from benchmarks.harness.reports import holds, markdown, title
from benchmarks.harness.timing import Cost
from iibr_core.evaluation.report import number
from iibr_core.formats.outputs import write_file

FRONT_MARK = "●"


@dataclass(frozen=True)
class Measured:
    """One variant on one scene. ratio: processor time over the reference's. psnr_db, flip: means over judged views."""

    name: str
    cost: Cost
    ratio: float
    psnr_db: float
    flip: float


@dataclass(frozen=True)
class Figures:
    """All variants on one scene, the first of which is the reference. is_soft: whether its map was blurred."""

    scene: str
    about: str
    measured: tuple[Measured, ...]
    is_soft: bool = False

    @property
    def front(self) -> set[str]:
        """Names of the variants that none beats in time and PSNR both."""
        return on_the_front({m.name: (m.ratio, m.psnr_db) for m in self.measured})


@dataclass(frozen=True)
class SpeedTarget:
    """One figure with its target, in words."""

    what: str
    target: str
    measured: str
    is_met: bool


@dataclass(frozen=True)
class Bench:
    """Everything that was measured. machine: in words."""

    scenes: tuple[Figures, ...]
    targets: tuple[SpeedTarget, ...]
    machine: str = ""

    @property
    def kinds(self) -> list[tuple[str, list[Figures]]]:
        """Scenes with their own maps, and with soft ones; each with a title."""
        names = {False: "maps as they are", True: "soft maps"}
        found = ((name, [s for s in self.scenes if s.is_soft == is_soft]) for is_soft, name in names.items())
        return [(f"Mean over scenes, {name}", scenes) for name, scenes in found if scenes]


def write_bench(folder: Path, bench: Bench) -> list[Path]:
    """Write speed.md and speed.svg into an existing folder and return their paths. Raises InputError on failure."""
    panels = [
        Panel(what, {name: (ratio, gain) for name, (ratio, gain, _) in means(scenes).items()})
        for what, scenes in bench.kinds
    ]
    made = {"speed.md": markdown_of(bench).encode(), "speed.svg": plot_panels(panels, "svg")}
    for name, content in made.items():
        with write_file(folder / name) as temporary:
            temporary.write_bytes(content)
    return [folder / name for name in made]


def means(scenes: Sequence[Figures]) -> dict[str, tuple[float, float, float]]:
    """Return for each variant the geometric mean of time ratios, the mean gain over the reference (dB), mean FLIP."""
    found = {}
    for of_variant in zip(*(scene.measured for scene in scenes)):
        ratio = np.exp(np.mean(np.log([m.ratio for m in of_variant])))
        gain = np.mean([m.psnr_db - scene.measured[0].psnr_db for m, scene in zip(of_variant, scenes)])
        found[of_variant[0].name] = float(ratio), float(gain), float(np.mean([m.flip for m in of_variant]))
    return found


HEAD = f"""Time is processor time of the whole light field over that of *iibr* in the same round (median of rounds).
{FRONT_MARK} marks the Pareto front: no other variant is both as fast and better, or as good and faster.

![Time against PSNR of every variant](speed.svg)
"""


def markdown_of(bench: Bench) -> str:
    """Return the means over the scenes, of which the first is what to show elsewhere, and each scene with its map."""
    parts = [title("Speed against error", "benchmarks.speed", bench.machine), HEAD]
    parts += (f"## {what}\n\n{means_table(scenes)}\n" for what, scenes in bench.kinds)
    parts += (f"## {each.scene}\n\n{each.about}\n\n{table(each)}\n" for each in bench.scenes if not each.is_soft)
    if bench.targets:
        rows = ((target.what, target.target, target.measured, holds(target.is_met)) for target in bench.targets)
        parts.append(f"## Targets\n\n{markdown(('figure', 'target', 'measured', 'holds'), rows)}\n")
    return "\n".join(parts)


def means_table(scenes: Sequence[Figures]) -> str:
    """Return a table of the means over scenes."""
    found = means(scenes)
    front = on_the_front({name: (ratio, gain) for name, (ratio, gain, _) in found.items()})
    rows = (
        (name, FRONT_MARK * (name in front), f"{ratio:.2f}", f"{gain:+.2f}", number(flip, 4))
        for name, (ratio, gain, flip) in found.items()
    )
    return markdown(("variant", "front", "time / iibr", "PSNR against iibr, dB", "FLIP"), rows)


def table(figures: Figures) -> str:
    """Return a table of the variants on one scene."""
    rows = (
        (
            *(m.name, FRONT_MARK * (m.name in figures.front), f"{m.ratio:.2f}", f"{1e3 * m.cost.cpu_s:.0f}"),
            *(number(m.psnr_db, 2), number(m.flip, 4)),
        )
        for m in figures.measured
    )
    return markdown(("variant", "front", "time / iibr", "ms", "PSNR dB", "FLIP"), rows)
