"""NaN, infinity and huge numbers, one pixel and none at the inputs of every public function of the core: finite values
or one clear error. More values where IIBR_TEST_ALL_VALUES is set, as `make fuzz` does. A public function that no table
here names fails a test, so that a new one gets its case.
"""

import dataclasses
import importlib
import math
import os
import pkgutil
import sys
import warnings
from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest

import iibr_core
from benchmarks import plucker
from iibr_core import color
from iibr_core.depth import map_file as depth_maps
from iibr_core.depth import near_end, pictorial_cues, scaling, search, subject
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.edges import blur_fit, edge_band, edge_blur, edge_labels, refine
from iibr_core.depth.embedded import apple, google
from iibr_core.depth.embedded.xmp import Xmp
from iibr_core.depth.estimates import DisparityMap, MetricDepth, RelativeInverseDepth
from iibr_core.depth.multi_view import agreement, estimate_disparity, every_view, matching
from iibr_core.formats.images import oiio_reader, photo
from iibr_core.formats.images.picture_kinds import KINDS
from iibr_core.formats.images.picture_writers import write_picture
from iibr_core.formats.images.xmp_packet import parse_packet
from iibr_core.formats.light_fields import hci, light_field_formats, views
from iibr_core.formats.maps import disparity_file, resample
from iibr_core.generation import cost_model, dense_field, disparity_range, free_views, outer_views, plan
from iibr_core.generation import light_field as generating
from iibr_core.inpainting import diffusion, disparity_by_color, disparity_holes, outpainting
from iibr_core.rendering import (
    ambiguous_rays,
    candidates,
    coherent_cells,
    flying_pixels,
    free_view,
    hypotheses,
    large_views,
    mixed_pixels,
    resampling,
    slope_connectivity,
)
from iibr_core.rendering.flying_pixels import postprocessed_view
from iibr_core.rendering.gloss import environment, geometry, gloss_surface, shading
from iibr_core.rendering.gloss.gloss_settings import Gloss, GlossLight, GlossSurface, of_maps
from iibr_core.rendering.photo_rays import rays_of_photo
from iibr_core.rendering.view_synthesis import ViewSynthesis
from iibr_core.rendering.visibility_weights import entropy, visibility_weights, weights_and_coverage
from iibr_core.runtime.tiling import never
from iibr_core.types import DISPLAY_P3, Camera, Disparity, GridShape, ImageSize, Margins, Photo, ViewOffset, ViewUpdate
from tests.iibr_core import embedded_files as embedded
from tests.iibr_core.scenes import smooth_texture, square_before_wall

WILD = (math.nan, math.inf, -math.inf, 3e38)
MORE_WILD = (-3e38, 1e30, 1e-42, -1e-300, 0.0)
if os.environ.get("IIBR_TEST_ALL_VALUES"):  # `make fuzz` sets it
    WILD += MORE_WILD
SIZE = USUAL_SIZE = ImageSize(12, 14)
GRID = GridShape(3, 3)
OFFSETS = [ViewOffset(0.0, 0.0), ViewOffset(0.0, 1.0)]


def camera(**changes):
    """In the origin, looking ahead."""
    straight = Camera(np.eye(3), np.zeros(3), SIZE, (20.0, 20.0), (6.5, 5.5), "test")
    return dataclasses.replace(straight, **changes)


def image(value):
    """Colours with a wild value in one channel of one pixel, and in a block."""
    pixels = smooth_texture(*SIZE)
    if SIZE != USUAL_SIZE:
        return np.full_like(pixels, value)
    pixels[3, 4, 0] = pixels[7:9, 5:8] = np.float32(value)
    return pixels


def pair(value):
    """Two views of HDR colours, one of them wild."""
    return [image(0.5).astype(np.float16), image(value).astype(np.float16)]


def depths(value):
    """A map of two surfaces with wild values at one place and in a row."""
    if SIZE != USUAL_SIZE:
        return np.full(SIZE, value, np.float32)
    values = np.where(np.arange(SIZE[1]) < 6, 0.5, 2.0).astype(np.float32) * np.ones((SIZE[0], 1), np.float32)
    values[3, 4] = values[9] = np.float32(value)
    return values


def known(value):
    """The same for those who take NaN as "nothing here" and no infinity."""
    return np.where(np.isfinite(depths(value)), depths(value), np.float32(np.nan))


def mixed_between_surfaces():
    """Two surfaces, and a column between them that is of neither."""
    columns = np.repeat(np.float32([0.0, 0.9, 2.0]), [6, 1, USUAL_SIZE[1] - 7])
    return np.tile(columns[: SIZE[1]], (SIZE[0], 1))


def aligned(value):
    """Disparity fitted to a wild estimate in a gap that takes half of the picture."""
    disparity, gap = depths(1.0), np.tile(np.arange(SIZE[1]) >= 5, (SIZE[0], 1))
    diffusion.align_in_gaps(depths(value), disparity, gap, gap)
    return disparity


def scene():
    return scene_of(SIZE)


scene_of = cache(lambda size: square_before_wall(*size))


def rays(value=0.5):
    return rays_of_photo(scene()[0].pixels, known(value), 1.0, 0)


def found(value):
    return candidates.find_candidates(rays(value), ViewOffset(0.5, -1.0), (0, SIZE[0]))


def shown(value):
    """Weights, and what they show, of rays with a wild disparity."""
    weights = visibility_weights(found(value))
    return weights, resampling.resample_colors(rays(value), found(value), weights)


def contest(value):
    return hypotheses.find_ambiguous_rays(rays(value), found(value), *shown(value), (0, SIZE[0]), every=True)


def undecided(value):
    return ambiguous_rays.find_undecided_rays(rays(value), found(value), *shown(value), (0, SIZE[0]))


def in_use(asked):
    """Features, and what of the hypotheses is no leftover memory."""
    return asked.features, asked.disparity[asked.mask]


