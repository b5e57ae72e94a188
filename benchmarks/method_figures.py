"""Makes the figures of docs/method.md from the demo photo, one for each step of the paper.

    python -m benchmarks method-figures DIR [--max-pixels N]

epi.png: an EPI of the light field. candidates.png: the source rays that land near one ray. weights.png: the weights of
the ray transformer and of the closed form along a row. occlusion.png: covered share and entropy of a corner view.
inpainting.png: a hole before and after. ray_set.png: which views add rays.
"""

from __future__ import annotations

import argparse
import io
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from PIL import Image

from benchmarks.scenes import offsets_of
from iibr_core.depth.search import PhotoWithDepth, open_with_depth
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.formats.outputs import write_file
from iibr_core.method.ambiguous_rays import find_ambiguous_rays
from iibr_core.method.candidates import Candidates, find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.look_up import look_up
from iibr_core.method.occlusion import FULLY_COVERED, MIN_COVERED, view_entropy
from iibr_core.method.photo_views import PhotoViews
from iibr_core.method.plan import plan_for_viewing
from iibr_core.method.ray_transformer import shipped_transformer
from iibr_core.method.rays import RaySet
from iibr_core.method.view import Renderer
from iibr_core.runtime.resources import resource_folder
from iibr_core.stages import stages_without
from iibr_core.types import FloatImage, ViewOffset

PLACE = 0.58, 0.38, 0.20, 0.22
"""Left, top, width and height of the close-ups (the fork of the motorcycle), as shares of the picture."""
EPI_PLACE = 0.40, 0.52, 0.42
"""Left end, height in the picture and length of the EPI's row, as shares of the picture."""
EPI_VIEWS = 65
NEAR_PX = 2.6
"""Distance from a ray within which landed source rays are drawn, in pixels."""
ROW_PX = 25
"""Length of the row whose weights are drawn, in pixels."""
HOLE = 1.0, 0.0, 0.8
"""Colour of holes."""
NEAR_COLOR, FAR_COLOR, MARK = "#c2410c", "#1d4ed8", "#15803d"
DPI = 110
STYLE = {"font.size": 9, "axes.titlesize": 9, "axes.labelsize": 9, "xtick.labelsize": 8, "ytick.labelsize": 8}
DEMO = resource_folder("assets") / "motorcycle" / "motorcycle.png"


class Steps:
    """The demo photo, the rays before anything was inpainted, and the views that complete them."""

    def __init__(self, demo: PhotoWithDepth) -> None:
        plan = plan_for_viewing(demo.photo, demo.disparity)
        self.photo, self.disparity = demo.photo.pixels, plan.field_disparity(demo.disparity).values
        field, self.reach = offsets_of(plan.grid), plan.grid.centre[0]
        self.corner, self.beside = ViewOffset(-self.reach, -self.reach), ViewOffset(0.0, self.reach)
        self.complete = PhotoViews(self.photo, self.disparity, field)
        self.photo_rays = PhotoViews(self.photo, self.disparity, field, stages_without(["share-inpainted"])).rays
        self.height, self.width = self.disparity.shape

    @property
    def place(self) -> tuple[slice, slice]:
        """Rows and columns of the close-ups."""
        left, top, width, height = np.multiply(PLACE, (self.width, self.height) * 2).astype(int)
        return slice(top, top + height), slice(left, left + width)


