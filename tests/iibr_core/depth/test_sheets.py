"""Sheets of small maps, as a person sees them: every tool and tone of the editor, refined edges, guesses."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from scipy.ndimage import gaussian_filter, maximum_filter

from iibr_core.depth.edges.refine import refine
from iibr_core.depth.editing.canvas import DepthCanvas, apply_edits
from iibr_core.depth.editing.edits import BRUSH_TOOLS, DepthEdits, Patch, Stroke
from iibr_core.depth.guess import guess_depth
from iibr_core.formats.maps.resample import resample_map
from iibr_core.stages import ALL_STAGES
from iibr_core.types import FloatImage, image_size
from tests.iibr_core.depth.drawn_photo import drawn
from tests.iibr_core.scenes import photo_of, smooth_texture
from tests.image_compare import DECISIONS, assert_golden


def assert_sheet(
    name: str, maps: Iterable[FloatImage], span: tuple[float, float], columns: int, regenerate, folder, by=DECISIONS
):
    """Compare maps in rows of a picture, from black (low) to white (high), a grey line between them."""
    low, high = span
    shares = (np.clip((np.nan_to_num(values, nan=low) - low) / (high - low), 0, 1) for values in maps)
    tiles = [np.pad(part, (0, 1), constant_values=0.5) for part in shares]
    rows = [np.hstack(tiles[k : k + columns]) for k in range(0, len(tiles), columns)]
    sheet = np.repeat(np.rint(255 * np.vstack(rows)).astype(np.uint8)[..., None], 3, 2)
    assert_golden(sheet, f"depth/{name}", by, folder, regenerate, tiles[0].shape)


HEIGHT, WIDTH = 60, 80
STROKES = (
    *(Stroke(tool, ((0.3, 0.4), (0.5, 0.6)), 0.12, 0.6) for tool in BRUSH_TOOLS),
    Stroke("nearer", ((0.1, 0.9),), 0.25, 1.0),
    Stroke("smooth", ((0.1, 0.5), (0.9, 0.5)), 0.25, 1.0),
    Stroke("level", ((0.1, 0.2), (0.7, 0.2), (0.7, 0.9)), 0.06, 1.0, taken_from=(0.5, 0.5)),
    Stroke("fill", ((0.9, 0.1), (0.5, 0.5)), 0.03, 1.0, taken_from=(0.05, 0.95)),
    Stroke("fill", ((0.1, 0.1),), 0.03, 0.5, tolerance=4.0),
    Stroke("fill", ((0.7, 0.8),), 0.1, 1.0, tolerance=0.25),
    Stroke("fill", ((0.5, 0.5),), 0.03, 0.7, taken_from=(7.0, -2.0)),
    Stroke("back", ((0.1, 0.1),), 0.03, 0.3, feather=0.1),
    Stroke("back", ((0.5, 0.5), (0.89, 0.3)), 0.03, 0.3),
    Stroke(
        "forward", ((0.5, 0.5),), 0.03, 0.3,
        patches=(Patch(((0.1, 0.1), (0.2, 0.1)), 0.06), Patch(((0.5, 0.3),), 0.1, erases=True)), feather=0.03,
    ),
)  # fmt: skip
OUTSIDE = tuple(
    Stroke(tool, (place,), 0.1, 1.0) for tool in BRUSH_TOOLS for place in ((-5.0, 0.5), (1e30, -1e30), (0.5, 1.0))
)
EDITS = (
    DepthEdits(strokes=(*OUTSIDE, Stroke("nearer", ((0.2, 0.5),), 0.002, 1.0))),
    *(DepthEdits(strokes=(stroke,)) for stroke in STROKES),
    DepthEdits(gamma=2.5),
    DepthEdits(gamma=0.4, far_clip=0.3),
    DepthEdits(is_inverted=True, near_clip=0.6, far_clip=0.2, gamma=1.7),
    DepthEdits(is_inverted=True, gamma=0.5, strokes=(STROKES[0], STROKES[2], STROKES[8])),
)


def edited_scene() -> tuple[FloatImage, FloatImage]:
    """Return a photo and its map: a disc and a post before a wall of two colours, texture, a speck, unknown corners."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    disc, post = np.hypot(x - 40, y - 30) < 16, abs(x - 71) < 5
    photo = np.where((x < 60)[..., None], [0.3, 0.4, 0.3], [0.5, 0.6, 0.7]) + 0.02 * ((x + y) % 2)[..., None]
    photo[disc], photo[post], photo[28:31, 20:23] = (0.8, 0.4, 0.2), (0.1, 0.1, 0.5), 0.9
    values = np.where(disc, 0.8, np.where(post, 0.5, 0.1 + 0.002 * x + 0.001 * y))
    values[:3, :5], values[-2:, -2:] = np.nan, 1.5
    return photo.astype(np.float32), gaussian_filter(values, 0.6).astype(np.float32)


