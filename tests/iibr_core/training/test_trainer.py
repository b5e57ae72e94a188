import csv
import json
import os
import signal
import threading
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import nn

from iibr_core.formats.weights import load_weights, read_tensors, read_weights, save_weights, write_tensors
from iibr_core.training.losses import LossWeights, color_loss, entropy_loss, epi_loss, epis_of_rays
from iibr_core.training.run_files import LogRow, checkpoint_path, log_path
from iibr_core.training.trainer import (
    CHECKPOINT,
    Batch,
    TrainConfig,
    TrainingDiverged,
    choose_device,
    learning_rate,
    train,
)
from iibr_core.types import InputError

EPIS, VIEWS, WIDTH, K = 2, 3, 8, 4
CONFIG = TrainConfig(steps=12, seed=5, learning_rate=1e-2, device="cpu", checkpoint_every=5)


class Scorer(nn.Module):
    """A score for each candidate from its features alone, softmax over those that are there; dropout draws numbers."""

    def __init__(self, dropout=0.0, seed=0):
        super().__init__()
        torch.manual_seed(seed)
        self.layers = nn.Sequential(nn.Linear(2, 8), nn.ReLU(), nn.Dropout(dropout), nn.Linear(8, 1))

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


def state(model):
    return {name: tensor.clone() for name, tensor in model.state_dict().items()}


def same(one, other):
    return one.keys() == other.keys() and all(np.array_equal(one[name], other[name]) for name in one)


def log_rows(out):
    with log_path(out).open(newline="") as file:
        reader = csv.DictReader(file)
        assert tuple(reader.fieldnames) == LogRow._fields
        return list(reader)


def without_seconds(rows):
    return [{name: value for name, value in row.items() if name != "seconds"} for row in rows]


def stop_at(step, error):
    def give(now):
        if now == step:
            raise error
        return batches(now)

    return give


@pytest.fixture
def out(tmp_path):
    return tmp_path / "weights.safetensors"


def test_fifty_steps_lower_the_loss_on_batches_not_trained_on(out):
    model = Scorer()

    def held_out_loss():
        batch = batches(1, seed=77)
        with torch.no_grad():
            weights = model(batch.features, batch.mask)
        return color_loss((weights[..., None] * batch.colors).sum(dim=1), batch.truth).item()

    before = held_out_loss()
    train(model, batches, replace(CONFIG, steps=50, learning_rate=0.03), out)
    assert held_out_loss() < 0.7 * before
    totals = [float(row["total"]) for row in log_rows(out)]
    assert len(totals) == 50
    assert sum(totals[-10:]) < 0.7 * sum(totals[:10])


def test_what_is_written(out):
    model = Scorer()
    seen = []
    train(model, batches, CONFIG, out, metadata={"commit": "abc"}, report_progress=lambda *now: seen.append(now))
    assert sorted(path.name for path in out.parent.iterdir()) == [
        "weights.checkpoint.safetensors",
        "weights.csv",
        "weights.safetensors",
    ]
    tensors, metadata = read_weights(out)
    assert same(tensors, state(model))
    assert metadata["commit"] == "abc"
    assert json.loads(metadata["training"])["seed"] == CONFIG.seed
    rows = log_rows(out)
    assert [int(row["step"]) for row in rows] == list(range(1, 13))
    assert seen == [(n, 12, f"loss {float(row['total']):.4g}") for n, row in enumerate(rows, 1)]


def test_the_first_step_against_adam_by_hand(out):
    """Adam's first step is -lr * g / (|g| + eps); the log holds the losses before it."""
    model, twin = Scorer(), Scorer()
    config = replace(CONFIG, steps=1, lambdas=LossWeights(3, 5, 7))
    train(model, batches, config, out)
    batch = batches(1)
    weights = twin(batch.features, batch.mask)
    rendered = torch.einsum("nk,nkc->nc", weights, batch.colors)
    rendered, truth = (rendered + 1e-4) ** (1 / 2.2), (batch.truth + 1e-4) ** (1 / 2.2)
    color, entropy = color_loss(rendered, truth), entropy_loss(weights)
    epi = epi_loss(epis_of_rays(rendered, batch.epi_shape), epis_of_rays(truth, batch.epi_shape))
    total = 3 * color + 5 * entropy + 7 * epi
    total.backward()
    norm = sum((parameter.grad**2).sum() for parameter in twin.parameters()) ** 0.5
    row = log_rows(out)[0]
    expected = (total, color, entropy, epi, norm)
    for name, value in zip(LogRow._fields[1:6], expected):
        assert float(row[name]) == pytest.approx(value.item(), rel=1e-5), name
    for trained, start in zip(model.parameters(), twin.parameters()):
        by_hand = start - config.learning_rate * start.grad / (start.grad.abs() + 1e-8)
        assert torch.allclose(trained, by_hand, rtol=1e-5, atol=1e-7)