def main(words: Sequence[str] | None = None) -> None:
    """Write all pictures into the folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--max-pixels", type=int, default=DEFAULT_MAX_PIXELS, help="size of the photo")
    options = parser.parse_args(words)
    steps = Steps(open_with_depth(DEMO, max_pixels=options.max_pixels))
    with rc_context(STYLE):
        for draw in (epi, candidates, weights, occlusion, inpainting, ray_set):
            _write(options.folder / f"{draw.__name__}.png", draw(steps))


def epi(steps: Steps) -> Figure:
    """Draw a row of the photo and what it becomes in the views from left to right."""
    left, height, length = EPI_PLACE
    row, columns = int(height * steps.height), slice(int(left * steps.width), int((left + length) * steps.width))
    reach = steps.reach
    offsets = [ViewOffset(0.0, float(s)) for s in np.linspace(-reach, reach, EPI_VIEWS)]
    lines = np.stack([view.colors[row, columns] for view in steps.complete.views(offsets)])
    figure, (photo, lower) = _figure(8.0, 4.6, 2, 1, height_ratios=(1.25, 1.0))
    around = slice(max(row - 60, 0), row + 61)
    _show(photo, steps.photo[around, columns], (columns.start, around.start))
    photo.axhline(row, color=MARK, linewidth=1.2)
    photo.set(title=f"The photo around row {row} (green)", ylabel="y, px")
    lower.imshow(np.clip(lines, 0, 1), extent=(columns.start - 0.5, columns.stop - 0.5, reach, -reach), aspect="auto")
    lower.set(title="EPI of that row: every ray of the photo draws a line", xlabel="x, px", ylabel="s, view steps")
    shown = steps.disparity[row, columns]
    for at, color in ((int(shown.argmax()), NEAR_COLOR), (int(shown.argmin()), FAR_COLOR)):
        x, d = columns.start + at, float(shown[at])
        lower.plot([x + d * reach, x - d * reach], [-reach, reach], "--", color=color, linewidth=1.4)
        lower.plot([], [], "--", color=color, label=f"disparity {d:+.1f} px a view step")
    lower.set(xlim=(columns.start - 0.5, columns.stop - 0.5), ylim=(reach, -reach))
    lower.legend(loc="lower left", fontsize=8, framealpha=0.9)
    return figure


def candidates(steps: Steps) -> Figure:
    """Draw where the source rays around one ray at a depth edge land, and the candidates that they form."""
    rays, offset = steps.photo_rays, steps.beside
    (row, column), found, shares = _edge_ray(steps)
    y, x = row + rays.margins.top, column + rays.margins.left
    number = int(found.number[y, x])
    order = np.argsort(-found.disparity[:number, y, x])
    colors = [NEAR_COLOR, FAR_COLOR, MARK, "#7c3aed", "#64748b"]
    figure, (view, landed) = _figure(8.0, 4.0, 1, 2)
    open_view, _ = Renderer().visible(rays, offset)
    window = np.s_[row - 7 : row + 8, column - 7 : column + 8]
    _show(view, _marked(open_view.colors, open_view.occluded)[window], (column - 7, row - 7))
    view.add_patch(_square(column, row, 1.0))
    view.set(title=f"View at {_words(offset)}; the ray in green", xlabel="x, px", ylabel="y, px")
    arrays, shifts = rays.arrays, rays.to_view(offset)
    for source, (t, s) in enumerate(shifts):
        rows, columns = np.nonzero(arrays.coverage[source] > 0)
        d = arrays.disparity[source][rows, columns]
        right, down = columns - d * s - x, rows - d * t - y
        near = np.maximum(abs(right), abs(down)) <= NEAR_PX
        pixels = arrays.colors[source][rows[near], columns[near]]
        slot = np.abs(d[near][:, None] - found.disparity[order, y, x]).argmin(axis=1)
        edges = [colors[k] for k in slot]
        landed.scatter(
            right[near], down[near], s=70, c=np.clip(pixels, 0, 1), edgecolors=edges, marker="os"[source > 0]
        )
    landed.add_patch(_square(0, 0, 1.0))
    for k, slot in enumerate(order):
        d, coverage = found.disparity[slot, y, x], found.coverage[slot, y, x]
        words = f"disparity {d:+.2f} px: covers {coverage:.2f}, weight {shares[slot, y, x]:.2f}"
        landed.scatter([], [], s=70, c="none", edgecolors=colors[k], label=words)
    landed.set(xlim=(-NEAR_PX, NEAR_PX), ylim=(NEAR_PX, -NEAR_PX), aspect="equal")
    landed.set(title="Source rays that land around it", xlabel="px to its right", ylabel="px below it")
    landed.scatter([], [], s=70, c="none", edgecolors="black", marker="s", label="square: split from a mixed pixel")
    figure.legend(*landed.get_legend_handles_labels(), loc="outside lower center", fontsize=8, ncols=2)
    return figure


def weights(steps: Steps) -> Figure:
    """Draw the weight of the nearer surface along a row of a view, by the closed form and by the transformer.

    The row is the one in the close-up on which the transformer decides the most rays.
    """
    rays, offset, transformer = steps.photo_rays, steps.beside, shipped_transformer()
    found = find_candidates(rays, offset, (0, rays.size.height))
    shares, covered = closed_form(found)
    shown, every_row = look_up(rays, found, shares), (0, rays.size.height)
    settled = covered < FULLY_COVERED  # composited over what is inpainted behind it
    asked = find_ambiguous_rays(rays, found, shares, shown, every_row, settled)
    row, first = _fullest_row(steps, asked.pixel)
    columns = np.arange(first, first + ROW_PX)
    at = row + rays.margins.top, columns + rays.margins.left
    middle = (shown.disparity[at].min() + shown.disparity[at].max()) / 2
    is_near = (np.arange(len(shares))[:, None] < found.number[at]) & (found.disparity[:, *at] > middle)
    closed = np.where(is_near, shares[:, *at], 0).sum(axis=0)
    figure, (strip, plot) = _figure(8.0, 3.4, 2, 1, height_ratios=(0.25, 1.0))
    _show(strip, steps.complete.view(offset).colors[row - 2 : row + 3, columns], (first, row - 2))
    strip.set_aspect("auto")
    strip.set(title=f"Row {row} of the view at {_words(offset)}, with its neighbours", yticks=[], xticklabels=[])
    plot.step(columns, closed, where="mid", color=FAR_COLOR, label="closed form")
    for every, style, size, words in (True, "o--", 4, "transformer, if asked"), (False, "o", 10, "where it decides"):
        ambiguous = find_ambiguous_rays(rays, found, shares, shown, (at[0], at[0] + 1), settled, every)
        trained = np.full(rays.size.width, np.nan)
        trained[ambiguous.pixel[:, 1]] = np.where(ambiguous.disparity > middle, transformer(ambiguous), 0).sum(axis=1)
        inside = NEAR_COLOR if every else "none"
        plot.plot(columns, trained[at[1]], style, color=NEAR_COLOR, mfc=inside, ms=size, lw=1, label=words)
    for k, x in enumerate(columns[settled[at]]):
        plot.axvspan(x - 0.5, x + 0.5, color="0.88", label="" if k else "in part inpainted")
    plot.set(xlim=(first - 0.5, first + ROW_PX - 0.5), ylim=(-0.05, 1.05), xlabel="x, px")
    plot.set_ylabel("weight of the nearer surface")
    plot.grid(alpha=0.25)
    figure.legend(*plot.get_legend_handles_labels(), loc="outside lower center", fontsize=8, ncols=4)
    return figure


def occlusion(steps: Steps) -> Figure:
    """Draw a corner view made of the photo's rays alone, how much of each ray they cover, and the entropy."""
    rays, place = steps.photo_rays, steps.place
    view, covered = Renderer().visible(rays, steps.corner)
    figure, axes = _figure(9.0, 2.5, 1, 3)
    _show(axes[0], _marked(view.colors, view.occluded)[place], (place[1].start, place[0].start))
    axes[0].set(title=f"View at {_words(steps.corner)}; holes in pink", ylabel="y, px")
    titles = f"Covered share; a hole below {MIN_COVERED:g}", "Entropy of the weights, 0 to 1"
    for axis, values, words in zip(axes[1:], (covered, view_entropy(rays, steps.corner)), titles):
        _show(axis, np.clip(values[place], 0, 1), (place[1].start, place[0].start))
        axis.set_title(words)
        figure.colorbar(axis.images[0], ax=axis, fraction=0.046, pad=0.03)
    for axis in axes:
        axis.set(xlabel="x, px")
    return figure


