"""Downloads depth models in a thread, one at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass

from iibr_core.runtime.tiling import Cancelled
from viewer.background.jobs import Failed, Job, JobThread
from viewer.model.state.model_download import Downloading, ModelOffer, ModelsPrompt

BYTES_OF_MEGABYTE = 1e6


@dataclass(frozen=True)
class ModelRequest:
    """The name of a known model."""

    name: str


@dataclass(frozen=True)
class Downloaded:
    """What came."""

    model: ModelOffer


DownloadResult = Downloading | Downloaded | Failed[str]


class ModelDownloads(JobThread[ModelRequest, DownloadResult]):
    """A new request gives up the one before."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: called, in the thread, when a result was posted."""
        super().__init__("iibr-models", wake, _results_of, lambda asked, message: Failed(asked.name, message))


def _results_of(job: Job[ModelRequest, DownloadResult]) -> Iterator[DownloadResult]:
    from iibr_core.depth.models.catalog import fetch, known_model

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

    with suppress(Cancelled):
        fetch(model, report, job.should_stop)
        yield Downloaded(next(offer for offer in list_models().models if offer.name == model.name))


def list_models() -> ModelsPrompt:
    """What can be had, and what is here. Takes half a second the first time."""
    from iibr_core.depth.models.catalog import KNOWN_MODELS, cached_folder, lacking_package

    offers = []
    for model in KNOWN_MODELS:
        lacking = lacking_package(model.package)
        lacks = f"It also needs the package {lacking}: {model.install}" if lacking is not None else ""
        is_here = cached_folder(model) is not None
        offers.append(
            ModelOffer(model.name, model.title, model.megabytes, model.licence, model.repository, is_here, lacks)
        )
    return ModelsPrompt(tuple(offers))