def test_training_twice_gives_the_same_bits(tmp_path):
    models = [Scorer(dropout=0.3), Scorer(dropout=0.3)]
    for number, model in enumerate(models):
        train(model, batches, CONFIG, tmp_path / f"{number}.safetensors")
        torch.rand(number + 1)  # What others draw from the global generator must not matter.
    assert same(*map(state, models))
    other = Scorer(dropout=0.3)
    train(other, batches, replace(CONFIG, seed=6), tmp_path / "other.safetensors")
    assert not same(state(models[0]), state(other)), "the seed decides what dropout draws"


@pytest.mark.parametrize("cosine_decay", [False, True])
@pytest.mark.parametrize("last", [1, 5, 6, 8, 12])
def test_resuming_gives_the_bits_of_an_uninterrupted_run(tmp_path, last, cosine_decay):
    config = replace(CONFIG, cosine_decay=cosine_decay)
    whole, parts = tmp_path / "whole.safetensors", tmp_path / "parts.safetensors"
    model = Scorer(dropout=0.3)
    train(model, batches, config, whole)
    first = Scorer(dropout=0.3)
    with pytest.raises(KeyboardInterrupt):
        train(first, stop_at(last, KeyboardInterrupt()), config, parts)
    if last == 1:
        assert not checkpoint_path(parts).exists(), "nothing was trained, so nothing is there to save"
        return
    second = Scorer(dropout=0.3, seed=123)
    train(second, batches, config, parts, resume=True)
    assert same(state(model), state(second))
    assert same(read_weights(whole)[0], read_weights(parts)[0])
    assert without_seconds(log_rows(whole)) == without_seconds(log_rows(parts))
    seconds = [float(row["seconds"]) for row in log_rows(parts)]
    assert seconds == sorted(seconds)


def test_resuming_after_a_kill_drops_what_the_log_has_beyond_the_checkpoint(tmp_path):
    """A power cut at step 8: the checkpoint is of step 5, the log ends in half a line."""
    whole, out = tmp_path / "whole.safetensors", tmp_path / "out.safetensors"
    train(Scorer(), batches, CONFIG, whole)
    with pytest.raises(OSError, match="cut"):
        train(Scorer(), stop_at(8, OSError("cut")), CONFIG, out)
    with log_path(out).open("a") as log:
        log.write("8,0.2")
    assert int(read_tensors(checkpoint_path(out), CHECKPOINT)[1]["step"]) == 5
    model = Scorer(seed=9)
    train(model, batches, CONFIG, out, resume=True)
    assert same(state(model), read_weights(whole)[0])
    assert without_seconds(log_rows(whole)) == without_seconds(log_rows(out))
    log_path(out).unlink()
    train(model, batches, replace(CONFIG, steps=14), out, resume=True)
    assert [row["step"] for row in log_rows(out)] == ["13", "14"]


def test_training_on_after_the_end(tmp_path):
    long, short = tmp_path / "long.safetensors", tmp_path / "short.safetensors"
    train(Scorer(), batches, replace(CONFIG, steps=20), long)
    train(Scorer(), batches, CONFIG, short)
    train(Scorer(), batches, CONFIG, short, resume=True)
    assert [row["step"] for row in log_rows(short)][-1] == "12", "nothing was left to do"
    train(Scorer(), batches, replace(CONFIG, steps=20), short, resume=True)
    assert same(read_weights(long)[0], read_weights(short)[0])


def test_a_parameter_that_never_gets_a_gradient_and_one_that_is_frozen(tmp_path):
    def model():
        scorer = Scorer()
        scorer.unused = nn.Parameter(torch.ones(3))
        scorer.layers[0].bias.requires_grad_(False)
        return scorer

    whole, parts = tmp_path / "whole.safetensors", tmp_path / "parts.safetensors"
    one = model()
    train(one, batches, CONFIG, whole)
    assert torch.equal(one.unused, torch.ones(3))
    assert torch.equal(one.layers[0].bias, model().layers[0].bias)
    with pytest.raises(KeyboardInterrupt):
        train(model(), stop_at(7, KeyboardInterrupt()), CONFIG, parts)
    train(model(), batches, CONFIG, parts, resume=True)
    assert same(read_weights(whole)[0], read_weights(parts)[0])


