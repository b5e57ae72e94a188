"""A light field as one web page with its views and the program that draws them, for any browser, offline."""

import base64
import hashlib
import json
import re
from dataclasses import asdict
from html import escape
from pathlib import Path
from string import Template
from typing import Any

from iibr_core.beyond import aperture_sampling, lens_slices, optics, picture_quality
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.source import ExportSource
from iibr_core.exports.web_streams import can_encode
from iibr_core.exports.web_views import ViewStore, WebViews, form_that_fits
from iibr_core.formats.images.metadata import Caption, caption_in
from iibr_core.formats.images.open_picture import read_metadata
from iibr_core.formats.outputs import write_file
from iibr_core.runtime.extras import how_to_install
from iibr_core.runtime.resources import resource_folder
from iibr_core.runtime.shader_sources import flatten
from iibr_core.scenes.f_numbers import f_number, unit_f_number
from iibr_core.scenes.lens_limits import aperture_limit, eye_limits, first_aperture, focus_limits, focus_span
from iibr_core.scenes.outer_views import OuterViews
from iibr_core.types import SRGB, ImageSize

AVIF = "image/avif"
SHADERS = (
    "fullscreen.vert", "blocks.vert", "lens.frag", "surfaces.frag", "occupancy.frag", "reach.frag", "slice.frag",
    "disc.frag", "composite.frag", "present.frag", "window.vert", "window.frag",
)  # fmt: skip
"""The shaders that the page has: the desktop's, and those of a headset, see `web/renderer.js`."""
PREAMBLE = "preamble.glsl"
"""The first lines of each shader in a page."""
POLICY = (
    "default-src 'none'; script-src {script}; style-src {style}; img-src data: blob:; media-src blob:; base-uri 'none';"
    " form-action 'none'"
)
FILE = '<script type="text/plain" id="{name}">{data}</script>'
SCRIPTS = "slices.js", "lens.js", "discs.js", "renderer.js", "views.js", "headset.js", "tilt.js", "viewer.js"
LINK = re.compile(r"^import [^;]*;\n|^export (?=const|class|function|async)", re.MULTILINE)
"""Imports and exports of the scripts, which are one module in a page."""
COMMENT = re.compile(r"(?<!:)//[^\n]*$", re.MULTILINE)
BLANK = re.compile(r"^\s+|[ \t]+$", re.MULTILINE)
"""Indentation, ends of lines and empty lines."""


NO_STREAMS = " Safari will show the middle view only: streams of all views need PyAV; {}, and export again."
ROUND = " Pages have no masks: the lens of this one is round."


def write_page(path: Path, source: ExportSource, options: ExportOptions) -> str:
    """Write an .html file; return a sentence about its views."""
    page, views = make_page(source, options)
    with write_file(path) as temporary:
        temporary.write_bytes(page)
    height, width = views.size
    depth = "" if views.has_disparity else ", without depth"
    return (
        f"{len(views.places)} views of {width}x{height} px{depth} at quality {views.form.quality}:"
        f" {len(page) / 1e6:.2f} MB.{'' if views.form.is_video else NO_STREAMS.format(how_to_install('export'))}"
        f"{ROUND if source.optics.aperture_shape.kind == 'mask' else ''}"
    )


def make_page(source: ExportSource, options: ExportOptions) -> tuple[bytes, WebViews]:
    """Return the page and its views."""
    scene = source.scene
    size, keeps_views = ImageSize(scene.height, scene.width), options.target == "headset"
    form = form_that_fits(scene.grid, size, can_encode(), keeps_views)
    store, outer, centre = ViewStore(scene.grid, form, scene.color_space), OuterViews(scene), None
    for view in source.views(with_disparity=True, in_srgb=False):
        store.add(view)
        outer.take(view)
        centre = centre or view
    if centre is not None and centre.disparity is not None and (hidden := outer.hidden_behind(centre)) is not None:
        store.add_hidden(hidden, centre.disparity)
    words = _words(source, options.credit)
    if options.budget is None:
        views = store.encode(form)
    else:
        views = store.encode_within(options.budget, lambda views: len(_page(source, words, views)))
    return _page(source, words, views), views


def _words(source: ExportSource, is_credited: bool) -> dict[str, str]:
    """Return the escaped texts of the page by the name of their place."""
    caption = caption_in(read_metadata(Path(source.scene.source.path))) if source.loaded is not None else Caption()
    if not is_credited:
        caption = Caption(description=caption.description)
    title = caption.title or source.scene.name
    credit = ", ".join(filter(None, (caption.author, caption.rights)))
    meta = (("author", caption.author), ("dcterms.rights", caption.rights))
    heading = f"<h1>{escape(title)}</h1>" if is_credited else ""
    return {
        "title": escape(title),
        "alt": escape(caption.description or f"Light field: {title}"),
        "meta": "\n".join(f'<meta name="{name}" content="{escape(text)}">' for name, text in meta if text),
        "heading": heading + (f"<p>{escape(credit)}</p>" if credit else ""),
    }


