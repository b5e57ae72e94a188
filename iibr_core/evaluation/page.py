"""Judgements as one HTML page that needs no other file: tables, pictures, maps of errors, EPIs."""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator, Sequence
from html import escape

import numpy as np
from PIL import Image

from iibr_core.color import encoded_from_stored
from iibr_core.evaluation.metrics import flip_picture
from iibr_core.evaluation.protocol import TRUTH, Bytes, EvaluationResult
from iibr_core.evaluation.refocus import LENS
from iibr_core.evaluation.tables import (
    ABOUT_CONSISTENCY,
    Table,
    about,
    about_refocus,
    consistency_table,
    figures_table,
    heading,
    refocus_table,
    summary_table,
)

WIDEST_PX = 480
"""Pictures are shown no wider: a page with many scenes must stay one that can be opened."""
WEBP_QUALITY = 82
STYLE = """
:root { color-scheme: light dark; --line: #8884; --soft: #888; }
body { font: 15px/1.5 system-ui, sans-serif; margin: 2rem auto; max-width: 76rem; padding: 0 1rem; }
h1 { font-size: 1.6rem; }
h2 { font-size: 1.15rem; margin-top: 3rem; border-top: 1px solid var(--line); padding-top: 1rem; }
p, li { color: var(--soft); } code { font-size: .85em; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; margin: .8rem 0; font-variant-numeric: tabular-nums; }
th, td { padding: .25rem .7rem; border-bottom: 1px solid var(--line); text-align: right; white-space: nowrap; }
th:first-child, td:first-child { text-align: left; }
.pictures { display: grid; grid-template-columns: repeat(auto-fill, minmax(15rem, 1fr)); gap: .9rem; }
.refocus { display: grid; grid-template-columns: repeat(3, 1fr); gap: .9rem; }
figure { margin: 0; } figcaption { font-size: .85rem; color: var(--soft); }
figure img { width: 100%; display: block; }
.epis { display: grid; grid-template-columns: 8rem 1fr; gap: .3rem .8rem; align-items: center; font-size: .85rem; }
.epis img { width: 100%; height: 4.5rem; image-rendering: pixelated; }
"""


def page_of(judgements: Sequence[EvaluationResult], command: str) -> str:
    """The page as text."""
    parts = [
        "<!doctype html>",
        '<html lang="en"><head><meta charset="utf-8">',
        '<meta name="viewport" content="width=device-width, initial-scale=1">',
        f"<title>iibr evaluation</title><style>{STYLE}</style></head><body>",
        f"<h1>Evaluation</h1><p>Made by <code>{escape(command)}</code>. Mean PSNR of the full frame in dB:</p>",
        _table(summary_table(judgements)),
    ]
    if any(judgement.consistency for judgement in judgements):
        parts.append(f"<p>{escape(ABOUT_CONSISTENCY)}</p>")
    for judgement in judgements:
        parts.extend(_section(judgement))
    return "\n".join([*parts, "</body></html>"]) + "\n"


def _section(judgement: EvaluationResult) -> Iterator[str]:
    yield f"<h2>{escape(heading(judgement))}</h2><p>{escape(about(judgement))}</p>"
    yield _table(figures_table(judgement))
    if judgement.consistency:
        yield _table(consistency_table(judgement))
    if judgement.refocus:
        yield f"<p>{escape(about_refocus(judgement))}</p>"
        yield _table(refocus_table(judgement))
    if judgement.notes:
        yield "<ul>" + "".join(f"<li>{escape(note)}</li>" for note in judgement.notes) + "</ul>"
    pictures = judgement.pictures
    yield f"<p>The farthest view, {escape(pictures.view)}, and FLIP error maps (black: no difference to be seen):</p>"
    yield '<div class="pictures">'
    truth = pictures.by_method[TRUTH]
    for method, image in pictures.by_method.items():
        yield _figure(method, image)
        if method != TRUTH:
            yield _figure(f"{method}, error", _error(image, truth))
    yield "</div>"
    if pictures.epis:
        yield f"<p>EPIs of pixel row {pictures.epi_row}, leftmost view on top:</p>"
        yield '<div class="epis">'
        for method, epi in pictures.epis.items():
            yield f'<span>{escape(method)}</span><img alt="EPI, {escape(method)}" src="{_png(epi)}">'
        yield "</div>"
    if judgement.refocus:
        yield '<p>Refocused, of each focus: made, as it should be, FLIP error map:</p><div class="refocus">'
        for found in judgement.refocus:
            name = found.focus.name
            yield _figure(f"{name}, {found.shown}", found.made)
            yield _figure(name if name == LENS else f"{name}, {TRUTH}", found.expected)
            yield _figure(f"{name}, error", _error(found.made, found.expected))
        yield "</div>"


def _error(image: Bytes, truth: Bytes) -> Bytes:
    error = flip_picture(encoded_from_stored(image), encoded_from_stored(truth))
    return (np.clip(error, 0, 1) * 255 + 0.5).astype(np.uint8)


def _table(table: Table) -> str:
    head = "".join(f"<th>{escape(cell)}</th>" for cell in table.head)
    rows = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in table.rows)
    return f'<div class="wide"><table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table></div>'


def _figure(caption: str, image: Bytes) -> str:
    source = _webp(image)
    return f'<figure><img alt="{escape(caption)}" src="{source}"><figcaption>{escape(caption)}</figcaption></figure>'


def _webp(image: Bytes) -> str:
    picture = Image.fromarray(image)
    picture.thumbnail((WIDEST_PX, 4 * WIDEST_PX), Image.Resampling.LANCZOS)
    return _data_of(picture, "webp", quality=WEBP_QUALITY)


def _png(image: Bytes) -> str:
    return _data_of(Image.fromarray(image), "png")


def _data_of(picture: Image.Image, kind: str, **options: int) -> str:
    buffer = io.BytesIO()
    picture.save(buffer, kind, **options)
    return f"data:image/{kind};base64,{base64.b64encode(buffer.getvalue()).decode()}"