def spoilt_at(step, field, value):
    """Batches of which one has a bad number."""

    def give(now):
        batch = batches(now)
        if now == step:
            getattr(batch, field)[3] = value
        return batch

    return give


@pytest.mark.parametrize(
    ("field", "value"), [("truth", float("nan")), ("colors", float("inf")), ("truth", float("inf"))]
)
def test_a_loss_that_is_not_finite_stops_and_keeps_the_last_good_checkpoint(out, field, value):
    with pytest.raises(TrainingDiverged, match=r"total is not finite at step 8: .*keeps step 5") as caught:
        train(Scorer(), spoilt_at(8, field, value), CONFIG, out)
    assert caught.value.step == 8
    assert "\n" not in str(caught.value)
    assert not out.exists()
    assert [row["step"] for row in log_rows(out)][-1] == "7"
    model = Scorer()
    train(model, batches, CONFIG, out, resume=True)
    untroubled = out.with_name("untroubled.safetensors")
    train(Scorer(), batches, CONFIG, untroubled)
    assert same(state(model), read_weights(untroubled)[0])


def test_a_gradient_that_is_not_finite_stops_before_the_model_is_touched(out):
    class Steep(Scorer):
        def forward(self, features, mask):
            # sqrt has value 0 and slope infinity at 0: the loss is fine, the gradient is NaN.
            return super().forward(features, mask) + 0 * (self.layers[0].weight.sum() * 0).sqrt()

    model = Steep()
    before = state(model)
    with pytest.raises(
        TrainingDiverged, match=r"gradient_norm is not finite at step 1: .*no checkpoint was written yet"
    ):
        train(model, batches, CONFIG, out)
    assert same(state(model), before)


def test_weights_that_overflow_do_not_replace_a_good_checkpoint(out):
    config = replace(CONFIG, checkpoint_every=1)
    train(Scorer(), batches, replace(config, steps=3), out)
    model = Scorer()

    def spoil(step, _steps, _doing):
        if step == 4:
            with torch.no_grad():
                model.layers[0].weight[0, 0] = float("inf")

    with pytest.raises(TrainingDiverged, match=r"layers\.0\.weight is not finite at step 4"):
        train(model, batches, config, out, resume=True, report_progress=spoil)
    assert int(read_tensors(checkpoint_path(out), CHECKPOINT)[1]["step"]) == 3


def test_ctrl_c_in_the_middle_of_an_update_waits_for_its_end(tmp_path):
    """A real signal, sent while the model computes: the checkpoint holds whole steps, and resuming loses nothing."""

    class Interrupted(Scorer):
        calls = 0

        def forward(self, features, mask):
            self.calls += 1
            if self.calls == 7:
                os.kill(os.getpid(), signal.SIGINT)
            return super().forward(features, mask)

    whole, parts = tmp_path / "whole.safetensors", tmp_path / "parts.safetensors"
    handler = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        train(Interrupted(), batches, CONFIG, parts)
    assert signal.getsignal(signal.SIGINT) is handler
    assert int(read_tensors(checkpoint_path(parts), CHECKPOINT)[1]["step"]) == 7
    assert [row["step"] for row in log_rows(parts)][-1] == "7"
    assert not parts.exists()
    train(Scorer(), batches, CONFIG, whole)
    train(Scorer(), batches, CONFIG, parts, resume=True)
    assert same(read_weights(whole)[0], read_weights(parts)[0])


def test_training_runs_in_a_thread(tmp_path):
    """Only the main thread may set signal handlers."""
    paths = [tmp_path / "thread.safetensors", tmp_path / "main.safetensors"]
    thread = threading.Thread(target=train, args=(Scorer(), batches, CONFIG, paths[0]))
    thread.start()
    thread.join()
    train(Scorer(), batches, CONFIG, paths[1])
    assert same(*(read_weights(path)[0] for path in paths))


