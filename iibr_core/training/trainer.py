"""Trains a model on batches of rays: seeded, resumable, never leaving a file half written or a checkpoint spoilt.

Steps count from 1, everywhere: step n takes batches(n), is logged as n, and the checkpoint of step n follows it. What
a step does depends on the seed, n and the state before it alone, so a resumed run repeats an uninterrupted one.
"""

from __future__ import annotations

import json
import signal
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass, field, replace
from math import cos, isfinite, pi
from pathlib import Path
from time import perf_counter

import numpy as np
import torch
from torch import Tensor, nn

from iibr_core.formats.weights import read_tensors, require_shapes, save_weights, write_tensors
from iibr_core.runtime.work import report_progress
from iibr_core.training.losses import EpiShape, LossWeights, to_perceptual, total_loss
from iibr_core.training.run_files import LogRow, checkpoint_path, log_path, require_run_files, training_log
from iibr_core.types import InputError

CHECKPOINT = "iibr-checkpoint"
ADAM_STATE = ("step", "exp_avg", "exp_avg_sq")


@dataclass(frozen=True, eq=False)
class Batch:
    """N target rays with K candidates each.

    features: (N, K, F), what the model sees. mask: (N, K) bool, True where there is a candidate; every ray should
    have one. colors: (N, K, 3), each candidate's vote in linear light, finite in empty slots too. truth: (N, 3), linear
    light; both are compared by `losses.to_perceptual`. epi_shape: the first E * V * W rays form EPIs (E, V, W) in this
    order, or None. color_gain: factor on the colour loss of this batch.
    """

    features: Tensor
    mask: Tensor
    colors: Tensor
    truth: Tensor
    epi_shape: EpiShape | None = None
    color_gain: float = 1.0

    def to(self, device: torch.device) -> Batch:
        """The same batch on a device."""
        features, mask, colors, truth = (t.to(device) for t in (self.features, self.mask, self.colors, self.truth))
        return Batch(features, mask, colors, truth, self.epi_shape, self.color_gain)


@dataclass(frozen=True)
class TrainConfig:
    """How to train. Raises InputError for values that cannot be.

    learning_rate: of the first step, and of all unless cosine_decay lets it fall to 0 over `steps`. device: auto
    (CUDA, else MPS, else CPU), or torch's name of one. checkpoint_every: in steps.
    """

    steps: int
    seed: int = 0
    learning_rate: float = 1e-4
    cosine_decay: bool = False
    betas: tuple[float, float] = (0.9, 0.99)
    lambdas: LossWeights = field(default_factory=LossWeights)
    device: str = "auto"
    checkpoint_every: int = 500

    def __post_init__(self) -> None:
        if self.steps < 1 or self.checkpoint_every < 1:
            raise InputError(f"--steps {self.steps}, checkpoint every {self.checkpoint_every}: give at least 1")
        if self.seed < 0:
            raise InputError(f"--seed {self.seed}: give 0 or a positive integer")
        if not (isfinite(self.learning_rate) and self.learning_rate > 0):
            raise InputError(f"--learning-rate {self.learning_rate}: give a positive number, such as 1e-4")


class TrainingDiverged(RuntimeError):
    """A loss, gradient or weight that is not finite. step: the step whose batch and state give it."""

    def __init__(self, what: str, step: int, kept: str) -> None:
        super().__init__(f"{what} is not finite at step {step}: lower the learning rate; {kept}")
        self.step = step


