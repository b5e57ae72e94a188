"""Downloads depth models in a thread, one at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from urllib.parse import urlsplit

from iibr_core.depth.models.catalog import fetch, known_model, model_here
from iibr_core.depth.models.known import KNOWN_MODELS, KnownModel, missing_package
from iibr_core.runtime.work import Cancelled, watched
from viewer.background.job_threads import Failed, Job, JobThread
from viewer.model.state.model_download import Downloading, ModelOffer, ModelsListed

MEGABYTE = 1e6


@dataclass(frozen=True)
class ModelRequest:
    """The name of a known model."""

    name: str


@dataclass(frozen=True)
class Downloaded:
    """A model that was downloaded, and the list of models since."""

    model: ModelOffer
    listed: ModelsListed


DownloadResult = Downloading | Downloaded | Failed[str]


class ModelDownloads(JobThread[ModelRequest, DownloadResult]):
    """A thread of downloads; a new request cancels the previous one."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: called, in the thread, when a result was posted."""
        super().__init__("iibr-models", wake, _results_of, lambda request, message: Failed(request.name, message))


def _results_of(job: Job[ModelRequest, DownloadResult]) -> Iterator[DownloadResult]:
    model = known_model(job.request.name)
    shown = Downloading(model.title, 0, model.megabytes)
    yield shown

    def report(done_bytes: float, total_bytes: float, doing: str) -> None:
        nonlocal shown
        latest = Downloading(model.title, int(done_bytes / MEGABYTE), max(int(total_bytes / MEGABYTE), 1))
        if latest != shown:
            shown = latest
            job.post(latest)

    with suppress(Cancelled), watched(report):
        fetch(model)
        listed = list_models()
        yield Downloaded(next(offer for offer in listed.known if offer.name == model.name), listed)


def list_models() -> ModelsListed:
    """Return the known models and which of them are here. Takes half a second the first time."""
    return ModelsListed(tuple(map(_offer_of, KNOWN_MODELS)))


def _offer_of(model: KnownModel) -> ModelOffer:
    from huggingface_hub import constants

    package = missing_package(model.runner)
    return ModelOffer(
        model.name,
        model.title,
        model.megabytes,
        model.licence,
        host=urlsplit(constants.ENDPOINT).netloc,
        words=" ".join(filter(None, (f"{model.figures}.", model.advice, model.needs))),
        is_here=model_here(model) is not None,
        lacks=f"needs the package {package}" if package else "",
        is_recommended=model.is_recommended,
    )
