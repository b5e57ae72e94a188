"""Results on disk: report.json with all figures, report.md with tables, index.html with tables and pictures."""

from __future__ import annotations

import base64
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from pathlib import Path

import msgspec
import numpy as np
from jinja2 import Environment, FileSystemLoader, StrictUndefined
from PIL import Image

from iibr_core.color import bytes_from_encoded
from iibr_core.evaluation.evaluate import TRUTH, Bytes, Result
from iibr_core.evaluation.metrics import flip_picture
from iibr_core.evaluation.scenes import CENTRE_TRIAL
from iibr_core.formats.outputs import make_folder, write_file
from iibr_core.runtime.resources import resource_folder


@dataclass(frozen=True)
class Table:
    """head: names of the columns. rows: cells, the first of each a name."""

    head: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


def write_report(folder: Path, results: Sequence[Result], command: str) -> None:
    """Write the report into a folder, which is made. command: the one that made the results. Raises InputError."""
    texts = {
        "report.json": json_of(results, command),
        "report.md": render("report.md", results, command),
        "index.html": render("page.html", results, command),
    }
    make_folder(folder)
    for name, text in texts.items():
        with write_file(folder / name) as unfinished:
            unfinished.write_text(text, encoding="utf-8", errors="backslashreplace")


def json_of(results: Sequence[Result], command: str) -> str:
    """Return everything but the pictures; figures that are not known are null."""
    plain = [{f.name: getattr(result, f.name) for f in fields(result) if f.name != "pictures"} for result in results]
    return msgspec.json.format(msgspec.json.encode({"command": command, "results": plain}), indent=1).decode() + "\n"


def render(template: str, results: Sequence[Result], command: str) -> str:
    """Return the text of a template of assets/evaluation."""
    environment = Environment(
        loader=FileSystemLoader(resource_folder("assets") / "evaluation"),
        autoescape=template.endswith(".html"),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(data_uri=_data_uri)
    environment.globals.update(figures_table=figures_table, error_map=_error_map, truth=TRUTH)
    return environment.get_template(template).render(command=command, summary=summary_table(results), results=results)


def summary_table(results: Sequence[Result]) -> Table:
    """Return the full-frame PSNR of all ways, a row for each result, with means over the scenes."""
    names = list(dict.fromkeys(row.name for result in results for row in result.rows))
    rows, centred = [], []
    for result in results:
        found = {row.name: row.mean.full_db for row in result.rows}
        figures = [found.get(name, math.nan) for name in names]
        rows.append((result.scene, result.trial, str(len(result.rows[0].views)), *_numbers(figures)))
        if result.trial == CENTRE_TRIAL:
            centred.append(figures)
    if len(centred) > 1:
        rows.append((f"mean of {len(centred)} scenes", CENTRE_TRIAL, "–", *_numbers(np.mean(centred, axis=0).tolist())))
    return Table(("scene", "trial", "views", *names), tuple(rows))


def figures_table(result: Result) -> Table:
    """Return the figures of a result, a row for each way; columns without any figure are left out."""
    means = [row.mean for row in result.rows]
    worst = _numbers([row.views[row.worst_view].full_db for row in result.rows])
    columns = {
        "full dB": _numbers([mean.full_db for mean in means]),
        "visible dB": _numbers([mean.visible_db for mean in means]),
        "hole dB": _numbers([mean.hole_db for mean in means]),
        "worst view dB": [f"{db} ({row.worst_view})" for db, row in zip(worst, result.rows)],
        "SSIM": _numbers([mean.ssim for mean in means], 4),
        "FLIP": _numbers([mean.flip for mean in means], 4),
        "LPIPS": _numbers([mean.lpips for mean in means], 4),
        "consistency": _numbers([row.consistency for row in result.rows]),
        **{f"{f.name} focus dB": _numbers([row.refocus_db[f.name] for row in result.rows]) for f in result.foci},
    }
    known = {title: cells for title, cells in columns.items() if set(cells) != {"–"}}
    names = [row.name for row in result.rows]
    return Table(("way", *known), tuple(zip(names, *known.values(), strict=True)))


def _numbers(values: Sequence[float], digits: int = 2) -> list[str]:
    """Return figures as text, a dash for NaN."""
    return [f"{value:.{digits}f}" if math.isfinite(value) else "–" for value in values]


def summary_lines(result: Result) -> str:
    """Return the full-frame PSNR of all ways, a line each below a heading."""
    numbers = _numbers([row.mean.full_db for row in result.rows])
    lines = [f"{number:>7} dB  {row.name}" for number, row in zip(numbers, result.rows)]
    return "\n".join((f"{result.scene}: {result.trial}, {len(result.rows[0].views)} views", *lines))


def _error_map(image: Bytes, truth: Bytes) -> Bytes:
    return bytes_from_encoded(flip_picture(image, truth))


def _data_uri(image: Bytes) -> str:
    """Return a picture as the text that a page holds it by, at most 480 pixels wide."""
    picture, buffer = Image.fromarray(image), io.BytesIO()
    picture.thumbnail((480, 1920), Image.Resampling.LANCZOS)
    picture.save(buffer, "webp", quality=82)
    return f"data:image/webp;base64,{base64.b64encode(buffer.getvalue()).decode()}"
