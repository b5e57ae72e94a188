"""Files of a repository on the Hugging Face hub: one commit, compared with what the hub states for it before use.

A folder is used only with its list of verified files beside them: what is half there or was never compared has none.
"""

from __future__ import annotations

import hashlib
import json
import re
import shutil
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from pathlib import Path
from typing import Any
from urllib.parse import quote

from iibr_core.depth.estimators.hub import (
    PARTIAL,
    HubRefusal,
    chunks_of,
    failures_told,
    hub_answer,
    hub_cache,
    read_json,
)
from iibr_core.formats.files import is_file, printable, read_text, reason_of, stays_within
from iibr_core.formats.outputs import write_file
from iibr_core.runtime.work import report_progress
from iibr_core.types import InputError

VERIFIED = "iibr-verified.json"
"""Beside downloaded files: the digest of each, by its name, as the hub states them."""
DIGEST = re.compile("sha256:[0-9a-f]{64}|blob:[0-9a-f]{40}")
"""Of large files SHA-256; of small ones what git calls a blob: SHA-1 with the length before it."""

Digests = Mapping[str, str]


@dataclass(frozen=True)
class _StatedFile:
    """What the hub states for a file. size: in bytes."""

    digest: str
    size: int


def verified_folder(repository: str, commit: str) -> Path | None:
    """Where a commit's files lie in the hub's cache, None where they were not downloaded and verified."""
    folder = _model_cache(repository) / "snapshots" / commit
    try:
        return folder if is_file(folder / VERIFIED) else None
    except InputError:  # where it may not be looked at
        return None


def download(
    repository: str,
    commit: str,
    patterns: Sequence[str],
) -> Path:
    """Bring those files of a commit that match a pattern into the hub's cache; returns their folder.

    A file grows elsewhere in the cache and comes into the folder once it is what the hub states. Raises
    InputError where it fails. The next call goes on from there.
    """
    with failures_told(repository, hub_cache()):
        stated = _stated_files(repository, commit, patterns)
        folder = _fetch(repository, commit, stated)
        digests = {name: file.digest for name, file in stated.items()}
        for name in _unlike(folder, digests):
            _remove(folder / name)
            raise InputError(_unlike_words(repository, commit, name))
        with write_file(folder / VERIFIED) as temporary:
            temporary.write_text(json.dumps(digests, indent=1) + "\n", "utf-8")
    return folder


def require_unchanged(folder: Path) -> None:
    """Raise InputError where a downloaded file is not what was verified. Folders from elsewhere have no list."""
    path = folder / VERIFIED
    if not is_file(path):
        return
    try:
        stated = json.loads(read_text(path))
        if not isinstance(stated, dict) or not all(map(_is_digest, stated.values())):
            raise ValueError("no digests")
        changed = _unlike(folder, stated)
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"{path}: damaged ({reason_of(error)}); delete {folder} and get it again") from error
    if changed:
        raise InputError(f"{folder}: {changed[0]} changed since it was downloaded; delete {folder} and get it again")


def _model_cache(repository: str) -> Path:
    """The repository's folder in the hub's cache."""
    return hub_cache() / f"models--{repository.replace('/', '--')}"


def _stated_files(repository: str, commit: str, patterns: Sequence[str]) -> dict[str, _StatedFile]:
    """What the hub states for the files that are wanted, by name. Raises InputError where it states none."""
    about = read_json(f"api/models/{repository}/revision/{commit}?blobs=true")
    try:
        told, files = str(about["sha"]), [(str(file["rfilename"]), file) for file in about["siblings"]]
        wanted = {name: file for name, file in files if any(fnmatch(name, pattern) for pattern in patterns)}
        stated = {name: _stated_file(file) for name, file in wanted.items()}
    except (KeyError, TypeError, ValueError) as error:
        raise HubRefusal("what answers is no hub: it describes no model; check HF_ENDPOINT") from error
    if told != commit:
        raise InputError(f"{repository}: the hub answers with commit {printable(told)}, not {commit}; get it elsewhere")
    lacking = [name for name, file in stated.items() if not _is_digest(file.digest) or not stays_within(name)]
    if lacking or not stated:
        what = f"no hash of {printable(lacking[0])}" if lacking else f"no files like {', '.join(patterns)}"
        raise InputError(f"{repository}: the hub states {what} for commit {commit[:7]}; get it elsewhere")
    return stated


def _stated_file(told: Any) -> _StatedFile:
    large = told.get("lfs")
    return _StatedFile(f"sha256:{large['sha256']}" if large else f"blob:{told['blobId']}", int(told["size"]))


def _fetch(
    repository: str,
    commit: str,
    stated: Mapping[str, _StatedFile],
) -> Path:
    """Files that are there stay as they are."""
    cache = _model_cache(repository)
    folder, growing = cache / "snapshots" / commit, cache / "iibr-growing" / commit
    total, before = sum(file.size for file in stated.values()), 0
    for name, file in sorted(stated.items()):

        def report(size: int, before: int = before) -> None:
            report_progress(before + size, total, "downloading")

        if not is_file(folder / name):
            (growing / name).parent.mkdir(parents=True, exist_ok=True)
            _grow(growing / name, f"{repository}/resolve/{commit}/{quote(name)}", file.size, report)
            if _digest_of(growing / name, file.digest) != file.digest:
                _remove(growing / name)
                raise InputError(_unlike_words(repository, commit, name))
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            (growing / name).replace(folder / name)
        before += file.size
    shutil.rmtree(growing.parent, ignore_errors=True)
    return folder


def _grow(path: Path, url: str, size: int, report: Callable[[int], None]) -> None:
    """Bring the rest of a file, which has this size in the end."""
    with path.open("ab") as file:
        done = file.tell() if file.tell() <= size else file.truncate(0)
        if done == size:
            return
        with hub_answer(url, done) as answer:
            if answer.status_code != PARTIAL:
                done = file.truncate(0)
            for chunk in chunks_of(answer, size - done):
                file.write(chunk)
                done += len(chunk)
                report(done)
        if done < size:
            raise ConnectionError(f"it ended after {done:,} of {size:,} bytes")


def _unlike_words(repository: str, commit: str, name: str) -> str:
    return f"{repository}: {name} is not what the hub states for commit {commit[:7]}; it was removed, get it again"


def _unlike(folder: Path, stated: Digests) -> list[str]:
    """Names of the files that are not what is stated."""
    return [name for name, digest in sorted(stated.items()) if _digest_of(folder / name, digest) != digest]


def _digest_of(path: Path, like: str) -> str:
    """Of a file, of the same kind as another digest; "" where it is not there."""
    if not is_file(path):
        return ""
    kind, _, _ = like.partition(":")
    digest = hashlib.sha256() if kind == "sha256" else hashlib.sha1(b"blob %d\0" % path.stat().st_size)
    with path.open("rb") as file:
        return f"{kind}:{hashlib.file_digest(file, lambda: digest).hexdigest()}"


def _is_digest(text: object) -> bool:
    return isinstance(text, str) and DIGEST.fullmatch(text) is not None


def _remove(path: Path) -> None:
    """The file, and the one in the hub's cache that it is a link to."""
    path.resolve().unlink(missing_ok=True)
    path.unlink(missing_ok=True)
