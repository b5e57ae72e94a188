"""Depth by a model for the photo that is shown with a guess, in a thread of its own; the newest wish counts."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from iibr_core.scenes.scene import LoadedPhoto, Source
from iibr_core.types import FloatImage
from viewer.background.job_threads import Failed, Job, JobThread
from viewer.model import messages
from viewer.model.action import do
from viewer.model.actions import Action, SamePlaces
from viewer.model.reducers.depth_models import wanted_model
from viewer.model.remedies import DEPTH_COMMANDS
from viewer.model.state.app_state import AppState
from viewer.model.state.model_download import DepthEstimated, GiveUpEstimate
from viewer.model.state.notices import Notice

COMPARED = 200
"""So many rows and columns of two maps are compared, at most."""
PAIRS = 33
STOPPED = "Estimating depth stopped unexpectedly; the photo keeps the depth that it had. Try it again."


@dataclass(frozen=True, eq=False)
class EstimateRequest:
    """A photo as it is open, a model's name or path, and whether edges are refined."""

    source: Source
    loaded: LoadedPhoto
    model: str
    refine: bool

    def is_for(self, loaded: LoadedPhoto, model: str) -> bool:
        """Whether it asks this model about this photo, whatever was edited in it."""
        return loaded.photo is self.loaded.photo and model == self.model


@dataclass(frozen=True, eq=False)
class Estimated:
    """What came of a request."""

    request: EstimateRequest
    loaded: LoadedPhoto


EstimateResult = Estimated | Failed[EstimateRequest]


class DepthFinder(JobThread[EstimateRequest, EstimateResult]):
    """Has a model asked where the state wants that. Everything is called from the thread of the window."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: called, in the thread, when a result was posted."""
        super().__init__("iibr-depth", wake, _results_of, Failed)
        self._asked: EstimateRequest | None = None
        self._found: LoadedPhoto | None = None

    def advance(self, state: AppState, loaded: LoadedPhoto | None) -> list[Action]:
        """Say what came, and ask for what is wanted now of the photo that is loaded."""
        actions: list[Action] = []
        while (result := self.next_result()) is not None:
            actions += self._take(result)
        model = wanted_model(state)
        if actions:
            return actions
        if model is None or loaded is None or state.scene is None:
            if self._asked is not None:
                self.cancel()
                self._asked = None
        elif self._asked is None or not self._asked.is_for(loaded, model):
            self._asked = EstimateRequest(state.scene.source, loaded, model, state.depth.refine)
            self.submit(self._asked)
        elif self.is_lost:
            return self._fail(STOPPED)
        return []

    def newest(self, loaded: LoadedPhoto | None) -> LoadedPhoto | None:
        """The photo that is shown, with the depth found for it since, where that is not shown yet."""
        found = self._found
        if loaded is None or found is None or found.photo is not loaded.photo or found.found is loaded.found:
            self._found = None
            return loaded
        return found

    def _take(self, result: EstimateResult) -> list[Action]:
        match result:
            case Failed():
                return self._fail(result.message)
            case Estimated(request, loaded):
                self._asked, self._found = None, loaded
                return [DepthEstimated(request.model)]

    def _fail(self, message: str) -> list[Action]:
        self._asked = None
        return [GiveUpEstimate(), do(messages.notify, Notice(message, is_error=True, commands=DEPTH_COMMANDS))]


def _results_of(job: Job[EstimateRequest, EstimateResult]) -> Iterator[EstimateResult]:
    from iibr_core.scenes.photo import deepen

    asked = job.request
    source = replace(asked.source, depth=replace(asked.source.depth, file=None, start="model", model=asked.model))
    yield Estimated(asked, deepen(source, asked.loaded, asked.refine))


def same_places(before: FloatImage, now: FloatImage, focused_at: tuple[float, float] | None) -> SamePlaces:
    """Two field disparities (H, W) of one photo, compared. focused_at: a place, -1..1 across the picture, y down."""
    steps = tuple(slice(None, None, -(-length // COMPARED)) for length in before.shape)
    old, new = before[steps].ravel(), now[steps].ravel()
    order = np.array_split(np.argsort(old, kind="stable"), min(PAIRS, old.size))
    pairs = tuple((float(np.median(old[places])), float(np.median(new[places]))) for places in order)
    if focused_at is None:
        return SamePlaces(pairs)
    height, width = before.shape
    column, row = ((at + 1) / 2 * length - 0.5 for at, length in zip(focused_at, (width, height)))
    at = min(max(round(row), 0), height - 1), min(max(round(column), 0), width - 1)
    return SamePlaces(pairs, (float(before[at]), float(now[at])))