def test_resume_needs_a_whole_checkpoint_of_this_model_and_course(out):
    with pytest.raises(InputError, match="no such file"):
        train(Scorer(), batches, CONFIG, out, resume=True)
    train(Scorer(), batches, CONFIG, out)
    path = checkpoint_path(out)

    def refused(match, model=None, config=CONFIG):
        model = model or Scorer(seed=3)
        before = state(model)
        with pytest.raises(InputError, match=match) as caught:
            train(model, batches, config, out, resume=True)
        assert str(caught.value).startswith(str(path))
        assert "\n" not in str(caught.value)
        assert same(state(model), before)

    refused("learning_rate 0.01, not 0.5", config=replace(CONFIG, learning_rate=0.5))
    refused("seed 5, not 4", config=replace(CONFIG, seed=4))
    refused("cosine_decay False, not True", config=replace(CONFIG, cosine_decay=True))
    refused("betas", config=replace(CONFIG, betas=(0.5, 0.9)))
    refused("is at step 12 already", config=replace(CONFIG, steps=11))
    refused("lambdas", config=replace(CONFIG, lambdas=LossWeights(epi=0)))
    larger = Scorer()
    larger.layers[3] = nn.Linear(8, 2)
    refused("layers.3.bias is", model=larger)
    tensors, about = read_tensors(path, CHECKPOINT)
    about = {name: text for name, text in about.items() if name not in ("content", "version")}
    for damage in ({"step": "many"}, {"config": "["}, {"config": "7"}, {"step": "-4"}):
        write_tensors(path, CHECKPOINT, tensors, {**about, **damage})
        refused("is damaged")
    for name in ("optimizer.0.exp_avg", "optimizer.1.step"):
        write_tensors(path, CHECKPOINT, {n: t for n, t in tensors.items() if n != name}, about)
        refused(f"lacks {name}")
    for name in ("optimizer.99.exp_avg", "optimizer.x.step", "optimizer", "other.0.step"):
        write_tensors(path, CHECKPOINT, {**tensors, name: torch.zeros(1)}, about)
        refused(f"holds {name}")
    write_tensors(path, CHECKPOINT, {**tensors, "optimizer.0.exp_avg": torch.zeros(1)}, about)
    refused("optimizer.0.exp_avg is")
    save_weights(Scorer(), path)
    refused("holds iibr-weights, not iibr-checkpoint")
    path.write_bytes(path.read_bytes()[:-7])
    refused("not a safetensors file, or is damaged")


def test_bad_paths_are_known_before_the_first_step(tmp_path):
    def never(step):
        raise AssertionError("a batch was asked for")

    for path, match in [
        (tmp_path / "weights.pt", "are written as .safetensors"),
        (tmp_path / "nowhere" / "weights.safetensors", "does not exist"),
        (tmp_path / "folder.safetensors", "is a folder"),
    ]:
        if match == "is a folder":
            path.mkdir()
        with pytest.raises(InputError, match=match):
            train(Scorer(), never, CONFIG, path)


def test_a_model_that_gives_weights_of_another_shape_is_refused(out):
    class Flat(Scorer):
        def forward(self, features, mask):
            return super().forward(features, mask).mean(dim=1, keepdim=True)

    with pytest.raises(ValueError, match=r"gives weights \(64, 1\), needed are \(64, 4\)"):
        train(Flat(), batches, CONFIG, out)


def test_learning_rate_over_the_steps():
    constant = TrainConfig(steps=10, learning_rate=3e-4)
    assert [learning_rate(constant, n) for n in (1, 5, 10)] == [3e-4] * 3
    falling = replace(constant, cosine_decay=True)
    rates = [learning_rate(falling, n) for n in range(1, 12)]
    assert rates[0] == 3e-4
    assert rates[5] == pytest.approx(1.5e-4)
    assert rates[10] == pytest.approx(0, abs=1e-18)
    assert rates == sorted(rates, reverse=True)


def test_config_refuses_what_cannot_be():
    for change in (
        {"steps": 0},
        {"checkpoint_every": 0},
        {"seed": -1},
        {"learning_rate": 0.0},
        {"learning_rate": float("nan")},
    ):
        with pytest.raises(InputError):
            replace(CONFIG, **change)


def test_devices():
    assert choose_device("cpu").type == "cpu"
    assert choose_device("auto").type in ("cuda", "mps", "cpu")
    for name in ("gpu", "cuda:99", "cpu:3", "meta", ""):
        with pytest.raises(InputError, match=f"--device {name}: no such device here; choose auto or one of: .*cpu"):
            choose_device(name)


@pytest.mark.parametrize("device", ["cuda", "mps"])
def test_training_on_an_accelerator_agrees_with_the_cpu(tmp_path, device):
    try:
        choose_device(device)
    except InputError:
        pytest.skip(f"no {device} device here")
    here, there = tmp_path / "cpu.safetensors", tmp_path / "accelerator.safetensors"
    train(Scorer(), batches, CONFIG, here)
    train(Scorer(), batches, replace(CONFIG, device=device), there)
    one, other = Scorer(), Scorer()
    load_weights(here, one)
    load_weights(there, other)
    for a, b in zip(one.parameters(), other.parameters()):
        assert torch.allclose(a, b, atol=1e-4)
