import re

import numpy as np
import pytest
from torch import nn

from iibr_core.formats.weights import VERSION, read_weights, require_shapes, save_weights
from iibr_core.types import InputError


@pytest.fixture
def path(tmp_path):
    path = tmp_path / "weights.safetensors"
    save_weights(nn.Linear(3, 4), path, {"command": 'iibr train --out "ä b.safetensors"\n', "commit": "abc"})
    return path


def test_round_trip_with_metadata_and_the_file_may_be_replaced_while_its_weights_are_in_use(path):
    arrays, metadata = read_weights(path)
    before = {name: array.copy() for name, array in arrays.items()}
    assert {name: array.shape for name, array in arrays.items()} == {"weight": (4, 3), "bias": (4,)}
    assert metadata["command"] == 'iibr train --out "ä b.safetensors"\n'
    assert (metadata["content"], metadata["version"]) == ("iibr-weights", VERSION)
    assert list(path.parent.iterdir()) == [path]
    path.write_bytes(b"\0" * path.stat().st_size)
    assert all(np.array_equal(arrays[name], before[name]) for name in arrays)


def test_truncated_and_missing_files_are_refused(path):
    data = path.read_bytes()
    for length in range(1, len(data), 7):
        path.write_bytes(data[:length])
        with pytest.raises(InputError, match=rf"^{path}: is not a safetensors file, or is damaged .*$"):
            read_weights(path)
    path.unlink()
    with pytest.raises(InputError, match="no such file"):
        read_weights(path)


@pytest.mark.parametrize(
    ("expected", "message"),
    [
        ({"weight": (4, 3), "bias": (5,)}, "bias is (4,), this model needs (5,)"),
        ({"weight": (4, 3), "bias": (4,), "more": (1,)}, "lacks more"),
        ({"weight": (4, 3)}, "holds bias, which this model lacks"),
    ],
)
def test_weights_of_another_model(path, expected, message):
    with pytest.raises(InputError, match=re.escape(message)):
        require_shapes(path, read_weights(path)[0], expected)