def decided(value):
    return hypotheses.blend_hypotheses(
        rays(value), contest(value), generating.transformer_for("balanced")(contest(value))
    )


def field(photo_given, values):
    """Plan and views, by the transformer too."""
    disparity = Disparity(values, "wild")
    made = plan.plan_literal(photo_given, disparity, GRID)
    return [made, *generating.generate(photo_given, made.field_disparity(disparity), made, quality="balanced")]


def completed(values):
    disparity = Disparity(values, "wild")
    return list(generating.ray_set(scene()[0], disparity, plan.plan_literal(scene()[0], disparity, GRID))[1])


def dense(values):
    """Views between two, of one disparity."""
    given = [dense_field.GivenView(0, column, view, values) for column, view in enumerate(pair(0.5))]
    return list(dense_field.densify(given, GridShape(1, 2), GridShape(1, 3)))


def rendered(offset, value=0.5):
    with ViewSynthesis(keeps_entropy=True) as synthesis:
        return synthesis.render(rays(value), offset)


def without_flying(value):
    view = rendered(ViewOffset(0.5, 1.0), value)
    return flying_pixels.without_flying_pixels(
        rays(value), ViewOffset(0.5, 1.0), view.colors, view.disparity, view.inpainted
    )


def tile_views(value):
    photo, tile = large_views.LargePhoto(image(0.5), np.nan_to_num(depths(value))), large_views.Part(2, 9, 3, 12)
    with ViewSynthesis() as synthesis:
        return list(large_views.views_of_tile(photo, tile, [ViewOffset(0.5, 1.0)], synthesis))


def shares(value):
    weights = np.full((5, *SIZE), 0.1, np.float32)
    weights[2, 3:4, 4:5] = np.clip(np.float32(value), 0, 0.6)  # to NaN nothing is done
    return weights


def known_of(estimate):
    """What an estimate knows; NaN is what it does not."""
    (values,) = (array for array in plain(estimate) if array.ndim)
    return values[~np.isnan(values)]


def gdepth_xmp(value):
    depth = embedded.picture(np.full(SIZE, 90, np.uint8), "PNG")
    return Xmp((parse_packet(embedded.gdepth_segments(depth, near=value, far=5)[0][len(embedded.STANDARD) :]),))


def map_file(folder, value, name="map"):
    np.save(folder / f"{name}.npy", depths(value))
    return folder / f"{name}.npy"


def photo_file(folder, value, kind=".exr"):
    photo.write_image(folder / f"a{kind}", image(value))
    return folder / f"a{kind}"


def field_on_disk(folder, value):
    with hci.HciWriter(folder / "field", GridShape(1, 1), 10.0, "wild", True) as writer:
        writer.add(ViewUpdate(0, 0, np.zeros((*SIZE, 3), np.uint8), depths(value)))
    return list(views.read_views(light_field_formats.open_light_field(folder / "field"))[1])


def read_back(write, path, pixels):
    """What is found in the file that was written."""
    write(path, pixels)
    return photo.read_photo(path).pixels


def glossy(value):
    """A view of a glossy scene with wild disparity: under a light, and with what its photo reflects moving."""
    given = Disparity(depths(value), "wild")
    lies = geometry.SceneGeometry(20.0, geometry.infinity_of(given))
    dark = GlossLight(color=(0.0, 0.0, 0.0))
    for gloss in (Gloss(), Gloss(photo_shines=True), Gloss(light=dark, photo_shines=True)):
        maps = shading.make_gloss_maps(gloss, image(0.5), given.values, lies, environment=image(value))
        view = ViewUpdate(0, 1, (255 * image(0.5)).astype(np.uint8), given.values)
        yield from shading.shade_views(iter([view]), maps, GRID)


