"""Golden results of tables: `tests/golden/NAME.json` keeps those of all rows of a table, under the rows' names.

`pytest --regenerate-golden` writes them again, in one process: rows share a file.
"""

import json
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent / "golden"


def read_rows(name: str) -> dict[str, Any]:
    """Return what is kept of a table; nothing before it is first written."""
    path = FOLDER / f"{name}.json"
    return json.loads(path.read_text("utf-8")) if path.is_file() else {}


def keep_row(name: str, row: str, value: list[Any] | dict[str, Any]) -> None:
    """Write a row, each entry on a line of its own."""
    path = FOLDER / f"{name}.json"
    rows = read_rows(name) | {row: value}
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(
        "{\n" + ",\n".join(f"{_text(row)}: {_lines(value)}" for row, value in rows.items()) + "\n}\n", "utf-8"
    )


def _lines(value: list[Any] | dict[str, Any]) -> str:
    if isinstance(value, dict):
        return "{\n " + ",\n ".join(f"{_text(name)}: {_text(fact)}" for name, fact in value.items()) + "\n}"
    return "[\n " + ",\n ".join(map(_text, value)) + "\n]"


def _text(value: Any) -> str:
    return json.dumps(value, ensure_ascii=False)
