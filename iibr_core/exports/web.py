"""A light field that anyone can open: one web page with its views and what draws them, for any browser, without a net."""

from __future__ import annotations

import base64
import hashlib
import json
from collections.abc import Iterable
from dataclasses import replace
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from iibr_core.exports.settings import ExportSettings
from iibr_core.exports.source import ExportSource
from iibr_core.exports.web_views import ViewStore, WebForm, WebViews, form_that_fits
from iibr_core.formats.outputs import atomic_write
from iibr_core.runtime.resources import resource_folder
from iibr_core.runtime.shader_sources import flatten
from iibr_core.scenes.lens_limits import aperture_limit, eye_limits, first_aperture, focus_limits
from iibr_core.scenes.scene import Scene
from iibr_core.types import DISPLAY_P3, SRGB, ImageSize, InputError

SHADERS = (
    "fullscreen.vert",
    "pinhole.frag",
    "march_intervals.frag",
    "aperture.frag",
    "defocus_tiles.frag",
    "widen_tiles.frag",
    "smooth.frag",
    "present.frag",
)
"""Those that the page draws with; see `web/viewer.js`."""
POLICY = (
    "default-src 'none'; script-src {script}; style-src {style}; img-src data: blob:; base-uri 'none';"
    " form-action 'none'"
)
QUALITIES = (1.0, 84), (0.68, 75), (0.47, 65), (0.33, 54)
"""What colours of a quality take, of the best ones."""
SMALLER = (1, 1.0), (2, 1.0), (2, 0.71), (2, 0.5), (4, 0.5), (4, 0.35), (8, 0.25), (64, 0.25), (64, 0.125)
"""Every how many views, and how large, one after the other where the budget is too small for the one before."""


def write_page(path: Path, source: ExportSource, settings: ExportSettings) -> str:
    """An .html file; returns what it carries, a sentence. Raises InputError where it cannot be written or the budget is
    too small for any page, Cancelled once the export should stop.
    """
    page, views = make_page(source, settings)
    with atomic_write(path) as temporary:
        temporary.write_bytes(page)
    height, width = views.size
    depth = "" if views.depths else ", without depth"
    return (
        f"{len(views.places)} views of {width}x{height} px{depth} at quality {views.form.quality}:"
        f" {len(page) / 1e6:.2f} MB."
    )


def make_page(source: ExportSource, settings: ExportSettings) -> tuple[bytes, WebViews]:
    """The page and what it carries. Raises as `write_page` does."""
    scene = source.scene
    space = SRGB if scene.color_space == SRGB else DISPLAY_P3
    form = form_that_fits(scene.grid, ImageSize(scene.height, scene.width), settings.stills)
    views = list(source.views()) if settings.budget else source.views()
    store = ViewStore(scene.grid, form, scene.color_space, space)
    store.fill(views)
    encoded = store.encode(form)
    page = _page(scene, source, settings, encoded)
    return page, encoded


def _page(scene: Scene, source: ExportSource, settings: ExportSettings, views: WebViews) -> bytes:
    folder = resource_folder("web")
    script, style = ((folder / name).read_text("utf-8") for name in ("viewer.js", "page.css"))
    name = escape(scene.name)
    filled = {
        "policy": POLICY.format(script=_hash(script), style=_hash(style)),
        "meta": "",
        "title": name,
        "heading": "",
        "alt": f"Light field: {name}",
        "style": style,
        "script": script,
        "first": f"data:{views.kind};base64,{_letters(views.first)}",
        "shaders": _json(_shaders(folder)),
        "field": _json(_field(scene, source, views)),
        "colors": "\n".join(map(_letters, views.colors)),
        "depths": "\n".join(map(_letters, views.depths)),
    }
    return Template((folder / "page.html").read_text("utf-8")).substitute(filled).encode()


def _shaders(folder: Path) -> dict[str, str]:
    """By name, their first lines, the version, left out: the preamble comes in its place."""
    sources = {name: flatten(resource_folder("shaders") / name).text for name in SHADERS}
    without = {name: text.partition("\n")[2] for name, text in sources.items()}
    return {"preamble": (folder / "preamble.glsl").read_text("utf-8"), **without}


def _field(scene: Scene, source: ExportSource, views: WebViews) -> dict[str, Any]:
    """What the script knows of the field; lengths in pixels are those of the views that the page carries."""
    scale = views.size.width / scene.width
    return {
        "name": scene.name,
        "rows": scene.grid.rows,
        "columns": scene.grid.columns,
        "width": views.size.width,
        "height": views.size.height,
        "step": views.form.every,
        "order": [{"t": place.t, "s": place.s} for place in views.places],
        "type": views.kind,
        "hasDisparity": bool(views.depths),
        "range": views.range_px,
        "colorSpace": "srgb" if scene.color_space == SRGB else "display-p3",
        "eyeLimits": {"t": eye_limits(scene.grid.rows), "s": eye_limits(scene.grid.columns)},
        "focusLimits": [scale * limit for limit in focus_limits(scene)],
        "apertureLimits": [0.0, aperture_limit(scene.grid)],
        "firstAperture": first_aperture(scene),
        "focus": scale * source.optics.focus_disparity,
        "aperture": source.optics.aperture_diameter,
    }


def _json(value: Any) -> str:
    """As it may stand in a page: no tag begins or ends in it."""
    return json.dumps(value, allow_nan=False).replace("<", "\\u003c")


def _letters(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def _hash(text: str) -> str:
    return f"'sha256-{_letters(hashlib.sha256(text.encode()).digest())}'"
