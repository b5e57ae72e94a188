"""The page's scripts by themselves: their syntax, and their numbers against the desktop's, in node."""

from __future__ import annotations

import json
import shutil
import subprocess
from typing import Any

import numpy as np
import pytest

from iibr_core.exports.web import page_script
from iibr_core.runtime.resources import resource_folder
from iibr_core.types import GridShape, ViewOffset
from viewer.gpu.refocus.view_sampling import aperture_samples, pinhole_sources

WEB = resource_folder("web")
SCRIPTS = sorted(WEB.glob("*.js"))
GRID = GridShape(5, 7)
MOST_LINES, MOST_WIDTH = 600, 120
EYES = (
    ViewOffset(0.0, 0.0),
    ViewOffset(0.5, -0.25),
    ViewOffset(-1.75, 2.5),
    ViewOffset(2.0, 3.0),
    ViewOffset(9.0, -9.0),
)


def node(code: str, given: Any = None) -> Any:
    """What a module prints as JSON. given: what it finds as `given`."""
    program = shutil.which("node")
    assert program is not None, "make test installs node"
    field = (
        "{ rows: 5, columns: 7, width: 96, height: 64, range: [-2, 2], hasDisparity: true, step: 1, layers: new Map() }"
    )
    text = (
        f"import * as renderer from {json.dumps((WEB / 'renderer.js').as_uri())};\n"
        f"const given = {json.dumps(given)}, field = {field};\nconsole.log(JSON.stringify({code}));"
    )
    done = subprocess.run([program, "--input-type=module", "-e", text], capture_output=True, text=True, check=True)
    return json.loads(done.stdout)


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.name)
def test_a_script_is_short_and_sound(path) -> None:
    lines = path.read_text("utf-8").splitlines()
    assert len(lines) <= MOST_LINES
    assert max(map(len, lines)) <= MOST_WIDTH
    subprocess.run(["node", "--check", str(path)], check=True)


def test_the_pages_script_is_one_module_that_ends_no_element(tmp_path) -> None:
    script = page_script()
    (tmp_path / "page.mjs").write_text(script, "utf-8")
    subprocess.run(["node", "--check", str(tmp_path / "page.mjs")], check=True)
    assert "import " not in script
    assert "</script" not in script.lower()
    assert "<!--" not in script


def test_pinhole_views_are_the_desktops() -> None:
    present = np.ones(GRID, bool)
    found = node("given.map(eye => renderer.pinholeSources(eye, field))", [{"t": t, "s": s} for t, s in EYES])
    for eye, sources in zip(EYES, found):
        wanted = {GRID.offset(row, column): weight for row, column, weight in pinhole_sources(eye, GRID, present)}
        assert {(one["t"], one["s"]): one["weight"] for one in sources} == pytest.approx(wanted)


@pytest.mark.parametrize("diameter", [1.2, 3.0, 7.0])
@pytest.mark.parametrize("is_smoothed", [False, True])
def test_samples_of_the_lens_are_the_desktops(diameter: float, is_smoothed: bool) -> None:
    moved = ViewOffset(0.25, -0.4)
    told = {"diameter": diameter, "isSmoothed": is_smoothed, "moved": {"t": moved.t, "s": moved.s}}
    told["eyes"] = [{"t": t, "s": s} for t, s in EYES[:4]]
    found = node(
        "given.eyes.map(eye => renderer.apertureSamples(eye, given.diameter, field, 1, given.moved, given.isSmoothed))",
        told,
    )
    for eye, samples in zip(EYES, found):
        present = np.ones(GRID, bool)
        wanted = aperture_samples(eye, diameter, GRID, present, moved=moved, is_smoothed=is_smoothed)
        weights = {(round(one.wanted.t, 6), round(one.wanted.s, 6)): one.weight for one in wanted}
        ours = {(round(one["t"], 6), round(one["s"], 6)): one["weight"] for one in samples}
        for place in weights.keys() | ours.keys():
            assert ours.get(place, 0) == pytest.approx(weights.get(place, 0), abs=4e-3), place


def test_a_tap_finds_the_first_surface_on_its_ray() -> None:
    code = "renderer.pick({...field, width: 8, height: 1}, [0, 0, 0, 0, 255, 255, 0, 0], given, 0.3, 0.5)"
    assert node(code, {"t": 0, "s": 0}) == -2
    assert node(code, {"t": 0, "s": 1}) == 2, "the near one, two pixels aside"
