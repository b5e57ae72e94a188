"""Results on disk: report.json with every figure, report.md with tables, index.html with tables and pictures."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from iibr_core.evaluation.focal_stacks import RefocusResult
from iibr_core.evaluation.page import page_of
from iibr_core.evaluation.report_folder import FILES
from iibr_core.evaluation.results import EvaluationResult
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
from iibr_core.formats.outputs import make_folder, write_file


def write_report(folder: Path, results: Sequence[EvaluationResult], command: str) -> None:
    """Write FILES into a folder, made if need be; each whole or not at all. command: how they were made.

    Raises InputError where the folder cannot be written.
    """
    texts = (json_of(results, command), markdown_of(results, command), page_of(results, command))
    make_folder(folder)
    for name, text in zip(FILES, texts):
        with write_file(folder / name) as temporary:
            temporary.write_text(text, encoding="utf-8", errors="backslashreplace")


def json_of(results: Sequence[EvaluationResult], command: str) -> str:
    """Everything but the pictures; what is not known is null."""
    plain = []
    for result in results:
        fields = {name: value for name, value in vars(result).items() if name != "pictures"}
        fields["rows"] = [asdict(replace(row, of_views=dict(row.of_views))) for row in result.rows]
        fields["consistency"] = {name: asdict(found) for name, found in result.consistency.items()}
        fields["refocus"] = [_plain_refocus(found) for found in result.refocus]
        fields["size"] = {"height": result.size.height, "width": result.size.width}
        plain.append(fields)
    return json.dumps(_finite({"command": command, "judgements": plain}), indent=1, allow_nan=False) + "\n"


def _plain_refocus(found: RefocusResult) -> dict[str, Any]:
    figures = {method: asdict(of_method) for method, of_method in found.figures.items()}
    return {**asdict(found.focus), "views": found.views, "methods": figures}


def _finite(value: Any) -> Any:
    """JSON knows no NaN."""
    if isinstance(value, dict):
        return {name: _finite(part) for name, part in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def markdown_of(results: Sequence[EvaluationResult], command: str) -> str:
    """Tables of all results, a summary first."""
    lines = ["# Evaluation", "", f"Made by `{command}`.", "", *markdown_table(summary_table(results))]
    if any(result.consistency for result in results):
        lines += ["", ABOUT_CONSISTENCY]
    for result in results:
        lines += ["", f"## {heading(result)}", "", about(result), "", *markdown_table(figures_table(result))]
        if result.consistency:
            lines += ["", *markdown_table(consistency_table(result))]
        if result.refocus:
            lines += ["", about_refocus(result), "", *markdown_table(refocus_table(result))]
        if result.notes:
            lines += ["", *(f"- {note}" for note in result.notes)]
    return "\n".join(lines) + "\n"


def markdown_table(table: Table) -> list[str]:
    """Lines of Markdown."""
    rows = [table.head, ("---",) * len(table.head), *table.rows]
    return [f"| {' | '.join(cell.replace('|', '/') for cell in row)} |" for row in rows]
