"""The paper's main table for the sets that are here: views from one, beside figures that others have published.

    python -m benchmarks.tables.main_table --data DATA [--views 8] [--lpips FOLDER]

DATA holds scenes as `iibr evaluate` takes them. Disparity: the set's true one, taken literally; and the program's own
estimate from the one picture: as it is, with scale and shift fitted to the truth, and, of stereo pairs, scaled to the
truth's median alone, as in SHARP's table. Writes docs/tables/main_table.md.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.tables.report import markdown, write_report
from iibr_core.depth.choice import DepthChoice
from iibr_core.evaluation.datasets import find_scenes
from iibr_core.evaluation.protocol import IDENTITY, EvaluationResult, Options, evaluate
from iibr_core.evaluation.tables import number, summary_line
from iibr_core.evaluation.trials import CENTRE_TRIAL, trial_input, trials_of
from iibr_core.formats.light_fields.scene import MultiView
from iibr_core.types import FloatImage

QUALITY = "balanced"
LITERALLY = DepthChoice(refine=0.0)
HEAD = ("set", "disparity", "method", "PSNR", "SSIM", "FLIP", "LPIPS", "s a view", "from")
HERE = "measured here"
MEDIAN_SCALED = "estimate, scaled to the median of the true disparity"
PUBLISHED = (
    ("Pov-ray", (("SinMPI", 22.419, 0.697, 0.213), ("TMPI", 23.619, 0.726, 0.170), ("ZeroMVS", 20.835, 0.710, 0.229),
                 ("NViST", 19.889, 0.553, 0.290), ("the paper", 28.407, 0.931, 0.037))),
    ("4DLF", (("SinMPI", 22.432, 0.701, 0.201), ("TMPI", 24.832, 0.780, 0.132), ("ZeroMVS", 20.759, 0.689, 0.231),
              ("NViST", 19.842, 0.540, 0.325), ("the paper, zero-shot", 28.095, 0.926, 0.046),
              ("the paper, fine-tuned", 28.382, 0.929, 0.041))),
    ("Stanford", (("SinMPI", 22.381, 0.674, 0.218), ("TMPI", 24.013, 0.749, 0.162), ("ZeroMVS", 20.481, 0.664, 0.228),
                  ("NViST", 18.548, 0.471, 0.493), ("the paper, zero-shot", 27.889, 0.910, 0.068),
                  ("the paper, fine-tuned", 27.682, 0.902, 0.052))),
    ("LLFF", (("SinMPI", 17.101, 0.530, 0.581), ("TMPI", 17.561, 0.569, 0.422), ("ZeroMVS", 11.211, 0.403, 0.623),
              ("NViST", 15.341, 0.437, 0.701), ("the paper, zero-shot", 24.910, 0.810, 0.183),
              ("the paper, fine-tuned", 25.534, 0.883, 0.095))),
    ("Middlebury, left to right, native size", (("SHARP", 17.12, math.nan, 0.358),
     ("SHARP, scaled by the true depth", 19.18, math.nan, 0.262), ("TMPI", 16.42, math.nan, math.nan),
     ("Flash3D", 15.88, math.nan, math.nan), ("Gen3C", 13.89, math.nan, math.nan))),
)  # fmt: skip
"""Set, then method, PSNR, SSIM, LPIPS: the paper's table, and SHARP's."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--views", type=int, default=8)
    parser.add_argument("--lpips", type=Path)
    options = parser.parse_args()
    rows = []
    for scene in find_scenes(options.data):
        has_truth = any(known.is_truth for known in scene.disparity.values())
        asked = Options(
            choice=LITERALLY, qualities=(QUALITY,), most_views=options.views, lpips=options.lpips,
            with_consistency=False, with_refocus=False,
        )  # fmt: skip
        for source in ("gt", "estimate") if has_truth else ("auto", "estimate"):
            for result in evaluate(scene, replace(asked, source=source)):
                rows += _rows(result)
                print(summary_line(result), flush=True)
        if has_truth and len(scene.views) == 2:  # of fields, disparity is not 0 at infinity
            result = _with_the_median_of_the_truth(scene, asked)
            rows += _rows(replace(result, disparity=MEDIAN_SCALED))
            print(summary_line(result), flush=True)
    absent = "" if options.lpips else " LPIPS: weights are not here (`--lpips FOLDER` reads them)."
    parts = [
        f"One view given, up to {options.views} others judged, at the size of the pictures that are here. Middlebury's"
        " pairs are quarter and third size: the published figures of native size tell nothing about them. disp_est: a"
        f" map found from all views of the set. Quality *{QUALITY}*, maps taken literally.{absent} DISTS: no library"
        " with weights is here. Seconds are of all cores.",
        # Doing nothing is the same for every estimate.
        markdown(HEAD, dict.fromkeys(rows)),
        "## Published elsewhere, on sets of that name in full",
        markdown(HEAD, _published()),
    ]
    write_report("main_table", "Views from one picture", parts)


def median_scaled(estimate: FloatImage, truth: FloatImage) -> FloatImage:
    """An estimate (H, W), its farthest pixel taken for infinitely far, times what gives it the truth's median.

    truth: (H, W), 0 at infinity. A flat estimate becomes 0.
    """
    above = estimate - estimate.min()
    median = float(np.median(above))
    return np.asarray(above * np.float32(np.nanmedian(truth) / median if median > 0 else 0.0), np.float32)


def _with_the_median_of_the_truth(scene: MultiView, asked: Options) -> EvaluationResult:
    """The centre trial with such an estimate."""
    trial = trials_of(scene, "estimate", asked.most_views)[0]
    given = trial_input(trial, "estimate", asked.choice, asked.max_pixels)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "disparity.npy"
        np.save(path, median_scaled(given.maps[0].values, given.judge.values))
        return evaluate(scene, replace(asked, source=path))[0]


def _rows(result: EvaluationResult) -> Iterator[tuple[str, ...]]:
    if result.trial != CENTRE_TRIAL:
        return
    for row in result.rows:
        if row.method == IDENTITY and not result.disparity.startswith("estimate"):
            continue
        mean = row.mean
        figures = number(mean.full_db, 2), number(mean.ssim, 4), number(mean.flip, 4), number(mean.lpips, 3)
        seconds = number(mean.ms / 1e3, 3) if mean.ms > 0 else number(math.nan, 0)
        disparity = "none" if row.method == IDENTITY else result.disparity
        yield f"{result.scene}, {result.size}", disparity, row.method, *figures, seconds, HERE


def _published() -> Iterator[tuple[str, ...]]:
    for name, methods in PUBLISHED:
        for method, decibels, ssim, lpips in methods:
            none = number(math.nan, 0)
            figures = f"{decibels:g}", number(ssim, 3), none, number(lpips, 3), none
            yield name, "its own", method, *figures, "published"


if __name__ == "__main__":
    main()
