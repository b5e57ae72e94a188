"""Weights on disk: the round trip, and files that are damaged or belong to another model."""

import re
from contextlib import suppress

import numpy as np
import pytest
import torch
from torch import nn

from iibr_core.formats.weights import VERSION, load_weights, read_weights, save_weights
from iibr_core.types import InputError


def small_model(seed=0, width=4):
    torch.manual_seed(seed)
    return nn.Sequential(nn.Linear(3, width), nn.ReLU(), nn.Linear(width, 1))


def values(model):
    return {name: tensor.clone() for name, tensor in model.state_dict().items()}


def same(one, other):
    return one.keys() == other.keys() and all(np.array_equal(one[name], other[name]) for name in one)


def require_refusal(path, match):
    """Loading fails with one line that names the file, and the model stays unchanged."""
    model = small_model(seed=9)
    before = values(model)
    with pytest.raises(InputError, match=match) as caught:
        load_weights(path, model)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert "\n" not in message
    assert same(values(model), before)


def test_round_trip_with_metadata(tmp_path):
    path = tmp_path / "weights.safetensors"
    saved, loaded = small_model(0), small_model(1)
    stated = {"command": 'iibr train --out "ä b.safetensors"\n', "commit": "abc"}
    save_weights(saved, path, stated)
    metadata = load_weights(path, loaded)
    assert same(values(saved), values(loaded))
    assert metadata == {**stated, "content": "iibr-weights", "version": VERSION}
    assert list(tmp_path.iterdir()) == [path]


def test_the_file_may_be_replaced_while_its_weights_are_in_use(tmp_path):
    path = tmp_path / "weights.safetensors"
    save_weights(small_model(), path)
    tensors, _ = read_weights(path)
    before = {name: array.copy() for name, array in tensors.items()}
    path.write_bytes(b"\0" * path.stat().st_size)
    assert same(tensors, before)


def test_truncated_files_are_refused_and_flipped_bits_are_harmless(tmp_path):
    path = tmp_path / "weights.safetensors"
    save_weights(small_model(), path, {"command": "iibr train"})
    data = path.read_bytes()
    for length in range(1, len(data), 7):
        path.write_bytes(data[:length])
        require_refusal(path, "not a safetensors file, or is damaged")
    for position in range(8 + int.from_bytes(data[:8], "little")):
        broken = bytearray(data)
        broken[position] ^= 1 << position % 8
        path.write_bytes(broken)
        with suppress(InputError):
            load_weights(path, small_model())


def test_weights_of_another_model(tmp_path):
    path = tmp_path / "weights.safetensors"
    save_weights(small_model(width=5), path)
    require_refusal(path, re.escape("0.bias is (5,), this model needs (4,)"))
    save_weights(nn.Linear(3, 4), path)
    require_refusal(path, "lacks 0.bias")
    save_weights(nn.Sequential(*small_model(), nn.Linear(1, 1)), path)
    require_refusal(path, "holds 3.bias, which this model lacks")
