"""Do views agree where they show what no view has seen, and does the field refocus as true views, or a lens, would?

    python -m benchmarks.agreement DATA [DATA ...] [--views 8]

What `iibr evaluate` finds beyond single views, a line a scene. Holes and surfaces: rms between an outer view and the
one half-way to it, in 1/255. Refocus: PSNR in dB against the true views', and against the path-traced picture of a lens
where one lies beside them (`tests/data/thin_lens`), which takes every view.
"""

from __future__ import annotations

from pathlib import Path

from benchmarks.harness.report import parser_of, start
from iibr_core.evaluation.datasets import find_scenes
from iibr_core.evaluation.protocol import EvaluationResult, Options, evaluate
from iibr_core.evaluation.tables import NO_FIGURE, number
from iibr_core.evaluation.trials import CENTRE_TRIAL
from iibr_core.types import DEFAULT_QUALITY


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("data", type=Path, nargs="+", help="a scene as `iibr evaluate` takes it, or a folder of them")
    parser.add_argument("--views", type=int, help="judge at most so many of a scene")
    options = parser.parse_args()
    for scene in (scene for folder in options.data for scene in find_scenes(folder)):
        for result in evaluate(scene, Options(qualities=(DEFAULT_QUALITY,), most_views=options.views)):
            if result.trial == CENTRE_TRIAL and result.consistency:
                print(line_of(result), flush=True)


def line_of(result: EvaluationResult) -> str:
    """In words, of the default quality."""
    agreed = result.consistency[DEFAULT_QUALITY]
    rms = f"holes {number(agreed.hole_rms, 2)} ({agreed.hole_pixels} px), surfaces {number(agreed.surface_rms, 2)}"
    refocus = (f"{found.focus.name} {found.figures[DEFAULT_QUALITY].db:.2f}" for found in result.refocus)
    return f"{result.scene:26} {rms} | refocus {', '.join(refocus) or NO_FIGURE}"


if __name__ == "__main__":
    start("benchmarks.agreement", main)
