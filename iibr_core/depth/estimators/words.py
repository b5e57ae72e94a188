"""What is said of a known model, wherever models are listed: the command line and the window say the same."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.depth.estimators.depth_estimator import KnownModel


@dataclass(frozen=True)
class ModelState:
    """What this machine has of a model. needs: what must be installed first, and how; "" where nothing must.
    seconds: that it took for a photo here, the last time; None where it never ran.
    """

    is_here: bool
    needs: str
    seconds: float | None


@dataclass(frozen=True)
class ModelWords:
    """Each is one line. needs: "" where nothing must be installed first."""

    good_for: str
    figures: str
    place: str
    needs: str


def words_about(model: KnownModel, state: ModelState) -> ModelWords:
    """What a model is good for; its size, its licence and its time here; whether it is here; what it needs."""
    good_for = f"Good for {model.good_for}." + (" Recommended." if model.is_recommended else "")
    figures = f"{model.megabytes:,} MB, {model.licence}"
    if state.seconds is not None:
        figures += f", {state.seconds:.1f} s a photo on this machine"
    place = "here" if state.is_here else "not here"
    return ModelWords(good_for, figures, place, f"Needs {state.needs}." if state.needs else "")
