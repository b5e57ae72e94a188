import csv
import json
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import nn

from iibr_core.formats.weights import read_weights
from iibr_core.runtime.work import watched
from iibr_core.training.trainer import Batch, LogRow, TrainConfig, TrainingRun, checkpoint_path, log_path, train
from iibr_core.types import InputError

EPIS, VIEWS, WIDTH, K = 2, 3, 8, 4
CONFIG = TrainConfig(steps=12, learning_rate=1e-2, device="cpu", checkpoint_every=5)


class Scorer(nn.Module):
    """A score for each candidate from its features alone, softmax over those that are there."""

    def __init__(self, seed=0):
        super().__init__()
        torch.manual_seed(seed)
        self.layers = nn.Sequential(nn.Linear(2, 8), nn.ReLU(), nn.Linear(8, 1))

    def forward(self, features, mask):
        scores = self.layers(features)[..., 0].masked_fill(~mask, float("-inf"))
        return torch.softmax(scores, dim=1)


def batches(step, seed=5):
    """The nearest candidate votes right, the others at random; features are distance and noise."""
    generator = torch.Generator().manual_seed(1000 * seed + step)
    rays = EPIS * VIEWS * WIDTH + 16
    features = torch.rand(rays, K, 2, generator=generator)
    mask = torch.rand(rays, K, generator=generator) < 0.8
    mask[:, 0] = True
    truth = torch.rand(rays, 3, generator=generator)
    colors = torch.rand(rays, K, 3, generator=generator)
    nearest = features[..., 0].masked_fill(~mask, 2).argmin(dim=1)
    colors[torch.arange(rays), nearest] = truth
    return Batch(features, mask, colors, truth, (EPIS, VIEWS, WIDTH))


def is_close(one, other):
    return one.keys() == other.keys() and all(np.allclose(one[name], other[name], atol=1e-5) for name in one)


def log_rows(out):
    with log_path(out).open(newline="") as file:
        reader = csv.DictReader(file)
        assert tuple(reader.fieldnames) == LogRow._fields
        return list(reader)


@pytest.fixture
def out(tmp_path):
    return tmp_path / "weights.safetensors"


def test_weights_checkpoint_and_log_are_written(out):
    model = Scorer()
    reports = []
    with watched(lambda *now: reports.append(now)):
        train(model, batches, CONFIG, out, metadata={"commit": "abc"})
    assert {path.name for path in out.parent.iterdir()} == {out.name, checkpoint_path(out).name, log_path(out).name}
    tensors, metadata = read_weights(out)
    assert is_close(tensors, model.state_dict())
    assert metadata["commit"] == "abc"
    kept = TrainingRun(Scorer(9), CONFIG)
    kept.restore(checkpoint_path(out))
    assert kept.step == 12, "it can go on from its end"
    assert json.loads(metadata["training"])["learning_rate"] == CONFIG.learning_rate
    rows = log_rows(out)
    assert [int(row["step"]) for row in rows] == list(range(1, 13))
    assert reports == [(n, 12, f"loss {float(row['total']):.4g}") for n, row in enumerate(rows, 1)]
    rates = [float(row["learning_rate"]) for row in rows]
    assert rates[0] == CONFIG.learning_rate
    assert rates[6] == pytest.approx(CONFIG.learning_rate / 2)
    assert rates == sorted(rates, reverse=True)


def test_an_interrupted_training_continues_from_its_checkpoint(tmp_path):
    whole, parts = tmp_path / "whole.safetensors", tmp_path / "parts.safetensors"

    def interrupted(step):
        if step == 8:
            raise KeyboardInterrupt
        return batches(step)

    train(Scorer(), batches, CONFIG, whole)
    with pytest.raises(KeyboardInterrupt):
        train(Scorer(), interrupted, CONFIG, parts)
    assert not parts.exists()
    train(Scorer(seed=123), batches, CONFIG, parts, resume=True)
    assert is_close(read_weights(whole)[0], read_weights(parts)[0])
    assert [int(row["step"]) for row in log_rows(parts)] == list(range(1, 13))


@pytest.mark.parametrize(("field", "value"), [("truth", float("nan")), ("colors", float("inf"))])
def test_a_loss_that_is_not_finite_stops_and_keeps_the_last_good_checkpoint(out, field, value):
    def spoilt(step):
        batch = batches(step)
        if step == 8:
            getattr(batch, field)[3] = value
        return batch

    with pytest.raises(InputError, match="the loss is not finite at step 8; lower the learning rate"):
        train(Scorer(), spoilt, CONFIG, out)
    assert not out.exists()
    run = TrainingRun(Scorer(), CONFIG)
    run.restore(checkpoint_path(out))
    assert run.step == 5
    assert all(torch.isfinite(tensor).all() for tensor in run.model.state_dict().values())


def test_what_cannot_be_trained_is_refused_before_the_first_step(out):
    def begin(place=out, **options):
        train(Scorer(), pytest.fail, replace(CONFIG, **options), place, may_replace=False)

    with pytest.raises(InputError, match="device nonsense: this machine has none; choose auto or cpu"):
        begin(device="nonsense")
    with pytest.raises(InputError, match=r"w\.bin: weights are written as \.safetensors"):
        begin(out.with_name("w.bin"))
    for there in (out, checkpoint_path(out), log_path(out)):
        there.touch()
        with pytest.raises(InputError, match=there.name):
            begin()
        there.unlink()
    assert not list(out.parent.iterdir())


def test_resume_needs_a_whole_checkpoint_of_this_model(out):
    path = checkpoint_path(out)

    def refused(match, model=None):
        with pytest.raises(InputError, match=match) as caught:
            train(model or Scorer(), batches, CONFIG, out, resume=True)
        assert str(caught.value).startswith(str(path))
        assert "\n" not in str(caught.value)

    refused("no such file")
    train(Scorer(), batches, CONFIG, out)
    other = Scorer()
    other.layers[2] = nn.Linear(8, 2)
    refused("is damaged or of another model", other)
    whole = path.read_bytes()
    for damaged in (whole[:-300], whole[:10], b"no checkpoint", json.dumps({"step": 3}).encode()):
        path.write_bytes(damaged)
        refused("is damaged or of another model")
