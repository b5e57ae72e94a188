import json
import re

import numpy as np
import pytest
import torch
from safetensors.torch import save
from torch import nn

from iibr_core.formats.weights import VERSION, load_weights, read_weights, save_weights, write_tensors
from iibr_core.types import InputError


def small_model(seed=0, width=4):
    torch.manual_seed(seed)
    return nn.Sequential(nn.Linear(3, width), nn.ReLU(), nn.Linear(width, 1))


def values(model):
    return {name: tensor.clone() for name, tensor in model.state_dict().items()}


def same(one, other):
    return one.keys() == other.keys() and all(np.array_equal(one[name], other[name]) for name in one)


def refused(path, match, model=None):
    """Loading fails with one line that names the file, and the model stays as it was."""
    model = model or small_model(seed=9)
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
    save_weights(saved, path, {"command": "iibr train --seed 3", "commit": "abc"})
    metadata = load_weights(path, loaded)
    assert same(values(saved), values(loaded))
    assert metadata == {
        "command": "iibr train --seed 3",
        "commit": "abc",
        "content": "iibr-weights",
        "version": VERSION,
    }
    tensors, metadata_again = read_weights(path)
    assert same(tensors, values(saved))
    assert metadata_again == metadata
    assert list(tmp_path.iterdir()) == [path]


def test_the_file_may_be_replaced_or_removed_while_its_weights_are_in_use(tmp_path):
    path = tmp_path / "weights.safetensors"
    model = small_model()
    save_weights(model, path)
    tensors, _ = read_weights(path)
    before = {name: array.copy() for name, array in tensors.items()}
    path.write_bytes(b"\0" * path.stat().st_size)
    path.unlink()
    assert same(tensors, before)


def test_tied_and_transposed_weights(tmp_path):
    model = nn.Sequential(nn.Linear(4, 4), nn.Linear(4, 4))
    model[1].weight = model[0].weight
    model[0].bias = nn.Parameter(torch.rand(8, 2).t()[0, ::2])
    save_weights(model, tmp_path / "tied.safetensors")
    other = nn.Sequential(nn.Linear(4, 4), nn.Linear(4, 4))
    load_weights(tmp_path / "tied.safetensors", other)
    assert same(values(model), values(other))


def test_missing_empty_and_foreign_files(tmp_path):
    refused(tmp_path / "none.safetensors", "no such file")
    refused(tmp_path, "is a folder")
    for name, content, match in [
        ("empty", b"", "empty"),
        ("text", b"not weights at all, but long enough to hold a header length", "not a safetensors file"),
        ("pickle", b"\x80\x02}q\x00.", "not a safetensors file"),
        ("huge header", b"\xff" * 64, "not a safetensors file"),
    ]:
        path = tmp_path / f"{name}.safetensors"
        path.write_bytes(content)
        refused(path, match)


def test_every_truncation_is_refused(tmp_path):
    whole = tmp_path / "weights.safetensors"
    save_weights(small_model(), whole, {"command": "iibr train"})
    data = whole.read_bytes()
    cut = tmp_path / "cut.safetensors"
    for length in range(1, len(data)):
        cut.write_bytes(data[:length])
        refused(cut, "not a safetensors file, or is damaged")


def test_a_damaged_header_is_refused_or_harmless(tmp_path):
    """A flipped bit either makes the file unreadable or changes numbers only: nothing but InputError comes out."""
    whole = tmp_path / "weights.safetensors"
    save_weights(small_model(), whole)
    data = whole.read_bytes()
    header = 8 + int.from_bytes(data[:8], "little")
    damaged, refusals = tmp_path / "damaged.safetensors", 0
    for position in range(header):
        broken = bytearray(data)
        broken[position] ^= 1 << position % 8
        damaged.write_bytes(broken)
        try:
            load_weights(damaged, small_model())
        except InputError:
            refusals += 1
    assert refusals > header // 2


def test_other_versions_and_contents(tmp_path):
    path = tmp_path / "weights.safetensors"
    tensors = values(small_model())
    path.write_bytes(save(tensors, {"content": "iibr-weights", "version": "999"}))
    refused(path, f"version 999 of iibr-weights, this program reads version {VERSION}")
    path.write_bytes(save(tensors, {"content": "iibr-weights"}))
    refused(path, "version None")
    path.write_bytes(save(tensors))
    refused(path, "tensors of unknown origin")
    write_tensors(path, "iibr-checkpoint", tensors, {})
    refused(path, "holds iibr-checkpoint, not iibr-weights")


def test_weights_of_another_model(tmp_path):
    path = tmp_path / "weights.safetensors"
    save_weights(small_model(width=5), path)
    refused(path, re.escape("0.bias is (5,), this model needs (4,)"))
    save_weights(nn.Linear(3, 4), path)
    refused(path, "lacks 0.bias")
    save_weights(nn.Sequential(*small_model(), nn.Linear(1, 1)), path)
    refused(path, "holds 3.bias, which this model lacks")


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_numbers_that_are_not_finite(tmp_path, bad):
    path = tmp_path / "weights.safetensors"
    model = small_model()
    with torch.no_grad():
        model[0].weight[1, 2] = bad
    save_weights(model, path)
    refused(path, "0.weight holds values that are not finite")


def test_a_write_that_fails_keeps_the_file_that_was_there(tmp_path):
    path = tmp_path / "weights.safetensors"
    save_weights(small_model(), path)
    before = path.read_bytes()
    with pytest.raises(ValueError, match='"version" is set by'):
        save_weights(small_model(1), path, {"version": "7"})
    assert path.read_bytes() == before
    with pytest.raises(InputError, match=r"folder .* does not exist"):
        save_weights(small_model(), tmp_path / "nowhere" / "weights.safetensors")


def test_metadata_keeps_any_text(tmp_path):
    path = tmp_path / "weights.safetensors"
    text = json.dumps({"command": 'iibr train --out "ä b.safetensors"\n', "empty": ""}, ensure_ascii=False)
    save_weights(small_model(), path, {"training": text})
    assert read_weights(path)[1]["training"] == text