def inpainting(steps: Steps) -> Figure:
    """Draw a corner view before and after its holes are filled."""
    rays, place = steps.photo_rays, steps.place
    view, _ = Renderer().visible(rays, steps.corner)
    before = _marked(view.colors, view.occluded)
    after = Renderer(shipped_transformer()).render(rays, steps.corner)
    figure, axes = _figure(9.0, 2.5, 1, 3)
    pictures = {
        "Before: holes in pink": before,
        "After: filled from the background": after.colors,
        "Its disparity, px a view step": after.disparity,
    }
    for axis, (words, picture) in zip(axes, pictures.items()):
        _show(axis, picture[place], (place[1].start, place[0].start))
        axis.set(title=words, xlabel="x, px")
    axes[0].set_ylabel("y, px")
    figure.colorbar(axes[2].images[0], ax=axes[2], fraction=0.046, pad=0.03)
    return figure


def ray_set(steps: Steps) -> Figure:
    """Draw how many rays each image of the set holds, and where the views added theirs."""
    rays = steps.complete.rays
    added = _rays_by_image(rays)
    counts = {name: int(mask.sum()) for name, mask in added.items()}
    views = [name for name in added if name.startswith("view")]
    figure = Figure(figsize=(9.0, 3.2), layout="constrained", facecolor="white")
    left, right = figure.subfigures(1, 2, width_ratios=(1.0, 1.1))
    bars = left.subplots()
    bars.barh(list(counts), list(counts.values()), color=[NEAR_COLOR if name in views else FAR_COLOR for name in added])
    for k, count in enumerate(counts.values()):
        bars.annotate(f"{count:,}", (count, k), xytext=(3, 0), textcoords="offset points", va="center", fontsize=8)
    bars.set(xscale="log", xlabel="rays (logarithmic)", title="Rays, in the order in which they join")
    bars.set_xlim(min(counts.values()) / 4 + 1, 20 * max(counts.values()))
    bars.invert_yaxis()
    for axis, name in zip(right.subplots(2, 2).flat, views):
        _show(axis, rays.in_view(added[name]).astype(np.float32), (0, 0), "Oranges")
        axis.set(title=f"added by the {name}", xticks=[], yticks=[])
    return figure


