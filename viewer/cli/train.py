"""`iibr train`: the ray transformer, the training loop, a bar, and one line about how it ended. Torch waits."""

from __future__ import annotations

import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from iibr_core.formats.files import is_file
from iibr_core.runtime.extras import require_extra
from viewer.cli.shared_options import Force
from viewer.cli.terminal import show_progress

if TYPE_CHECKING:
    from iibr_core.training.trainer import Batch

ENTROPY_WEIGHT = 0.01
"""The paper's 1 for the entropy outweighs the colours where hypotheses share a pixel, and makes edges ragged."""
EXIT_DIVERGED = 1
EXIT_INTERRUPTED = 130


def train(
    steps: Annotated[int, typer.Option(min=1, max=10**9, help="Batches of rays to learn from.")],
    out: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Weights to write (.safetensors).")],
    seed: Annotated[int, typer.Option(min=0, max=2**32 - 1, help="The same seed gives the same weights.")] = 0,
    learning_rate: Annotated[float, typer.Option(max=1.0, help="Of the first step; it falls to 0 over all.")] = 1e-4,
    device: Annotated[str, typer.Option(metavar="NAME", help="auto, cpu, cuda, cuda:1 or mps.")] = "auto",
    resume: Annotated[bool, typer.Option("--resume", help="Go on from the checkpoint beside the weights.")] = False,
    checkpoint_every: Annotated[int, typer.Option(min=1, help="Steps from one checkpoint to the next.")] = 500,
    force: Force = False,
) -> None:
    """Train the ray transformer on made-up scenes. Ctrl-C saves, --resume goes on; a log lies beside the weights.

    Example: iibr train --steps 2500 --learning-rate 3e-3 -o weights.safetensors
    """
    require_extra("train", "torch")
    from iibr_core.training.run_files import require_run_files

    require_run_files(out, may_replace=force or resume)
    raise typer.Exit(train_weights(steps, out, seed, learning_rate, device, resume, checkpoint_every, force))


def train_weights(
    steps: int,
    out: Path,
    seed: int,
    learning_rate: float,
    device: str,
    resume: bool,
    checkpoint_every: int,
    may_replace: bool,
) -> int:
    """Train and write `out`; prints how it ended and returns the exit code. See `iibr_core.training.trainer.train`.

    Raises InputError for a bad path, device, value or checkpoint.
    """
    import torch

    from iibr_core.training import trainer
    from iibr_core.training.batches import training_batch
    from iibr_core.training.losses import LossWeights
    from iibr_core.training.model import RayTransformer
    from iibr_core.training.run_files import checkpoint_path

    config = trainer.TrainConfig(
        steps,
        seed,
        learning_rate,
        cosine_decay=True,
        lambdas=LossWeights(entropy=ENTROPY_WEIGHT),
        device=device,
        checkpoint_every=checkpoint_every,
    )
    command = shlex.join(["iibr", *sys.argv[1:]])
    published = command.replace(str(out), out.name)  # the folder is nobody's business
    torch.set_num_threads(1)  # batches are small: more threads mostly wait for each other, and spin meanwhile
    torch.manual_seed(seed)
    model = RayTransformer()

    def batches(step: int) -> Batch:
        return training_batch(step, seed)

    try:
        with show_progress("training", counts=True):
            about = {"command": published}
            trainer.train(
                model,
                batches,
                config,
                out,
                resume=resume,
                may_replace=may_replace,
                metadata=about,
            )
    except KeyboardInterrupt:
        if not is_file(checkpoint_path(out)):
            return _report_end("interrupted before the first step was done", EXIT_INTERRUPTED)
        again = command if resume else f"{command} --resume"
        return _report_end(f"interrupted; what was learned is saved, go on with: {again}", EXIT_INTERRUPTED)
    except trainer.TrainingDiverged as error:
        return _report_end(str(error), EXIT_DIVERGED)
    print(f"{out}: {out.stat().st_size / 1000:.1f} kB after {steps} steps")
    return 0


def _report_end(message: str, code: int) -> int:
    print(f"iibr: {message}", file=sys.stderr)
    return code
