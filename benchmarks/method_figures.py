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
from iibr_core.depth.search import open_with_depth
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.formats.outputs import write_file
from iibr_core.method.ambiguous_rays import find_ambiguous_rays
from iibr_core.method.candidates import find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.light_field import ViewMaker
from iibr_core.method.look_up import look_up
from iibr_core.method.occlusion import FULLY_COVERED, MIN_COVERED, view_entropy
from iibr_core.method.plan import plan_for_viewing
from iibr_core.method.ray_transformer import shipped_transformer
from iibr_core.method.view import Renderer, View
from iibr_core.runtime.resources import resource_folder
from iibr_core.stages import stages_without
from iibr_core.types import FloatImage, ViewOffset

NEAR_PX = 2.6
"""Distance from a ray within which landed source rays are drawn, in pixels."""
ROW_PX = 25
"""Length of the row whose weights are drawn, in pixels."""
NEAR_COLOR, FAR_COLOR, MARK, PINK = "#c2410c", "#1d4ed8", "#15803d", (1.0, 0.0, 0.8)
STYLE = {
    "font.size": 8,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "figure.constrained_layout.use": True,
    "image.interpolation": "nearest",
}
DEMO = resource_folder("assets") / "motorcycle" / "motorcycle.png"

Window = tuple[slice, slice]
"""Rows and columns of a part of a picture."""


class Steps:
    """The demo photo, the rays before anything was inpainted, the views that complete them, and the close-up."""

    def __init__(self, max_pixels: int) -> None:
        demo = open_with_depth(DEMO, max_pixels=max_pixels)
        plan = plan_for_viewing(demo.photo, demo.disparity)
        self.photo, self.disparity = demo.photo.pixels, plan.field_disparity(demo.disparity).values
        field, self.reach = offsets_of(plan.grid), plan.grid.centre[0]
        self.corner, self.beside = ViewOffset(-self.reach, -self.reach), ViewOffset(0.0, self.reach)
        self.complete = ViewMaker(self.photo, self.disparity, field)
        self.rays = ViewMaker(self.photo, self.disparity, field, stages=stages_without(["share-inpainted"])).rays
        self.fork = self.window(0.38, 0.60, 0.58, 0.78)

    def window(self, top: float, bottom: float, left: float, right: float) -> Window:
        """Return a part of the picture, given in shares of its height and width."""
        height, width = self.disparity.shape
        return np.s_[int(top * height) : int(bottom * height), int(left * width) : int(right * width)]

    def place_of_largest(self, values: NDArray[Any]) -> tuple[int, int]:
        """Return row and column in the picture of the largest of the fork's values."""
        row, column = np.unravel_index(values.argmax(), values.shape)
        return int(row) + self.fork[0].start, int(column) + self.fork[1].start


