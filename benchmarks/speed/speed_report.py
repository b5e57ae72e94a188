"""What the bench measured as Markdown and as a plot: speed.md, speed.svg."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from benchmarks.harness.plots import Panel, on_the_front, plot_panels
from benchmarks.harness.reports import holds, markdown, title
from benchmarks.harness.timing import Cost
from iibr_core.evaluation.tables import number
from iibr_core.formats.outputs import write_file

FRONT_MARK = "●"


@dataclass(frozen=True)
class Measured:
    """One way of doing the same. ratio: of processor time, to the reference's. psnr_db, flip: means over the judged.
    samples: points of the lens that a picture is made of.
    """

    name: str
    cost: Cost
    ratio: float
    psnr_db: float
    flip: float
    samples: int = 0


@dataclass(frozen=True)
class Figures:
    """what: a scene's field, or a picture of it, made in many ways; the first is the reference. planned: the way that
    the plan would choose for a field.
    """

    what: str
    about: str
    measured: tuple[Measured, ...]
    planned: str = ""
    is_soft: bool = False

    @property
    def front(self) -> set[str]:
        """Ways that none beats in time and PSNR both."""
        return on_the_front({m.name: (m.ratio, m.psnr_db) for m in self.measured})

    @property
    def gains(self) -> dict[str, tuple[float, float]]:
        """Time ratio and gain in dB, both against the reference, by name."""
        return {m.name: (m.ratio, m.psnr_db - self.measured[0].psnr_db) for m in self.measured}

    @property
    def choice(self) -> Measured:
        """The plan's."""
        return next(m for m in self.measured if m.name == self.planned)

    @property
    def behind_front_db(self) -> float:
        """By how much the plan's choice falls short of the best way that takes no longer."""
        return max(m.psnr_db for m in self.measured if m.ratio <= self.choice.ratio) - self.choice.psnr_db

    def fastest_as_good(self, within_db: float) -> Measured:
        """The fastest way that falls short of the plan's choice by no more than that."""
        as_good = [m for m in self.measured if m.psnr_db >= self.choice.psnr_db - within_db]
        return min(as_good, key=lambda m: m.ratio)


@dataclass(frozen=True)
class SpeedTarget:
    """One figure with its target, in words. is_met: None where this system cannot tell."""

    what: str
    target: str
    measured: str
    is_met: bool | None


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
    """Write speed.md and speed.svg into an existing folder, each whole or not at all; return their paths.

    Raises InputError where that cannot be done.
    """
    made = {"speed.md": markdown_of(bench).encode(), "speed.svg": plot_panels(panels(bench), "svg")}
    for name, content in made.items():
        with write_file(folder / name) as temporary:
            temporary.write_bytes(content)
    return [folder / name for name in made]


def means(scenes: Sequence[Figures]) -> dict[str, tuple[float, float, float]]:
    """Of every variant that all scenes have: geometric mean of time ratios, mean gain over the reference, mean FLIP."""
    shared = [name for name in scenes[0].gains if all(name in scene.gains for scene in scenes)]
    found = {}
    for name in shared:
        ratios, gains = zip(*(scene.gains[name] for scene in scenes))
        flips = [m.flip for scene in scenes for m in scene.measured if m.name == name]
        found[name] = float(np.exp(np.mean(np.log(ratios)))), float(np.mean(gains)), float(np.mean(flips))
    return found


HEAD = f"""Time is processor time of the whole light field over that of *fast* in the same round (median of rounds).
{FRONT_MARK} marks the Pareto front: no other variant is both as fast and better, or as good and faster. Cubic
interpolation of colours and 32-bit floats until a view is stored have no switch.

![Time against PSNR of every variant](speed.svg)
"""


def markdown_of(bench: Bench) -> str:
    """The means over the scenes, of which the first is what to show elsewhere, and each scene with its own map."""
    parts = [title("Speed against error", "benchmarks.speed", bench.machine), HEAD]
    parts += (f"## {what}\n\n{means_table(scenes)}\n" for what, scenes in bench.kinds)
    parts += (f"## {each.what}\n\n{each.about}\n\n{table(each)}\n" for each in bench.scenes if not each.is_soft)
    rows = ((target.what, target.target, target.measured, holds(target.is_met)) for target in bench.targets)
    parts.append(f"## Targets\n\n{markdown(('figure', 'target', 'measured', 'holds'), rows)}\n")
    return "\n".join(parts)


def means_table(scenes: Sequence[Figures]) -> str:
    """Means over scenes."""
    found = means(scenes)
    front = on_the_front({name: (ratio, gain) for name, (ratio, gain, _) in found.items()})
    rows = (
        (name, FRONT_MARK * (name in front), f"{ratio:.2f}", f"{gain:+.2f}", number(flip, 4))
        for name, (ratio, gain, flip) in found.items()
    )
    return markdown(("variant", "front", "time / fast", "PSNR against fast, dB", "FLIP"), rows)


def table(figures: Figures) -> str:
    """Every way."""
    head = ("variant", "front", f"time / {figures.measured[0].name}", "ms", "PSNR dB", "FLIP", "samples")
    rows = (
        (
            *(m.name, FRONT_MARK * (m.name in figures.front), f"{m.ratio:.2f}", f"{1e3 * m.cost.cpu_s:.0f}"),
            *(number(m.psnr_db, 2), number(m.flip, 4), m.samples),
        )
        for m in figures.measured
    )
    shown = slice(-1 if figures.planned else None)  # fields have no samples
    return markdown(head[shown], (row[shown] for row in rows))


def panels(bench: Bench) -> list[Panel]:
    """Means over scenes."""
    return [
        Panel(what, {name: (ratio, gain) for name, (ratio, gain, _) in means(scenes).items()})
        for what, scenes in bench.kinds
    ]
