"""NaN, infinity, denormal and huge numbers at the inputs of every public function of the core: finite values or one
clear error. A public function that no table here names fails a test, so that a new one gets its case.
"""

import dataclasses
import importlib
import math
import pkgutil
import warnings
from collections.abc import Iterator
from functools import cache

import numpy as np
import pytest

import iibr_core
from iibr_core import (
    candidates,
    color,
    contested,
    cost,
    geometry,
    lookup,
    mixed_pixels,
    occlusion,
    plan,
    smooth_cells,
    surroundings,
)
from iibr_core import generate as generating
from iibr_core.depth import align, apple, fill, gdepth, offline, refine, resample, source
from iibr_core.depth.estimate import DisparityMap, MetricDepth, RelativeInverseDepth
from iibr_core.depth.origin import DepthChoice
from iibr_core.depth.xmp import Xmp, parsed
from iibr_core.formats import disparity_file, hci, photo
from iibr_core.synthesis import ViewSynthesis, rays_of_photo
from iibr_core.types import Disparity, GridShape, Photo, ViewOffset, ViewUpdate
from iibr_core.weights import closed_form_weights
from tests.core import embedded_files as embedded
from tests.core.scenes import smooth_texture, square_before_wall

WILD = (math.nan, math.inf, -math.inf, 3e38, -3e38, 1e30, 1e-42, -1e-300, 0.0)
SIZE = 12, 14
GRID = GridShape(3, 3)


def image(value):
    """Colours with a wild value in one channel of one pixel, and in a block."""
    pixels = smooth_texture(*SIZE)
    pixels[3, 4, 0] = pixels[7:9, 5:8] = np.float32(value)
    return pixels


def depths(value):
    """A map of two surfaces with wild values at one place and in a row."""
    values = np.where(np.arange(SIZE[1]) < 6, 0.5, 2.0).astype(np.float32) * np.ones((SIZE[0], 1), np.float32)
    values[3, 4] = values[9] = np.float32(value)
    return values


def known(value):
    """The same for those who take NaN as "nothing here" and no infinity."""
    return np.where(np.isfinite(depths(value)), depths(value), np.float32(np.nan))


@cache
def scene():
    return square_before_wall(*SIZE)


def rays(value=0.5):
    return rays_of_photo(scene()[0].pixels, known(value), 1.0, 0)


def found(value):
    return candidates.find_candidates(rays(value), ViewOffset(0.5, -1.0), (0, SIZE[0]))


def shown(value):
    """Weights, and what they show, of rays with a wild disparity."""
    weights = closed_form_weights(found(value))
    return weights, lookup.look_up_colors(rays(value), found(value), weights)


def contest(value):
    weights, (_, disparity, origin) = shown(value)
    return contested.find_contested(rays(value), found(value), weights, (disparity, origin), (0, SIZE[0]), every=True)


def in_use(asked):
    """Features, and what of the hypotheses is no leftover memory."""
    return asked.features, asked.disparity[asked.mask]


def decided(value):
    return contested.decide(rays(value), contest(value), generating.transformer_for("exact")(contest(value)))


def field(photo_given, values):
    """Plan and views, by the transformer too."""
    disparity = Disparity(values, "wild")
    made = plan.plan_literal(photo_given, disparity, GRID)
    return [made, *generating.generate(photo_given, made.field_disparity(disparity), made, quality="exact")]


def completed(values):
    disparity = Disparity(values, "wild")
    return list(generating.ray_set(scene()[0], disparity, plan.plan_literal(scene()[0], disparity, GRID))[1])


def rendered(offset, value=0.5):
    with ViewSynthesis(keeps_entropy=True) as synthesis:
        return synthesis.render(rays(value), offset)


def shares(value):
    weights = np.full((5, *SIZE), 0.1, np.float32)
    weights[2, 3, 4] = np.clip(np.float32(value), 0, 0.6)  # to NaN nothing is done
    return weights


