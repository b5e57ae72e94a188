"""The Hugging Face hub over HTTP, by the client of its own library: mirrors, proxies, tokens and offline mode are as
that library's variables say. Its downloads are not used: they cannot be stopped at once.
"""

from __future__ import annotations

import json
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from iibr_core.formats.files import reason_of
from iibr_core.runtime.work import Cancelled, in_this_job, is_stopped, raise_if_stopped
from iibr_core.types import InputError

TIMEOUT_S = 10
"""For a connection, and for more data to come."""
LOOK_S = 0.05
"""How often a request that waits for the hub looks whether it is still wanted."""
MOST_ANSWER_BYTES = 1 << 24
PARTIAL = 206

BESIDES = "name a mirror with HF_ENDPOINT, or use a model's file, which needs no network: --depth-model FILE.onnx"


class HubRefusal(Exception):
    """The hub answers, but not with what was asked for. The message says why, and what to do."""


def hub_cache() -> Path:
    """The library's cache; it may not exist yet."""
    from huggingface_hub import constants  # the rest of that library takes half a second to import

    return Path(constants.HF_HUB_CACHE)


def read_json(path: str) -> Any:
    """What the hub's interface answers. Raises as `hub_answer` does, HubRefusal for what is no JSON."""
    with hub_answer(path) as answer:
        text = b"".join(chunks_of(answer, MOST_ANSWER_BYTES))
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as error:
        raise HubRefusal(f"what answers is no hub ({reason_of(error)}); check HF_ENDPOINT and the network") from error


@contextmanager
def hub_answer(path: str, begin: int = 0) -> Iterator[Any]:
    """The answer to a request for a path, from byte begin on if the hub can: its status is PARTIAL then.

    Raises HubRefusal for an answer of another status, and what the library's client raises for networks that fail.
    While the block runs, the connection ends once the job is stopped.
    """
    from huggingface_hub import constants, get_session
    from huggingface_hub.utils import build_hf_headers  # type: ignore[attr-defined]

    if constants.HF_HUB_OFFLINE:
        raise HubRefusal("HF_HUB_OFFLINE is set: unset it, or use a model's file: --depth-model FILE.onnx")
    headers = {**build_hf_headers(), "Accept-Encoding": "identity"}
    if begin:
        headers["Range"] = f"bytes={begin}-"
    url = f"{constants.ENDPOINT}/{path}"
    with get_session().stream("GET", url, headers=headers, timeout=TIMEOUT_S, follow_redirects=True) as answer:
        if not answer.is_success:
            raise HubRefusal(_refusal(answer.status_code, answer.headers.get("Retry-After", "")))
        with _ending(answer):
            yield answer


def chunks_of(answer: Any, most_bytes: int) -> Iterator[bytes]:
    """What comes, as it comes. Raises HubRefusal for more bytes than most_bytes."""
    count = 0
    for chunk in answer.iter_raw():
        raise_if_stopped()
        count += len(chunk)
        if count > most_bytes:
            raise HubRefusal("it sends more than it states; check HF_ENDPOINT")
        yield chunk


@contextmanager
def failures_told(repository: str, cache: Path) -> Iterator[None]:
    """Whatever a download raises becomes InputError, in one line that says what to do, or Cancelled."""
    try:
        yield
    except (Cancelled, InputError):
        raise
    except Exception as error:  # whatever the library's ways to the network raise: they change with its versions
        if is_stopped():
            raise Cancelled from error
        raise InputError(f"{repository} cannot be downloaded: {_advice(error, cache)}") from error


def _advice(error: Exception, cache: Path) -> str:
    if isinstance(error, HubRefusal):
        return str(error)
    if isinstance(error, OSError) and not isinstance(error, ConnectionError):
        reason = error.strerror or reason_of(error)
        return f"{cache} cannot be written ({reason}); make room there, or name another folder with HF_HOME"
    reason = reason_of(error).removeprefix("Got: ")[:120]
    return f"the network fails ({reason}); what has come is kept: try again, {BESIDES}"


def _refusal(status: int, retry_after: str) -> str:
    """What an answer of this status means, and what to do."""
    match status:
        case 401 | 403:
            return (
                f"the hub wants to know you ({status}): accept its owner's licence on huggingface.co, and set HF_TOKEN"
            )
        case 404:
            return f"the hub does not have it ({status}): check HF_ENDPOINT, or get it elsewhere for --depth-model"
        case 429:
            when = f"in {int(retry_after):,} s" if retry_after.isdecimal() and len(retry_after) < 7 else "later"
            return f"the hub is asked too often ({status}): try again {when}"
        case _:
            return f"the hub fails ({status}): try again later, or {BESIDES}"


@contextmanager
def _ending(answer: Any) -> Iterator[None]:
    """While it is entered, the connection is cut once the job is stopped: reading from it ends."""
    is_over = threading.Event()
    connection = answer.extensions["network_stream"].get_extra_info("socket")

    def look() -> None:
        while not is_over.wait(LOOK_S):
            if is_stopped():
                with suppress(OSError):  # it is over already
                    socket.socket.shutdown(connection, socket.SHUT_RDWR)
                return

    looking = threading.Thread(target=in_this_job(look), name="iibr-hub", daemon=True)
    looking.start()
    try:
        yield
    finally:
        is_over.set()
        looking.join()
