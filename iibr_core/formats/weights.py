"""Trained weights on disk: safetensors, which hold numbers and text only, so opening a stranger's file runs no code.

Every file says what it is and in which version; what does not fit the model is refused before the model is touched.
torch is imported by what needs it only: trained weights are used without.
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
"""Raised whenever the same numbers come to mean something else."""
WEIGHTS = "iibr-weights"
RESERVED = ("content", "version")


def save_weights(model: nn.Module, path: Path, metadata: Mapping[str, str] | None = None) -> None:
    """Write the model's state to `path`, whole or not at all.

    metadata: what made the weights (command, seed, commit, the model's sizes); "content" and "version" are set here.
    Raises InputError where the file cannot be written, ValueError if metadata takes a name that is set here.
    """
    write_tensors(path, WEIGHTS, model.state_dict(), metadata or {})


def load_weights(path: Path, model: nn.Module) -> dict[str, str]:
    """Put the weights of `path` into the model; returns their metadata.

    Raises InputError, and leaves the model as it was, if the file is missing, truncated, no safetensors, of another
    version, for a model of another shape, or holds a number that is not finite.
    """
    tensors, metadata = read_tensors(path, WEIGHTS)
    require_shapes(path, tensors, {name: tensor.shape for name, tensor in model.state_dict().items()})
    model.load_state_dict(tensors)
    return metadata


def read_weights(path: Path) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
    """The arrays by name, and the metadata. Raises InputError as `load_weights` does, but for shapes."""
    return _read(path, WEIGHTS)


def write_tensors(path: Path, content: str, tensors: Mapping[str, Tensor], metadata: Mapping[str, str]) -> None:
    """Write tensors from any device and text; `content` says what they are. Raises as `save_weights` does."""
    from safetensors.torch import save

    taken = [name for name in RESERVED if name in metadata]
    if taken:
        raise ValueError(f'metadata "{taken[0]}" is set by the file format')
    # Cloned, because safetensors refuses tensors that share memory, as tied layers do.
    copies = {name: tensor.detach().cpu().clone().contiguous() for name, tensor in tensors.items()}
    data = save(copies, {**metadata, "content": content, "version": VERSION})
    with write_file(path) as temporary:
        temporary.write_bytes(data)


def read_tensors(path: Path, content: str) -> tuple[dict[str, Tensor], dict[str, str]]:
    """The inverse of `write_tensors`: CPU tensors by name, metadata.

    Raises InputError if the file is missing, damaged, holds something else, is of another version or not finite.
    """
    import torch

    arrays, metadata = _read(path, content)
    return {name: torch.from_numpy(array) for name, array in arrays.items()}, metadata


def _read(path: Path, content: str) -> tuple[dict[str, NDArray[Any]], dict[str, str]]:
    require_file(path)
    try:
        with safe_open(path, framework="np") as file:
            metadata = dict(file.metadata() or {})
            _require_content(path, metadata, content)
            # Copied, because these may lie in the mapped file, which must be free to be replaced.
            arrays = {name: np.array(file.get_tensor(name)) for name in file.keys()}  # noqa: SIM118
    except (SafetensorError, OSError) as error:
        raise InputError(f"{path}: is not a safetensors file, or is damaged ({reason_of(error)})") from error
    for name, array in arrays.items():
        if not np.isfinite(array).all():
            raise InputError(f"{path}: {name} holds values that are not finite; train again or use another file")
    return arrays, metadata


def require_shapes(
    path: Path, tensors: Mapping[str, Tensor | NDArray[Any]], expected: Mapping[str, tuple[int, ...]]
) -> None:
    """Raise InputError, naming the first difference, unless the names and shapes are those expected."""
    for name in sorted(tensors.keys() | expected.keys()):
        if name not in tensors:
            raise InputError(f"{path}: lacks {name}; it was made for another model")
        if name not in expected:
            raise InputError(f"{path}: holds {name}, which this model lacks; it was made for another model")
        there, wanted = tuple(tensors[name].shape), tuple(expected[name])
        if there != wanted:
            raise InputError(f"{path}: {name} is {there}, this model needs {wanted}; it was made for another model")


def _require_content(path: Path, metadata: Mapping[str, str], content: str) -> None:
    there, version = metadata.get("content"), metadata.get("version")
    if there != content:
        raise InputError(f"{path}: holds {there or 'tensors of unknown origin'}, not {content}; choose another file")
    if version != VERSION:
        raise InputError(f"{path}: is version {version} of {content}, this program reads version {VERSION}")