def train(
    model: nn.Module,
    batches: Callable[[int], Batch],
    config: TrainConfig,
    out: Path,
    *,
    resume: bool = False,
    may_replace: bool = True,
    metadata: Mapping[str, str] | None = None,
) -> None:
    """Train the model in place and write its weights to `out` (.safetensors) with metadata and the configuration.

    model(features, mask) gives weights (N, K): >= 0, 0 where there is no candidate, rows with sum 1. batches(step)
    must depend on nothing but the step, which counts from 1.
    Beside `out` lie a log (`log_path`) and the newest checkpoint (`checkpoint_path`); resume goes on from there.
    may_replace: whether files that are there already are replaced, else AlreadyThereError is raised.
    The same start gives the same weights, to the bit on one CPU, interrupted or not. Seeds torch's global generator.

    Raises InputError for a bad path, device or checkpoint, TrainingDiverged (the checkpoint stays the last good one),
    KeyboardInterrupt once what has been trained is saved, for resume.
    """
    require_run_files(out, may_replace or resume)
    device = choose_device(config.device)
    model.to(device).train()
    run = TrainingRun(model, config, checkpoint_path(out))
    if resume:
        run.restore()
    with training_log(log_path(out), run.step) as write_row:
        try:
            while run.step < config.steps:
                # The batch is made outside: Ctrl-C may stop that at once, but not an update half done.
                batch = batches(run.step + 1).to(device)
                with _defer_interrupts():
                    row = run.take_step(batch)
                    write_row(row)
                report_progress(run.step, config.steps, f"loss {row.total:.4g}")
                if run.step % config.checkpoint_every == 0 or run.step == config.steps:
                    run.save()
        except KeyboardInterrupt:
            run.save()
            raise
    save_weights(model, out, {**(metadata or {}), "training": json.dumps(asdict(config))})


def choose_device(name: str) -> torch.device:
    """The torch device of that name; "auto": CUDA, else MPS, else CPU. Raises InputError if it is not there."""
    has_mps = torch.backends.mps.is_available()
    if name == "auto":
        return torch.device("cuda" if torch.cuda.is_available() else "mps" if has_mps else "cpu")
    there = {"cpu": 1, "cuda": torch.cuda.device_count(), "mps": int(has_mps)}
    try:
        device = torch.device(name)
    except RuntimeError:
        device = None
    if device is None or (device.index or 0) >= there.get(device.type, 0):
        present = ", ".join(kind for kind, count in there.items() if count)
        raise InputError(f"--device {name}: no such device here; choose auto or one of: {present}")
    return device


def learning_rate(config: TrainConfig, step: int) -> float:
    """Learning rate of a step (from 1): constant, or half a cosine from the full rate to 0 after the last step."""
    if not config.cosine_decay:
        return config.learning_rate
    return config.learning_rate * 0.5 * (1 + cos(pi * min((step - 1) / config.steps, 1.0)))