FINITE = {
    "rendering.gloss.environment.prefilter_environment": lambda v, _: environment.prefilter_environment(image(v), 0.5),
    "rendering.gloss.geometry.infinity_of": lambda v, _: geometry.infinity_of(Disparity(depths(v), "wild")),
    "rendering.gloss.gloss_settings.of_maps": lambda v, _: of_maps(Gloss(roughness=v, reflectance=v)) and None,
    "rendering.gloss.shading.shade_views": lambda v, _: list(glossy(v)),
    "rendering.gloss.gloss_surface.surface_mask": lambda v, _: gloss_surface.surface_mask(
        GlossSurface(color=(0.5, 0.5, 0.5)), image(0.5), Disparity(depths(v), "wild").values
    ),
    "rendering.candidates.find_candidates": lambda v, _: [rendered(ViewOffset(v, 0.5)), rendered(ViewOffset(0.5, v))],
    "rendering.hypotheses.blend_hypotheses": lambda v, _: decided(v),
    "rendering.hypotheses.describe_rays": lambda v, _: hypotheses.describe_rays(rays(v), undecided(v)),
    "rendering.hypotheses.find_ambiguous_rays": lambda v, _: in_use(contest(v)),
    "rendering.ambiguous_rays.find_undecided_rays": lambda v, _: undecided(v),
    "rendering.hypotheses.hypothesis_colors": lambda v, _: hypotheses.hypothesis_colors(rays(v), contest(v)),
    "generation.cost_model.estimate_costs": lambda v, _: [
        cost_model.estimate_costs(cost_model.measure_parallax(depths(values), 4.0), GRID) for values in (1.0, v)
    ],
    "generation.cost_model.measure_parallax": lambda v, _: [
        cost_model.measure_parallax(depths(v), 4.0),
        cost_model.measure_parallax(depths(1.0), v),
    ],
    "generation.cost_model.estimate_workload": lambda v, _: cost_model.estimate_workload(
        cost_model.measure_parallax(depths(v), 4.0), GRID, "balanced"
    ),
    "depth.scaling.inverse_metres_over": lambda v, _: np.array(
        scaling.inverse_metres_over(MetricDepth(depths(v)), scaling.disparity_from(MetricDepth(depths(v)), GRID))
        or (0.0, 0.0)
    ),
    "depth.scaling.disparity_from": lambda v, _: [
        known_of(DisparityMap(scaling.disparity_from(kind(depths(v)), GRID)))
        for kind in (RelativeInverseDepth, MetricDepth, DisparityMap)
    ],
    "depth.embedded.apple.heic_estimate": lambda v, _: apple.heic_estimate(
        np.ones(SIZE, np.float32), {"d_min": v, "d_max": 2.0}
    ),
    "inpainting.disparity_by_color.fill_disparity_by_color": lambda v, _: [
        disparity_by_color.fill_disparity_by_color(scene()[0].pixels, known(v)),
        disparity_by_color.fill_disparity_by_color(image(v), known(np.nan)),
    ],
    "inpainting.diffusion.align_in_gaps": lambda v, _: aligned(v),
    "inpainting.disparity_holes.fill_disparity_holes": lambda v, _: disparity_holes.fill_disparity_holes(known(v)),
    "inpainting.disparity_holes.say_filled": lambda v, _: disparity_holes.say_filled("map", v) and None,
    "depth.embedded.google.gdepth_estimate": lambda v, _: known_of(google.gdepth_estimate(gdepth_xmp(v))),
    "depth.multi_view.matching.luma_of": lambda v, _: matching.luma_of(image(v).astype(np.float16)),
    "depth.multi_view.every_view.estimate_all": lambda v, _: every_view.estimate_all(pair(v), OFFSETS, (-1.0, 1.0)),
    "depth.multi_view.agreement.reconcile": lambda v, _: agreement.reconcile(
        pair(v), [np.nan_to_num(depths(v)), depths(1.0)], OFFSETS
    ),
    "depth.multi_view.agreement.find_confirmed": lambda v, _: agreement.find_confirmed(
        [depths(v), depths(1.0)], OFFSETS, 0
    ),
    "depth.multi_view.estimate_disparity.estimate_coarse": lambda v, _: (
        estimate_disparity.estimate_coarse(pair(v), OFFSETS, 0).values
    ),
    "depth.multi_view.estimate_disparity.refine_disparity": lambda v, _: estimate_disparity.refine_disparity(
        pair(v), OFFSETS, 0, np.zeros_like(depths(0.5)), (-1.0, 1.0)
    ),
    "depth.multi_view.estimate_disparity.estimate_disparity": lambda v, _: estimate_disparity.estimate_disparity(
        pair(v), OFFSETS, 0, (-1.0, 1.0)
    ),
    "depth.pictorial_cues.estimate_from_cues": lambda v, _: pictorial_cues.estimate_from_cues(
        Photo(image(v), 20.0, "wild")
    ),
    "depth.edges.edge_blur.extent": lambda v, _: edge_blur.extent(np.nan_to_num(depths(v))),
    "depth.edges.edge_blur.measure_edge_blur": lambda v, _: edge_blur.measure_edge_blur(
        image(0.5), np.nan_to_num(depths(v))
    ),
    "depth.edges.blur_fit.fit_to_blur": lambda v, _: [
        blur_fit.fit_to_blur(image(v), depths(1.0), depths(0.5), 1.0, 0.1),
        blur_fit.fit_to_blur(image(0.5), np.nan_to_num(depths(v)), np.nan_to_num(depths(v)), 1.0, 0.1),
    ],
    "depth.edges.edge_band.resolve_edge_band": lambda v, _: [
        edge_band.resolve_edge_band(scene()[0].pixels, np.nan_to_num(known(v)), 0.5, np.isnan(known(v))),
        edge_band.resolve_edge_band(image(v), mixed_between_surfaces(), 0.5, np.zeros(SIZE, np.bool_)),
    ],
    "depth.edges.edge_labels.step_distance": lambda v, _: edge_labels.step_distance(depths(v), 0.5),
    "depth.edges.edge_labels.label_edges": lambda v, _: [
        edge_labels.label_edges(scene()[0].pixels, np.nan_to_num(known(v)), np.isnan(known(v)), 0.5, never),
        edge_labels.label_edges(image(v), mixed_between_surfaces(), np.ones(SIZE, np.bool_), 0.5, never),
    ],
    "depth.edges.refine.refine": lambda v, _: [
        refine.refine(image(0.5), depths(v)),
        refine.refine(image(0.5), depths(1.0), strength=v),
    ],
    "formats.maps.resample.resample_map": lambda v, _: known_of(
        DisparityMap(resample.resample_map(known(v), ImageSize(7, 9)))
    ),
    "formats.maps.resample.resample_surfaces": lambda v, _: known_of(
        DisparityMap(resample.resample_surfaces(known(v), ImageSize(7, 9)))
    ),
    "formats.maps.disparity_file.read_disparity": lambda v, to: [
        disparity_file.read_disparity(map_file(to, v), SIZE),
        disparity_file.read_disparity(map_file(to, v), ImageSize(7, 8)),
    ],
    "depth.search.open_with_depth": lambda v, to: [
        search.open_with_depth(photo_file(to, v)),
        search.open_with_depth(photo_file(to, 1.0), DepthChoice(file=str(map_file(to, v)))),
    ],
    "depth.search.sketch_depth": lambda v, to: [
        search.sketch_depth(to, photo.read_photo(photo_file(to, 1.0)), DepthChoice(file=str(map_file(to, v)))),
    ],
    "depth.search.disparity_of_file": lambda v, to: [
        search.disparity_of_file(map_file(to, v, "map_depth"), photo.read_photo(photo_file(to, 1.0)), DepthChoice()),
    ],
    "depth.map_file.depth_from_file": lambda v, to: known_of(
        depth_maps.depth_from_file(map_file(to, v), photo.read_photo(photo_file(to, 1.0)), DepthChoice()).estimate
    ),
    "depth.near_end.near_evidence": lambda v, _: [near_end.near_evidence(image(v), known(v))],
    "depth.near_end.is_better_turned": lambda v, _: [
        float(near_end.is_better_turned(image(v), known(v), known(v)[::-1, ::-1]))
    ],
    "formats.light_fields.views.read_views": lambda v, to: field_on_disk(to, v),
    "formats.images.photo.read_photo": lambda v, to: photo.read_photo(photo_file(to, v), max_pixels=90),
    "formats.images.photo.write_image": lambda v, to: [
        photo.read_photo(photo_file(to, v, kind)) for kind in (".png", ".exr")
    ],
    "generation.light_field.generate": lambda v, _: [
        field(scene()[0], depths(v)),
        field(Photo(image(v), 9.0, "wild"), depths(1.0)),
    ],
    "generation.outer_views.outpainting_margins": lambda v, _: [
        outer_views.outpainting_margins(depths(v), [ViewOffset(1.0, -1.0)]),
        outer_views.outpainting_margins(depths(1.0), [ViewOffset(v, 1.0)]),
    ],
    "generation.dense_field.densify": lambda v, _: dense(depths(v)),
    "generation.free_views.inverse_depth_of": lambda v, _: [
        free_views.inverse_depth_of(Disparity(depths(v), "test").values, known) for known in (None, (1.0, 9.0))
    ],
    "generation.free_views.reach_of": lambda v, _: free_views.reach_of(
        camera(), [camera(), camera(position=np.array([v, 0.0, 0.1]))], (1.0, 3.0)
    ),
    "generation.free_views.FreeViews": lambda v, _: [
        free_views.FreeViews(image(0.5), near, camera(), [seen]).view(seen)
        for near in (
            np.full(SIZE, 0.5, np.float32),
            free_views.inverse_depth_of(Disparity(depths(v), "test").values, None),
        )
        for seen in (camera(position=np.array([0.0, 0.1, v])), camera(focal_px=(v, v)), camera(centre_px=(v, 1.0)))
    ],
    "rendering.free_view.target_from_photo": lambda v, _: free_view.target_from_photo(
        camera(), camera(position=np.array([0.0, v, 0.1]), focal_px=(v, 20.0)), 10.0
    ),
    "inpainting.outpainting.outpaint": lambda v, _: outpainting.outpaint(
        np.maximum(np.nan_to_num(image(v)), 0), known(v), Margins(1, 2, 3, 2)
    )[0],
    "generation.light_field.ray_set": lambda v, _: completed(depths(v)),
    "geometry.line_of_pixel": lambda v, _: plucker.line_of_pixel([v], [0.0], ViewOffset(0.0, 1.0)),
    "rendering.resampling.heaviest_candidate": lambda v, _: resampling.heaviest_candidate(
        rays(v), found(v), shown(v)[0]
    ),
    "rendering.resampling.resample_colors": lambda v, _: shown(v)[1],
    "rendering.mixed_pixels.move_with_foreground": lambda v, _: mixed_pixels.move_with_foreground(known(v), (0.1, 1.0))[
        np.isfinite(known(v))
    ],
    "rendering.mixed_pixels.split_mixed_pixels": lambda v, _: mixed_pixels.split_mixed_pixels(
        image(0.5), known(v), 0.5
    )[:2],
    "rendering.flying_pixels.measure_detail": lambda v, _: flying_pixels.measure_detail(image(v)),
    "rendering.flying_pixels.without_flying_pixels": lambda v, _: without_flying(v),
    "rendering.large_views.views_of_tile": lambda v, _: tile_views(v),
    "rendering.visibility_weights.entropy": lambda v, _: entropy(np.nan_to_num(shares(v))),
    "generation.plan.plan_for_viewing": lambda v, _: [
        plan.plan_for_viewing(scene()[0], Disparity(depths(v), "wild")),
        plan.plan_for_viewing(*scene(), plan.PlanOverrides(depth_strength=v)),
        plan.plan_for_viewing(*scene(), plan.PlanOverrides(focus_disparity=v)).field_disparity(scene()[1]),
    ],
    "generation.disparity_range.measure_disparity_range": lambda v, _: disparity_range.measure_disparity_range(
        depths(v)
    ),
    "generation.disparity_range.rounding_step": lambda v, _: disparity_range.rounding_step(depths(v)),
    "generation.plan.plan_literal": lambda v, _: plan.plan_literal(scene()[0], Disparity(depths(v), "wild"), GRID),
    "rendering.coherent_cells.find_coherent_cells": lambda v, _: [
        coherent_cells.find_coherent_cells(rays(v), ViewOffset(0.5, -1.0), (0, SIZE[0])),
        coherent_cells.find_coherent_cells(rays(1.0), ViewOffset(v, 0.5), (0, SIZE[0])),
    ],
    "rendering.coherent_cells.land_incoherent": lambda v, _: [
        coherent_cells.land_incoherent(rays(v).cells, 0, t, 0.5, (0, 4), np.eye(1, 4, dtype=np.bool_)) for t in (0.5, v)
    ],
    "rendering.slope_connectivity.connect_rays": lambda v, _: slope_connectivity.connected_either_way(
        slope_connectivity.connect_rays(depths(v), 0.5)
    ),
    "rendering.slope_connectivity.connected_either_way": lambda v, _: slope_connectivity.connected_either_way(
        slope_connectivity.connect_rays(depths(v), 0.5)
    ),
    "depth.subject.subject_disparity": lambda v, _: subject.subject_disparity(depths(v)),
    "synthesis.ViewSynthesis.render": lambda v, _: rendered(ViewOffset(0.5, -1.0), v),
    "rendering.photo_rays.rays_of_photo": lambda v, _: rendered(ViewOffset(0.0, 2.0), v),
    "rendering.flying_pixels.postprocessed_view": lambda v, _: postprocessed_view(
        rays(v), ViewOffset(0.5, 1.0), rendered(ViewOffset(0.5, 1.0), v)
    ),
    "types.Disparity": lambda v, _: Disparity(depths(v), "wild"),
    "formats.images.picture_writers.write_picture": lambda v, to: [
        read_back(write_picture, to / f"a{ending}", image(v)) for ending in KINDS
    ],
    "color.photo_in_srgb": lambda v, _: (
        color.photo_in_srgb(Photo(image(v), 20.0, "wild", color_space=DISPLAY_P3)).pixels
    ),
    "types.Photo": lambda v, _: Photo(image(v), 20.0, "wild"),
    "rendering.visibility_weights.visibility_weights": lambda v, _: visibility_weights(found(v)),
    "rendering.visibility_weights.weights_and_coverage": lambda v, _: weights_and_coverage(found(v)),
}
"""What comes back is finite, or InputError or another ValueError says why not."""

