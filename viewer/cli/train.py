"""`iibr train`: train the ray transformer. Torch is imported when the command runs."""

from __future__ import annotations

import shlex
import sys
from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from iibr_core.runtime.extras import require_extra
from viewer.cli.options import Force
from viewer.cli.progress import print_notes, show_progress

ENTROPY_WEIGHT = 0.01
"""Weight of the entropy loss. The paper's 1 outweighs the colours where hypotheses share a pixel: edges get ragged."""


def train(
    steps: Annotated[int, typer.Option(min=1, metavar="N", help="Number of batches of rays.")],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Weights to write (.safetensors).")],
    seed: Annotated[int, typer.Option(min=0, metavar="N", help="Seed of the scenes.")] = 0,
    learning_rate: Annotated[
        float, typer.Option(min=1e-9, max=1.0, metavar="X", help="Learning rate of the first step; it falls to 0.")
    ] = 1e-4,
    device: Annotated[str, typer.Option(metavar="NAME", help="auto, cpu, cuda, cuda:1 or mps.")] = "auto",
    resume: Annotated[bool, typer.Option("--resume", help="Continue from the checkpoint beside the weights.")] = False,
    checkpoint_every: Annotated[
        int, typer.Option(min=1, metavar="N", help="Number of steps between checkpoints.")
    ] = 500,
    force: Force = False,
) -> None:
    """Train the ray transformer on procedural scenes. Ctrl-C saves, --resume continues; a log lies beside the weights.

    Example: iibr train --steps 2500 --learning-rate 3e-3 -o weights.safetensors
    """
    require_extra("train", "torch")
    import torch

    from iibr_core.training import batches, trainer
    from iibr_core.training.losses import LossWeights
    from iibr_core.training.model import RayTransformer

    lambdas = LossWeights(entropy=ENTROPY_WEIGHT)
    config = trainer.TrainConfig(steps, seed, learning_rate, lambdas, device, checkpoint_every)
    command = shlex.join(["iibr", *sys.argv[1:]])
    torch.set_num_threads(1)  # batches are small: more threads mostly wait for each other
    torch.manual_seed(seed)
    try:
        with show_progress("training", counts=True):
            trainer.train(
                RayTransformer(),
                partial(batches.training_batch, seed=seed),
                config,
                output,
                resume=resume,
                may_replace=force,
                metadata={"command": command.replace(str(output), output.name)},  # without the user's folders
            )
    except KeyboardInterrupt:
        print_notes((f"The training so far is saved; continue with: {command}{'' if resume else ' --resume'}",))
        raise
    print(f"{output}: {output.stat().st_size / 1000:.1f} kB after {steps} steps")
