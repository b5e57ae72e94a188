"""Depth models in threads: their list, their download, and the estimate for the open photo."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from urllib.parse import urlsplit

from iibr_core.depth.models.cache import seconds_of
from iibr_core.depth.models.catalog import fetch, known_model, list_own_models, model_here
from iibr_core.depth.models.download import NoConnectionError
from iibr_core.depth.models.known import KNOWN_MODELS, KnownModel, missing_package
from iibr_core.runtime.work import Cancelled, watched
from iibr_core.scenes.scene import LoadedPhoto, Source
from iibr_core.types import FloatImage, InputError, Photo
from viewer.background.newest import Failed, Finder, Newest, Post, noting
from viewer.model import depth_models, messages
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.depth_models import Downloading, ModelOffer
from viewer.model.messages import Notice
from viewer.model.remedies import words_of

MEGABYTE = 1e6
OFFLINE = "No internet connection. Nothing is lost."


@dataclass(frozen=True)
class EstimateRequest:
    """The open photo, the name or path of a model, and whether edges are refined."""

    photo: Photo
    model: str
    loaded: LoadedPhoto = field(compare=False)
    source: Source = field(compare=False)
    refine: bool = field(compare=False)


class DepthFinder(Finder[EstimateRequest, tuple[str, LoadedPhoto]]):
    """Estimates depth of the open photo where the state wants that. Called from the thread of the window."""

    def __init__(self, loaded: Callable[[], LoadedPhoto | None], wake: Callable[[], None]) -> None:
        """loaded: returns the open photo. wake: called, in the thread, when a result was posted."""
        super().__init__(Newest("iibr-depth", _estimate, wake), self._request, self._take_estimate, _failure)
        self._loaded = loaded
        self._found: LoadedPhoto | None = None

    def newest(self) -> LoadedPhoto | None:
        """Return the open photo, with the depth that was estimated for it if the screen does not show that yet."""
        found, loaded = self._found, self._loaded()
        if (
            loaded is None
            or found is None
            or found.photo.pixels is not loaded.photo.pixels
            or found.found is loaded.found
        ):
            self._found = None
            return loaded
        return found

    def _request(self, state: AppState) -> EstimateRequest | None:
        model, loaded, scene = depth_models.wanted_model(state), self._loaded(), state.scene
        if model is None or loaded is None or scene is None:
            return None
        return EstimateRequest(loaded.photo, model, loaded, scene.source, state.depth.refine)

    def _take_estimate(self, estimate: tuple[str, LoadedPhoto]) -> list[Action]:
        model, self._found = estimate
        return [do(depth_models.take_estimate, model)]


def _failure(failed: Failed[EstimateRequest]) -> list[Action]:
    return [do(depth_models.report_failure, failed.request.model, failed.message)]


def _estimate(request: EstimateRequest, post: Post[tuple[str, LoadedPhoto]]) -> None:
    from iibr_core.scenes.photo import deepen

    source = request.source
    source = replace(source, depth=replace(source.depth, file=None, start="model", model=request.model))
    post((request.model, deepen(source, request.loaded, request.refine)))


def download(name: str, post: Post[Action]) -> None:
    """Download a known model and post the progress as actions. A model that came is used where it is wanted."""
    model = known_model(name)
    shown = Downloading(model.title, 0, model.megabytes)
    post(do(depth_models.set_downloading, shown))

    def report(done_bytes: float, total_bytes: float, doing: str) -> None:
        nonlocal shown
        latest = Downloading(model.title, int(done_bytes / MEGABYTE), max(int(total_bytes / MEGABYTE), 1))
        if latest != shown:
            shown = latest
            post(do(depth_models.set_downloading, latest))

    with suppress(Cancelled), watched(report):
        try:
            fetch(model)
        except InputError as error:
            post(do(depth_models.set_downloading, None))
            post(do(messages.notify, _failure_notice(error, name)))
            return
        models = list_models()
        post(do(depth_models.set_known, models))
        post(do(depth_models.set_downloading, None))
        (offer,) = (offer for offer in models if offer.name == name)
        if offer.lacks:
            post(do(messages.notify, Notice(f"{offer.title} is here. It {offer.lacks}.")))


def _failure_notice(error: InputError, name: str) -> Notice:
    if isinstance(error, NoConnectionError):
        return Notice(OFFLINE, is_error=True, details=f"({error})", failed_model=name)
    return Notice(words_of(error), is_error=True, failed_model=name)


def actions_of_download(result: Action | Failed[str]) -> list[Action]:
    """Return what follows from a step of a download, or from its failure."""
    return noting(do(depth_models.set_downloading, None))(result) if isinstance(result, Failed) else [result]


def list_models() -> tuple[ModelOffer, ...]:
    """Return the known models and those that were copied here. Takes half a second the first time."""
    return (*map(_offer_of, KNOWN_MODELS), *(_offer_of_own(name, file) for name, file in list_own_models().items()))


def _offer_of_own(name: str, file: Path) -> ModelOffer:
    megabytes, package = round(file.stat().st_size / MEGABYTE), missing_package("onnx")
    lacks = f"needs the package {package}" if package else ""
    words = f"{megabytes:,} MB{_time_text(name)}, your own: {file}"
    return ModelOffer(name, name, megabytes, "your own", "", words, True, lacks, runs_as_installed=True)


def _offer_of(model: KnownModel) -> ModelOffer:
    from huggingface_hub import constants

    package = missing_package(model.runner)
    return ModelOffer(
        model.name,
        model.title,
        model.megabytes,
        model.licence,
        host=urlsplit(constants.ENDPOINT).netloc,
        words=" ".join(filter(None, (f"{model.figures}{_time_text(model.name)}.", model.advice, model.needs))),
        is_here=model_here(model) is not None,
        lacks=f"needs the package {package}" if package else "",
        is_recommended=model.is_recommended,
        runs_as_installed=model.runs_as_installed,
    )


def _time_text(model: str) -> str:
    """Return how long the model took on this machine, for the end of its figures; "" if it never ran."""
    seconds = seconds_of(model)
    return "" if seconds is None else f", {seconds:.1f} s here"


def focus_before_and_now(
    before: FloatImage, now: FloatImage, focused_at: tuple[float, float] | None
) -> tuple[float, float] | None:
    """Return the values of two maps (H, W) at a place, -1..1 across the picture, y down; None without a place."""
    if focused_at is None:
        return None
    height, width = before.shape
    column, row = ((at + 1) / 2 * length - 0.5 for at, length in zip(focused_at, (width, height)))
    at = min(max(round(row), 0), height - 1), min(max(round(column), 0), width - 1)
    return float(before[at]), float(now[at])