def main(words: Sequence[str] | None = None) -> None:
    """Write all pictures into the folder."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--max-pixels", type=int, default=DEFAULT_MAX_PIXELS, help="size of the photo")
    options = parser.parse_args(words)
    steps = Steps(options.max_pixels)
    with rc_context(STYLE):
        for draw in (epi, candidates, weights, occlusion, inpainting, ray_set):
            buffer, path = io.BytesIO(), options.folder / f"{draw.__name__}.png"
            draw(steps).savefig(buffer, format="png", dpi=110)
            with write_file(path) as unfinished:
                Image.open(buffer).convert("RGB").quantize(256).save(unfinished, "png", optimize=True)
            print(path)


def epi(steps: Steps) -> Figure:
    """Draw a row of the photo and what it becomes in the views from left to right."""
    (rows, columns), reach = steps.window(0.52, 1.0, 0.40, 0.82), steps.reach
    row, ends = rows.start, (columns.start - 0.5, columns.stop - 0.5)
    offsets = [ViewOffset(0.0, float(s)) for s in np.linspace(-reach, reach, 65)]
    lines = np.stack([view.colors[row, columns] for view in steps.complete.views(offsets)])
    figure = Figure((8.0, 4.6))
    photo, lower = figure.subplots(2, height_ratios=(1.25, 1.0))
    _show(photo, steps.photo, np.s_[max(row - 60, 0) : row + 61, columns], f"The photo around row {row} (green)")
    photo.axhline(row, color=MARK, linewidth=1.2)
    lower.imshow(np.clip(lines, 0, 1), extent=(*ends, reach, -reach), aspect="auto")
    lower.set(title="EPI of that row: every ray of the photo draws a line", xlabel="x, px", ylabel="s, view steps")
    shown = steps.disparity[row, columns]
    for at, color in ((int(shown.argmax()), NEAR_COLOR), (int(shown.argmin()), FAR_COLOR)):
        x, shift, words = columns.start + at, shown[at] * reach, f"disparity {shown[at]:+.1f} px a view step"
        lower.plot([x + shift, x - shift], [-reach, reach], "--", color=color, linewidth=1.4, label=words)
    lower.set(xlim=ends, ylim=(reach, -reach))
    lower.legend(loc="lower left", framealpha=0.9)
    return figure


def candidates(steps: Steps) -> Figure:
    """Draw where the source rays around a ray land that two surfaces share most evenly, and its candidates."""
    rays, offset = steps.rays, steps.beside
    found = find_candidates(rays, offset, (0, rays.size.height))
    shares, _ = closed_form(found)
    row, column = steps.place_of_largest(rays.in_view(np.sort(shares, axis=0)[-2])[steps.fork])
    y, x = row + rays.margins.top, column + rays.margins.left
    order = np.argsort(-found.disparity[: found.number[y, x], y, x])
    colors = [NEAR_COLOR, FAR_COLOR, MARK, "#7c3aed", "#64748b"]
    figure = Figure((8.0, 4.0))
    view, landed = figure.subplots(1, 2)
    window = np.s_[row - 7 : row + 8, column - 7 : column + 8]
    _show(view, _with_holes(Renderer().visible(rays, offset)[0]), window, f"View at {_words(offset)}; the ray in green")
    for axis, corner in ((view, (column - 0.5, row - 0.5)), (landed, (-0.5, -0.5))):
        axis.add_patch(Rectangle(corner, 1, 1, fill=False, edgecolor=MARK, linewidth=2, zorder=3))
    for source, (t, s) in enumerate(rays.to_view(offset)):
        rows, columns = np.nonzero(rays.arrays.coverage[source] > 0)
        d = rays.arrays.disparity[source][rows, columns]
        right, down = columns - d * s - x, rows - d * t - y
        near = np.maximum(abs(right), abs(down)) <= NEAR_PX
        pixels = np.clip(rays.arrays.colors[source][rows[near], columns[near]], 0, 1)
        edges = [colors[k] for k in np.abs(d[near][:, None] - found.disparity[order, y, x]).argmin(axis=1)]
        landed.scatter(right[near], down[near], s=70, c=pixels, edgecolors=edges, marker="os"[source > 0])
    for slot, color in zip(order, colors):
        d, coverage, share = (values[slot, y, x] for values in (found.disparity, found.coverage, shares))
        words = f"disparity {d:+.2f} px: covers {coverage:.2f}, weight {share:.2f}"
        landed.scatter([], [], s=70, c="none", edgecolors=color, label=words)
    landed.scatter([], [], s=70, c="none", edgecolors="black", marker="s", label="square: split from a mixed pixel")
    landed.set(xlim=(-NEAR_PX, NEAR_PX), ylim=(NEAR_PX, -NEAR_PX), aspect="equal")
    landed.set(title="Source rays that land around it", xlabel="px to its right", ylabel="px below it")
    figure.legend(*landed.get_legend_handles_labels(), loc="outside lower center", ncols=2)
    return figure


def weights(steps: Steps) -> Figure:
    """Draw the weight of the nearer surface along a row of a view, by the closed form and by the transformer.

    The row is the one in the close-up on which the transformer decides the most rays.
    """
    rays, offset, transformer = steps.rays, steps.beside, shipped_transformer()
    found = find_candidates(rays, offset, (0, rays.size.height))
    shares, covered = closed_form(found)
    shown, settled = look_up(rays, found, shares), covered < FULLY_COVERED  # composited over what is inpainted
    decided = np.zeros(rays.size, np.int64)
    decided[tuple(find_ambiguous_rays(rays, found, shares, shown, (0, rays.size.height), settled).pixel.T)] = 1
    counts = sliding_window_view(rays.in_view(decided)[steps.fork], ROW_PX, axis=1).sum(axis=-1)
    row, first = steps.place_of_largest(counts)
    columns = np.arange(first, first + ROW_PX)
    at = row + rays.margins.top, columns + rays.margins.left
    middle = (shown.disparity[at].min() + shown.disparity[at].max()) / 2
    is_near = (np.arange(len(shares))[:, None] < found.number[at]) & (found.disparity[:, *at] > middle)
    figure = Figure((8.0, 3.4))
    strip, plot = figure.subplots(2, height_ratios=(0.25, 1.0))
    window = np.s_[row - 2 : row + 3, first : first + ROW_PX]
    _show(strip, steps.complete.view(offset).colors, window, f"Row {row} of the view at {_words(offset)} in the middle")
    strip.set(aspect="auto", yticks=[], xticklabels=[], xlabel="", ylabel="")
    closed = np.where(is_near, shares[:, *at], 0).sum(axis=0)
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
    figure.legend(*plot.get_legend_handles_labels(), loc="outside lower center", ncols=4)
    return figure


def occlusion(steps: Steps) -> Figure:
    """Draw a corner view made of the photo's rays alone, how much of each ray they cover, and the entropy."""
    view, covered = Renderer().visible(steps.rays, steps.corner)
    pictures = {
        f"View at {_words(steps.corner)}; holes in pink": _with_holes(view),
        f"Covered share; a hole below {MIN_COVERED:g}": np.clip(covered, 0, 1),
        "Entropy of the weights, 0 to 1": np.clip(view_entropy(steps.rays, steps.corner), 0, 1),
    }
    return _close_ups(steps, pictures)


