import json
import shutil
import subprocess
from dataclasses import asdict
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from iibr_core.beyond.lens_slices import slices_of
from iibr_core.beyond.optics import ApertureShape, Optics
from iibr_core.exports.web import page_numbers, page_script
from iibr_core.runtime.resources import resource_folder
from iibr_core.types import SRGB, GridShape, ViewOffset
from viewer.gpu.refocus.picture_lens import lens_of
from viewer.gpu.refocus.view_sampling import Samples, blended_samples

WEB = resource_folder("web")
MODULES = "slices", "lens", "headset"
GRID = GridShape(5, 7)
PRESENT = np.ones(GRID, bool)
DESKTOP_FIELD = {
    "grid": GRID,
    "width": 96,
    "height": 64,
    "range_px": (-2.0, 2.0),
    "present": PRESENT,
    "hdr": False,
    "color_space": SRGB,
    "row_step": 1.0,
}
"""The field of `node` as the desktop has it."""
EYES = (
    ViewOffset(0.0, 0.0),
    ViewOffset(0.5, -0.25),
    ViewOffset(-1.75, 2.5),
    ViewOffset(2.0, 3.0),
    ViewOffset(9.0, -9.0),
)


def node(code: str, given: Any = None) -> Any:
    """Return what a module prints as JSON. given: what it finds as `given`."""
    program = shutil.which("node")
    assert program is not None, "make test installs node"
    field = (
        "{ rows: 5, columns: 7, width: 96, height: 64, range: [-2, 2], hasDisparity: true, step: 1, rowStep: 1,"
        " layers: new Map() }"
    )
    imports = (f"import * as {name} from {json.dumps((WEB / f'{name}.js').as_uri())};\n" for name in MODULES)
    text = (
        "".join(imports) + f"Object.assign(slices.NUMBERS, {json.dumps(page_numbers())});\n"
        f"const given = {json.dumps(given)}, field = {field};\nconsole.log(JSON.stringify({code}));"
    )
    done = subprocess.run([program, "--input-type=module", "-e", text], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


def told(offset: ViewOffset) -> dict[str, float]:
    return {"t": offset.t, "s": offset.s}


def pairs(places: list[dict[str, float]]) -> np.ndarray:
    """Return offsets of the page as (N, 2) of (t, s)."""
    return np.array([(place["t"], place["s"]) for place in places])


def weights_of(cameras: np.ndarray, views: np.ndarray, weights: np.ndarray) -> dict[tuple[float, ...], float]:
    """Return weights by camera and view, whatever their order."""
    return {(*view, *camera): weight for view, camera, weight in zip(views, np.round(cameras, 6) + 0.0, weights)}


def found_weights(samples: list[dict[str, Any]]) -> dict[tuple[float, ...], float]:
    """Return the same for samples of the page."""
    weights = np.array([sample["weight"] for sample in samples])
    return weights_of(pairs(samples), pairs([sample["view"] for sample in samples]), weights)


def wanted_weights(samples: Samples, grid: GridShape, step: int = 1) -> dict[tuple[float, ...], float]:
    """Return the same for those of the desktop. step: from one view of the grid to the next, view steps."""
    return weights_of(step * samples.cameras, step * (samples.views - np.array(grid.centre)), samples.weights)


def test_the_pages_script_is_one_module_that_ends_no_element(tmp_path) -> None:
    script = page_script()
    (tmp_path / "page.mjs").write_text(script, "utf-8")
    subprocess.run(["node", "--check", str(tmp_path / "page.mjs")], check=True)
    assert "import " not in script
    assert "</script" not in script.lower()
    assert "<!--" not in script


def test_halves_are_rounded_as_in_python() -> None:
    halves = [k / 2 for k in range(20)]
    assert node("given.map(slices.rounded)", halves) == list(map(round, halves))


@pytest.mark.parametrize("kind", ["disc", "polygon", "ring"])
@pytest.mark.parametrize("step", [1, 2, 1000])
def test_views_that_an_aperture_adds_up_are_the_desktops(kind, step) -> None:
    """The desktop is told that the views that are there are a whole grid: its view step is `step` of the page's."""
    grid, shape = GridShape(*(2 * (middle // step) + 1 for middle in GRID.centre)), ApertureShape(kind, blades=5)
    code = (
        "given.eyes.map(eye => lens.viewsInAperture({ shape: given.shape, diameter: given.diameter, eye },"
        f" {{ ...field, step: {step} }}))"
    )
    diameter = 3.0
    found = node(code, {"shape": asdict(shape), "diameter": diameter, "eyes": list(map(told, EYES))})
    for eye, samples in zip(EYES, found):
        eye_there = ViewOffset(eye.t / step, eye.s / step)
        wanted = blended_samples(shape, diameter / step, eye_there, grid, np.ones(grid, bool))
        assert found_weights(samples) == pytest.approx(wanted_weights(wanted, grid, step)), eye


SHAPES = (
    ApertureShape(),
    ApertureShape("polygon", blades=5, rotation_deg=20.0, roundness=0.4),
    ApertureShape("ring", ring_inner=0.6),
    ApertureShape("cat_eye"),
)


@pytest.mark.parametrize("shape", SHAPES, ids=[shape.kind for shape in SHAPES])
def test_slices_and_discs_are_the_cores(shape) -> None:
    """Few surfaces, a slope from near to far with more slices than there may be, and one surface."""
    random = np.random.default_rng(3)
    cases = [random.uniform(-60, 90, 4).round(2), random.uniform(-2000, 3000, 600), np.array([7.5]), np.array([])]
    code = "given.cases.map(values => slices.slicesOf(values, given.shape))"
    found = node(code, {"cases": [values.tolist() for values in cases], "shape": asdict(shape)})
    for values, of_page in zip(cases, found, strict=True):
        wanted = slices_of(values, shape)
        assert [one["diameterPx"] for one in of_page] == pytest.approx([one.diameter_px for one in wanted])
        assert [one["level"] for one in of_page] == [one.level for one in wanted]
        assert [one["reachPx"] for one in of_page] == pytest.approx([one.reach_px for one in wanted])
        for one, other in zip(of_page, wanted):
            np.testing.assert_allclose(one["taps"], other.taps, atol=1e-9)


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (0.5, -1.0)])
@pytest.mark.parametrize("aperture", [0.0, 0.7, 6.0, 900.0])
def test_the_lens_is_the_desktops(tilt, aperture) -> None:
    sample = np.random.default_rng(2).uniform(-2, 1.5, 50)
    optics = Optics(
        focus_disparity=0.25, focus_range=0.3, focus_tilt=tilt, aperture_diameter=aperture, highlight_recovery=0.5
    )
    told_optics = {
        "eye": {"t": 0, "s": 0}, "focus": 0.25, "range": 0.3, "tilt": tilt, "aperture": aperture, "highlights": 0.5,
        "shape": asdict(ApertureShape()),
    }  # fmt: skip
    found = node(
        "lens.lensOf(given.optics, { ...field, sample: given.sample }, 200)",
        {"optics": told_optics, "sample": sample.tolist()},
    )
    field = SimpleNamespace(**DESKTOP_FIELD, disparity_sample=sample, has_disparity=PRESENT)
    wanted = lens_of(optics, field, 200)
    assert [one["diameterPx"] for one in found["slices"]] == pytest.approx([one.diameter_px for one in wanted.slices])
    assert found["discPx"] == pytest.approx(wanted.disc_px)
    assert found["texelPx"] == pytest.approx(wanted.texel_px)
    assert found["marginPx"] == wanted.margin_px
    assert found["gain"] == pytest.approx(wanted.highlight_gain)


def test_a_tap_finds_the_first_surface_on_its_ray() -> None:
    code = "lens.pick({...field, width: 8, height: 1}, [0, 0, 0, 0, 255, 255, 0, 0], given, 0.3, 0.5)"
    assert node(code, {"t": 0, "s": 0}) == -2
    assert node(code, {"t": 0, "s": 1}) == 2, "the near one, two pixels aside"


@pytest.mark.parametrize("focus", [-0.5, 0.0, 30.0])
@pytest.mark.parametrize("limits", [((-2, 2), (-4, 4)), ((-0.5, 0.5), (-0.5, 0.5)), ((-0.5, 0.5), (-4, 3))])
def test_heads_anywhere_see_what_the_grid_has_with_an_eye_each(limits, focus) -> None:
    """Rays cross the grid; it stops the head smoothly, and the eyes stay apart."""
    field = {"width": 96, "height": 64, "rowStep": 0.5, "range": [-1, 2], "eyeLimits": dict(zip("ts", limits))}
    heads = [(x, y, z) for y in (-2.0, 0.01) for z in (-1.0, 0.0, 0.4, 1.5, 9.0) for x in np.linspace(-3, 3, 61)]
    found = node(
        "given.heads.map(([x, y, z]) => given.sides.map(side => headset.sightOf("
        "given.field, given.focus, [1.2, 0.8], [x + side, y, z], [x, y, z])))",
        {"field": field, "focus": focus, "heads": heads, "sides": (-0.03, 0.03)},
    )
    places = []
    for sight in (sight for eyes in found for sight in eyes):
        part, dolly = sight["part"], np.array(sight["dolly"])
        ends = np.array([(part["y"], part["y"] + part["height"]), (part["x"], part["x"] + part["width"])])
        assert ends.min() >= -1e-9
        assert ends.max() <= 1 + 1e-9
        rays = np.array([[sight["eye"]["t"]], [sight["eye"]["s"]]]) + dolly[::-1, None] * (ends - 0.5)
        assert (np.array(limits)[:, :1] - 1e-9 <= rays).all()
        assert (rays <= np.array(limits)[:, 1:] + 1e-9).all()
        places.append(rays[1].mean())
    across = np.array(places).reshape(-1, 61, 2)
    assert (across[..., 1] > across[..., 0]).all(), "the right eye sees a view farther right"
    assert np.diff(across, axis=1).min() >= -1e-9


@pytest.mark.parametrize(
    ("held", "screen", "turned", "axis"),
    [
        ({"alpha": 0, "beta": 40, "gamma": 0}, 0, {"beta": 50}, "t"),
        ({"alpha": 0, "beta": 0, "gamma": -40}, 90, {"gamma": -50}, "t"),
        ({"alpha": 0, "beta": 0, "gamma": 40}, 270, {"gamma": 50}, "t"),
        ({"alpha": 0, "beta": 0, "gamma": -85}, 90, {"alpha": 180, "beta": 180, "gamma": 85}, "t"),
        ({"alpha": 0, "beta": 0, "gamma": 0}, 0, {"gamma": 10}, "s"),
        ({"alpha": 0, "beta": 0, "gamma": 0}, 90, {"beta": 10}, "s"),
        ({"alpha": 0, "beta": 0, "gamma": 0}, 270, {"beta": -10}, "s"),
    ],
)
def test_a_screen_turns_to_where_its_border_goes_down_however_it_is_held(held, screen, turned, axis) -> None:
    """A raised upper border turns it down, a lowered right border turns it right. A screen upright in landscape lies
    where angles jump.
    """
    code = (
        f"import {{ Tilt }} from {json.dumps((WEB / 'tilt.js').as_uri())};\n"
        f"const tilt = new Tilt(), held = {json.dumps(held)}, turned = {{ ...held, ...{json.dumps(turned)} }};\n"
        f"console.log(JSON.stringify([held, turned, held, held].map(one => tilt.turn(one, {screen}))));"
    )
    done = subprocess.run(["node", "--input-type=module", "-e", code], capture_output=True, text=True, check=True)
    expected = [{"t": 0, "s": 0} | {axis: turn} for turn in (0, 9.6, -9.2, 0)]
    for found, turn in zip(json.loads(done.stdout), expected, strict=True):
        assert found == pytest.approx(turn, abs=1e-6), "noise of 0.4 degrees turns nothing"
