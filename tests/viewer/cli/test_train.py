"""`iibr train`: short runs on real batches, how they end and continue, and their messages."""

from __future__ import annotations

import math
import signal
from dataclasses import replace
from pathlib import Path

import pytest

from tests.viewer.cli.test_cli import run

WORDS = ("train", "--device", "cpu", "--seed", 3)
WRITTEN = ["w.checkpoint.pt", "w.csv", "w.safetensors"]


def names(folder: Path) -> list[str]:
    return sorted(path.name for path in folder.iterdir())


def interrupt_at(monkeypatch: pytest.MonkeyPatch, step: int) -> None:
    """Ctrl-C while the batch of this step is made."""
    from iibr_core.training.batches import training_batch

    def batch(now: int, seed: int) -> object:
        if now == step:
            signal.raise_signal(signal.SIGINT)
        return training_batch(now, seed)

    monkeypatch.setattr("iibr_core.training.batches.training_batch", batch)


def test_three_steps_write_weights_with_their_command(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    import torch

    from iibr_core.formats.weights import read_weights

    torch.set_num_threads(2)
    out = tmp_path / "w.safetensors"
    assert run(monkeypatch, *WORDS, "--steps", 3, "--out", out) == 0
    assert capsys.readouterr().out == f"{out}: {out.stat().st_size / 1000:.1f} kB after 3 steps\n"
    assert names(tmp_path) == WRITTEN
    assert torch.get_num_threads() == 1, "several wait for each other"
    expected = f"iibr train --device cpu --seed 3 --steps 3 --out {out.name}"
    assert read_weights(out)[1]["command"] == expected
    assert len((tmp_path / "w.csv").read_text().splitlines()) == 4


def test_ctrl_c_saves_and_says_how_to_continue(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.chdir(tmp_path)
    with monkeypatch.context() as patch:
        interrupt_at(patch, 3)
        assert run(patch, *WORDS, "--steps", 3, "--out", "w.safetensors") == 130
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("iibr: interrupted; the training so far is saved, continue with: iibr train ")
    assert names(tmp_path) == WRITTEN[:2]
    again = line.split("continue with: iibr ")[1].split()
    assert run(monkeypatch, *again) == 0
    assert names(tmp_path) == WRITTEN
    assert [row.split(",")[0] for row in Path("w.csv").read_text().splitlines()] == ["step", "1", "2", "3"]


def test_a_loss_that_is_not_finite_is_one_line_that_names_the_step(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    from iibr_core.training.batches import training_batch

    def batch(now: int, seed: int) -> object:
        good = training_batch(now, seed)
        return replace(good, truth=good.truth * math.nan) if now == 2 else good

    monkeypatch.setattr("iibr_core.training.batches.training_batch", batch)
    out = tmp_path / "w.safetensors"
    assert run(monkeypatch, *WORDS, "--steps", 3, "--checkpoint-every", 1, "--out", out) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("iibr: the loss is not finite at step 2")
    assert names(tmp_path) == WRITTEN[:2]


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("--steps", "0"), "--steps"),
        (("--steps", "x"), "--steps"),
        (("--seed", "-1"), "--seed"),
        (("--learning-rate", "0"), "--learning-rate"),
        (("--learning-rate", "1e39"), "--learning-rate"),
        (("--checkpoint-every", "0"), "--checkpoint-every"),
        (("--device", "abacus"), "abacus"),
        (("--out", "w.pt"), "w.pt"),
        (("--out", "nowhere/w.safetensors"), "nowhere"),
        (("--resume",), "w.checkpoint.pt"),
    ],
)
def test_bad_values_are_one_line_and_leave_nothing(
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    words: tuple[str, ...],
    named: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run(monkeypatch, "train", "--steps", 2, "--out", "w.safetensors", *words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("iibr: ")
    assert named in line
    assert names(tmp_path) == []


@pytest.mark.parametrize("name", WRITTEN[1:])
def test_existing_files_are_replaced_only_by_force(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path, name: str
) -> None:
    """The log too, which may be somebody's table."""
    (tmp_path / name).write_text("mine")
    words = (*WORDS, "--steps", 1, "--out", tmp_path / "w.safetensors")
    assert run(monkeypatch, *words) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith(f"iibr: {tmp_path / name}: already exists; give --force")
    assert (tmp_path / name).read_text() == "mine"
    assert names(tmp_path) == [name]
    assert run(monkeypatch, *words, "--force") == 0
    assert names(tmp_path) == WRITTEN