def known_of(estimate):
    """What an estimate knows; NaN is what it does not."""
    (values,) = (array for array in plain(estimate) if array.ndim)
    return values[~np.isnan(values)]


def gdepth_xmp(value):
    depth = embedded.picture(np.full(SIZE, 90, np.uint8), "PNG")
    return Xmp((parsed(embedded.gdepth_segments(depth, near=value, far=5)[0][len(embedded.STANDARD) :]),))


def map_file(folder, value, name="map"):
    np.save(folder / f"{name}.npy", depths(value))
    return folder / f"{name}.npy"


def photo_file(folder, value, kind=".exr"):
    photo.write_image(folder / f"a{kind}", image(value))
    return folder / f"a{kind}"


def field_on_disk(folder, value):
    with hci.HciWriter(folder / "field", GridShape(1, 1), 10.0, "wild", True) as writer:
        writer.add(ViewUpdate(0, 0, np.zeros((*SIZE, 3), np.uint8), depths(value)))
    header, views = hci.read_light_field(folder / "field")
    return header, list(views)


FINITE = {
    "candidates.find_candidates": lambda v, _: [rendered(ViewOffset(v, 0.5)), rendered(ViewOffset(0.5, v))],
    "contested.decide": lambda v, _: decided(v),
    "contested.find_contested": lambda v, _: in_use(contest(v)),
    "contested.votes": lambda v, _: contested.votes(rays(v), contest(v)),
    "cost.needs_of": lambda v, _: [cost.needs_of(cost.relief_of(depths(values), 4.0), GRID) for values in (1.0, v)],
    "cost.relief_of": lambda v, _: [cost.relief_of(depths(v), 4.0), cost.relief_of(depths(1.0), v)],
    "cost.work_of": lambda v, _: cost.work_of(cost.relief_of(depths(v), 4.0), GRID, "exact"),
    "depth.align.disparity_from": lambda v, _: [
        known_of(DisparityMap(align.disparity_from(kind(depths(v)), GRID)))
        for kind in (RelativeInverseDepth, MetricDepth, DisparityMap)
    ],
    "depth.apple.heic_estimate": lambda v, _: apple.heic_estimate(
        np.ones(SIZE, np.float32), {"d_min": v, "d_max": 2.0}
    ),
    "depth.fill.fill_from_background": lambda v, _: fill.fill_from_background(known(v)),
    "depth.gdepth.gdepth_estimate": lambda v, _: known_of(gdepth.gdepth_estimate(gdepth_xmp(v))),
    "depth.offline.estimate_offline": lambda v, _: offline.estimate_offline(Photo(image(v), 20.0, "wild")),
    "depth.refine.edge_blur_px": lambda v, _: refine.edge_blur_px(np.nan_to_num(depths(v))),
    "depth.refine.refine": lambda v, _: [
        refine.refine(image(0.5), depths(v)),
        refine.refine(image(0.5), depths(1.0), strength=v),
    ],
    "depth.resample.resample_surfaces": lambda v, _: known_of(
        DisparityMap(resample.resample_surfaces(known(v), (7, 9)))
    ),
    "formats.disparity_file.read_disparity": lambda v, to: [
        disparity_file.read_disparity(map_file(to, v), SIZE),
        disparity_file.read_disparity(map_file(to, v, "map_depth"), (7, 8)),
    ],
    "depth.source.open_with_depth": lambda v, to: [
        source.open_with_depth(photo_file(to, v)),
        source.open_with_depth(photo_file(to, 1.0), DepthChoice(file=str(map_file(to, v)))),
    ],
    "depth.source.resized": lambda v, _: known_of(source.resized(DisparityMap(known(v)), (7, 9))),
    "formats.hci.read_light_field": lambda v, to: field_on_disk(to, v),
    "formats.photo.read_photo": lambda v, to: photo.read_photo(photo_file(to, v), max_pixels=90),
    "formats.photo.write_image": lambda v, to: [photo.read_photo(photo_file(to, v, kind)) for kind in (".png", ".exr")],
    "generate.generate": lambda v, _: [field(scene()[0], depths(v)), field(Photo(image(v), 9.0, "wild"), depths(1.0))],
    "generate.ray_set": lambda v, _: completed(depths(v)),
    "geometry.line_of_pixel": lambda v, _: geometry.line_of_pixel([v], [0.0], ViewOffset(0, 1)),
    "lookup.heaviest": lambda v, _: lookup.heaviest(found(v), shown(v)[0]),
    "lookup.look_up_colors": lambda v, _: shown(v)[1],
    "mixed_pixels.split_mixed_pixels": lambda v, _: mixed_pixels.split_mixed_pixels(image(0.5), known(v), 0.5)[:2],
    "occlusion.entropy": lambda v, _: occlusion.entropy(np.nan_to_num(shares(v))),
    "occlusion.occlusion_mask": lambda v, _: occlusion.occlusion_mask(shares(v)),
    "plan.plan_for_viewing": lambda v, _: [
        plan.plan_for_viewing(scene()[0], Disparity(depths(v), "wild")),
        plan.plan_for_viewing(*scene(), plan.PlanOverrides(depth_strength=v)),
        plan.plan_for_viewing(*scene(), plan.PlanOverrides(focus_disparity=v)).field_disparity(scene()[1]),
    ],
    "plan.plan_literal": lambda v, _: plan.plan_literal(scene()[0], Disparity(depths(v), "wild"), GRID),
    "smooth_cells.find_smooth_cells": lambda v, _: [
        smooth_cells.find_smooth_cells(rays(v), ViewOffset(0.5, -1.0), (0, SIZE[0])),
        smooth_cells.find_smooth_cells(rays(1.0), ViewOffset(v, 0.5), (0, SIZE[0])),
    ],
    "smooth_cells.land_on_rough": lambda v, _: [
        smooth_cells.land_on_rough(rays(v).cells, 0, t, 0.5, (0, 4), np.eye(1, 4, dtype=np.bool_)) for t in (0.5, v)
    ],
    "surroundings.edge_softness": lambda v, _: surroundings.edge_softness(depths(v), 0.5),
    "surroundings.surroundings_of": lambda v, _: surroundings.surroundings_of(depths(v)[None], 1.0).softness,
    "synthesis.ViewSynthesis.render": lambda v, _: rendered(ViewOffset(0.5, -1.0), v),
    "synthesis.rays_of_photo": lambda v, _: rendered(ViewOffset(0.0, 2.0), v),
    "types.Disparity": lambda v, _: Disparity(depths(v), "wild"),
    "types.Photo": lambda v, _: Photo(image(v), 20.0, "wild"),
    "weights.closed_form_weights": lambda v, _: closed_form_weights(found(v)),
}
"""What comes back is finite, or InputError or another ValueError says why not."""

