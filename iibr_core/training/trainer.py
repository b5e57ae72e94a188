"""Train a model on batches of rays, with a log and a checkpoint beside the weights. Steps count from 1."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from math import cos, isfinite, pi
from pathlib import Path
from pickle import UnpicklingError
from typing import NamedTuple

import torch
from torch import Tensor, nn

from iibr_core.formats.files import reason_of, require_file
from iibr_core.formats.outputs import check_output, write_file
from iibr_core.formats.weights import save_weights
from iibr_core.runtime.work import report_progress
from iibr_core.training.losses import EpiShape, LossWeights, to_perceptual, total_loss
from iibr_core.types import InputError

ADAM_BETAS = 0.9, 0.99


@dataclass(frozen=True, eq=False)
class Batch:
    """N target rays with K hypotheses each.

    features (N, K, F): input of the model. mask (N, K): hypotheses in use, at least one for each ray. colors (N, K, 3)
    and truth (N, 3): linear light. epi_shape: the first E * V * W rays form EPIs, or None. color_gain: factor on the
    colour loss.
    """

    features: Tensor
    mask: Tensor
    colors: Tensor
    truth: Tensor
    epi_shape: EpiShape | None = None
    color_gain: float = 1.0

    def to(self, device: torch.device) -> Batch:
        """Return the same batch on a device."""
        features, mask, colors, truth = (t.to(device) for t in (self.features, self.mask, self.colors, self.truth))
        return Batch(features, mask, colors, truth, self.epi_shape, self.color_gain)


@dataclass(frozen=True)
class TrainConfig:
    """Settings of a training. learning_rate: of the first step; it falls to 0 along half a cosine. device: as torch
    names it, or auto. checkpoint_every: in steps.
    """

    steps: int
    seed: int = 0
    learning_rate: float = 1e-4
    lambdas: LossWeights = field(default_factory=LossWeights)
    device: str = "auto"
    checkpoint_every: int = 500


class LogRow(NamedTuple):
    """One row of the log. The losses are without their lambdas, except in the total."""

    step: int
    total: float
    color: float
    entropy: float
    epi: float
    gradient_norm: float
    learning_rate: float


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
    """Train a model in place and write its weights, with metadata and the settings, to `out` (.safetensors).

    model(features, mask) gives weights (N, K) whose rows sum to 1. batches(step) gives the batch of a step. resume:
    continue from the newest checkpoint. Raises InputError for a bad path, device or checkpoint, and for a loss that is
    not finite; the checkpoint is then the last good one. Saves before it passes on a KeyboardInterrupt.
    """
    _check_outputs(out, may_replace or resume)
    device, checkpoint = choose_device(config.device), checkpoint_path(out)
    run = TrainingRun(model.to(device), config)
    if resume:
        run.restore(checkpoint)
    with log_path(out).open("a" if resume else "w", buffering=1, newline="") as file:
        log = csv.writer(file)
        if not resume:
            log.writerow(LogRow._fields)
        try:
            while run.step < config.steps:
                row = run.take_step(batches(run.step + 1).to(device))
                log.writerow(row)
                report_progress(run.step, config.steps, f"loss {row.total:.4g}")
                if run.step % config.checkpoint_every == 0:
                    run.save(checkpoint)
        except KeyboardInterrupt:
            run.save(checkpoint)
            raise
    run.save(checkpoint)
    save_weights(model, out, {**(metadata or {}), "training": json.dumps(asdict(config))})


def checkpoint_path(out: Path) -> Path:
    """Return the path of the checkpoint of a training that writes `out`."""
    return out.with_suffix(".checkpoint.pt")


def log_path(out: Path) -> Path:
    """Return the path of the log (CSV) of a training that writes `out`."""
    return out.with_suffix(".csv")


def choose_device(name: str) -> torch.device:
    """Return torch's device of this name; auto: an accelerator where there is one. Raises InputError without it."""
    if name == "auto":
        return torch.accelerator.current_accelerator(check_available=True) or torch.device("cpu")
    try:
        return torch.empty(0, device=name).device
    except (RuntimeError, AssertionError) as error:
        raise InputError(f"device {name}: this machine has none; choose auto or cpu") from error


class TrainingRun:
    """A model, its optimizer and the number of steps done."""

    def __init__(self, model: nn.Module, config: TrainConfig) -> None:
        self.model, self.config = model, config
        self.optimizer = torch.optim.Adam(model.parameters(), lr=config.learning_rate, betas=ADAM_BETAS)
        self.step = 0

    def take_step(self, batch: Batch) -> LogRow:
        """Take the next step. Raises InputError, and leaves the model alone, if loss or gradient are not finite."""
        rate = self.config.learning_rate * 0.5 * (1 + cos(pi * min(self.step / self.config.steps, 1.0)))
        self.optimizer.zero_grad()
        weights = self.model(batch.features, batch.mask)
        rendered = to_perceptual((weights[..., None] * batch.colors).sum(dim=1))
        lambdas = replace(self.config.lambdas, color=self.config.lambdas.color * batch.color_gain)
        losses = total_loss(rendered, to_perceptual(batch.truth), weights, batch.epi_shape, lambdas)
        losses.total.backward()
        norm = nn.utils.get_total_norm(p.grad for p in self.model.parameters() if p.grad is not None)
        total, color, entropy, epi, gradient_norm = torch.stack([*losses, norm]).tolist()
        if not isfinite(total + gradient_norm):
            raise InputError(f"the loss is not finite at step {self.step + 1}; lower the learning rate and start again")
        for group in self.optimizer.param_groups:
            group["lr"] = rate
        self.optimizer.step()
        self.step += 1
        return LogRow(self.step, total, color, entropy, epi, gradient_norm, rate)

    def save(self, path: Path) -> None:
        """Write a checkpoint."""
        model, optimizer = self.model.state_dict(), self.optimizer.state_dict()
        with write_file(path) as temporary:
            torch.save({"step": self.step, "model": model, "optimizer": optimizer}, temporary)

    def restore(self, path: Path) -> None:
        """Continue from a checkpoint. Raises InputError if it is missing, damaged, or of another model."""
        require_file(path)
        try:
            state = torch.load(path, "cpu", weights_only=True)
            self.model.load_state_dict(state["model"])
            self.optimizer.load_state_dict(state["optimizer"])
            self.step = state["step"]
        except (OSError, RuntimeError, ValueError, KeyError, EOFError, UnpicklingError) as error:
            raise InputError(f"{path}: is damaged or of another model ({reason_of(error)})") from error


def _check_outputs(out: Path, may_replace: bool) -> None:
    """Raise InputError before the first step where weights, checkpoint or log cannot be written."""
    if out.suffix != ".safetensors":
        raise InputError(f"{out}: weights are written as .safetensors; give such a name")
    for path in (out, checkpoint_path(out), log_path(out)):
        check_output(path, may_replace=may_replace)
