"""Files of a model on the Hugging Face hub, of one commit, in the folder where its library keeps them.

huggingface_hub fetches them: its variables state mirrors, proxies, tokens and offline mode. `hf_hub_download`
deletes what came of a file when it is stopped, so `http_get` is asked to resume files that grow beside their places.
"""

from __future__ import annotations

import hashlib
import socket
import threading
from concurrent.futures import Future
from contextlib import nullcontext
from pathlib import Path
from typing import Any, cast
from urllib.parse import urlsplit

from iibr_core.depth.models.known import KnownModel
from iibr_core.formats.files import reason_of
from iibr_core.remedies import FixableError, Remedy
from iibr_core.runtime.work import Cancelled, in_this_job, raise_if_stopped, report_progress, wait_unless_stopped
from iibr_core.types import InputError


class NoConnectionError(FixableError):
    """The hub cannot be reached."""


def local_folder(model: KnownModel) -> Path:
    """Return the folder of a model's files on this machine; it may not exist."""
    from huggingface_hub import constants  # its function for this needs all of that library, half a second

    repository = model.repository.replace("/", "--")
    return Path(constants.HF_HUB_CACHE) / f"models--{repository}" / "snapshots" / model.commit


def download(model: KnownModel) -> None:
    """Bring the files of a model here, unless they are.

    Raises InputError if it fails, Cancelled once the job is stopped: the thread that waits for the hub ends later.
    """
    folder, done = local_folder(model), Future[None]()

    def work() -> None:
        try:
            for name in model.files:
                if not (folder / name).is_file():
                    _fetch(model, name, folder / name)
            done.set_result(None)
        except BaseException as error:
            done.set_exception(error)

    threading.Thread(target=in_this_job(work), name="iibr-download", daemon=True).start()
    try:
        wait_unless_stopped(done)
    except (Cancelled, InputError):
        raise
    except Exception as error:  # whatever the library's clients raise: they change with its versions
        from huggingface_hub import constants

        if _is_offline(error):
            message = f"{model.title} cannot be downloaded: {urlsplit(constants.ENDPOINT).netloc} cannot be reached"
            raise NoConnectionError(f"{message}; what has arrived is kept", Remedy.DOWNLOAD) from error
        message = f"{model.title} cannot be downloaded ({reason_of(error)[:120]}); what has arrived is kept"
        raise FixableError(message, Remedy.DOWNLOAD) from error


def _is_offline(error: BaseException | None) -> bool:
    """Return whether an error came of a connection that could not be made."""
    while error is not None:
        if isinstance(error, ConnectionError | socket.gaierror | TimeoutError):
            return True
        error = error.__cause__ or error.__context__
    return False


def _fetch(model: KnownModel, name: str, place: Path) -> None:
    """Download the rest of a file, compare it with the hub's hash, and put it in its place."""
    from huggingface_hub import get_hf_file_metadata, get_token, hf_hub_url
    from huggingface_hub.file_download import http_get

    class Bar(nullcontext[Any]):
        """Progress of a file, in place of tqdm's. The library updates it before it writes a piece."""

        def __init__(self, initial: int = 0, **options: object) -> None:
            super().__init__(self)
            self.came = initial

        def update(self, count: int) -> None:
            raise_if_stopped()
            self.came += count
            report_progress(self.came, max(model.megabytes * 1e6, self.came), f"downloading {name}")

    url = hf_hub_url(model.repository, name, revision=model.commit)
    stated = get_hf_file_metadata(url)
    headers = {"Authorization": f"Bearer {get_token()}"} if get_token() else {}
    place.parent.mkdir(parents=True, exist_ok=True)
    part = place.with_name(f"{place.name}.part")
    part.touch()
    with part.open("r+b") as file:  # two processes that fetch the same file write the same bytes to the same places
        came = file.seek(0, 2)
        http_get(url, file, resume_size=came, headers=headers, expected_size=stated.size, tqdm_class=cast(Any, Bar))
    with part.open("rb") as whole:
        digest = hashlib.file_digest(whole, "sha256").hexdigest()
    if digest != stated.etag and len(stated.etag or "") == len(digest):  # tags of small files are no such hashes
        part.unlink()
        raise InputError(f"{model.title}: {name} is not what the hub states for this commit; get it again")
    part.replace(place)