def test_every_tool_and_tone_paints_what_it_painted(regenerate_golden, tmp_path) -> None:
    photo, disparity = edited_scene()
    maps = [apply_edits(photo, disparity, edits) for edits in EDITS]
    assert_sheet("edits", maps, (-0.4, 1.6), 5, regenerate_golden, tmp_path)
    canvas, made = DepthCanvas(photo, disparity), DepthEdits(is_inverted=True)
    for stroke in STROKES[:10]:
        made = replace(made, strokes=(*made.strokes, stroke))
        canvas.apply(made)
    for count in (9, 1, 5, 0, 10):  # undone and done again
        some = replace(made, strokes=made.strokes[:count])
        np.testing.assert_array_equal(canvas.apply(some), apply_edits(photo, disparity, some))


SIZE = 80, 100
WITHOUT = {
    name: replace(ALL_STAGES, **{name: False})
    for name in ("sharpen_soft_edges", "fit_to_blur", "refill_between_surfaces", "label_edge_bands")
}


def edged_scene() -> tuple[FloatImage, FloatImage]:
    """Return a photo and its exact map: a slanted disc, a box and a post before a slanted wall."""
    y, x = np.mgrid[: SIZE[0], : SIZE[1]]
    things = [np.hypot(x - 30, y - 42) < 20, (abs(x - 72) < 14) & (abs(y - 34) < 18), (abs(x - 92) < 3) & (y > 10)]
    photo, values = 0.4 * smooth_texture(*SIZE), 0.3 + 0.003 * y
    for thing, color, value in zip(
        things, ((1, 0.6, 0.3), (0.4, 0.9, 0.5), (0.9, 0.9, 0.2)), (2 + 0.004 * x, 1.2, 2.6)
    ):
        photo[thing] = (smooth_texture(*SIZE, 1) * color)[thing]
        values = np.where(thing, value, values)
    return photo.astype(np.float32), values.astype(np.float32)


def test_refined_edges_are_where_they_were(regenerate_golden, tmp_path) -> None:
    photo, exact = edged_scene()
    soft, softer = (gaussian_filter(exact, sigma, mode="nearest") for sigma in (1.5, 3))
    small = resample_map(gaussian_filter(exact, 1.5)[::2, ::2], image_size(exact))
    grown, unknown = maximum_filter(exact, 5), np.random.default_rng(0).random(exact.shape) < 0.1
    lone = 0.5 * (exact + np.roll(exact, 1, axis=0))
    holed = np.where(unknown, np.float32(np.nan), soft)
    maps = [
        exact, soft, softer, small, grown, lone, holed,
        *(refine(photo, values) for values in (exact, soft, softer, grown, lone, holed)),
        refine(photo, small, is_enlarged=True), refine(photo, grown, unknown),
        refine(photo, lone, abs(lone - exact) > 0.1),
        *(refine(photo, small, stages=stages, is_enlarged=True) for stages in WITHOUT.values()),
        refine(np.full_like(photo, 0.5), soft),
    ]  # fmt: skip
    assert_sheet("refined", maps, (0, 3), 7, regenerate_golden, tmp_path)
    errors = [np.abs(values - exact).mean() for values in maps]
    assert np.array_equal(maps[7], exact)
    assert all(after < 0.7 * before for before, after in zip(errors[1:5], (*errors[8:10], errors[13], errors[10])))


def test_guesses_are_what_they_were(regenerate_golden, tmp_path) -> None:
    pixels = [scene[0][::2, ::2] / np.float32(255) for scene in (drawn(), drawn(has_sky=True))]
    photos = (*pixels, 300 * pixels[1], pixels[0][::-1], edged_scene()[0], pixels[0].repeat(6, 0).repeat(6, 1))
    maps = [guess_depth(photo_of(photo, is_hdr=photo.max() > 1)).values for photo in photos]
    maps = [np.asarray(values[:: len(values) // 80, :: len(values) // 80])[:80, :100] for values in maps]
    assert_sheet("guesses", maps, (-5, 5), 3, regenerate_golden, tmp_path)