NEVER_EMPTY = {
    "depth.multi_view.estimate_disparity.estimate_coarse",
    "depth.pictorial_cues.estimate_from_cues",
    "generation.free_views.FreeViews",
    "generation.free_views.inverse_depth_of",
    "generation.free_views.reach_of",
    "generation.outer_views.outpainting_margins",
    "generation.plan.plan_for_viewing",
    "generation.disparity_range.measure_disparity_range",
    "generation.disparity_range.rounding_step",
    "inpainting.outpainting.outpaint",
    "rendering.free_view.target_from_photo",
}
"""Of photos, maps and views that were read: every reader refuses those without pixels."""

ELEMENTWISE = {
    "color.encoded_from_stored": lambda x: color.encoded_from_stored(x.astype(np.float16)),
    "color.linear_from_srgb": color.linear_from_srgb,
    "color.srgb_from_linear": color.srgb_from_linear,
    "geometry.line_of": lambda x: plucker.line_of(np.stack([x, x, x], -1), np.ones((len(x), 3))),
    "formats.images.oiio_reader.upright": lambda x: oiio_reader.upright(x[None], 2)[0, ::-1],
}
"""One wild element changes no other."""

GLOSSY = "of a field's disparity and sound settings, as `shade_views` is given them"
FINITE_BY_CONTRACT = {
    "rendering.aperture_shape.opening": "of Optics, see scenes.lens_limits.is_finite",
    "rendering.aperture_shape.openness": "of Optics, see scenes.lens_limits.is_finite",
    "rendering.optics.within": "says the limits of a field",
    "rendering.gloss.geometry.SceneGeometry": GLOSSY,
    "rendering.gloss.light_search.find_light": GLOSSY,
    "rendering.gloss.microfacet.lobe_shares": GLOSSY,
    "rendering.gloss.microfacet.reflected_share": GLOSSY,
    "rendering.gloss.reflection.reflection_disparity": GLOSSY,
    "rendering.gloss.separation.eroded": GLOSSY,
    "rendering.gloss.separation.harmonics": GLOSSY,
    "rendering.gloss.separation.reflected_light": GLOSSY,
    "rendering.gloss.separation.separate_light": GLOSSY,
    "rendering.gloss.gloss_settings.require_sound": "refuses what is not finite, tests/iibr_core/rendering/gloss",
    "rendering.gloss.shading.make_gloss_maps": GLOSSY,
    "rendering.gloss.shading.shade": GLOSSY,
    "rendering.gloss.gloss_surface.fit_normals": GLOSSY,
    "color.convert": "of a Photo, see color.photo_in_srgb",
    "color.primaries_matrix": "of colour spaces that the reader of profiles checked",
    "color.bytes_from_encoded": "of photos and of views, as for `stored_from_encoded`",
    "generation.stored_views.stored_colors": "of rendered views only, as they are stored",
    "generation.stored_views.encode_for_storage": "of rendered views only, as for `stored_from_encoded`",
    "color.stored_from_encoded": "made for every view; Photo and the synthesis see to it",
    "geometry.distance_between": "of lines that `line_of` made",
    "geometry.offset_of_line": "lines along the plane give infinity or NaN, as it says",
    "geometry.pixel_of_line": "lines along the plane give infinity or NaN, as it says",
    "stages.stages_without": "names only",
    "surfaces.step_of": "of constants and of view offsets, which are finite",
    "inpainting.background.fill_background": "of rendered views only",
    "inpainting.background.continue_farthest": "of rendered views only",
    "inpainting.background.goes_on_in_front": "of rendered views only",
    "formats.poses.central_camera": "of Cameras, which refuse what is not finite",
    "generation.free_views.fitted_cameras": "of Cameras, which refuse what is not finite",
    "generation.free_views.steered": "of a Camera; the window keeps the rest within limits",
    "generation.free_views.depths_of": "of what `inverse_depth_of` gave",
    "rendering.free_view.disparity_space": "of a Camera",
    "rendering.landed_squares.rows_landed_on": "as `render_free_view` calls it",
    "rendering.landed_squares.draw_rays": "as `render_free_view` calls it",
    "rendering.free_view.render_free_view": "as `generation.free_views.FreeViews` calls it",
    "inpainting.diffusion.DiffusionInpainter": "of rendered views only; what a model paints is made finite",
    "inpainting.disparity_by_color.nearness": "of constants only",
    "inpainting.nearest_known.nearest_known": "of masks only",
    "inpainting.patch_synthesis.copy_patches": "of rendered views only",
    "depth.multi_view.matching.matching_views": "of lumas that `luma_of` made finite",
    "depth.multi_view.matching.sweep": "of `matching_views`, whose lumas `luma_of` made finite",
    "depth.multi_view.semi_global.choose_disparity": "of costs in 8 bits",
    "depth.multi_view.gradient_refinement.refine_by_gradients": "of `matching_views`, within a sweep's disparities",
    "depth.multi_view.guided_filter.GuidedFilter": "of what `luma_of` made finite",
    "generation.carried_disparity.carry_disparity": "of a Photo and a Disparity",
    "depth.estimators.estimate_depth.estimate_with": "of a Photo; what a model gives is cleaned by `disparity_from`",
    "depth.estimators.transformers_models.input_for": "sizes only",
    "depth.estimators.transformers_models.run_transformers": "of a Photo; `estimate_with` refuses non-finite results",
    "depth.estimators.onnx_models.input_for": "sizes only",
    "depth.estimators.onnx_models.run_onnx": "of a Photo; `estimate_with` refuses non-finite results",
    "depth.estimators.preparation.affordable_pixels": "sizes only",
    "depth.estimators.preparation.input_size": "sizes only",
    "depth.estimators.preparation.network_input": "of a Photo, which is finite",
    "formats.images.photo.read_picture": "`read_photo` reads so",
    "formats.images.photo.encoded_colors": "`read_views` reads so",
    "formats.images.hdr.pq_light": "of encoded values 0..1",
    "formats.images.hdr.hlg_scene_light": "of encoded values 0..1",
    "formats.images.hdr.hlg_display_light": "of light that `ColorProfile` looked up",
    "formats.images.hdr.tone_map": "of light that `ColorProfile` looked up",
    "formats.images.picture_source.part_of": "keeps what it gets, tests/iibr_core/formats/test_view_files.py",
    "depth.stereo_pair.estimate_from_pair": "of pictures that `read_photo` made finite",
    "formats.images.photo.focal_px_from_fov": "of angles that options check",
    "formats.images.photo.size_within": "sizes only",
    "formats.maps.pfm.write_pfm": "keeps every bit pattern, tests/core/test_pfm.py",
    "formats.maps.writer.write_map": "keeps what it gets; maps of the viewer are finite",
    "formats.light_fields.multi_view_scene.middle": "of viewpoints that the readers of layouts checked",
    "formats.light_fields.multi_view_scene.nearest_view": "of viewpoints that the readers of layouts checked",
    "formats.light_fields.multi_view_scene.seen_from": "of viewpoints that the readers of layouts checked",
    "formats.weights.write_tensors": "training stops before, tests/iibr_core/training",
    "formats.weights.save_weights": "training stops before, tests/iibr_core/training",
    "ray_transformer.inference.TrainedWeights": "huge features: rendering/test_ambiguous_rays.py, test_hard_cases.py",
    "ray_transformer.model.RayTransformer": "huge features: rendering/test_ambiguous_rays.py",
    "rendering.resized_light.mean_of_areas": "of light that was drawn",
    "rendering.lens.LensSum": "optics that the interface checked; far cameras: rendering/test_lens.py",
    "rendering.aperture_sampling.grid_weights": "points of an aperture that the interface checked",
    "rendering.aperture_sampling.aperture_points": "an aperture that the interface or the window checked",
    "rendering.aperture_sampling.open_area": "an aperture that the interface or the window checked",
    "rendering.aperture_sampling.fractions": "counts",
    "rendering.ray_set.RaySet": "NaN is no surface; infinity is refused by Disparity",
    "depth.estimators.estimate_cache.store": "an Estimate, in which NaN is unknown",
    "depth.estimators.package_calls.prepare_by": "of a Photo; the package's NaN is unknown",
    "depth.estimators.package_calls.positive": "what is not finite becomes unknown",
}
"""Who promises the numbers, or where the case is tested."""

