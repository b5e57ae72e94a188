"""Facts about pictures and files as values that JSON holds, and their comparison with those in `tests/golden`.

Colours are means of blocks, each row a text such as "#ff8000 000000"; they are compared channel by channel.
"""

import json
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from tests.golden_rows import keep_row, read_rows

MAX_BLOCKS = 16


def colors(pixels: NDArray[Any]) -> list[str]:
    """Return the means of blocks of bytes (H, W, 3) or (H, W)."""
    pixels = np.repeat(pixels[..., None], 3, 2) if pixels.ndim == 2 else pixels[..., :3]
    rows, columns = (min(-(-side // 8), MAX_BLOCKS) for side in pixels.shape[:2])
    parts = [np.array_split(band, columns, axis=1) for band in np.array_split(pixels, rows)]
    means = [[np.rint(part.mean(axis=(0, 1))).astype(int) for part in row] for row in parts]
    return ["#" + " ".join(bytes(mean.tolist()).hex() for mean in row) for row in means]


def spread(values: NDArray[Any]) -> list[float]:
    """Return the least, middle and greatest of finite values, their mean, and the means of both halves; [] of none."""
    flat = np.asarray(values, np.float64).ravel()
    if not flat.size:
        return []
    parts = [flat.min(), np.median(flat), flat.max(), flat.mean(), *(part.mean() for part in np.array_split(flat, 2))]
    return [float(f"{part:.6g}") for part in parts]


def require_golden(facts: dict[str, Any], name: str, row: str, levels: float, is_regenerated: bool) -> None:
    """Fail where facts differ from the row of a golden table, or write them there.

    levels: largest difference of colours, of 0..255; numbers agree to 0.2 %.
    """
    facts = json.loads(json.dumps(facts, default=_plain))
    if is_regenerated:
        keep_row(name, row, facts)
    problems = list(differences(facts, read_rows(name)[row], levels))
    assert not problems, "\n".join(problems)


def _plain(value: Any) -> Any:
    return value.tolist() if isinstance(value, np.generic | np.ndarray) else float(value)


def differences(found: Any, expected: Any, levels: float, place: str = "") -> Iterator[str]:
    """Yield where facts differ. See `require_golden`."""
    if isinstance(expected, dict) and isinstance(found, dict) and found.keys() == expected.keys():
        for name, value in expected.items():
            yield from differences(found[name], value, levels, f"{place}/{name}")
    elif isinstance(expected, list | tuple) and isinstance(found, list | tuple) and len(found) == len(expected):
        for k, value in enumerate(expected):
            yield from differences(found[k], value, levels, f"{place}/{k}")
    elif isinstance(expected, str) and expected.startswith("#") and isinstance(found, str):
        one, other = (np.frombuffer(bytes.fromhex(text[1:].replace(" ", "")), np.uint8) for text in (found, expected))
        if one.shape != other.shape or np.abs(one.astype(int) - other).max() > levels:
            yield f"{place}: {found}, expected {expected}"
    elif isinstance(expected, float | int) and isinstance(found, float | int):
        if not np.isclose(found, expected, rtol=2e-3, atol=2e-3):
            yield f"{place}: {found}, expected {expected}"
    elif found != expected:
        yield f"{place}: {found!r}, expected {expected!r}"