def inpainting(steps: Steps) -> Figure:
    """Draw a corner view before and after its holes are filled."""
    view, _ = Renderer().visible(steps.rays, steps.corner)
    after = Renderer(shipped_transformer()).render(steps.rays, steps.corner)
    pictures = {
        "Before: holes in pink": _with_holes(view),
        "After: filled from the background": after.colors,
        "Its disparity, px a view step": after.disparity,
    }
    return _close_ups(steps, pictures)


def ray_set(steps: Steps) -> Figure:
    """Draw how many rays each image of the set holds, and where the views added theirs."""
    rays = steps.complete.rays
    in_frame, added = np.zeros(rays.size, np.bool_), rays.arrays.coverage > 0
    rays.in_view(in_frame)[:] = True
    views = {
        f"view at {_words(ViewOffset(*offset))}": mask
        for offset, mask in zip(rays.arrays.offsets[rays.photo_images :], added[rays.photo_images :])
    }
    images = {"the photo": in_frame, "beyond its frame": ~in_frame, "split mixed pixels": added[1 : rays.photo_images]}
    counts = {name: int(mask.sum()) for name, mask in (images | views).items()}
    left, right = (figure := Figure((9.0, 3.2))).subfigures(1, 2, width_ratios=(1.0, 1.1))
    axis = left.subplots()
    bars = axis.barh(list(counts), list(counts.values()), color=[*[FAR_COLOR] * 3, *[NEAR_COLOR] * len(views)])
    axis.bar_label(bars, fmt="{:,.0f}", padding=3)
    axis.set(xscale="log", xlabel="rays (logarithmic)", title="Rays, in the order in which they join")
    axis.set_xlim(min(counts.values()) / 4 + 1, 20 * max(counts.values()))
    axis.invert_yaxis()
    for axis, (name, mask) in zip(right.subplots(2, 2).flat, views.items()):
        axis.imshow(rays.in_view(mask), "Oranges")
        axis.set(title=f"added by the {name}", xticks=[], yticks=[])
    return figure


def _close_ups(steps: Steps, pictures: dict[str, FloatImage]) -> Figure:
    """Draw pictures side by side, by their titles; values (H, W) with a scale of colours."""
    figure = Figure((9.0, 2.5))
    for axis, (title, picture) in zip(figure.subplots(1, len(pictures)), pictures.items()):
        _show(axis, picture, steps.fork, title)
        if picture.ndim == 2:
            figure.colorbar(axis.images[0], ax=axis, fraction=0.046, pad=0.03)
    return figure


def _show(axis: Axes, picture: FloatImage, window: Window, title: str) -> None:
    """Show a part of a picture (H, W, 3) or of values (H, W), with the places of its pixels."""
    rows, columns = window
    part = picture[window] if picture.ndim == 2 else np.clip(picture[window], 0, 1)
    axis.imshow(part, extent=(columns.start - 0.5, columns.stop - 0.5, rows.stop - 0.5, rows.start - 0.5))
    axis.set(title=title, xlabel="x, px", ylabel="y, px")


def _with_holes(view: View) -> FloatImage:
    """Return the colours of a view (H, W, 3), its holes in pink."""
    return np.where(view.occluded[..., None], np.float32(PINK), view.colors)


def _words(offset: ViewOffset) -> str:
    return f"t = {offset.t:g}, s = {offset.s:g}"


if __name__ == "__main__":
    main()
