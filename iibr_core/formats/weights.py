"""Trained weights on disk: safetensors, which hold numbers and text only, so a foreign file runs no code.

A file states its content and version.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from iibr_core.formats.files import parsing, require_file
from iibr_core.formats.outputs import write_file
from iibr_core.types import InputError

if TYPE_CHECKING:
    from torch import nn

VERSION = "1"
"""Version of the meaning of the numbers."""
WEIGHTS = "iibr-weights"
"""Content of the files."""


def save_weights(model: nn.Module, path: Path, metadata: Mapping[str, str] | None = None) -> None:
    """Write the model's state, whole or not at all. metadata: origin of the weights (command, seed, commit, sizes)."""
    arrays = {name: np.ascontiguousarray(tensor.detach().cpu().numpy()) for name, tensor in model.state_dict().items()}
    data = save(arrays, {**(metadata or {}), "content": WEIGHTS, "version": VERSION})
    with write_file(path) as temporary:
        temporary.write_bytes(data)


def read_weights(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
    """Return arrays by name and the metadata of a file of this VERSION."""
    require_file(path)
    errors = (SafetensorError, OSError)
    with parsing(path, "is not a safetensors file, or is damaged ({})", errors), safe_open(path, "np") as file:
        metadata = dict(file.metadata() or {})
        # Copied, because these may lie in the mapped file, which must be free to be replaced.
        arrays = {name: np.array(file.get_tensor(name)) for name in file.keys()}  # noqa: SIM118
    content, version = metadata.get("content"), metadata.get("version")
    if content != WEIGHTS:
        raise InputError(f"{path}: holds {content or 'tensors of unknown origin'}, not {WEIGHTS}; choose another file")
    if version != VERSION:
        raise InputError(f"{path}: is version {version} of {WEIGHTS}, this program reads version {VERSION}")
    return arrays, metadata


def require_shapes(path: Path, arrays: Mapping[str, NDArray[Any]], expected: Mapping[str, tuple[int, ...]]) -> None:
    """Raise InputError, with the first difference, unless the names and shapes are the expected ones."""
    stored = {name: array.shape for name, array in arrays.items()}
    for name in sorted(stored.keys() | expected.keys()):
        if name not in stored:
            raise InputError(f"{path}: lacks {name}; it was made for another model")
        if name not in expected:
            raise InputError(f"{path}: holds {name}, which this model lacks; it was made for another model")
        if stored[name] != (wanted := tuple(expected[name])):
            raise InputError(f"{path}: {name} is {stored[name]}, this model needs {wanted}; choose another file")