class TrainingRun:
    """The state that training changes: the model, Adam's moments, steps and seconds done; and its checkpoint.

    For those who have loops of their own; `train` is the usual one.
    """

    def __init__(self, model: nn.Module, config: TrainConfig, checkpoint: Path) -> None:
        self.model, self.config, self.checkpoint = model, config, checkpoint
        self.parameters = [parameter for parameter in model.parameters() if parameter.requires_grad]
        self.optimizer = torch.optim.Adam(self.parameters, lr=config.learning_rate, betas=config.betas)
        self.step = 0
        self.saved_step = 0
        self.seconds_before = 0.0
        self.started = perf_counter()

    def take_step(self, batch: Batch) -> LogRow:
        """One update. Raises TrainingDiverged before it touches the model if the losses or gradients are not finite."""
        step = self.step + 1
        rate = learning_rate(self.config, step)
        torch.manual_seed(int(np.random.SeedSequence((self.config.seed, step)).generate_state(1, np.uint64)[0]))
        self.optimizer.zero_grad(set_to_none=True)
        weights = self.model(batch.features, batch.mask)
        if weights.shape != batch.mask.shape:
            raise ValueError(f"the model gives weights {tuple(weights.shape)}, needed are {tuple(batch.mask.shape)}")
        rendered = to_perceptual((weights[..., None] * batch.colors).sum(dim=1))
        lambdas = replace(self.config.lambdas, color=self.config.lambdas.color * batch.color_gain)
        losses = total_loss(rendered, to_perceptual(batch.truth), weights, batch.epi_shape, lambdas)
        losses.total.backward()
        gradients = [parameter.grad for parameter in self.parameters if parameter.grad is not None]
        norm = nn.utils.get_total_norm(gradients).to(losses.total)
        # All at once: every look at a number on a GPU waits for it.
        values = torch.stack([*losses, norm]).tolist()
        for name, value in zip(LogRow._fields[1:], values):
            if not isfinite(value):
                raise self._divergence(name, step)
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        self.optimizer.step()
        self.step = step
        total, color, entropy, epi, gradient_norm = values
        return LogRow(step, total, color, entropy, epi, gradient_norm, rate, self._seconds())

    def save(self) -> None:
        """Write the checkpoint, unless it already exists or nothing has been trained.

        Raises TrainingDiverged, and keeps the file, if a number in it were not finite.
        """
        if self.step == self.saved_step:
            return
        tensors = {f"model.{name}": tensor for name, tensor in self.model.state_dict().items()}
        for index, state in self.optimizer.state_dict()["state"].items():
            tensors |= {f"optimizer.{index}.{name}": state[name] for name in ADAM_STATE}
        for name, tensor in tensors.items():
            if not torch.isfinite(tensor).all():
                raise self._divergence(name, self.step)
        about = {"step": str(self.step), "seconds": repr(self._seconds()), "config": json.dumps(asdict(self.config))}
        with _defer_interrupts():
            write_tensors(self.checkpoint, CHECKPOINT, tensors, about)
            self.saved_step = self.step

    def restore(self) -> None:
        """Go on from the checkpoint.

        Raises InputError if it is missing, damaged, or was trained in another way than this run is asked to.
        """
        path = self.checkpoint
        tensors, about = read_tensors(path, CHECKPOINT)
        try:
            step, seconds, before = int(about["step"]), float(about["seconds"]), dict(json.loads(about["config"]))
            if step < 1:
                raise ValueError(step)
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"{path}: is damaged (step, seconds or config cannot be read); start again") from error
        _require_same_course(path, before, self.config)
        if step > self.config.steps:
            raise InputError(f"{path}: is at step {step} already; give --steps {step} or more, or start again")
        own = {name.removeprefix("model."): t for name, t in tensors.items() if name.startswith("model.")}
        rest = {name: tensor for name, tensor in tensors.items() if not name.startswith("model.")}
        require_shapes(path, own, {name: tensor.shape for name, tensor in self.model.state_dict().items()})
        moments = self._moments(rest)
        self.model.load_state_dict(own)
        self.optimizer.load_state_dict({**self.optimizer.state_dict(), "state": moments})
        self.step = self.saved_step = step
        self.seconds_before = seconds

    def _moments(self, tensors: Mapping[str, Tensor]) -> dict[int, dict[str, Tensor]]:
        """Adam's state by parameter, from a checkpoint's remaining tensors; a parameter without gradients has none."""
        present = {int(index): self.parameters[int(index)] for index in _indices(tensors, len(self.parameters))}
        expected = {
            f"optimizer.{index}.{name}": torch.Size() if name == "step" else parameter.shape
            for index, parameter in present.items()
            for name in ADAM_STATE
        }
        require_shapes(self.checkpoint, tensors, expected)
        return {index: {name: tensors[f"optimizer.{index}.{name}"] for name in ADAM_STATE} for index in present}

    def _seconds(self) -> float:
        return self.seconds_before + perf_counter() - self.started

    def _divergence(self, what: str, step: int) -> TrainingDiverged:
        kept = f"{self.checkpoint} keeps step {self.saved_step}" if self.saved_step else "no checkpoint was written yet"
        return TrainingDiverged(what, step, kept)


def _indices(tensors: Mapping[str, Tensor], count: int) -> list[str]:
    """The numbers below `count` in names "optimizer.NUMBER...."; whatever else is there fails the check of shapes."""
    numbers = {name.split(".")[1] for name in tensors if name.count(".") == 2}
    return [str(index) for index in range(count) if str(index) in numbers]


def _require_same_course(path: Path, before: Mapping[str, object], now: TrainConfig) -> None:
    """Raise InputError if going on under another configuration would end elsewhere than either alone."""
    free = {"device", "checkpoint_every"} | (set() if now.cosine_decay else {"steps"})
    # Through JSON, as the other one went: tuples come back as lists.
    for name, value in json.loads(json.dumps(asdict(now))).items():
        if name not in free and before.get(name) != value:
            was = before.get(name)
            raise InputError(f"{path}: was trained with {name} {was}, not {value}; give {was} or start again")


@contextmanager
def _defer_interrupts() -> Iterator[None]:
    """Ctrl-C within the block counts after it, so that model, moments and step never part. Other threads get none."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    held: list[int] = []
    before = signal.signal(signal.SIGINT, lambda number, _: held.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler if before is None else before)
    if held:
        signal.raise_signal(signal.SIGINT)
