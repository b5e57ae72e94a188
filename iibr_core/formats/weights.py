"""Trained weights on disk: safetensors, which hold numbers and text only, so a foreign file runs no code.

A file states its content and version. A file that does not fit the model is refused before the model changes. Only
functions that need torch import it.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open

from iibr_core.formats.files import reason_of, require_file
from iibr_core.formats.outputs import write_file
from iibr_core.types import InputError

if TYPE_CHECKING:
    from torch import Tensor, nn

VERSION = "1"
"""Version of the meaning of the numbers."""
WEIGHTS = "iibr-weights"


def save_weights(model: nn.Module, path: Path, metadata: Mapping[str, str] | None = None) -> None:
    """Write the model's state, whole or not at all. metadata: origin of the weights (command, seed, commit, sizes)."""
    write_tensors(path, WEIGHTS, model.state_dict(), metadata or {})


def load_weights(path: Path, model: nn.Module) -> dict[str, str]:
    """Put the weights of a file into the model, which stays unchanged on errors, and return their metadata."""
    tensors, metadata = read_tensors(path, WEIGHTS)
    require_shapes(path, tensors, {name: tensor.shape for name, tensor in model.state_dict().items()})
    model.load_state_dict(tensors)
    return metadata


def write_tensors(path: Path, content: str, tensors: Mapping[str, Tensor], metadata: Mapping[str, str]) -> None:
    """Write tensors from any device, and text. content: kind of the file, which `read_tensors` requires."""
    from safetensors.torch import save

    # Cloned, because safetensors refuses tensors that share memory, as tied layers do.
    copies = {name: tensor.detach().cpu().clone().contiguous() for name, tensor in tensors.items()}
    data = save(copies, {**metadata, "content": content, "version": VERSION})
    with write_file(path) as temporary:
        temporary.write_bytes(data)


def read_tensors(path: Path, content: str) -> tuple[dict[str, Tensor], dict[str, str]]:
    """Return CPU tensors by name and the metadata of a file that `write_tensors` wrote."""
    import torch

    arrays, metadata = read_weights(path, content)
    return {name: torch.from_numpy(array) for name, array in arrays.items()}, metadata


def read_weights(path: Path, content: str = WEIGHTS) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
    """Return arrays by name and the metadata of a file of this content and VERSION."""
    require_file(path)
    try:
        with safe_open(path, framework="np") as file:
            metadata = dict(file.metadata() or {})
            # Copied, because these may lie in the mapped file, which must be free to be replaced.
            arrays = {name: np.array(file.get_tensor(name)) for name in file.keys()}  # noqa: SIM118
    except (SafetensorError, OSError) as error:
        raise InputError(f"{path}: is not a safetensors file, or is damaged ({reason_of(error)})") from error
    stored, version = metadata.get("content"), metadata.get("version")
    if stored != content:
        raise InputError(f"{path}: holds {stored or 'tensors of unknown origin'}, not {content}; choose another file")
    if version != VERSION:
        raise InputError(f"{path}: is version {version} of {content}, this program reads version {VERSION}")
    return arrays, metadata


def require_shapes(
    path: Path, tensors: Mapping[str, Tensor | NDArray[Any]], expected: Mapping[str, tuple[int, ...]]
) -> None:
    """Raise InputError, with the first difference, unless the names and shapes are the expected ones."""
    stored = {name: tuple(tensor.shape) for name, tensor in tensors.items()}
    for name in sorted(stored.keys() | expected.keys()):
        if name not in stored:
            raise InputError(f"{path}: lacks {name}; it was made for another model")
        if name not in expected:
            raise InputError(f"{path}: holds {name}, which this model lacks; it was made for another model")
        if stored[name] != (wanted := tuple(expected[name])):
            raise InputError(f"{path}: {name} is {stored[name]}, this model needs {wanted}; choose another file")
