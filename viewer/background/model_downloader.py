"""Downloads depth models in a thread, one at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

from iibr_core.runtime.work import Cancelled, watched
from viewer.background.job_threads import Failed, Job, JobThread
from viewer.model.state.model_download import Downloading, ModelOffer, ModelsListed

if TYPE_CHECKING:
    from iibr_core.depth.estimators.depth_estimator import KnownModel

BYTES_OF_MEGABYTE = 1e6


@dataclass(frozen=True)
class ModelRequest:
    """The name of a known model."""

    name: str


@dataclass(frozen=True)
class Downloaded:
    """What came, and what there is now."""

    model: ModelOffer
    listed: ModelsListed


DownloadResult = Downloading | Downloaded | Failed[str]


class ModelDownloads(JobThread[ModelRequest, DownloadResult]):
    """A new request gives up the one before."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: called, in the thread, when a result was posted."""
        super().__init__("iibr-models", wake, _results_of, lambda asked, message: Failed(asked.name, message))


def _results_of(job: Job[ModelRequest, DownloadResult]) -> Iterator[DownloadResult]:
    from iibr_core.depth.estimators.catalog import fetch, known_model

    model = known_model(job.request.name)
    told = Downloading(model.title, 0, model.megabytes)
    yield told

    def report(done_bytes: float, total_bytes: float, doing: str) -> None:
        nonlocal told
        done = int(done_bytes / BYTES_OF_MEGABYTE)
        latest = Downloading(model.title, done, max(int(total_bytes / BYTES_OF_MEGABYTE), done, 1))
        if latest != told:
            told = latest
            job.post(latest)

    with suppress(Cancelled), watched(report):
        fetch(model)
        listed = list_models()
        yield Downloaded(next(offer for offer in listed.known if offer.name == model.name), listed)


def list_models() -> ModelsListed:
    """What can be had, and what is here. Takes half a second the first time."""
    from iibr_core.depth.estimators.catalog import KNOWN_MODELS

    return ModelsListed(tuple(map(_offer_of, KNOWN_MODELS)))


def _offer_of(model: KnownModel) -> ModelOffer:
    """What the window says of a model."""
    from huggingface_hub import constants

    from iibr_core.depth.estimators.catalog import state_of
    from iibr_core.depth.estimators.words import words_about

    state = state_of(model)
    words = words_about(model, state)
    return ModelOffer(
        model.name,
        model.title,
        model.megabytes,
        model.licence,
        host=urlsplit(constants.ENDPOINT).netloc,
        words=" ".join(filter(None, (f"{words.figures}.", words.good_for, words.needs))),
        is_here=state.is_here,
        lacks=f"needs {state.needs}" if state.needs else "",
        is_recommended=model.is_recommended,
    )