def _page(source: ExportSource, words: dict[str, str], views: WebViews) -> bytes:
    folder = resource_folder("web")
    script, style = page_script(), (folder / "page.css").read_text("utf-8")
    fields = {
        **words,
        "policy": POLICY.format(script=hash_of(script), style=hash_of(style)),
        "style": style,
        "script": script,
        "first": f"data:{AVIF};base64,{_base64(views.first)}",
        "shaders": _json(_shaders(folder)),
        "field": _json(_field(source, views)),
        "files": "\n".join(FILE.format(name=name, data=_base64(data)) for name, data in views.files.items()),
    }
    return Template((folder / "page.html").read_text("utf-8")).substitute(fields).encode("utf-8", "replace")


def page_script() -> str:
    """Return the page's scripts as one module, since a page cannot import files."""
    return _smaller(LINK.sub("", "\n".join((resource_folder("web") / name).read_text("utf-8") for name in SCRIPTS)))


def _smaller(code: str) -> str:
    """Return the code of a script or a shader without comments, indentation and empty lines."""
    return BLANK.sub("", COMMENT.sub("", code))


def _shaders(folder: Path) -> dict[str, str]:
    """Return the shaders by name, without the version line, which the preamble replaces."""
    sources = {name: flatten(resource_folder("shaders") / name).text for name in SHADERS}
    without = {name: _smaller(text.partition("\n")[2]) for name, text in sources.items()}
    return {PREAMBLE: (folder / PREAMBLE).read_text("utf-8"), **without}


def _field(source: ExportSource, views: WebViews) -> dict[str, Any]:
    """Return the script's data about the field; lengths are in pixels of the page's views."""
    scene = source.scene
    scale = views.size.width / scene.width
    lens = source.optics.with_focus_scaled(scale)
    return {
        "rows": scene.grid.rows,
        "columns": scene.grid.columns,
        "width": views.size.width,
        "height": views.size.height,
        "step": views.form.every,
        "rowStep": scene.row_step,
        "order": [{"t": place.t, "s": place.s} for place in views.places],
        "chunks": {name: stream.chunks for name, stream in views.streams.items()},
        "hasDisparity": views.has_disparity,
        "range": views.range_px,
        "colorSpace": "srgb" if scene.color_space == SRGB else "display-p3",
        "eyeLimits": {"t": eye_limits(scene.grid.rows), "s": eye_limits(scene.grid.columns)},
        "focusLimits": [scale * limit for limit in focus_limits(scene)],
        "apertureLimits": [0.0, aperture_limit(scene)],
        "rangeLimits": [0.0, scale * focus_span(scene)],
        "firstAperture": first_aperture(scene),
        "unitFNumber": unit_f_number(scene) if views.has_disparity else None,
        "isExactFNumber": f_number(scene, 1.0) is not None,
        "optics": {
            "focus": lens.focus_disparity,
            "aperture": lens.aperture_diameter,
            "range": lens.focus_range,
            "tilt": lens.focus_tilt,
            "shape": asdict(optics.ApertureShape() if lens.aperture_shape.kind == "mask" else lens.aperture_shape),
            "highlights": lens.highlight_recovery,
        },
        "numbers": page_numbers(),
    }


def page_numbers() -> dict[str, Any]:
    """Return the numbers that the scripts in `web/` need, by name."""
    modules = picture_quality, aperture_sampling, lens_slices, optics
    numbers = {name: value for module in modules for name, value in vars(module).items() if _is_number(name, value)}
    return {**numbers, "LEVELS": [asdict(level) for level in picture_quality.QUALITY_LEVELS]}


def _is_number(name: str, value: Any) -> bool:
    return name.isupper() and (isinstance(value, int | float) or name == "SQRT_STEPS")


def _json(value: Any) -> str:
    """Return JSON that contains no tag."""
    return json.dumps(value, allow_nan=False).replace("<", "\\u003c")


def _base64(data: bytes) -> str:
    return base64.b64encode(data).decode("ascii")


def hash_of(text: str) -> str:
    """Return the hash of a script or a style as a content policy names it."""
    return f"'sha256-{_base64(hashlib.sha256(text.encode()).digest())}'"