READS_OR_TELLS = {
    "depth.embedded.apple": "appended_estimate",
    "depth.estimates": "values_of inverted",
    "depth.embedded.embedded_depth": "read_embedded embedded_in_jpeg jpeg_bytes leia_estimate",
    "depth.estimators.estimate_cache": "cache_folder key_of load store_seconds seconds_of",
    "depth.embedded.google": "all_in_focus dynamic_depth_estimate range_notes",
    "depth.estimators.config": "folder_of safetensors_in mentions read_config read_preparation",
    "depth.estimators.catalog": "known_model family_of model_to_use model_here state_of fetch is_meaning_known "
    "register",
    "depth.estimators.download": "verified_folder download require_unchanged",
    "depth.estimators.hub": "HubRefusal hub_cache read_json hub_answer chunks_of failures_told",
    "depth.estimators.onnx_models": "weights_in",
    "depth.estimators.onnx_file": "PictureInput open_session picture_input depth_output external_files",
    "depth.estimators.own_models": "own_models_folder list_own_models own_name copy_own_model",
    "depth.estimators.words": "words_about",
    "depth.multi_view.estimate_disparity": "map_work sweep_bytes sweep_steps",
    "depth.multi_view.every_view": "matched_views",
    "depth.multi_view.matching": "choose_views",
    "depth.embedded.images": "picture_file decode_map",
    "depth.embedded.unread": "unread_parts",
    "depth.embedded.samsung": "samsung_estimate",
    "depth.embedded.trailers": "huawei_estimate second_picture_estimate appended_pictures grey_size",
    "depth.near_end": "zeros_are_depth",
    "depth.edges.map_alignment": "lies_at_corners",
    "formats.maps.resample": "has_soft_edges is_enlarged_smoothly without_repeats",
    "depth.map_file": "DepthFromFile depth_from_channel depth_beside_picture depth_of_picture depth_of_model "
    "turned_estimate",
    "formats.images.rgbd": "rgbd_parts",
    "formats.images.exr_depth": "read_depth_channel",
    "depth.pictorial_cues": "box_filter resize_picture",
    "formats.maps.color_maps": "values_of_colors",
    "formats.maps.map_text": "MapText text_of text_from",
    "formats.maps.disparity_file": "has_shape_of require_scale scaled_disparity map_at_size filling_note "
    "resampling_note",
    "depth.sidecar": "find_sidecar sidecars_of map_to_read flat_disparity",
    "depth.embedded.xmp": "is_jpeg jpeg_layout number_in xmp_of",
    "formats.animations": "even_size require_video_size write_animation",
    "formats.cameras": "FieldCameras write_llff write_nerfstudio write_colmap spread infinity_of",
    "formats.ply": "write_points write_splats write_ply",
    "formats.images.spatial_photo": "write_spatial_photo",
    "formats.quilts": "Quilt quilt_named quilt_for lay_out tagged",
    "formats.stereo": "anaglyph",
    "formats.files": "reason_of shown_name printable status_of is_file is_folder ordinary_file file_within "
    "stays_within entries_of require_file open_binary read_text refuse_bomb",
    "formats.outputs": "AlreadyThereError check_output check_output_folder require_files_in make_folder "
    "write_file UnfinishedFolder release_place require_own_folder open_to_append",
    "formats.places": "real_place require_folder_for require_writable require_no_dangling_link require_no_link "
    "require_outside is_within places_of reads_file",
    "formats.unfinished": "Claims remove_leftovers remove_around make_temporary lock_of unlock",
    "formats.poses": "read_poses read_llff_poses",
    "formats.light_fields.numbered_grid": "read_numbered_grid NumberedGridWriter",
    "formats.light_fields.hci": "read_hci HciWriter",
    "formats.light_fields.folder_writer": "FolderWriter",
    "formats.light_fields.whole_field": "EslfWriter ExrWriter",
    "formats.images.exr_parts": "ExrPart write_exr_parts",
    "formats.images.downsampling": "downsampled_linear finite_pixels linear_light OddValues Rows",
    "formats.images.color_profile": "ColorProfile UnusableProfileError color_profile color_profile_of color_space_of "
    "profile_of_codes codes_named",
    "formats.images.color_primaries": "space_of_number space_of_chromaticities space_of_matrix",
    "formats.images.alike_halves": "is_one_scene",
    "formats.images.file_kinds": "FileKind raw_kind unreadable_kind",
    "formats.images.file_notes": "file_notes",
    "formats.images.iso_boxes": "boxes box color_codes_of with_auxiliary_shown",
    "formats.images.jpeg_segments": "jpeg_segments",
    "formats.images.jps": "JpsDescriptor read_jps_descriptor",
    "formats.images.small_picture": "small_picture small_decoded_picture",
    "formats.images.avif": "is_avif read_avif avif_size avif_depth_file avif_orientation",
    "formats.images.heic": "is_heic read_heic heic_size heic_pair read_heic_depth heic_orientation heic_auxiliaries"
    " describe",
    "formats.images.lfp": "is_lfp open_lfp lfp_size read_lfp read_lfp_depth",
    "formats.images.lif": "read_lif open_lif read_lif_picture lif_picture_size lif_bytes",
    "formats.images.mpo": "is_jpeg is_stereo_mpo read_mpo_picture mpo_picture_size",
    "formats.images.picture_source": "is_read_whole PicturePart source_size read_source",
    "formats.images.pillow_reader": "open_with_pillow raster_of",
    "formats.images.side_by_side": "side_by_side_pair stated_pair stated_layout own_picture require_developed",
    "formats.light_fields.lenslet_image": "read_lenslet_image",
    "formats.light_fields.quilt": "read_quilt",
    "formats.light_fields.stanford_1996": "read_stanford_1996",
    "formats.light_fields.stereo_file": "read_stereo_file",
    "formats.light_fields.llff": "read_llff",
    "formats.light_fields.middlebury": "read_middlebury",
    "formats.light_fields.parameters": "read_parameters write_parameters stated_grid stated_focal_px stated_range_px",
    "formats.light_fields.light_field_formats": "LightFieldWriter WriterFactory is_light_field find_light_field "
    "open_light_field is_view_file writer_for",
    "formats.light_fields.multi_view_scene": "pictures_in common_size on_grid maps_in first_map numbers_in",
    "formats.light_fields.view_grid": "view_folder candidate_views set_view require_fitting missing_view grid_scene",
    "formats.light_fields.views": "grid_of read_stored_view disparity_range step_length",
    "formats.maps.npy": "read_array read_array_header npz_member",
    "formats.maps.pfm": "read_pfm read_pfm_size",
    "formats.maps.reader": "read_map read_map_file read_map_picture read_map_header MapHeader MapFile",
    "formats.images.oiio_writer": "write_image_file encode_image_file",
    "formats.images.icc_profile": "icc_profile",
    "formats.images.caption": "read_caption",
    "formats.images.metadata": "PictureMetadata read_metadata camera_facts exif_for xmp_for text_in_xmp unpack_text",
    "formats.images.picture_kinds": "PictureKind PictureFormat picture_kind require_picture_format is_float",
    "formats.images.picture_writers": "write_png write_exr write_jpeg write_webp write_avif write_tiff",
    "formats.images.xmp_packet": "value_in parse_packet",
    "formats.images.oiio_names": "oiio_name",
    "formats.images.oiio_reader": "read_size read_orientation read_raster PictureRows require_whole_png text_attribute "
    "complaint_of full_scale",
    "formats.images.header": "PhotoHeader read_photo_header",
    "formats.images.settings_text": "settings_text_in",
    "formats.images.thumbnail": "read_thumbnail",
    "formats.light_fields.stanford": "read_stanford StanfordWriter",
    "formats.weights": "load_weights read_weights read_tensors require_shapes",
    "generation.light_field": "transformer_for nearest_first",
    "generation.stored_views": "StoredViews",
    "generation.dense_field": "GivenView require_steps",
    "generation.given_views": "read_given_views DenseFieldWork",
    "generation.field_work": "FieldWork",
    "rendering.coherent_cells": "cells_in",
    "runtime.time_left": "TimeLeft about_left",
    "generation.view_maker": "ViewMaker quantise_as_stored",
    "generation.outer_views": "outer_views outer_views_for outer_views_of_grid farthest_views",
    "generation.update_loop": "render_outer_views complete_ray_set",
    "inpainting.background": "background_inpainter",
    "inpainting.nearest_known": "AroundHoles",
    "inpainting.inpainter": "Inpainter",
    "inpainting.diffusion": "diffusion_inpainter large_gaps",
    "inpainting.registry": "load_inpainter require_inpainter",
    "runtime.allocator": "limit_arenas give_back_memory",
    "runtime.machine": "core_count memory_bytes usual_budget_bytes cgroup_memory_bytes cgroup_cores own_limit_bytes",
    "runtime.compiling": "watch_compiling note_kernel",
    "runtime.kernel_cache": "KernelCache sources_hash fill",
    "runtime.offers": "offered_by",
    "runtime.resources": "resource_folder",
    "runtime.shader_sources": "FlatSource ShaderError flatten",
    "runtime.extras": "is_installed require_extra said_by",
    "generation.memory_model": "Budget budget_of require_process process_bytes view_bytes whole_bytes pixels_within "
    "largest_side require_reading require_decoding require_map require_views require_field require_picture "
    "require_dense_field "
    "require_own_size require_free_views require_matching mebibytes Making making_bytes own_size_bytes bytes_of "
    "undecided_bytes",
    "generation.plan_reasons": "grid_reason wild_reasons edge_reasons quality_reason",
    "generation.cost_model": "CostEstimate CostEstimates Workload largest_offset",
    "runtime.tiling": "Cancelled never raise_if_stopped in_pieces in_bands pieces_of",
    "depth.embedded.picture": "photo_in_focus rotate_estimate",
    "depth.search": "ask_model estimator_of read_shown_photo",
    "rendering.ambiguous_rays": "UndecidedRays",
    "rendering.candidates": "Candidates",
    "rendering.large_views": "Part tiles_of whole",
    "rendering.ray_cells": "Cells over_cells",
    "rendering.ray_set": "RayArrays",
    "rendering.renderer": "Renderer",
    "rendering.resampling": "ShownRays",
    "rendering.view_synthesis": "ViewSynthesis",
    "types": "Camera ColorSpace ViewOffset GridShape ImageSize Margins image_size ignore_progress InputError",
}
"""Files, bytes and names go in: hostile ones are fuzzed (`python -m benchmarks.fuzz`) and tested beside each reader."""

