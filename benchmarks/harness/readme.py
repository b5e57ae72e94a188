"""Tables of README and docs/accuracy.md: copied from the other pages of docs/, so that a figure is the same in both."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from pathlib import Path

from benchmarks.harness.pages import cell, put_between, table
from benchmarks.harness.reports import markdown
from iibr_core.formats.outputs import write_file
from iibr_core.types import InputError

CENTRE = "centre to all others"
PARTS = "full", "visible", "hole"
SOFT = "hci_antinous"
SCENES = {
    "HCI antinous, 9x9": "hci_antinous",
    "Middlebury teddy": "mb2003_teddy_quarter",
    "Middlebury moebius": "mb2005_moebius_third",
    "Middlebury motorcycle": "mb2014_motorcycle_quarter",
}


def switches(docs: Path) -> str:
    """Speed against error, the means over scenes."""
    names, *rows = table(docs / "speed.md", "Mean over scenes, maps as they are", "front")
    return markdown(names, rows)


def views(docs: Path) -> str:
    """Return the accuracy of views made from the centre view and the map of the scene."""

    def words(scene: str, method: str) -> str:
        page = docs / "evaluation" / f"{scene}.md"
        full, seen, holes = (cell(page, f"{scene}: {CENTRE}", method, f"{part} dB") for part in PARTS)
        return f"{full} dB ({seen}, {holes})"

    rows = ((name, words(scene, "iibr"), words(scene, "reference warp")) for name, scene in SCENES.items())
    names = "from the centre view and its map: full frame (visible, holes)", "iibr", "resampling warp, filled holes"
    return markdown(names, rows)


def soft_maps(docs: Path) -> str:
    """Return what maps that are not exact cost."""
    names, *rows = table(docs / "depth.md", "Refinement", SOFT)
    kept = [k for k, name in enumerate(names) if k == 0 or name.startswith(SOFT)]
    return markdown([names[k] for k in kept], ([cells[k] for k in kept] for cells in rows))


def figures(docs: Path) -> str:
    """One line each."""
    free, speed = docs / "free_views.md", docs / "speed.md"
    field = partial(cell, docs / "figures.md", "field-disparity")
    stop = partial(cell, docs / "figures.md", "cancelled", "")
    lens = partial(cell, row="iibr", column="path-traced lens")
    warm = partial(cell, speed, "Targets", column="measured")
    ours, warp = (cell(free, "poses", f"all | {way}", "frame dB") for way in ("ours", "resampled"))
    rows = {
        "[free cameras](free_views.md), eight poses of eight scenes": f"{ours} dB; a resampling warp {warp} dB",
        "a flat photo": "one view: nothing is made",
        "81 views of 512x512, warm": warm(row="9x9 of 512x512, hci_antinous"),
        "a cancelled job at 4 MP": f"ends after {stop('after, ms')} ms (median), {stop('longest')} ms at the longest",
        "two fields refocused, against a path-traced thin lens": " and ".join(
            f"{lens(docs / 'evaluation' / f'{scene}.md', f'{scene}: {CENTRE}')} dB" for scene in ("shelf", "fence")
        ),
        "HCI antinous without a map: disparity from its views": (
            f"{field(SOFT, 'bad pixels')} % of pixels off by more than 0.07 px; {field(SOFT, 'whole')} s of processor"
            " time"
        ),
    }
    for scene in (SOFT, "blender_shop_9x9"):
        drawn, blend = field(scene, "views held back"), field(scene, "plain blend")
        rows[f"{scene}, every second view held back"] = f"drawn {drawn} dB, plain blend {blend} dB"
    return markdown(("", ""), rows.items())


ACCURACY = "docs/accuracy.md"
TABLES: Mapping[str, tuple[str, Callable[[Path], str]]] = {
    "switches": (ACCURACY, switches),
    "views": ("README.md", views),
    "figures": (ACCURACY, figures),
    "soft-maps": (ACCURACY, soft_maps),
}
"""Page and maker of each table, by its mark."""


def write_readme(root: Path, only_check: bool = False) -> Iterator[str]:
    """Copy the tables and yield the faults: those that could not be, or with only_check, those that differ."""
    for mark, (page, make) in TABLES.items():
        path = root / page
        text = path.read_text("utf-8")
        try:
            made = put_between(text, mark, make(root / "docs"))
        except InputError as error:
            yield f"{page}: table {mark} stays: {error}"
            continue
        if made == text:
            continue
        if only_check:
            yield f"{page}: table {mark} is not what its page says"
        else:
            with write_file(path) as unfinished:
                unfinished.write_text(made, "utf-8")
