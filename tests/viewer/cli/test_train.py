"""`iibr train`: short runs on real batches, how they end and continue, and their messages."""

import signal
from pathlib import Path

import pytest

from iibr_core.formats.weights import read_weights
from iibr_core.training import batches
from iibr_core.types import InputError
from tests.viewer.cli.conftest import output_of, refusal_of

WORDS = ("train", "--device", "cpu", "--seed", 3, "-o", "w.safetensors")
WRITTEN = ["w.checkpoint.pt", "w.csv", "w.safetensors"]


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def names():
    return sorted(path.name for path in Path().iterdir())


def test_steps_write_weights_with_their_command(iibr):
    size = output_of(iibr(*WORDS, "--steps", 3)).strip()
    assert size == f"w.safetensors: {Path('w.safetensors').stat().st_size / 1000:.1f} kB after 3 steps"
    assert names() == WRITTEN
    assert read_weights(Path("w.safetensors"))[1]["command"] == f"iibr {' '.join(map(str, WORDS))} --steps 3"
    assert len(Path("w.csv").read_text().splitlines()) == 4
    with pytest.raises(InputError, match=r"gone\.safetensors: no such file"):
        read_weights(Path("gone.safetensors"))


def test_ctrl_c_saves_and_names_the_command_that_continues(iibr, monkeypatch):
    def batch(step, seed):
        if step == 3:
            signal.raise_signal(signal.SIGINT)
        return real_batch(step, seed)

    real_batch = batches.training_batch
    with monkeypatch.context() as patch:
        patch.setattr(batches, "training_batch", batch)
        done = iibr(*WORDS, "--steps", 3)
    note, last = done.stderr.splitlines()
    assert (done.returncode, last) == (130, "iibr: interrupted")
    assert names() == WRITTEN[:2]
    again = note.split("continue with: iibr ")[1].split()
    output_of(iibr(*again))
    assert names() == WRITTEN
    assert [row.split(",")[0] for row in Path("w.csv").read_text().splitlines()] == ["step", "1", "2", "3"]


@pytest.mark.parametrize("name", WRITTEN[1:])
def test_existing_files_are_kept_without_force(iibr, name):
    """The log too, which may be somebody's table."""
    Path(name).write_text("mine")
    assert f"{name}: already exists; give --force" in refusal_of(iibr(*WORDS, "--steps", 1))
    assert Path(name).read_text() == "mine"
    assert names() == [name]