ELSEWHERE = ("training.", "evaluation.", "interface.", "scenes.", "exports.", "runtime.jit.", "depth.editing.")
"""Packages whose own tests feed them such values: drawn scenes, figures, what users call, use cases, pieces of kernels,
edits.
"""


def plain(result):
    """Every array and number in a result, whatever it is packed in."""
    if isinstance(result, np.ndarray | np.generic | float | int):
        yield np.asarray(result)
    elif dataclasses.is_dataclass(result):
        yield from plain([getattr(result, item.name) for item in dataclasses.fields(result)])
    elif isinstance(result, list | tuple | Iterator):
        for item in result:
            yield from plain(item)


@pytest.mark.parametrize("value", WILD, ids=str)
@pytest.mark.parametrize("name", sorted(FINITE))
def test_finite_or_a_clear_error(name, value, tmp_path):
    require_finite_or_clear(name, value, tmp_path)


@pytest.mark.parametrize("name", sorted(FINITE))
def test_one_pixel_gives_finite_values_or_a_clear_error(name, tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "SIZE", ImageSize(1, 1))
    for value in (0.5, math.nan):
        require_finite_or_clear(name, value, tmp_path)


@pytest.mark.parametrize("name", sorted({*FINITE} - NEVER_EMPTY))
def test_no_pixels_give_finite_values_or_a_clear_error(name, tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "SIZE", ImageSize(0, 0))
    require_finite_or_clear(name, 0.5, tmp_path)