ELEMENTWISE = {
    "color.encoded_from_stored": lambda x: color.encoded_from_stored(x.astype(np.float16)),
    "color.linear_from_srgb": color.linear_from_srgb,
    "color.srgb_from_linear": color.srgb_from_linear,
    "geometry.depth_of": geometry.depth_of,
    "geometry.line_of": lambda x: geometry.line_of(np.stack([x, x, x], -1), np.ones((len(x), 3))),
    "formats.photo.upright": lambda x: photo.upright(x[None], 2)[0, ::-1],
}
"""One wild element changes no other."""

FINITE_BY_CONTRACT = {
    "color.stored_from_encoded": "made for every view; Photo and the synthesis see to it",
    "geometry.distance_between": "of lines that `line_of` made",
    "geometry.offset_of_line": "lines along the plane give infinity or NaN, as it says",
    "geometry.pixel_of_line": "lines along the plane give infinity or NaN, as it says",
    "inpaint.background.fill_background": "of rendered views only",
    "depth.estimators.estimate_with": "of a Photo; what a model gives is cleaned by `disparity_from`",
    "depth.estimators.input_size": "sizes only",
    "formats.photo.focal_px_from_fov": "of angles that options check",
    "formats.photo.size_within": "sizes only",
    "formats.pfm.write_pfm": "keeps every bit pattern, tests/core/test_pfm.py",
    "formats.map_file.write_map": "keeps what it gets; maps of the viewer are finite",
    "formats.multi_view.middle": "of viewpoints that the readers of layouts checked",
    "formats.multi_view.nearest_view": "of viewpoints that the readers of layouts checked",
    "formats.multi_view.seen_from": "of viewpoints that the readers of layouts checked",
    "formats.weights_file.write_tensors": "training stops before, tests/core/test_training_loop.py",
    "formats.weights_file.save_weights": "training stops before, tests/core/test_training_loop.py",
    "ray_weights.TrainedWeights": "huge features and logits: tests/core/test_contested.py, test_hard_cases.py",
    "ray_transformer.RayTransformer": "huge features: tests/core/test_contested.py",
    "rays.RaySet": "NaN is no surface; infinity is refused by Disparity",
    "depth.estimate_cache.store": "an Estimate, in which NaN is unknown",
}
"""Who promises the numbers, or where the case is tested."""

