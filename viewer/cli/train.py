"""`iibr train`: train the ray transformer. Torch is imported when the command runs."""

from __future__ import annotations

import shlex
import sys
from functools import partial
from pathlib import Path
from typing import Annotated

from iibr_core.runtime.extras import require_extra
from viewer.cli.messages import print_notes, show_progress
from viewer.cli.option_records import flag, option, output_option
from viewer.cli.options import Force

ENTROPY_WEIGHT = 0.01
"""Weight of the entropy loss. The paper's 1 outweighs the colours where hypotheses share a pixel: edges get ragged."""


def train(
    steps: Annotated[int, option("Number of batches of rays.", "N", min=1)],
    output: Annotated[Path, output_option("Weights to write (.safetensors).")],
    seed: Annotated[int, option("Seed of the scenes.", "N", min=0)] = 0,
    learning_rate: Annotated[
        float, option("Learning rate of the first step; it falls to 0.", "X", min=1e-6, max=1.0)
    ] = 1e-4,
    device: Annotated[str, option("auto, cpu, cuda, cuda:1 or mps.", "NAME")] = "auto",
    resume: Annotated[bool, flag("--resume", "Continue from the checkpoint beside the weights.")] = False,
    checkpoint_every: Annotated[int, option("Number of steps between checkpoints.", "N", min=1)] = 500,
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
        print_notes(f"The training so far is saved; continue with: {command}{'' if resume else ' --resume'}")
        raise
    print(f"{output}: {output.stat().st_size / 1000:.1f} kB after {steps} steps")