def require_finite_or_clear(name, value, tmp_path):
    complaint, result = None, None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)
            result = FINITE[name](value, tmp_path)
    except ValueError as error:
        complaint = str(error)
    assert complaint is None or (complaint and "\n" not in complaint)
    assert all(np.isfinite(array).all() for array in plain(result) if array.dtype.kind == "f")


@pytest.mark.parametrize("value", WILD, ids=str)
@pytest.mark.parametrize("name", sorted(ELEMENTWISE))
def test_one_wild_element_changes_no_other(name, value):
    elements = np.linspace(0.1, 0.9, 9)
    clean = ELEMENTWISE[name](elements)
    elements[4] = value
    with np.errstate(all="ignore"):
        result = ELEMENTWISE[name](elements)
    others = np.arange(9) != 4
    assert np.array_equal(result[others], clean[others])


def public_names():
    """module.name of every function and of every class that does more than hold values."""
    for found_module in pkgutil.walk_packages(iibr_core.__path__, "iibr_core."):
        module = importlib.import_module(found_module.name)
        for name, value in vars(module).items():
            is_own = getattr(value, "__module__", None) == module.__name__ and not name.startswith("_")
            if is_own and callable(value) and not dataclasses.is_dataclass(value):
                yield f"{found_module.name.removeprefix('iibr_core.')}.{name}", value


def test_every_public_function_has_its_case():
    told = {f"{module}.{name}" for module, names in READS_OR_TELLS.items() for name in names.split()}
    tabled = {*FINITE, *ELEMENTWISE, *FINITE_BY_CONTRACT, *told}
    kernels = type(candidates._land_rays)  # pieces of hot loops, called by kernels only
    missing = {
        name
        for name, value in public_names()
        if name not in tabled and not name.startswith(ELSEWHERE) and not isinstance(value, kernels)
    }
    assert not missing, "give it a case in one of the tables"