READS_OR_TELLS = {
    "depth.apple": "appended_estimate",
    "depth.embedded": "read_embedded embedded_in_jpeg",
    "depth.estimate_cache": "cache_folder key_of load",
    "depth.gdepth": "all_in_focus dynamic_depth_estimate",
    "depth.model_config": "read_config package_for read_preparation",
    "depth.models": "known_model model_to_use is_installed cached_folder weight_files bytes_of fetch",
    "depth.package_models": "run_package",
    "depth.pictures": "picture_file decoded_map",
    "depth.samsung": "samsung_estimate",
    "depth.sidecar": "find_sidecar flat_disparity",
    "depth.xmp": "is_jpeg jpeg_layout value_in xmp_of parsed",
    "formats.files": "temporary_sibling written_whole require_file opened_file refuse_bomb",
    "formats.grid_folder": "read_grid_folder",
    "formats.hci": "is_light_field_folder read_view HciWriter",
    "formats.heic": "is_heic read_heic read_heic_depth",
    "formats.llff": "read_llff",
    "formats.middlebury": "read_middlebury",
    "formats.multi_view": "pictures_in with_equal_sizes first_existing numbers_in scene_folders",
    "formats.npy": "read_array",
    "formats.pfm": "read_pfm",
    "formats.picture_out": "write_picture",
    "formats.raster": "read_size read_orientation read_raster read_map require_whole_png text_attribute complaint_of",
    "formats.stanford": "read_stanford",
    "formats.weights_file": "load_weights read_weights read_tensors require_shapes",
    "generate": "transformer_for",
    "resources": "resource_folder",
    "cost": "Need Needs Work outermost_of",
    "bands": "Cancelled never go_on in_pieces in_bands",
    "synthesis": "ViewSynthesis",
    "types": "ViewOffset GridShape InputError",
}
"""Files, bytes and names go in: hostile ones are fuzzed (`python -m benchmarks.fuzz`) and tested beside each reader."""

ELSEWHERE = ("training.", "evaluation.", "kernels.", "depth.brush.", "depth.edit.")
"""Packages whose own tests feed them such values: scenes of our own making, figures, pieces of kernels, edits."""


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
    kernels = type(candidates._land)  # pieces of hot loops, called by kernels only
    missing = {
        name
        for name, value in public_names()
        if name not in tabled and not name.startswith(ELSEWHERE) and not isinstance(value, kernels)
    }
    assert not missing, "give it a case in one of the tables"
