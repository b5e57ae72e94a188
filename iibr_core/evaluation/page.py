"""Results as one HTML page that needs no other file: tables, pictures, maps of errors, EPIs.

The page itself is a Jinja2 template, assets/evaluation/page.html; here is what it is given.
"""

from __future__ import annotations

import base64
import io
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from PIL import Image

from iibr_core.color import bytes_from_encoded
from iibr_core.evaluation.focal_stacks import LENS
from iibr_core.evaluation.metrics import flip_picture
from iibr_core.evaluation.results import TRUTH, Bytes, EvaluationResult
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
from iibr_core.runtime.resources import resource_folder

WIDEST_PX = 480
"""Pictures are shown no wider: a page with many scenes must stay one that can be opened."""
WEBP_QUALITY = 82


@dataclass(frozen=True)
class PagePicture:
    """source: the picture itself as a data URI."""

    caption: str
    source: str


@dataclass(frozen=True)
class PageSection:
    """What the page shows of one result. None and empty: there is none, and nothing about it is shown."""

    heading: str
    about: str
    figures: Table
    consistency: Table | None
    about_refocus: str
    refocus: Table | None
    notes: tuple[str, ...]
    view: str
    pictures: tuple[PagePicture, ...]
    epi_row: int
    epis: tuple[PagePicture, ...]
    refocused: tuple[PagePicture, ...]


def page_of(results: Sequence[EvaluationResult], command: str) -> str:
    """The page as text. command: how the results were made."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(resource_folder("assets") / "evaluation"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        keep_trailing_newline=True,
    )
    return environment.get_template("page.html").render(
        command=command,
        summary=summary_table(results),
        about_consistency=ABOUT_CONSISTENCY if any(result.consistency for result in results) else "",
        sections=[section_of(result) for result in results],
    )


def section_of(result: EvaluationResult) -> PageSection:
    """What the page shows of a result."""
    return PageSection(
        heading(result),
        about(result),
        figures_table(result),
        consistency_table(result) if result.consistency else None,
        about_refocus(result) if result.refocus else "",
        refocus_table(result) if result.refocus else None,
        result.notes,
        result.pictures.view,
        tuple(_view_pictures(result)),
        result.pictures.epi_row,
        tuple(PagePicture(method, _png(epi)) for method, epi in result.pictures.epis.items()),
        tuple(_refocused_pictures(result)),
    )


def _view_pictures(result: EvaluationResult) -> Iterator[PagePicture]:
    """The view as every method makes it, each but the truth with its error beside it."""
    truth = result.pictures.by_method[TRUTH]
    for method, image in result.pictures.by_method.items():
        yield PagePicture(method, _webp(image))
        if method != TRUTH:
            yield PagePicture(f"{method}, error", _webp(_error(image, truth)))


def _refocused_pictures(result: EvaluationResult) -> Iterator[PagePicture]:
    """Of each focus three: made, as it should be, and the error."""
    for found in result.refocus:
        name = found.focus.name
        yield PagePicture(f"{name}, {found.shown}", _webp(found.made))
        yield PagePicture(name if name == LENS else f"{name}, {TRUTH}", _webp(found.expected))
        yield PagePicture(f"{name}, error", _webp(_error(found.made, found.expected)))


def _error(image: Bytes, truth: Bytes) -> Bytes:
    return bytes_from_encoded(flip_picture(image, truth))


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