def _rays_by_image(rays: RaySet) -> dict[str, NDArray[np.bool_]]:
    """Return which pixels (H, W) of each image of the set hold rays, by its name; the photo's margins apart."""
    arrays, found = rays.arrays, dict[str, NDArray[np.bool_]]()
    for k, (offset, coverage) in enumerate(zip(arrays.offsets, arrays.coverage)):
        if k == 0:
            found["the photo"] = np.zeros_like(coverage > 0)
            rays.in_view(found["the photo"])[:] = True
            found["beyond its frame"] = ~found["the photo"]
        elif k < rays.photo_images:
            found["split mixed pixels"] = coverage > 0
        else:
            found[f"view at {_words(ViewOffset(*map(float, offset)))}"] = coverage > 0
    return found


def _fullest_row(steps: Steps, pixel: NDArray[np.int64]) -> tuple[int, int]:
    """Return (row, first column) of the ROW_PX pixels of the close-up that hold the most of some pixels (N, 2) of the
    images.
    """
    is_marked = np.zeros(steps.photo_rays.size, np.int64)
    is_marked[tuple(pixel.T)] = 1
    close_up = steps.photo_rays.in_view(is_marked)[steps.place]
    sums = sliding_window_view(close_up, ROW_PX, axis=1).sum(axis=-1)
    row, first = np.unravel_index(sums.argmax(), sums.shape)
    return int(row) + steps.place[0].start, int(first) + steps.place[1].start


def _edge_ray(steps: Steps) -> tuple[tuple[int, int], Candidates, FloatImage]:
    """Return (row, column) of the ray that two surfaces share most evenly in the close-up of the view to the right, the
    candidates of that view and their weights in closed form.
    """
    rays = steps.photo_rays
    found = find_candidates(rays, steps.beside, (0, rays.size.height))
    shares, _ = closed_form(found)
    second = rays.in_view(np.sort(shares, axis=0)[-2])[steps.place]
    row, column = np.unravel_index(second.argmax(), second.shape)
    return (int(row) + steps.place[0].start, int(column) + steps.place[1].start), found, shares


def _figure(width: float, height: float, rows: int, columns: int, **ratios: Any) -> tuple[Figure, Any]:
    """Return a figure of this size in inches on white, readable on dark and light pages alike, and its axes."""
    figure = Figure(figsize=(width, height), layout="constrained", facecolor="white")
    return figure, figure.subplots(rows, columns, **ratios)


def _show(axis: Axes, pixels: NDArray[Any], corner: tuple[int, int], colors: str = "viridis") -> None:
    """Show pixels whose upper left one lies at `corner` (x, y); values (H, W) by a colour map."""
    (left, top), (height, width) = corner, pixels.shape[:2]
    extent = left - 0.5, left + width - 0.5, top + height - 0.5, top - 0.5
    axis.imshow(np.clip(pixels, 0, 1) if pixels.ndim == 3 else pixels, colors, extent=extent, interpolation="nearest")


def _square(x: float, y: float, side: float) -> Rectangle:
    return Rectangle((x - side / 2, y - side / 2), side, side, fill=False, edgecolor=MARK, linewidth=2, zorder=3)


def _marked(colors: FloatImage, hole: NDArray[np.bool_]) -> FloatImage:
    return np.where(hole[..., None], np.float32(HOLE), colors)


def _words(offset: ViewOffset) -> str:
    return f"t = {offset.t:g}, s = {offset.s:g}"


def _write(path: Path, figure: Figure) -> None:
    """Write a PNG of at most 256 colours."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI)
    with write_file(path) as unfinished:
        Image.open(buffer).convert("RGB").quantize(256).save(unfinished, "png", optimize=True)
    print(path)


if __name__ == "__main__":
    main()
